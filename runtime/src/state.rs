//! Time, coordinates and speeds of a mechanism.

use crate::Mechanism;

/// A state: plain data. Where there are as many speeds as coordinates `State<Q, S>` is enough.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct State<Q, S, U = Q> {
    /// t, s.
    pub t: S,
    /// q, NQ, rad.
    pub q: Q,
    /// u, NU, rad/s: dq/dt of joints.
    pub u: U,
}

/// The state of a mechanism.
pub type StateOf<M> =
    State<<M as Mechanism>::Coordinates, <M as Mechanism>::Scalar, <M as Mechanism>::Speeds>;
