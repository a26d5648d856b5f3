//! The errors of the algorithms: a small enum that names the joint or the loop.

use core::fmt;

/// Why an algorithm stopped. Indices are those of q and of the loops. Numbers serve the message only and are `f32`,
/// whatever the number type of the mechanism is.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub enum Error {
    /// The workspace is shorter than [`workspace_len`](crate::plumbing::workspace_len).
    Workspace {
        /// Numbers needed.
        needed: usize,
        /// Numbers given.
        given: usize,
    },
    /// A vector does not have the length that the mechanism requires.
    Length {
        /// Entries expected.
        expected: usize,
        /// Entries given.
        given: usize,
    },
    /// The module of the mechanism was written without this function.
    LeftOut {
        /// Its name, as in `lamc --functions`.
        function: &'static str,
    },
    /// The mass matrix is not positive definite at this joint.
    MassMatrix {
        /// Joint whose pivot failed.
        joint: usize,
    },
    /// A coordinate, speed, force or acceleration is infinite or not a number.
    NotFinite {
        /// The first joint with such a value.
        joint: usize,
    },
    /// A controller commands or remembers a number that is infinite or not a number.
    Command {
        /// The controller.
        controller: usize,
    },
    /// A loop cannot be closed.
    NotClosed {
        /// Loop with the largest residual.
        loop_index: usize,
        /// That residual, m.
        residual: f32,
        /// A joint that ran into its limit.
        joint: Option<usize>,
    },
    /// A driven joint cannot reach its prescribed angle, because the loops prevent it.
    NotDriven {
        /// The joint.
        joint: usize,
    },
    /// No state of rest was found.
    NoEquilibrium {
        /// The largest generalised force that remains, N m.
        force: f32,
    },
    /// The adaptive step fell below the shortest one allowed: the motion is too stiff, or cannot continue here.
    StepTooSmall {
        /// The time that was reached, s, to seven digits.
        t: f32,
    },
    /// A time or a step is not a finite number, or a step is not positive.
    Time,
}

impl Error {
    /// The status code of functions with a C interface: 0 is success, these are the same in every
    /// generated C module. It is -1 for errors that a C module cannot have: wrong lengths, functions left
    /// out.
    pub const fn code(&self) -> i32 {
        match self {
            Self::MassMatrix { .. } => 1,
            Self::NotFinite { .. } => 2,
            Self::NotClosed { .. } => 3,
            Self::NotDriven { .. } => 4,
            Self::Time => 5,
            Self::NoEquilibrium { .. } => 6,
            Self::StepTooSmall { .. } => 7,
            Self::Command { .. }
            | Self::Workspace { .. }
            | Self::Length { .. }
            | Self::LeftOut { .. } => -1,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Workspace { needed, given } => {
                write!(out, "workspace of {given} numbers where {needed} are needed")
            }
            Self::Length { expected, given } => {
                write!(out, "vector of {given} numbers where {expected} are expected")
            }
            Self::LeftOut { function } => {
                write!(out, "the module was written without the function `{function}`")
            }
            Self::MassMatrix { joint } => {
                write!(out, "mass matrix is not positive definite at joint {joint}")
            }
            Self::NotFinite { joint } => {
                write!(out, "joint {joint} has a value that is not finite")
            }
            Self::Command { controller } => {
                write!(out, "controller {controller} has a value that is not finite")
            }
            Self::NotClosed { loop_index, residual, joint } => {
                write!(out, "loop {loop_index} stays open by {residual:.3e} m")?;
                match joint {
                    Some(joint) => write!(out, "; joint {joint} is at its limit"),
                    None => Ok(()),
                }
            }
            Self::NotDriven { joint } => {
                write!(out, "driven joint {joint} cannot follow: the loops do not let it")
            }
            Self::NoEquilibrium { force } => {
                write!(out, "no state of rest found: {force:.3e} N m are left")
            }
            Self::StepTooSmall { t } => write!(out, "step became too small at t = {t} s"),
            Self::Time => write!(out, "a time or a step is not a usable number"),
        }
    }
}

impl core::error::Error for Error {}
