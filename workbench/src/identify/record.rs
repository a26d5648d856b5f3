//! Recorded joint angles, from CSV.
//!
//! A header names the columns: `t [s]` (or `t`, `time`) and, per joint, `q.<joint> [rad]` as
//! `lamc simulate --csv` writes it; `q.` may be left out; the unit is `[deg]` or `[rad]`, and radians if there is none.
//! Other columns are ignored, empty fields are angles that were not measured, lines that start with
//! `#` are comments.

use std::io::Read;

/// Angles over time; an angle that was not measured is NaN.
#[derive(Clone, Debug, PartialEq)]
pub struct Record {
    /// Ascending, s.
    pub t: Vec<f64>,
    /// By sample, then by joint of the model, rad.
    pub q: Vec<Vec<f64>>,
}

/// Why a record cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordError {
    /// The text is not CSV.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// Columns are missing, or numbers are invalid.
    #[error("{0}")]
    Content(String),
}

impl Record {
    /// Reads the angles of these joints. A joint without a column has no measured angles.
    ///
    /// # Errors
    /// No column of times, no joint, fewer than three samples, times that do not ascend, fields that are not
    /// numbers.
    pub fn read(text: impl Read, joints: &[&str]) -> Result<Self, RecordError> {
        let wrong = RecordError::Content;
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text);
        let header = reader.headers()?.clone();
        let column = |names: &[String]| {
            header.iter().position(|found| names.iter().any(|name| name == found))
        };
        let time = column(&["t [s]", "t", "time [s]", "time"].map(String::from))
            .ok_or_else(|| wrong("there is no column `t [s]`".into()))?;
        let columns: Vec<Option<(usize, f64)>> = joints
            .iter()
            .map(|joint| {
                let named =
                    |unit: &str| column(&[format!("{joint}{unit}"), format!("q.{joint}{unit}")]);
                let radians = named(" [rad]").or_else(|| named("")).map(|column| (column, 1.0));
                radians.or_else(|| named(" [deg]").map(|column| (column, 1_f64.to_radians())))
            })
            .collect();
        if columns.iter().all(Option::is_none) {
            let known = joints.iter().map(|joint| format!("`{joint} [rad]`")).collect::<Vec<_>>();
            return Err(wrong(format!(
                "no column is an angle; possible columns are {}",
                known.join(", ")
            )));
        }
        let mut record = Self { t: Vec::new(), q: Vec::new() };
        for row in reader.records() {
            let row = row?;
            let line = row.position().map_or(0, csv::Position::line);
            let number = |column: usize| -> Result<f64, RecordError> {
                let text = row.get(column).unwrap_or_default();
                match text.parse::<f64>() {
                    _ if text.is_empty() => Ok(f64::NAN),
                    Ok(number) if number.is_finite() => Ok(number),
                    _ => Err(wrong(format!("line {line}: `{text}` is not a number"))),
                }
            };
            let t = number(time)?;
            if t.is_nan() || record.t.last().is_some_and(|last| *last >= t) {
                return Err(wrong(format!("line {line}: times do not increase")));
            }
            let angle = |column: &Option<(usize, f64)>| match column {
                Some((column, unit)) => Ok(number(*column)? * unit),
                None => Ok(f64::NAN),
            };
            let q = columns.iter().map(angle).collect::<Result<Vec<f64>, RecordError>>()?;
            record.t.push(t);
            record.q.push(q);
        }
        if record.t.len() < 3 {
            return Err(wrong(format!("{} samples are too few", record.t.len())));
        }
        Ok(record)
    }

    /// The times (s) and angles (rad) of one joint, without the samples in which it was not measured.
    pub fn seen(&self, joint: usize) -> (Vec<f64>, Vec<f64>) {
        let both = self.t.iter().zip(&self.q).map(|(t, q)| (*t, q[joint]));
        both.filter(|(_, q)| !q.is_nan()).unzip()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> Result<Record, RecordError> {
        Record::read(text.as_bytes(), &["knee", "hip"])
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
        for (text, says) in [
            ("knee\n1\n2\n3\n", "there is no column `t [s]`"),
            (
                "t,neck\n0,1\n",
                "no column is an angle; possible columns are `knee [rad]`, `hip \
                               [rad]`",
            ),
            ("t,knee\n0,1\n0,2\n1,3\n", "line 3: times do not increase"),
            ("t,knee\n0,1\n1,x\n2,3\n", "line 3: `x` is not a number"),
            ("t,knee\n0,1\n1,inf\n2,3\n", "line 3: `inf` is not a number"),
            ("t,knee\n0,1\n1,2\n", "2 samples are too few"),
        ] {
            assert_eq!(read(text).unwrap_err().to_string(), says, "{text}");
        }
    }
}
