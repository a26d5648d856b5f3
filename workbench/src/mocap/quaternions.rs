//! Quaternions of bodies over time, from and to CSV.
//!
//! The header names `t [s]` (or `t`, `time`) and, for each body, `<body>.w`, `<body>.x`, `<body>.y`,
//! `<body>.z`. Empty fields are gaps. A fixed body without columns moves with a fixed body that has them;
//! if there is none, it stays in the world as drawn.

use std::collections::HashSet;
use std::fmt::Write;

use lamc::source::{Diagnostic, Diagnostics, Span, codes};
use nalgebra::{Quaternion, UnitQuaternion};

use crate::reading::{Row, Table};

/// Least number of samples.
const FEWEST: usize = 2;
/// Most notes about bodies that the model does not have.
const MOST_NOTES: usize = 20;

/// A quaternion whose length is this far from 1 is not a rotation: the row is left out.
const NO_ROTATION: f64 = 0.01;
/// A length this far from 1 is more than an error of printed digits, and is reported.
const INEXACT: f64 = 1e-3;

/// Rotations of bodies over time.
#[derive(Clone, Debug, PartialEq)]
pub struct Quaternions {
    /// Ascending, s.
    pub t: Vec<f64>,
    /// By body of the model, then by sample: body to world; `None` in a gap. Empty for a body that
    /// was not recorded.
    pub bodies: Vec<Vec<Option<UnitQuaternion<f64>>>>,
    /// Notes on rows that were corrected or left out.
    pub notes: Vec<String>,
}

/// Why frames cannot be made parallel.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FlattenError {
    /// The time is outside the record.
    #[error("{t} s is not within the record, {first} .. {last} s")]
    Outside {
        /// The time that was given, s.
        t: f64,
        /// First sample of the record, s.
        first: f64,
        /// Last sample of the record, s.
        last: f64,
    },
    /// At every sample the rotation of a body is missing.
    #[error("there is no time at which all bodies were measured")]
    Incomplete,
}

/// The columns of the time and of the four components of each body's rotation, w first.
struct Columns {
    time: usize,
    /// `None` for a body that is not in the file.
    bodies: Vec<Option<[usize; 4]>>,
}

impl Columns {
    fn find(table: &Table, bodies: &[(&str, bool)]) -> Result<Self, Diagnostics> {
        let time = table.time()?;
        let of_body = |(body, _): &(&str, bool)| match ["w", "x", "y", "z"]
            .map(|part| table.column(&format!("{body}.{part}")))
        {
            [Some(w), Some(x), Some(y), Some(z)] => Ok(Some([w, x, y, z])),
            [None, None, None, None] => Ok(None),
            _ => Err(table.missing(format!("`{body}` needs all of .w, .x, .y and .z")).into()),
        };
        let found = bodies.iter().map(of_body).collect::<Result<Vec<_>, Diagnostics>>()?;
        if found.iter().all(Option::is_none) {
            let names: Vec<_> = bodies.iter().map(|(name, _)| format!("`{name}.w`")).collect();
            let columns = names.join(", ");
            let message = format!("no column belongs to a body; possible columns are {columns}");
            return Err(table.missing(message).into());
        }
        Ok(Self { time, bodies: found })
    }
}

/// Counts of the rows of a body that are not exactly rotations.
#[derive(Clone, Copy, Default)]
struct Counts {
    refused: usize,
    inexact: usize,
}

impl Counts {
    /// Returns whether a quaternion is a rotation, at least nearly; counts those that are not exactly so.
    fn is_rotation(&mut self, quaternion: &Quaternion<f64>) -> bool {
        let off = (quaternion.norm() - 1.0).abs();
        let is_refused = off > NO_ROTATION;
        self.refused += usize::from(is_refused);
        self.inexact += usize::from(off > INEXACT && !is_refused);
        !is_refused
    }

    fn notes(self, name: &str) -> impl Iterator<Item = String> {
        let notes = [
            (
                self.refused,
                "are left out because they are not rotations (their length differs \
                            from 1 by more than 1 %)",
            ),
            (self.inexact, "are normalised because their length is not 1"),
        ];
        let notes = notes.into_iter().filter(|(count, _)| *count > 0);
        notes.map(move |(count, what)| format!("{count} rows of `{name}` {what}"))
    }
}

impl Quaternions {
    /// Reads the rotations of these bodies, each with whether it is fixed.
    ///
    /// # Errors
    /// No column of times, no body, only some of a body's four columns, times that do not ascend, fields that
    /// are not numbers, fewer than two samples.
    pub fn read(text: &str, bodies: &[(&str, bool)]) -> Result<Self, Diagnostics> {
        let table = Table::read(text)?;
        let columns = Columns::find(&table, bodies)?;
        let strangers = strangers(&table, bodies);
        let mut all =
            Self { t: Vec::new(), bodies: vec![Vec::new(); bodies.len()], notes: Vec::new() };
        let mut counts = vec![Counts::default(); bodies.len()];
        let count = table.rows(|row| all.add(row, &columns, &mut counts))?;
        if count < FEWEST {
            let end = Span { start: text.len(), end: text.len() };
            let message = format!("{count} samples are too few");
            return Err(Diagnostic::error(codes::TOO_FEW_ROWS, end, message).into());
        }
        all.add_fixed(bodies, &columns);
        all.notes.extend(strangers);
        for ((name, _), counts) in bodies.iter().zip(&counts) {
            all.notes.extend(counts.notes(name));
        }
        Ok(all)
    }

