//! What a mechanism with a reduction to independent speeds says of itself.

use crate::Error;
use crate::plumbing::{ProjectionMut, ReductionMut};

/// How the speeds of a mechanism follow from those of its independent joints: the same at every state.
///
/// Joints are given by their place in `branches`.
#[derive(Clone, Copy)]
pub struct Reduction<'a, S> {
    /// The joints of the spanning tree: each is followed by all joints beyond it.
    pub branches: &'a [Branch],
    /// The joints whose speeds are independent.
    pub independent: &'a [u16],
    /// The other joints, each after those that its speed follows from.
    pub dependent: &'a [Dependent],
    /// The joints that the speeds of the dependent ones follow from, in the order of the coefficients.
    pub columns: &'a [u16],
    /// Whether it is for driven joints, and for those at stops, only: straight-line code solves where there are none.
    pub is_for_driven: bool,
    /// What depends on the state.
    pub parts: &'a dyn ReductionParts<S>,
}

/// What a mechanism writes for a [`Reduction`].
pub trait ReductionParts<S> {
    /// What du/dt needs: `given`, NU, solves the closure with zeros for the independent joints; `forces`, NU, are
    /// f - M `given`.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_acceleration(
        &self,
        at: (S, &[S], &[S]),
        out: ReductionMut<'_, S>,
        given: &mut [S],
        forces: &mut [S],
    ) -> Result<(), Error>;

    /// The same for a projection of q and u: the residuals, and what solves the closure for them and for J u with zeros
    /// for the independent joints.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_projection(
        &self,
        q: &[S],
        u: &[S],
        out: ReductionMut<'_, S>,
        closing: ProjectionMut<'_, S>,
    ) -> Result<(), Error>;
}

/// A joint of the spanning tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Its place in q and u.
    pub joint: u16,
    /// The number of joints between it and the ground.
    pub depth: u16,
}

/// A joint whose speed is a sum over other joints.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dependent {
    /// The joint.
    pub branch: u16,
    /// The number of terms.
    pub terms: u16,
}

impl Branch {
    /// Joints with their depths.
    #[must_use]
    pub const fn all<const COUNT: usize>(pairs: [(u16, u16); COUNT]) -> [Self; COUNT] {
        let mut all = [Self { joint: 0, depth: 0 }; COUNT];
        let mut index = 0;
        while index < COUNT {
            let (joint, depth) = pairs[index];
            all[index] = Self { joint, depth };
            index += 1;
        }
        all
    }
}

impl Dependent {
    /// Joints with their numbers of terms.
    #[must_use]
    pub const fn all<const COUNT: usize>(pairs: [(u16, u16); COUNT]) -> [Self; COUNT] {
        let mut all = [Self { branch: 0, terms: 0 }; COUNT];
        let mut index = 0;
        while index < COUNT {
            let (branch, terms) = pairs[index];
            all[index] = Self { branch, terms };
            index += 1;
        }
        all
    }
}

/// Sizes of a [`Reduction`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReductionSizes {
    /// Joints of the tree.
    pub branches: usize,
    /// The greatest number of joints on the way from the ground.
    pub depth: usize,
    /// Independent joints.
    pub independent: usize,
    /// Coefficients.
    pub coefficients: usize,
}

impl ReductionSizes {
    /// Those of mechanisms that have no reduction.
    pub const NONE: Self = Self { branches: 0, depth: 0, independent: 0, coefficients: 0 };
}
