//! Recorded joint angles and poses of free bodies, from CSV.
//!
//! A header names the columns: `t [s]` (or `t`, `time`) and, per joint, `q.<joint> [rad]` as
//! `lamc simulate --csv` writes it; `q.` may be left out; the unit is `[deg]` or `[rad]`, and radians if there is none.
//! The coordinates of a free body are `q.<body>.x [m]` to `q.<body>.qz [1]`, as written there; the unit may be left out,
//! and is `[m]` or `[mm]` for displacements. An orientation has four columns or none.
//! Other columns are ignored, empty fields are values that were not measured, lines that start with
//! `#` are comments.

use lamc::source::free::{COORDINATE_NAMES, COORDINATES};
use lamc::source::{Diagnostic, Diagnostics, Span, codes};

use crate::reading::{Row, Table};

/// Least number of samples.
const FEWEST: usize = 3;
/// The length of a measured quaternion may be off 1 by this.
const LENGTH_OFF: f64 = 0.01;
/// The coordinates of a free body before its quaternion.
const DISPLACEMENTS: usize = 3;

/// Coordinates over time; one that was not measured is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Ascending, s.
    pub t: Vec<f64>,
    /// By sample, then by coordinate of the model: rad; m and quaternions of free bodies.
    pub q: Vec<Vec<f64>>,
}

/// A column of coordinates, and its unit in radians or metres.
type Column = (usize, f64);

