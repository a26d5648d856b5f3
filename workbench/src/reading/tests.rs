//! Places of mistakes, and limits, in files that would be too large for `tests/wrong`.

use lamc::source::{Diagnostic, Diagnostics};

use super::*;

/// Reads the numbers of the first column, each row with its number.
fn numbers(text: &str) -> Result<Vec<f64>, Diagnostics> {
    let mut numbers = Vec::new();
    Table::read(text)?.rows(|row| {
        numbers.extend(row.number(0)?);
        Ok(())
    })?;
    Ok(numbers)
}

/// Code and marked text of the first mistake, with the number of mistakes.
fn mistake<T: std::fmt::Debug>(text: &str, read: Result<T, Diagnostics>) -> (&str, &str, usize) {
    let errors = read.unwrap_err().0;
    let Diagnostic { code, span, .. } = &errors[0];
    let span = span.unwrap();
    (code.name, &text[span.start..span.end], errors.len())
}

#[test]
fn mistakes_are_marked_where_they_are() {
    for (text, code, marked) in [
        ("a,b\n1,2\nx,2\n", "bad-field", "x"),
        ("a,b\r\n1,2\r\n  x ,2\r\n", "bad-field", "x"),
        ("# c\n\n a,b\n\n# one\n# two\n x,2\n", "bad-field", "x"),
        ("a,b\n\"x\",\"2\n3\"\n", "bad-field", "\"x\",\"2\n3\""),
        ("a,b\n1,2\n1\n", "bad-row", "1"),
        ("a,b\n# c\n1,2,3", "bad-row", "1,2,3"),
        ("a,b\nä,2", "bad-field", "ä"),
    ] {
        assert_eq!(mistake(text, numbers(text)), (code, marked, 1), "{text:?}");
    }
    assert_eq!(numbers("a,b\n\n1,\n,2\n\n").unwrap(), [1.0]);
}

#[test]
fn a_table_of_another_kind_is_not_reported_row_by_row() {
    let text = format!("a\n{}", "x\n".repeat(1000));
    assert_eq!(mistake(&text, numbers(&text)), ("bad-field", "x", 20));
}

#[test]
fn rows_are_counted() {
    let mut text = format!("a\n{}", "1\n".repeat(MAX_ROWS));
    assert_eq!(numbers(&text).unwrap().len(), MAX_ROWS);
    text += "2\n";
    assert_eq!(mistake(&text, numbers(&text)), ("too-many-rows", "2", 1));
}

#[test]
fn states_are_counted() {
    let of =
        |count: usize| format!("{{\"states\":[\n{}\n]}}", vec!["{\"q\":[]}"; count].join(",\n"));
    assert_eq!(states(&of(MAX_STATES)).unwrap().len(), MAX_STATES);
    let text = of(MAX_STATES + 2);
    let (code, _, count) = mistake(&text, states(&text));
    assert_eq!((code, count), ("too-many-states", 1));
    let at = states(&text).unwrap_err().0[0].span.unwrap().start;
    // On the line of the first state too many or, where its reader stops, at the beginning of the next.
    let line = 1 + text[..at].matches('\n').count();
    assert!([MAX_STATES + 2, MAX_STATES + 3].contains(&line), "line {line}");
}

#[test]
fn states_have_defaults() {
    let read = states("{\"states\": [{\"q\": [1, 2.5]}]}").unwrap();
    assert_eq!(read, [StateInput { q: vec![1.0, 2.5], ..StateInput::default() }]);
    for (text, marked) in [
        ("{\"states\": [{\"q\": [1, no]}]}", "o"),
        ("{\n\"states\": [{\"u\": [1]}]\n}", "}"),
        ("", ""),
    ] {
        let (code, at, _) = mistake(text, states(text));
        assert_eq!((code, at), ("bad-states", marked), "{text}");
    }
}