    /// Adds a row.
    fn add(
        &mut self,
        row: &Row,
        columns: &Columns,
        counts: &mut [Counts],
    ) -> Result<(), Diagnostics> {
        self.t.push(row.time(columns.time, self.t.last().copied())?);
        for (body, columns) in columns.bodies.iter().enumerate() {
            let Some(columns) = columns else { continue };
            let mut parts = [None; 4];
            for (part, column) in parts.iter_mut().zip(columns) {
                *part = row.number(*column)?;
            }
            let rotation = match parts {
                [Some(w), Some(x), Some(y), Some(z)] => Some(Quaternion::new(w, x, y, z)),
                _ => None,
            };
            let sound = rotation.filter(|rotation| counts[body].is_rotation(rotation));
            self.bodies[body].push(sound.map(UnitQuaternion::from_quaternion));
        }
        Ok(())
    }

    /// Copies the rotation of a fixed body to the fixed bodies that are not in the file.
    fn add_fixed(&mut self, bodies: &[(&str, bool)], columns: &Columns) {
        let is_seen = |body: usize| columns.bodies[body].is_some();
        let ground = (0..bodies.len()).find(|&body| bodies[body].1 && is_seen(body));
        if ground.is_none() {
            let note = "no fixed body is in the file: the ground is assumed to have the orientation of \
                 the world";
            self.notes.push(note.to_owned());
        }
        for body in (0..bodies.len()).filter(|&body| bodies[body].1 && !is_seen(body)) {
            self.bodies[body] = match ground {
                Some(ground) => self.bodies[ground].clone(),
                None => vec![Some(UnitQuaternion::identity()); self.t.len()],
            };
        }
    }

    /// Turns all frames so that they are parallel to that of a fixed body when the sheet lies flat: at the sample nearest
    /// to `t` (s) at which all recorded bodies have a rotation. `fixed` has one entry per body.
    ///
    /// # Errors
    /// If there is no such sample, or `t` is outside the record.
    pub fn flatten(&mut self, t: f64, fixed: &[bool]) -> Result<(), FlattenError> {
        let [first, last] = [self.t[0], self.t[self.t.len() - 1]];
        if !(first..=last).contains(&t) {
            return Err(FlattenError::Outside { t, first, last });
        }
        let complete = |sample: &usize| {
            self.bodies.iter().all(|body| body.is_empty() || body[*sample].is_some())
        };
        let away = |sample: &usize| (self.t[*sample] - t).abs();
        let flat = (0..self.t.len())
            .filter(complete)
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .ok_or(FlattenError::Incomplete)?;
        let at = |body: &Vec<Option<UnitQuaternion<f64>>>| body.get(flat).copied().flatten();
        let mut grounds = self.bodies.iter().zip(fixed).filter(|(_, fixed)| **fixed);
        let ground = grounds.find_map(|(body, _)| at(body)).unwrap_or_default();
        for body in &mut self.bodies {
            let Some(mount) = at(body) else { continue };
            for rotation in body.iter_mut().flatten() {
                *rotation *= mount.inverse() * ground;
            }
        }
        Ok(())
    }
}

/// Notes on the bodies of a table that the model does not have.
fn strangers(table: &Table, bodies: &[(&str, bool)]) -> Vec<String> {
    let known: HashSet<&str> = bodies.iter().map(|(body, _)| *body).collect();
    let names = table.names().filter_map(|column| column.strip_suffix(".w"));
    let mut names = names.filter(|name| !known.contains(name));
    let note = |name| format!("there is no body `{name}`: its columns are left out");
    let mut notes: Vec<String> = names.by_ref().take(MOST_NOTES).map(note).collect();
    if let more @ 1.. = names.count() {
        notes.push(format!("the columns of {more} more bodies are left out"));
    }
    notes
}

/// Rotations as CSV, as [`Quaternions::read`] reads it: by sample, then by body.
pub fn write(bodies: &[&str], t: &[f64], rotations: &[Vec<Quaternion<f64>>]) -> String {
    let mut text = "t [s]".to_owned();
    for body in bodies {
        for part in ["w", "x", "y", "z"] {
            let _ = write!(text, ",{body}.{part}");
        }
    }
    text.push('\n');
    for (t, row) in t.iter().zip(rotations) {
        let _ = write!(text, "{t:?}");
        for q in row {
            let _ = write!(text, ",{:?},{:?},{:?},{:?}", q.w, q.i, q.j, q.k);
        }
        text.push('\n');
    }
    text
}
