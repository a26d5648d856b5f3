//! A mechanism whose joints stop at their limits: to the algorithms, a joint held at a stop is one
//! more that follows a prescribed angle.

use crate::delegate::Delegate;
use crate::plumbing::Drive;
use crate::{Arithmetic, Mechanism};

/// A system whose joints stop at their limits.
///
/// ```text
/// u_j+ = -restitution u_j-      where a joint hits a stop: an impulse through M and J
/// u_j = 0                       from then on, if that is slower than the threshold, until the
///                               torque of the stop changes sign
/// ```
///
/// A joint also leaves its stop where an impulse would have to hold it back, unless its acceleration would bring it back within
/// 1e-10 rad.
#[derive(Clone, Debug)]
pub struct Stopped<Y: Mechanism> {
    /// The system.
    pub system: Y,
    /// Share of its speed with which a joint leaves a stop, 0 to 1.
    pub restitution: Y::Scalar,
    /// Joints that would leave a stop more slowly stay there, rad/s.
    pub threshold: Y::Scalar,
    /// Per joint -1 where it is held at its least angle, 1 at its greatest, else 0.
    pub sides: Y::Speeds,
    /// Speeds that an impulse leaves to joints in `sides`, rad/s; zero otherwise.
    pub(super) speeds: Y::Speeds,
    /// Returns whether driven joints rest at their prescribed angles at t.
    pub(crate) still: bool,
}

impl<Y: Mechanism> Stopped<Y> {
    /// Without restitution; nothing is held.
    pub fn new(system: Y) -> Self {
        Self {
            restitution: Y::Scalar::ZERO,
            threshold: Y::Scalar::from_f64(1e-3),
            sides: system.speeds(),
            speeds: system.speeds(),
            still: false,
            system,
        }
    }

    /// The limit at which a joint is held, rad; `None` for one that is not held, or does not exist.
    pub fn held_at(&self, joint: usize) -> Option<Y::Scalar> {
        let side = *self.sides.as_ref().get(joint)?;
        (side != Y::Scalar::ZERO).then(|| self.limit(joint, side))
    }

    /// The limit on one side of a joint, rad.
    pub(super) fn limit(&self, joint: usize, side: Y::Scalar) -> Y::Scalar {
        let [least, greatest] = self.system.limits(joint);
        if side < Y::Scalar::ZERO { least } else { greatest }
    }

    /// Returns whether the joint has a prescribed angle in the model.
    pub(crate) fn is_driven(&self, t: Y::Scalar, joint: usize) -> bool {
        let mut driven = false;
        self.system.drives(t, |drive| driven |= drive.joint == joint);
        driven
    }
}

impl<Y: Mechanism> Delegate for Stopped<Y> {
    type Inner = Y;

    fn inner(&self) -> &Y {
        &self.system
    }

    fn drive_count(&self) -> usize {
        let held = self.sides.as_ref().iter().filter(|&&side| side != Y::Scalar::ZERO).count();
        self.system.dimensions().drives + held
    }

    /// The driven joints of the model, then those held at a limit.
    fn visit_drives(&self, t: Y::Scalar, mut visit: impl FnMut(Drive<Y::Scalar>)) {
        let zero = Y::Scalar::ZERO;
        let standing = |drive| Drive { speed: zero, acceleration: zero, jerk: zero, ..drive };
        self.system.drives(t, |drive| visit(if self.still { standing(drive) } else { drive }));
        for joint in 0..self.sides.as_ref().len() {
            if let Some(position) = self.held_at(joint) {
                let speed = self.speeds.as_ref()[joint];
                visit(Drive { joint, position, speed, acceleration: zero, jerk: zero });
            }
        }
    }
}
