//! Recorded joint angles, from CSV.
//!
//! A header names the columns: `t [s]` (or `t`, `time`) and, per joint, `q.<joint> [rad]` as
//! `lamc simulate --csv` writes it; `q.` may be left out; the unit is `[deg]` or `[rad]`, and radians if there is none.
//! Other columns are ignored, empty fields are angles that were not measured, lines that start with
//! `#` are comments.

use lamc::source::{Diagnostic, Diagnostics, Span, codes};

use crate::reading::{Row, Table};

/// Least number of samples.
const FEWEST: usize = 3;

/// Angles over time; an angle that was not measured is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Ascending, s.
    pub t: Vec<f64>,
    /// By sample, then by joint of the model, rad.
    pub q: Vec<Vec<f64>>,
}

/// A column of angles, and its unit in radians.
type Column = (usize, f64);

impl Record {
    /// Reads the angles of these joints. A joint without a column has no measured angles.
    ///
    /// # Errors
    /// No column of times, no joint, fewer than three samples, times that do not ascend, fields that are not
    /// numbers.
    pub fn read(text: &str, joints: &[&str]) -> Result<Self, Diagnostics> {
        let table = Table::read(text)?;
        let time = table.time()?;
        let columns: Vec<Option<Column>> =
            joints.iter().map(|joint| column_of(&table, joint)).collect();
        if columns.iter().all(Option::is_none) {
            return Err(no_angle(&table, joints).into());
        }
        let mut record = Self { t: Vec::new(), q: Vec::new() };
        let count = table.rows(|row| {
            let t = row.time(time, record.t.last().copied())?;
            let angle = |column: &Option<Column>| angle_in(row, *column);
            let q = columns.iter().map(angle).collect::<Result<_, _>>()?;
            record.t.push(t);
            record.q.push(q);
            Ok(())
        })?;
        if count < FEWEST {
            let end = Span { start: text.len(), end: text.len() };
            let message = format!("{count} samples are too few");
            return Err(Diagnostic::error(codes::TOO_FEW_ROWS, end, message).into());
        }
        Ok(record)
    }

    /// The times (s) and angles (rad) of one joint, without the samples in which it was not measured.
    pub fn seen(&self, joint: usize) -> (Vec<f64>, Vec<f64>) {
        let both = self.t.iter().zip(&self.q).map(|(t, q)| (*t, q[joint]));
        both.filter(|(_, q)| !q.is_nan()).unzip()
    }
}

fn column_of(table: &Table, joint: &str) -> Option<Column> {
    let named = |unit: &str| {
        let [bare, with_symbol] = [format!("{joint}{unit}"), format!("q.{joint}{unit}")];
        let found = [table.column(&bare), table.column(&with_symbol)];
        found.into_iter().flatten().min()
    };
    let radians = named(" [rad]").or_else(|| named("")).map(|column| (column, 1.0));
    radians.or_else(|| named(" [deg]").map(|column| (column, 1_f64.to_radians())))
}

fn angle_in(row: &Row, column: Option<Column>) -> Result<f64, Diagnostics> {
    let Some((column, unit)) = column else { return Ok(f64::NAN) };
    Ok(row.number(column)?.map_or(f64::NAN, |number| number * unit))
}

fn no_angle(table: &Table, joints: &[&str]) -> Diagnostic {
    let known = joints.iter().map(|joint| format!("`{joint} [rad]`")).collect::<Vec<_>>();
    let columns = known.join(", ");
    table.missing(format!("no column is an angle; possible columns are {columns}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Record, Diagnostics> {
        Record::read(text, &["knee", "hip"])
    }

    #[test]
    fn units_gaps_and_other_columns() {
        let record =
            read("# a swing\nt [s],q.hip [deg],marks,knee\n0,90,7,1\n0.5,,8,2\n1,180,9,-3e-1\n");
        let record = record.unwrap();
        assert_eq!(record.t, [0.0, 0.5, 1.0]);
        assert_eq!(record.q[0], [1.0, std::f64::consts::FRAC_PI_2]);
        assert!(record.q[1][0] == 2.0 && record.q[1][1].is_nan());
        assert_eq!(record.seen(1), (vec![0.0, 1.0], vec![90f64.to_radians(), 180f64.to_radians()]));
    }

    #[test]
    fn what_is_wrong_is_said() {
        for (text, at, says) in [
            (
                "knee
1
2
3
",
                "knee",
                "there is no column `t [s]`",
            ),
            (
                "t,neck
0,1
",
                "t,neck",
                "no column is an angle; possible columns are `knee [rad]`, `hip [rad]`",
            ),
            (
                "t,knee
0,1
0,2
1,3
",
                "0",
                "times do not increase",
            ),
            (
                "t,knee
0,1
1, x
2,3
",
                "x",
                "`x` is not a number",
            ),
            (
                "t,knee
0,1
1,inf
2,3
",
                "inf",
                "`inf` is not a number",
            ),
            (
                "t,knee
0,1
1,2
",
                "",
                "2 samples are too few",
            ),
        ] {
            let Diagnostic { message, span, .. } = read(text).unwrap_err().0.remove(0);
            let span = span.unwrap();
            assert_eq!((message.as_str(), &text[span.start..span.end]), (says, at), "{text}");
        }
    }
}