impl Record {
    /// Reads the angles of these joints and the coordinates of these free bodies. A joint without a column has no measured
    /// angles, and a coordinate of a body without a column no measured values.
    ///
    /// # Errors
    /// No column of times, no coordinate, orientations of which columns are missing, columns of a free body that are none
    /// of its coordinates, fewer than three samples, times that do not ascend, fields that are not numbers, quaternions
    /// that are no unit quaternions.
    pub fn read(text: &str, joints: &[&str], bodies: &[&str]) -> Result<Self, Diagnostics> {
        let table = Table::read(text)?;
        let time = table.time()?;
        let mut columns: Vec<Option<Column>> =
            joints.iter().map(|joint| column_of(&table, joint)).collect();
        for body in bodies {
            columns.extend(columns_of(&table, body)?);
        }
        if columns.iter().all(Option::is_none) {
            return Err(nothing_measured(&table, joints, bodies).into());
        }
        let mut record = Self { t: Vec::new(), q: Vec::new() };
        let count = table.rows(|row| {
            let t = row.time(time, record.t.last().copied())?;
            let value = |column: &Option<Column>| value_in(row, *column);
            let q: Vec<f64> = columns.iter().map(value).collect::<Result<_, _>>()?;
            check_quaternions(row, &columns, &q, joints.len())?;
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

/// Whether the quaternion of a free body, all of its coordinates, was measured as a whole and has the length 1, or was
/// not measured at all.
pub(super) fn is_orientation(body: &[f64; COORDINATES]) -> bool {
    let quaternion = &body[DISPLACEMENTS..];
    let length = quaternion.iter().map(|part| part * part).sum::<f64>().sqrt();
    quaternion.iter().all(|part| part.is_nan()) || (length - 1.0).abs() <= LENGTH_OFF
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

/// The columns of a free body.
fn columns_of(table: &Table, body: &str) -> Result<[Option<Column>; COORDINATES], Diagnostics> {
    let units = |index: usize| match index < DISPLACEMENTS {
        true => &[(" [m]", 1.0), ("", 1.0), (" [mm]", 1e-3)][..],
        false => &[(" [1]", 1.0), ("", 1.0)][..],
    };
    let columns: [Option<Column>; COORDINATES] = std::array::from_fn(|index| {
        let name = format!("q.{body}.{}", COORDINATE_NAMES[index]);
        let named = |(unit, factor): &(&str, f64)| {
            table.column(&format!("{name}{unit}")).map(|column| (column, *factor))
        };
        units(index).iter().find_map(named)
    });
    let begin = format!("q.{body}.");
    let is_read = |column: usize| columns.iter().flatten().any(|(read, _)| *read == column);
    let mut mistakes = Diagnostics::default();
    for (column, name) in table.names().enumerate() {
        if name.starts_with(&begin) && !is_read(column) {
            let message = format!("`{name}` is no coordinate of `{body}`, or is there twice");
            let hint = format!("its coordinates are {}", possible(body));
            mistakes.push(table.wrong_column(column, message).hint(hint));
        }
    }
    let quaternion = &columns[DISPLACEMENTS..];
    let missing = quaternion.iter().position(Option::is_none);
    if let (Some(missing), Some((column, _))) = (missing, quaternion.iter().flatten().next()) {
        let name = COORDINATE_NAMES[DISPLACEMENTS + missing];
        let message = format!("the orientation of `{body}` has no column `q.{body}.{name}`");
        mistakes.push(table.wrong_column(*column, message));
    }
    if mistakes.has_errors() { Err(mistakes) } else { Ok(columns) }
}

/// The columns that a free body may have.
fn possible(body: &str) -> String {
    format!(
        "`q.{body}.x [m]`, `.y [m]`, `.z [m]` and `q.{body}.qw [1]`, `.qx [1]`, `.qy [1]`, `.qz [1]`"
    )
}

fn value_in(row: &Row, column: Option<Column>) -> Result<f64, Diagnostics> {
    let Some((column, unit)) = column else { return Ok(f64::NAN) };
    Ok(row.number(column)?.map_or(f64::NAN, |number| number * unit))
}

fn check_quaternions(
    row: &Row,
    columns: &[Option<Column>],
    q: &[f64],
    joints: usize,
) -> Result<(), Diagnostics> {
    let bodies = q[joints..].as_chunks().0.iter().zip(columns[joints..].as_chunks().0);
    for (body, columns) in bodies {
        let columns: &[Option<Column>; COORDINATES] = columns;
        if let (false, Some((column, _))) = (is_orientation(body), columns[DISPLACEMENTS]) {
            return Err(row.wrong(column, "the first of four parts of a unit quaternion").into());
        }
    }
    Ok(())
}

fn nothing_measured(table: &Table, joints: &[&str], bodies: &[&str]) -> Diagnostic {
    let known = joints.iter().map(|joint| format!("`{joint} [rad]`"));
    let known: Vec<_> = known.chain(bodies.iter().map(|body| possible(body))).collect();
    let what = if bodies.is_empty() { "an angle" } else { "an angle or a coordinate" };
    table.missing(format!("no column is {what}; possible columns are {}", known.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Record, Diagnostics> {
        Record::read(text, &["knee", "hip"], &[])
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

    const ROW: &str = "q.hull.qw [1],q.hull.qx [1],q.hull.qy [1],q.hull.qz [1]";

    fn read_body(text: &str) -> Result<Record, Diagnostics> {
        Record::read(text, &["knee"], &["hull"])
    }

    #[test]
    fn poses_of_free_bodies_have_gaps_and_units() {
        let text =
            format!("t,q.hull.x [mm],{ROW},q.hull.z\n0,5,0,0,-1,0,2\n1,,,,,,3\n2,6,1,0,0,0,\n");
        let record = read_body(&text).unwrap();
        let nan = f64::NAN;
        let expected = [
            [nan, 0.005, nan, 2.0, 0.0, 0.0, -1.0, 0.0],
            [nan, nan, nan, 3.0, nan, nan, nan, nan],
            [nan, 0.006, nan, nan, 1.0, 0.0, 0.0, 0.0],
        ];
        for (found, expected) in record.q.iter().zip(expected) {
            let is_same = |(a, b): (&f64, f64)| *a == b || (a.is_nan() && b.is_nan());
            assert!(found.iter().zip(expected).all(is_same), "{found:?}");
        }
    }

    #[test]
    fn what_is_wrong_with_a_pose_is_said_where_it_is() {
        let rows = "\n0,1,0,0,0\n1,1,0,0,0\n2,1,0,0,0\n";
        let long = format!("t,{ROW}{}", rows.replace("1,1,0", "1,0.9,0"));
        let part = format!("t,{ROW}{}", rows.replace("1,1,0", "1,1,"));
        for (text, at, says) in [
            (
                format!("t,{}{rows}", ROW.replace("qz [1]", "qy")),
                "q.hull.qy",
                "`q.hull.qy` is no coordinate of `hull`, or is there twice",
            ),
            (
                format!("t,{}{rows}", ROW.replace("qz [1]", "yaw [deg]")),
                "q.hull.yaw [deg]",
                "`q.hull.yaw [deg]` is no coordinate of `hull`, or is there twice",
            ),
            (
                format!("t,{}{rows}", ROW.replace("q.hull.qz [1]", "knee")),
                "q.hull.qw [1]",
                "the orientation of `hull` has no column `q.hull.qz`",
            ),
            (long, "0.9", "`0.9` is not the first of four parts of a unit quaternion"),
            (part, "1", "`1` is not the first of four parts of a unit quaternion"),
            (
                "t,u.hull.vx\n0,1\n".to_owned(),
                "t,u.hull.vx",
                "no column is an angle or a coordinate; possible columns are `knee [rad]`, `q.hull.x [m]`, `.y [m]`, `.z [m]` and `q.hull.qw [1]`, `.qx [1]`, `.qy [1]`, `.qz [1]`",
            ),
        ] {
            let Diagnostic { message, span, .. } = read_body(&text).unwrap_err().0.remove(0);
            let span = span.unwrap();
            assert_eq!((message.as_str(), &text[span.start..span.end]), (says, at), "{text}");
        }
    }
}
