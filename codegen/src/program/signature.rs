//! Signatures: what each function of a compiled mechanism reads and writes.
//!
//! Shapes are symbolic, because they depend on the mechanism: [`Size::of`] evaluates them against
//! its [`Interface`]. The lowering, the verifier, the interpreter, the backends and the reserved
//! names of generated code all read the table [`SIGNATURES`]; the facts stand nowhere else.

use serde::{Deserialize, Serialize};

use super::argument::Argument;
use super::ir::Interface;
use super::shape::Array;
#[cfg(doc)]
use super::shape::Size;
use super::signatures::SIGNATURES;

/// Which function of a compiled mechanism; [`signature`](Self::signature) says what it computes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "`SIGNATURES` documents each")]
pub enum FunctionKind {
    Equations,
    Closure,
    Poses,
    Points,
    Energy,
    Drives,
    Contacts,
    Gaps,
    Reactions,
    Momentum,
    Control,
    Tangent,
    Acceleration,
    Projection,
    Reduction,
    ProjectionReduction,
    Jacobian,
    JacobianParams,
    Drawing,
}

impl FunctionKind {
    /// Every kind, in order.
    pub const ALL: [Self; SIGNATURES.len()] = {
        let mut all = [Self::Equations; SIGNATURES.len()];
        let mut index = 0;
        while index < all.len() {
            all[index] = SIGNATURES[index].kind;
            index += 1;
        }
        all
    };

    /// What the function is called, reads and writes.
    pub fn signature(self) -> &'static Signature {
        &SIGNATURES[self as usize]
    }

    /// What the function reads, in order: the inputs of its signature without a memory in which nothing is remembered,
    /// and the numbers of the drawing if some depend on parameters.
    pub fn inputs(self, interface: &Interface) -> impl Iterator<Item = Argument> + Clone {
        let is_drawn = interface.drawn > 0 && self != Self::Drawing;
        let remembers = interface.memory().next().is_some();
        let given = self.signature().inputs.iter().copied();
        let given = given.filter(move |&argument| argument != Argument::Memory || remembers);
        given.chain(is_drawn.then_some(Argument::Drawing))
    }

    /// The function's name in reports.
    pub fn name(self) -> &'static str {
        self.signature().name
    }
}

/// What a function is needed for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// Every program has it.
    Required,
    /// It solves the equations in straight-line code. A program without it is solved by the algorithms of
    /// the runtime, which need more time. Such a function does not decide on the rank; one of its outputs
    /// is how far its results can be trusted.
    Solution,
    /// It evaluates something that motion itself does not need. A program without it does not offer what
    /// depends on it.
    Output,
}

/// What a function of a compiled mechanism is called, reads and writes.
#[derive(Clone, Copy, Debug)]
pub struct Signature {
    /// Which function.
    pub kind: FunctionKind,
    /// Its name in reports and in C.
    pub name: &'static str,
    /// Whether a program may leave it out, and what happens then.
    pub role: Role,
    /// What it reads, in the order of its parameters.
    pub inputs: &'static [Argument],
    /// What it writes, in order.
    pub outputs: &'static [Array],
    /// What it computes, in one sentence without its full stop.
    pub doc: &'static str,
}

impl Signature {
    /// The lengths of the outputs, in their order.
    pub fn lengths(&self, interface: &Interface) -> impl Iterator<Item = usize> {
        self.outputs.iter().map(|output| output.shape.length(interface))
    }

    /// The outputs that have numbers for this mechanism.
    pub fn written(&self, interface: &Interface) -> impl Iterator<Item = &'static Array> {
        self.outputs.iter().filter(|output| output.shape.length(interface) > 0)
    }
}
