//! Constants of every joint or body that become parameters.

use serde::{Deserialize, Serialize};

use super::units::{ANGLE, DAMPING, Dimension, MASS, STIFFNESS};

/// A kind of constant that `tunable` turns into parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub enum Tunable {
    /// `stiffness_<joint>`.
    Stiffness,
    /// `damping_<joint>`.
    Damping,
    /// `rest_<joint>`.
    Rest,
    /// `mass_<body>`; the inertia scales with it (same shape, different density).
    Mass,
}

impl Tunable {
    /// All kinds.
    pub const ALL: [Self; 4] = [Self::Stiffness, Self::Damping, Self::Rest, Self::Mass];

    /// Returns its name in the file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Damping => "damping",
            Self::Rest => "rest",
            Self::Mass => "mass",
        }
    }

    /// Returns the dimension of its parameters.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Stiffness => STIFFNESS.dimension,
            Self::Damping => DAMPING.dimension,
            Self::Rest => ANGLE.dimension,
            Self::Mass => MASS.dimension,
        }
    }

    /// Returns the name of the parameter for a joint (body).
    pub fn parameter_name(self, owner: &str) -> String {
        format!("{}_{owner}", self.name())
    }
}
