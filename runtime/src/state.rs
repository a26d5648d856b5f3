//! Time, coordinates and speeds of a mechanism.

use crate::{Scalar, System};

/// A state: plain data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<V, S> {
    /// t, s.
    pub t: S,
    /// q, N, rad.
    pub q: V,
    /// u = dq/dt, N, rad/s.
    pub u: V,
}

/// The state of a system.
pub type StateOf<Y> = State<<Y as System>::Vector, <Y as System>::Scalar>;

impl<V: AsMut<[S]>, S: Scalar> State<V, S> {
    /// The model's initial guess at t = 0; [`assemble`](crate::assemble) closes it.
    pub fn initial<Y: System<Scalar = S, Vector = V>>(system: &Y) -> Self {
        let mut state = Self { t: S::ZERO, q: system.vector(), u: system.vector() };
        for (joint, value) in state.q.as_mut().iter_mut().enumerate() {
            *value = system.initial_position(joint);
        }
        for (joint, value) in state.u.as_mut().iter_mut().enumerate() {
            *value = system.initial_speed(joint);
        }
        state
    }
}
