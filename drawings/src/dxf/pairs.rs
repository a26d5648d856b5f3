//! The pairs of a DXF file: a group code and its value, as text or binary.
//!
//! AutoCAD DXF reference: "Group codes in numerical order", "ASCII DXF files", "Binary DXF files".

use std::borrow::Cow;

use crate::drawing::Place;
use crate::fault::{Cause, Fault};

/// The first bytes of a binary file.
pub(crate) const SENTINEL: &[u8] = b"AutoCAD Binary DXF\r\n\x1a\0";

/// A value. That of a text file is text, whatever its code.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Value<'a> {
    Text(&'a [u8]),
    Real(f64),
    Integer(i64),
}

/// A group code and its value.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pair<'a> {
    pub code: i32,
    value: Value<'a>,
    /// The position of the value.
    pub place: Place,
}

impl<'a> Pair<'a> {
    /// The value as text, without spaces around it. Bytes that are not UTF-8 are replaced.
    pub(super) fn text(&self) -> Cow<'a, str> {
        match self.value {
            Value::Text(bytes) => match String::from_utf8_lossy(bytes) {
                Cow::Borrowed(text) => Cow::Borrowed(text.trim()),
                Cow::Owned(text) => Cow::Owned(text.trim().to_string()),
            },
            Value::Real(number) => Cow::Owned(number.to_string()),
            Value::Integer(number) => Cow::Owned(number.to_string()),
        }
    }

    /// The value as a finite number.
    pub(super) fn real(&self) -> Result<f64, Fault> {
        let number = match self.value {
            Value::Text(_) => self.text().parse().ok(),
            Value::Real(number) => Some(number),
            // Integers of the file have at most 32 bits, or are no coordinates.
            Value::Integer(number) => Some(number as f64),
        };
        number.filter(|n: &f64| n.is_finite()).ok_or_else(|| self.wrong("a finite number"))
    }

    /// The value as an integer.
    pub(super) fn integer(&self) -> Result<i64, Fault> {
        match self.value {
            Value::Text(_) => self.text().parse().map_err(|_| self.wrong("an integer")),
            Value::Integer(number) => Ok(number),
            Value::Real(_) => Err(self.wrong("an integer")),
        }
    }

    fn wrong(&self, wanted: &str) -> Fault {
        let text: String = self.text().chars().take(30).collect();
        fault(
            Cause::Number,
            format!("group {} is `{text}`; it must be {wanted}", self.code),
            self.place,
        )
    }
}

/// Reads pairs one after the other.
pub(super) struct Pairs<'a> {
    bytes: &'a [u8],
    at: usize,
    form: Form,
}

#[derive(Clone, Copy, PartialEq)]
enum Form {
    Text,
    /// Group codes have two bytes, since release 13.
    Binary,
    /// Group codes have one byte, or 255 and two bytes.
    OldBinary,
}

impl<'a> Pairs<'a> {
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let (at, form) = match bytes.strip_prefix(SENTINEL) {
            // The first code is 0, the first value SECTION.
            Some([0, 0, ..]) => (SENTINEL.len(), Form::Binary),
            Some(_) => (SENTINEL.len(), Form::OldBinary),
            None => (if bytes.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 }, Form::Text),
        };
        Pairs { bytes, at, form }
    }

    /// Returns the next pair that is not a comment; None at the end.
    pub(super) fn next(&mut self) -> Result<Option<Pair<'a>>, Fault> {
        const COMMENT: i32 = 999;
        loop {
            let pair =
                if self.form == Form::Text { self.next_text()? } else { self.next_binary()? };
            if pair.is_none_or(|p| p.code != COMMENT) {
                return Ok(pair);
            }
        }
    }

    fn next_text(&mut self) -> Result<Option<Pair<'a>>, Fault> {
        if self.bytes[self.at..].iter().all(u8::is_ascii_whitespace) {
            self.at = self.bytes.len();
            return Ok(None);
        }
        let (line, place) = self.line();
        let code = std::str::from_utf8(line).ok().and_then(|text| text.trim().parse().ok());
        let Some(code) = code else {
            let text: String = String::from_utf8_lossy(line).chars().take(30).collect();
            let message = format!("`{text}` is not a group code, an integer on a line of its own");
            return Err(fault(Cause::Syntax, message, place));
        };
        if self.at >= self.bytes.len() {
            return Err(fault(
                Cause::Syntax,
                format!("the file ends after group code {code}"),
                place,
            ));
        }
        let (line, place) = self.line();
        Ok(Some(Pair { code, value: Value::Text(line), place }))
    }

    /// A line without its end, which is `\n`, `\r\n` or `\r`.
    fn line(&mut self) -> (&'a [u8], Place) {
        let rest = &self.bytes[self.at..];
        let length = rest.iter().position(|b| matches!(b, b'\n' | b'\r')).unwrap_or(rest.len());
        let place = Place { start: self.at, end: self.at + length };
        self.at = place.end
            + if rest[length..].starts_with(b"\r\n") {
                2
            } else {
                usize::from(length < rest.len())
            };
        (&rest[..length], place)
    }

    fn next_binary(&mut self) -> Result<Option<Pair<'a>>, Fault> {
        if self.at >= self.bytes.len() {
            return Ok(None);
        }
        let start = self.at;
        let code = match (self.form, self.bytes[self.at]) {
            (Form::OldBinary, code) if code != 255 => i32::from(self.take::<1>()?[0]),
            (form, _) => {
                self.at += usize::from(form == Form::OldBinary);
                i32::from(i16::from_le_bytes(self.take()?))
            }
        };
        let value = match code {
            10..=59 | 110..=149 | 210..=239 | 460..=469 | 1010..=1059 => {
                Value::Real(f64::from_le_bytes(self.take()?))
            }
            60..=79 | 170..=179 | 270..=289 | 370..=389 | 400..=409 | 1060..=1070 => {
                Value::Integer(i16::from_le_bytes(self.take()?).into())
            }
            90..=99 | 420..=429 | 440..=459 | 1071 => {
                Value::Integer(i32::from_le_bytes(self.take()?).into())
            }
            160..=169 => Value::Integer(i64::from_le_bytes(self.take()?)),
            290..=299 => Value::Integer(self.take::<1>()?[0].into()),
            310..=319 | 1004 => {
                let length = usize::from(self.take::<1>()?[0]);
                Value::Text(self.bytes_to(self.at + length)?)
            }
            0..=9
            | 100..=109
            | 300..=369
            | 390..=399
            | 410..=419
            | 430..=439
            | 470..=489
            | 999..=1009 => {
                let length = self.bytes[self.at..].iter().position(|b| *b == 0);
                let end = length.map_or(usize::MAX, |length| self.at + length);
                let text = self.bytes_to(end)?;
                self.at += 1;
                Value::Text(text)
            }
            _ => {
                let place = Place { start, end: self.at };
                return Err(fault(
                    Cause::Syntax,
                    format!("{code} is not a group code of binary DXF"),
                    place,
                ));
            }
        };
        Ok(Some(Pair { code, value, place: Place { start, end: self.at } }))
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        let mut found = [0; N];
        found.copy_from_slice(self.bytes_to(self.at + N)?);
        Ok(found)
    }

    fn bytes_to(&mut self, end: usize) -> Result<&'a [u8], Fault> {
        let Some(found) = self.bytes.get(self.at..end) else {
            let place = Place { start: self.at.min(self.bytes.len()), end: self.bytes.len() };
            return Err(fault(Cause::Syntax, "the file ends within a value".into(), place));
        };
        self.at = end;
        Ok(found)
    }
}

