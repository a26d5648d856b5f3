//! What can go wrong while a mechanism runs.

use core::fmt;

/// Why a computation has no result. Joints and loops are given by index.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Error {
    /// The caller's workspace or state has the wrong length.
    Workspace,
    /// The mass matrix is not positive definite at this joint: the state or a parameter is absurd.
    MassMatrix {
        /// The joint whose pivot is not positive.
        joint: usize,
    },
    /// An acceleration is infinite or NaN.
    NotFinite {
        /// The joint.
        joint: usize,
    },
    /// No closed configuration was found.
    NotClosed {
        /// The loop that stays open widest.
        loop_index: usize,
        /// How wide, m.
        residual: f64,
        /// A joint that stands at its limit, if any.
        joint: Option<usize>,
    },
    /// An adaptive integrator cannot take a step this small.
    StepTooSmall {
        /// Where it stopped, s.
        t: f64,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Workspace => f.write_str("the workspace or the state has the wrong length"),
            Self::MassMatrix { joint } => {
                write!(f, "the mass matrix is not positive definite at joint {joint}")
            }
            Self::NotFinite { joint } => {
                write!(f, "the acceleration of joint {joint} is not a finite number")
            }
            Self::NotClosed { loop_index, residual, joint } => {
                write!(f, "loop {loop_index} stays {residual:.3e} m open")?;
                match joint {
                    Some(joint) => write!(f, "; joint {joint} stands at its limit"),
                    None => Ok(()),
                }
            }
            Self::StepTooSmall { t } => {
                write!(f, "the step became too small at t = {t} s: the motion is too stiff or ends")
            }
        }
    }
}

impl core::error::Error for Error {}
