//! Tables as CSV (RFC 4180): a header, then rows with as many fields. Lines that start with `#` are comments.

use std::collections::HashMap;

use csv::{Reader, ReaderBuilder, StringRecord, Trim};
use lamc::source::{Diagnostic, Diagnostics, Span, codes};

/// Largest table, bytes: 256 MiB, a quarter of an hour of ten bodies in all digits at 360 Hz.
pub const MAX_TABLE_BYTES: usize = 256 << 20;
/// Most rows of a table: three quarters of an hour at 360 Hz.
pub const MAX_ROWS: usize = 1_000_000;
/// After so many mistakes the rest of the table is not read.
const MOST_MISTAKES: usize = 20;
/// The names that the column of times may have.
const TIME: [&str; 4] = ["t [s]", "t", "time [s]", "time"];

/// A table whose header has been read.
pub struct Table<'t> {
    text: &'t str,
    reader: Reader<&'t [u8]>,
    /// The names of the columns.
    header: StringRecord,
    /// The first column of each name.
    columns: HashMap<String, usize>,
    /// Position of the header.
    span: Span,
}

impl<'t> Table<'t> {
    /// Reads the header.
    ///
    /// # Errors
    /// Returns an error if the text has no line that is not a comment.
    pub fn read(text: &'t str) -> Result<Self, Diagnostics> {
        let mut reader =
            ReaderBuilder::new().trim(Trim::All).comment(Some(b'#')).from_reader(text.as_bytes());
        let header = match reader.headers() {
            Ok(header) => header.clone(),
            Err(error) => return Err(not_csv(&error, Span::default()).into()),
        };
        let span = line_from(text, 0, end_of(&reader));
        let mut columns = HashMap::with_capacity(header.len());
        for (column, name) in header.iter().enumerate() {
            columns.entry(name.to_owned()).or_insert(column);
        }
        Ok(Self { text, reader, header, columns, span })
    }

    /// Returns the names of the columns, in order.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.header.iter()
    }

    /// Returns the first column of this name.
    pub fn column(&self, name: &str) -> Option<usize> {
        self.columns.get(name).copied()
    }

    /// Returns the column of the times.
    ///
    /// # Errors
    /// Returns an error if there is none.
    pub fn time(&self) -> Result<usize, Diagnostics> {
        let found = TIME.into_iter().find_map(|name| self.column(name));
        found.ok_or_else(|| {
            self.missing("there is no column `t [s]`")
                .hint("the times, in seconds, are in the column `t [s]`, `t`, `time [s]` or `time`")
                .into()
        })
    }

    /// Returns an error about the header.
    pub fn missing(&self, message: impl Into<String>) -> Diagnostic {
        Diagnostic::error(codes::MISSING_COLUMN, self.span, message)
    }

    /// Returns an error about a column's name.
    pub fn wrong_column(&self, column: usize, message: impl Into<String>) -> Diagnostic {
        let span = field_of(self.text, self.span, column);
        Diagnostic::error(codes::MISSING_COLUMN, span, message)
    }

    /// Calls `each` with every row, also after a mistake, and returns the number of rows.
    ///
    /// # Errors
    /// Returns the mistakes: those of `each`, rows with more or fewer fields than the header, and more than
    /// [`MAX_ROWS`] rows.
    pub fn rows(
        mut self,
        mut each: impl FnMut(&Row) -> Result<(), Diagnostics>,
    ) -> Result<usize, Diagnostics> {
        let mut mistakes = Diagnostics::default();
        let mut record = StringRecord::new();
        let mut count = 0;
        while mistakes.0.len() < MOST_MISTAKES {
            let begin = end_of(&self.reader);
            let read = self.reader.read_record(&mut record);
            let span = line_from(self.text, begin, end_of(&self.reader));
            match read {
                Ok(false) => break,
                Ok(true) => count += 1,
                Err(error) => {
                    mistakes.push(not_csv(&error, span));
                    continue;
                }
            }
            if count > MAX_ROWS {
                let message = format!("the table has more than {MAX_ROWS} rows");
                let hint = "divide the measurement, or leave out samples";
                mistakes.push(Diagnostic::error(codes::TOO_MANY_ROWS, span, message).hint(hint));
                break;
            }
            let row = Row { text: self.text, record: &record, span };
            if let Err(wrong) = each(&row) {
                mistakes.extend(wrong.0);
            }
        }
        if mistakes.has_errors() { Err(mistakes) } else { Ok(count) }
    }
}