/// A fault with a position.
pub(super) fn fault(cause: Cause, message: String, place: Place) -> Fault {
    Fault { cause, message, place: Some(place), at: Vec::new(), hint: None }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn all(bytes: &[u8]) -> Result<Vec<(i32, String)>, Fault> {
        let mut pairs = Pairs::new(bytes);
        let mut found = Vec::new();
        while let Some(pair) = pairs.next()? {
            found.push((pair.code, pair.text().to_string()));
        }
        Ok(found)
    }

    fn check(bytes: &[u8], wanted: &[(i32, &str)]) {
        let found = all(bytes).unwrap();
        let found: Vec<(i32, &str)> =
            found.iter().map(|(code, text)| (*code, text.as_str())).collect();
        assert_eq!(found, wanted);
    }

    #[test]
    fn text_and_binary_say_the_same() {
        let wanted = [(0, "LINE"), (8, "A b"), (10, "1.5"), (62, "-3"), (420, "70000"), (0, "EOF")];
        let text = "  0\nLINE\n999\nnote\n8\n A b \n 10\n1.5\n 62\n-3\n420\n70000\n0\nEOF\n\n";
        check(text.as_bytes(), &wanted);
        check(text.replace('\n', "\r\n").as_bytes(), &wanted);
        check(text.replace('\n', "\r").as_bytes(), &wanted);
        check(format!("\u{feff}{text}").as_bytes(), &wanted);

        let values: [(i16, &[u8]); 6] = [
            (0, b"LINE\0"),
            (8, b"A b\0"),
            (10, &1.5_f64.to_le_bytes()),
            (62, &(-3_i16).to_le_bytes()),
            (420, &70_000_i32.to_le_bytes()),
            (0, b"EOF\0"),
        ];
        let (mut new, mut old) = (SENTINEL.to_vec(), SENTINEL.to_vec());
        for (code, value) in values {
            new.extend_from_slice(&code.to_le_bytes());
            match u8::try_from(code) {
                Ok(code) => old.push(code),
                Err(_) => old.extend([&[255], &code.to_le_bytes()[..]].concat()),
            }
            new.extend_from_slice(value);
            old.extend_from_slice(value);
        }
        check(&new, &wanted);
        check(&old, &wanted);
    }

    #[test]
    fn mistakes_have_a_position() {
        let place = |bytes: &[u8]| all(bytes).unwrap_err().place.map(|p| (p.start, p.end));
        assert_eq!(place(b"0\nLINE\nten\n1.0\n"), Some((7, 10)));
        assert_eq!(place(b"0\nLINE\n10\n"), Some((7, 9)));
        assert_eq!(place(b"AutoCAD Binary DXF\r\n\x1a\0\0\0LI"), Some((24, 26)));
        assert_eq!(place(b"AutoCAD Binary DXF\r\n\x1a\0\0\0\0\x50\0"), Some((25, 27)));
    }
}
