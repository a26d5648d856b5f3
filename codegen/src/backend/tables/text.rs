//! Groups of rows as text; [`lamc_runtime::table`] says how it reads it.

use lamc_runtime::table::{BASE, BOUND, DIGITS, fields, kind};

use super::order::Group;

/// Returns the text of groups.
pub fn text(groups: &[Group]) -> String {
    let mut text = String::new();
    let mut values = 0;
    for group in groups {
        number(&mut text, group.kind);
        number(&mut text, group.rows.len());
        let mut last = [values; 3];
        for &row in &group.rows {
            for (field, last) in row.into_iter().zip(last).take(fields(group.kind)) {
                number(
                    &mut text,
                    if field >= last { 2 * (field - last) } else { 2 * (last - field) - 1 },
                );
            }
            last = row;
        }
        values += match group.kind {
            kind::SINE_COSINE => 2 * group.rows.len(),
            kind if kind < kind::OUTPUT => group.rows.len(),
            _ => 0,
        };
    }
    text
}

/// Appends a number: one to four digits.
fn number(text: &mut String, number: usize) {
    assert!(number < BOUND, "a table has fewer values");
    let more = DIGITS.iter().filter(|(_, least)| *least <= number).count() - 1;
    let (least_digit, least) = DIGITS[more];
    let mut left = number - least;
    let mut digits = Vec::new();
    for _ in 0..more {
        digits.push(left % BASE);
        left /= BASE;
    }
    digits.push(least_digit + left);
    text.extend(digits.into_iter().rev().map(character));
}

/// The character of a digit: neither blank nor one that a string literal escapes.
fn character(digit: usize) -> char {
    let mut byte = b'!' + digit as u8;
    byte += u8::from(byte >= b'"');
    byte += u8::from(byte >= b'\\');
    char::from(byte)
}