/// A row of a table.
pub struct Row<'r> {
    text: &'r str,
    record: &'r StringRecord,
    span: Span,
}

impl Row<'_> {
    /// Returns the text of a field, without the blanks around it.
    pub fn field(&self, column: usize) -> &str {
        self.record.get(column).unwrap_or_default()
    }

    /// Returns the number in a field, `None` if the field is empty.
    ///
    /// # Errors
    /// Returns an error if the field is not a finite number.
    pub fn number(&self, column: usize) -> Result<Option<f64>, Diagnostics> {
        match self.field(column) {
            "" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ => Err(self.wrong(column, "a number").into()),
            },
        }
    }

    /// Returns the time in a field, s.
    ///
    /// # Errors
    /// Returns an error if the field is not a number, or not greater than the time before.
    pub fn time(&self, column: usize, last: Option<f64>) -> Result<f64, Diagnostics> {
        let later = self.number(column)?.filter(|t| last.is_none_or(|last| last < *t));
        later.ok_or_else(|| {
            let span = field_of(self.text, self.span, column);
            Diagnostic::error(codes::BAD_TIME, span, "times do not increase").into()
        })
    }

    /// Returns an error about a field that is not what it should be.
    pub fn wrong(&self, column: usize, expected: &str) -> Diagnostic {
        /// Characters of a field that a message shows.
        const LONGEST: usize = 40;
        let text = self.field(column);
        let mut shown: String = text.chars().take(LONGEST).collect();
        if shown.len() < text.len() {
            shown.push('…');
        }
        let span = field_of(self.text, self.span, column);
        Diagnostic::error(codes::BAD_FIELD, span, format!("`{shown}` is not {expected}"))
    }
}

/// Position of the reader behind the last record.
fn end_of(reader: &Reader<&[u8]>) -> usize {
    usize::try_from(reader.position().byte()).unwrap_or(usize::MAX)
}

/// Returns the record that was read from bytes `begin..end`: without the comments and empty lines before it, and
/// without its newline.
fn line_from(text: &str, begin: usize, end: usize) -> Span {
    let end = end.min(text.len());
    let mut start = begin.min(end);
    loop {
        let rest = &text[start..end];
        start += rest.len() - rest.trim_start_matches(['\n', '\r']).len();
        match &text[start..end] {
            comment if comment.starts_with('#') => {
                start += comment.find(['\n', '\r']).unwrap_or(comment.len());
            }
            record => {
                return Span { start, end: start + record.trim_end_matches(['\n', '\r']).len() };
            }
        }
    }
}

/// Returns the position of a field; of the whole record if it has quotes, within which a comma separates nothing.
fn field_of(text: &str, record: Span, column: usize) -> Span {
    let raw = &text[record.start..record.end];
    let mut start = record.start;
    for (index, field) in raw.split(',').enumerate().take_while(|_| !raw.contains('"')) {
        if index == column {
            let blanks = field.len() - field.trim_start().len();
            let start = start + blanks;
            return Span { start, end: start + field.trim().len() };
        }
        start += field.len() + 1;
    }
    record
}

fn not_csv(error: &csv::Error, span: Span) -> Diagnostic {
    let message = match error.kind() {
        csv::ErrorKind::UnequalLengths { expected_len, len, .. } => {
            format!("this row has {len} fields, but the header has {expected_len}")
        }
        _ => format!("not a table: {error}"),
    };
    Diagnostic::error(codes::BAD_ROW, span, message)
}
