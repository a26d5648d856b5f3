//! A mechanism some of whose joints are held at a limit: to the algorithms, joints more that
//! follow a prescribed angle.

use crate::{Balance, Change, Dimensions, Drive, Energy, EquationsMut, Scalar, System};

/// A system with joints held at a limit.
#[derive(Debug)]
pub struct Stopped<'a, Y: System> {
    /// The system.
    pub system: &'a Y,
    /// Per joint -1 where it is held at its least angle, 1 at its greatest, else 0.
    pub sides: Y::Vector,
    /// Whether driven joints stand still where they should be at t.
    pub(crate) still: bool,
}

impl<Y: System> Clone for Stopped<'_, Y> {
    fn clone(&self) -> Self {
        Self { system: self.system, sides: self.sides.clone(), still: self.still }
    }
}

impl<'a, Y: System> Stopped<'a, Y> {
    /// Nothing is held.
    pub fn new(system: &'a Y) -> Self {
        Self { system, sides: system.vector(), still: false }
    }

    /// The limit at which a joint is held, rad.
    pub fn limit(&self, joint: usize) -> Option<Y::Scalar> {
        let side = self.sides.as_ref()[joint];
        let [least, greatest] = self.system.limits(joint);
        if side < Y::Scalar::ZERO {
            Some(least)
        } else if side > Y::Scalar::ZERO {
            Some(greatest)
        } else {
            None
        }
    }

    /// Whether a joint follows a prescribed angle of its own.
    pub(crate) fn is_driven(&self, t: Y::Scalar, joint: usize) -> bool {
        let mut driven = false;
        self.system.drives(t, |drive| driven |= drive.joint == joint);
        driven
    }
}

impl<Y: System> System for Stopped<'_, Y> {
    type Scalar = Y::Scalar;
    type Vector = Y::Vector;
    type Matrix = Y::Matrix;
    type Workspace = Y::Workspace;

    fn dimensions(&self) -> Dimensions {
        let held = self.sides.as_ref().iter().filter(|&&side| side != Y::Scalar::ZERO).count();
        let dimensions = self.system.dimensions();
        Dimensions { drives: dimensions.drives + held, ..dimensions }
    }

    fn vector(&self) -> Y::Vector {
        self.system.vector()
    }

    fn matrix(&self) -> Y::Matrix {
        self.system.matrix()
    }

    fn workspace(&self) -> Y::Workspace {
        self.system.workspace()
    }

    fn size(&self) -> Y::Scalar {
        self.system.size()
    }

    fn limits(&self, joint: usize) -> [Y::Scalar; 2] {
        self.system.limits(joint)
    }

    fn initial_position(&self, joint: usize) -> Y::Scalar {
        self.system.initial_position(joint)
    }

    fn initial_speed(&self, joint: usize) -> Y::Scalar {
        self.system.initial_speed(joint)
    }

    fn is_given(&self, joint: usize) -> bool {
        self.system.is_given(joint)
    }

    fn write_equations(
        &self,
        t: Y::Scalar,
        q: &[Y::Scalar],
        u: &[Y::Scalar],
        out: EquationsMut<'_, Y::Scalar>,
    ) {
        self.system.write_equations(t, q, u, out);
    }

    fn write_closure(&self, q: &[Y::Scalar], residual: &mut [Y::Scalar], jacobian: &mut [Y::Scalar]) {
        self.system.write_closure(q, residual, jacobian);
    }

    fn energy(&self, t: Y::Scalar, q: &[Y::Scalar], u: &[Y::Scalar]) -> Energy<Y::Scalar> {
        self.system.energy(t, q, u)
    }

    fn write_poses(&self, q: &[Y::Scalar], out: &mut [Y::Scalar]) {
        self.system.write_poses(q, out);
    }

    fn write_points(&self, q: &[Y::Scalar], out: &mut [Y::Scalar]) {
        self.system.write_points(q, out);
    }

    /// Its own, then those held.
    fn drives(&self, t: Y::Scalar, mut visit: impl FnMut(Drive<Y::Scalar>)) {
        let zero = Y::Scalar::ZERO;
        let standing = |drive| Drive { speed: zero, acceleration: zero, jerk: zero, ..drive };
        self.system
            .drives(t, |drive| visit(if self.still { standing(drive) } else { drive }));
        for joint in 0..self.sides.as_ref().len() {
            if let Some(position) = self.limit(joint) {
                visit(Drive { joint, position, speed: zero, acceleration: zero, jerk: zero });
            }
        }
    }

    fn write_reactions(&self, at: Balance<'_, Y::Scalar>, out: &mut [Y::Scalar]) {
        self.system.write_reactions(at, out);
    }

    fn write_tangent(
        &self,
        at: Balance<'_, Y::Scalar>,
        change: Change<'_, Y::Scalar>,
        forces: &mut [Y::Scalar],
        closure: &mut [Y::Scalar],
    ) {
        self.system.write_tangent(at, change, forces, closure);
    }
}
