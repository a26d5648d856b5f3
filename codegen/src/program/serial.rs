//! The program as bytes, for caches and for processes that run a mechanism without deriving it: reading needs
//! neither the symbolic engine nor its licence.
//!
//! The bytes are [`sealed`](crate::sealed) as `lamcprog`, without context. Their value is [`Program`]: fields in the
//! order of the types in `ir.rs`, enums by the number of the variant, indices as numbers, `f64` with all bits.
//! Whoever changes one of these types, [`Phase`](super::Phase) or the table of signatures raises [`FORMAT_VERSION`];
//! a test compares it with the types.
//!
//! What was read has passed the [verifier](super::verify()), so that engines and backends can rely on it, whoever
//! made the bytes.

use serde::{Deserialize, Deserializer, de};

use super::ir::Program;
use super::signatures::SIGNATURES;
use super::verify::{VerifyError, verify};
use crate::sealed::{Format, Unreadable};

/// Version of the format.
pub const FORMAT_VERSION: u32 = 11;

const FORMAT: Format = Format { name: *b"lamcprog", version: FORMAT_VERSION };

/// Why bytes are no program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum ReadError {
    /// They are not of the format or damaged.
    #[error(transparent)]
    Unreadable(#[from] Unreadable),
    /// They describe a program that breaks an invariant.
    #[error("the program in the file is not valid: {0}")]
    Invalid(#[from] VerifyError),
}

impl Program {
    /// Returns the program as bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        FORMAT.write(self, &[])
    }

    /// Reads a program that [`to_bytes`](Self::to_bytes) wrote, and verifies it.
    ///
    /// # Errors
    /// Returns an error if the bytes are damaged, of another version, or no valid program.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReadError> {
        let program: Self = FORMAT.read(bytes, &[])?;
        verify(&program)?;
        Ok(program)
    }
}

/// Reads the name of an output, which is one of those in the table of signatures.
pub(super) fn name_of_an_output<'de, D>(from: D) -> Result<&'static str, D::Error>
where
    D: Deserializer<'de>,
{
    let name = String::deserialize(from)?;
    let mut outputs = SIGNATURES.iter().flat_map(|signature| signature.outputs);
    let known = outputs.find(|output| output.name == name);
    known.map(|output| output.name).ok_or_else(|| de::Error::custom("no output has this name"))
}
