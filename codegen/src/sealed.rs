//! Serialised values in a frame that says what they are, and whether they are whole.
//!
//! | bytes | content |
//! |---|---|
//! | 8 | the name of the format, ASCII |
//! | 4 | its version, little-endian |
//! | 32 | SHA-256 of these twelve bytes, of the length of the context (8 bytes, little-endian), of the context, and of what follows |
//! | rest | the value in the wire format of [postcard](https://postcard.jamesmunns.com/wire-format) |
//!
//! The context is what the value was written for, such as the key in a cache. It is not in the bytes: who reads
//! them gives it again, so that a value is not taken for another.

use serde::Serialize;
use serde::de::DeserializeOwned;
use sha2::{Digest, Sha256};

/// A kind of sealed values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// Name, the first bytes.
    pub name: [u8; 8],
    /// Version. It is raised whenever the same bytes would mean something else.
    pub version: u32,
}

/// Why bytes are no value of a format.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Unreadable {
    /// They do not begin with the name of the format.
    #[error("this is no file of this kind")]
    Foreign,
    /// They were written in another version of the format.
    #[error("the file has version {found}, and this lamc reads version {known}: write it anew")]
    Version {
        /// The version of the bytes.
        found: u32,
        /// The version that can be read.
        known: u32,
    },
    /// Their checksum is wrong: they are not as they were written, or were written for something else.
    #[error("the file is damaged, incomplete or of another release of lamc: its checksum is wrong")]
    Damaged,
    /// Their checksum is right, but they do not describe a value.
    #[error("the file was not written by lamc: its content does not fit the format")]
    Malformed,
}

const HEAD: usize = 12;
const DIGEST: usize = 32;

impl Format {
    /// Writes a value.
    pub fn write(&self, value: &impl Serialize, context: &[u8]) -> Vec<u8> {
        let mut bytes = self.head().to_vec();
        bytes.resize(HEAD + DIGEST, 0);
        let mut bytes = postcard::to_extend(value, bytes)
            .unwrap_or_else(|error| unreachable!("derived serialisation does not fail: {error}"));
        let digest = self.digest(context, &bytes[HEAD + DIGEST..]);
        bytes[HEAD..HEAD + DIGEST].copy_from_slice(&digest);
        bytes
    }

    /// Reads a value that was written for this context.
    ///
    /// # Errors
    /// Returns an error for any bytes but those that [`write`](Self::write) returned.
    pub fn read<T: DeserializeOwned>(&self, bytes: &[u8], context: &[u8]) -> Result<T, Unreadable> {
        let (head, rest) = bytes.split_first_chunk::<HEAD>().ok_or(Unreadable::Foreign)?;
        let (name, version) = head.split_at(self.name.len());
        if name != self.name {
            return Err(Unreadable::Foreign);
        }
        let found = version.iter().rev().fold(0, |number, byte| number << 8 | u32::from(*byte));
        if found != self.version {
            return Err(Unreadable::Version { found, known: self.version });
        }
        let (digest, payload) = rest.split_first_chunk::<DIGEST>().ok_or(Unreadable::Damaged)?;
        if *digest != self.digest(context, payload) {
            return Err(Unreadable::Damaged);
        }
        match postcard::take_from_bytes(payload) {
            Ok((value, [])) => Ok(value),
            _ => Err(Unreadable::Malformed),
        }
    }

    fn head(&self) -> [u8; HEAD] {
        let mut head = [0; HEAD];
        head[..self.name.len()].copy_from_slice(&self.name);
        head[self.name.len()..].copy_from_slice(&self.version.to_le_bytes());
        head
    }

    fn digest(&self, context: &[u8], payload: &[u8]) -> [u8; DIGEST] {
        let length = (context.len() as u64).to_le_bytes();
        let parts: [&[u8]; 4] = [&self.head(), &length, context, payload];
        parts.iter().fold(Sha256::new(), |hash, part| hash.chain_update(part)).finalize().into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FORMAT: Format = Format { name: *b"lamctest", version: 7 };

    #[test]
    fn every_number_keeps_its_bits() {
        let least = f64::from_bits(1);
        let quiet = f64::from_bits(0x7ff8_0000_dead_beef);
        let numbers = [0.0, -0.0, least, -least, f64::MIN_POSITIVE, f64::MAX, 0.1, -quiet, quiet];
        let numbers = [&numbers[..], &[f64::INFINITY, f64::NEG_INFINITY]].concat();
        let bytes = FORMAT.write(&numbers, b"");
        let read: Vec<f64> = FORMAT.read(&bytes, b"").unwrap();
        let bits = |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
        assert_eq!(bits(&read), bits(&numbers));
    }

    #[test]
    fn the_frame_is_as_documented() {
        let bytes = FORMAT.write(&(300_u32, "ab"), b"key");
        let payload = [0xac, 0x02, 2, b'a', b'b'];
        let head = b"lamctest\x07\0\0\0";
        let hashed = [&head[..], &[3, 0, 0, 0, 0, 0, 0, 0], b"key", &payload].concat();
        assert_eq!(bytes, [&head[..], &Sha256::digest(&hashed), &payload].concat());
    }

    #[test]
    fn other_bytes_are_refused_with_the_reason() {
        let bytes = FORMAT.write(&300_u32, b"key");
        let read = |bytes: &[u8]| FORMAT.read::<u32>(bytes, b"key");
        assert_eq!(read(&bytes), Ok(300));
        for length in 0..bytes.len() {
            let wrong = read(&bytes[..length]).unwrap_err();
            assert!(matches!(wrong, Unreadable::Foreign | Unreadable::Damaged), "{length}");
        }
        assert_eq!(FORMAT.read::<u32>(&bytes, b"other"), Err(Unreadable::Damaged));
        assert_eq!(
            FORMAT.read::<u16>(&FORMAT.write(&70_000_u32, b""), b""),
            Err(Unreadable::Malformed)
        );
        assert_eq!(
            FORMAT.read::<u8>(&FORMAT.write(&(1_u8, 2_u8), b""), b""),
            Err(Unreadable::Malformed)
        );
        let older = Format { version: 6, ..FORMAT };
        let expected = Unreadable::Version { found: 7, known: 6 };
        assert_eq!(older.read::<u32>(&bytes, b"key"), Err(expected));
        let other = Format { name: *b"lamcprog", ..FORMAT };
        assert_eq!(other.read::<u32>(&bytes, b"key"), Err(Unreadable::Foreign));
    }
}
