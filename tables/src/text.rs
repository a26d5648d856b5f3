//! The rows of functions as text, all in one: what one function has in common with another is written once.
//!
//! Rows stand in the order in which they are given. Where a value is an entry of an output, a row says so right after it.

use crate::arithmetic_code::{Reader, Writer};
use crate::kind::{OUTPUT, SINE_COSINE, operands};
use crate::prediction::{END, Prediction};
use crate::rows::{COSINE, Row, Rows};

/// A text that does not describe tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct NotATable;

/// Returns the text of functions: printable characters of ASCII without blank, `"` and `\`.
pub fn encode(functions: &[Rows]) -> String {
    let (mut code, mut prediction) = (Writer::new(), Prediction::new());
    for function in functions {
        let mut written = vec![Vec::new(); function.list.len()];
        for (output, entries) in function.outputs.iter().enumerate() {
            for &(row, index) in entries {
                let fields = [row, index, 0];
                written[row].push(Row { kind: OUTPUT + output, fields });
            }
        }
        for (&row, written) in function.list.iter().zip(written) {
            let own = Some(row).filter(|row| row.kind != COSINE);
            for row in own.into_iter().chain(written) {
                prediction.row(&mut code, row);
            }
        }
        prediction.row(&mut code, Row { kind: END, fields: [0; 3] });
    }
    code.finish()
}

/// Returns the functions of a text.
///
/// # Errors
/// The text does not describe so many functions.
pub fn decode(text: &[u8], functions: usize) -> Result<Vec<Rows>, NotATable> {
    let (mut code, mut prediction) = (Reader::new(text), Prediction::new());
    // A row takes at least a part of a bit: reading ends even where the text does not describe any tables.
    let mut left = 64 * text.len() + 64;
    let mut read = || {
        let mut rows = Rows::default();
        loop {
            left = left.checked_sub(1).ok_or(NotATable)?;
            let row = prediction.row(&mut code, Row::default());
            if row.kind == END {
                break;
            }
            let known = |value: &usize| *value < rows.list.len();
            if !row.fields[..operands(row.kind)].iter().all(known) {
                return Err(NotATable);
            }
            match row.kind.checked_sub(OUTPUT) {
                Some(output) => {
                    let count = rows.outputs.len().max(output + 1);
                    rows.outputs.resize(count, Vec::new());
                    rows.outputs[output].push((row.fields[0], row.fields[1]));
                }
                None => rows.list.push(row),
            }
            if row.kind == SINE_COSINE {
                rows.list.push(Row { kind: COSINE, fields: [rows.list.len() - 1, 0, 0] });
            }
        }
        rows.outputs.iter_mut().for_each(|entries| entries.sort_unstable_by_key(|entry| entry.1));
        Ok(rows)
    };
    (0..functions).map(|_| read()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kind::{ADD, ARGUMENT, MUL, MUL_ADD, NUMBER};

    /// As many copies of a pattern of rows, each of which reads the copy before; the last two rows are results.
    fn pattern(copies: usize) -> Rows {
        let mut rows = Rows::default();
        let mut push = |kind, fields| rows.list.push(Row { kind, fields });
        push(NUMBER, [0, 0, 0]);
        push(NUMBER, [1, 0, 0]);
        for copy in 0..copies {
            let last = 2 + 5 * copy;
            push(ARGUMENT, [1, copy, 0]);
            push(MUL, [last, last - 1, 0]);
            push(ADD, [last + 1, last - 2, 0]);
            push(SINE_COSINE, [last + 2, 0, 0]);
            push(COSINE, [last + 3, 0, 0]);
        }
        let last = rows.list.len() - 1;
        rows.list.push(Row { kind: MUL_ADD, fields: [last, last - 1, last - 4] });
        rows.outputs = vec![vec![(last, 0), (last, 3)], Vec::new(), vec![(last + 1, 2_500_000)]];
        rows
    }

    #[test]
    fn a_text_is_read_as_it_was_written() {
        let functions = [pattern(3), Rows::default(), pattern(40), pattern(3)];
        let text = encode(&functions);
        assert!(text.bytes().all(|byte| byte.is_ascii_graphic() && !b"\"\\".contains(&byte)));
        assert_eq!(decode(text.as_bytes(), functions.len()).unwrap(), functions);
    }

    #[test]
    fn what_comes_again_takes_little() {
        let [short, long] = [100, 1100].map(|copies| encode(&[pattern(copies)]).len());
        // 4,000 rows more.
        assert!(long - short < 60, "{short} and {long} characters");
    }

    #[test]
    fn damaged_texts_are_refused_or_read_otherwise() {
        let functions = [pattern(30)];
        let text = encode(&functions);
        let mut refused = 0;
        for at in 0..text.len() {
            let mut damaged = text.clone().into_bytes();
            damaged[at] = if damaged[at] == b'a' { b'b' } else { b'a' };
            match decode(&damaged, 1) {
                // The last digits may have some freedom.
                Ok(read) => assert!(at + 2 > text.len() || read != functions, "digit {at}"),
                Err(NotATable) => refused += 1,
            }
        }
        assert!(refused > text.len() / 5, "{refused} of {} were refused", text.len());
        assert_eq!(decode(text.as_bytes(), 3), Err(NotATable));
    }
}
