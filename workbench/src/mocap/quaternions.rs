//! Quaternions of bodies over time, from and to CSV.
//!
//! The header names `t [s]` (or `t`, `time`) and, for each body, `<body>.w`, `<body>.x`, `<body>.y`,
//! `<body>.z`. Empty fields are gaps. A fixed body without columns moves with a fixed body that has them;
//! if there is none, it stays in the world as drawn.

use std::fmt::Write;
use std::io::Read;

use nalgebra::{Quaternion, UnitQuaternion};

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

/// Why quaternions cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum MocapError {
    /// The text is not CSV.
    #[error("{0}")]
    Csv(#[from] csv::Error),
    /// Columns are missing, or numbers are invalid.
    #[error("{0}")]
    Content(String),
}

fn wrong(message: impl Into<String>) -> MocapError {
    MocapError::Content(message.into())
}

/// The columns of the time and of the four components of each body's rotation, w first.
struct Columns {
    time: usize,
    /// `None` for a body that is not in the file.
    bodies: Vec<Option<[usize; 4]>>,
}

impl Columns {
    fn find(header: &csv::StringRecord, bodies: &[(&str, bool)]) -> Result<Self, MocapError> {
        let column = |name: &str| header.iter().position(|found| found == name);
        let time = ["t [s]", "t", "time [s]", "time"].into_iter().find_map(column);
        let time = time.ok_or_else(|| wrong("there is no column `t [s]`"))?;
        let of_body = |(body, _): &(&str, bool)| match ["w", "x", "y", "z"]
            .map(|part| column(&format!("{body}.{part}")))
        {
            [Some(w), Some(x), Some(y), Some(z)] => Ok(Some([w, x, y, z])),
            [None, None, None, None] => Ok(None),
            _ => Err(wrong(format!("`{body}` needs all of .w, .x, .y and .z"))),
        };
        let found = bodies.iter().map(of_body).collect::<Result<Vec<_>, _>>()?;
        if found.iter().all(Option::is_none) {
            let names: Vec<_> = bodies.iter().map(|(name, _)| format!("`{name}.w`")).collect();
            return Err(wrong(format!(
                "no column belongs to a body; possible columns are {}",
                names.join(", ")
            )));
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
    pub fn read(text: impl Read, bodies: &[(&str, bool)]) -> Result<Self, MocapError> {
        let mut reader =
            csv::ReaderBuilder::new().trim(csv::Trim::All).comment(Some(b'#')).from_reader(text);
        let header = reader.headers()?.clone();
        let columns = Columns::find(&header, bodies)?;
        let mut all =
            Self { t: Vec::new(), bodies: vec![Vec::new(); bodies.len()], notes: Vec::new() };
        let mut counts = vec![Counts::default(); bodies.len()];
        for row in reader.records() {
            all.add(&row?, &columns, &mut counts)?;
        }
        if all.t.len() < 2 {
            return Err(wrong(format!("{} samples are too few", all.t.len())));
        }
        all.add_fixed(bodies, &columns);
        for name in header.iter().filter_map(|column| column.strip_suffix(".w")) {
            if bodies.iter().all(|(body, _)| *body != name) {
                all.notes.push(format!("there is no body `{name}`: its columns are left out"));
            }
        }
        for ((name, _), counts) in bodies.iter().zip(&counts) {
            all.notes.extend(counts.notes(name));
        }
        Ok(all)
    }

    /// Adds a row.
    fn add(
        &mut self,
        row: &csv::StringRecord,
        columns: &Columns,
        counts: &mut [Counts],
    ) -> Result<(), MocapError> {
        let line = row.position().map_or(0, csv::Position::line);
        let number = |column: usize| match row.get(column).unwrap_or_default() {
            "" => Ok(None),
            text => match text.parse::<f64>() {
                Ok(number) if number.is_finite() => Ok(Some(number)),
                _ => Err(wrong(format!("line {line}: `{text}` is not a number"))),
            },
        };
        let t = number(columns.time)?.filter(|t| self.t.last().is_none_or(|last| last < t));
        self.t.push(t.ok_or_else(|| wrong(format!("line {line}: times do not increase")))?);
        for (body, columns) in columns.bodies.iter().enumerate() {
            let Some(columns) = columns else { continue };
            let mut parts = [None; 4];
            for (part, column) in parts.iter_mut().zip(columns) {
                *part = number(*column)?;
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
    pub fn flatten(&mut self, t: f64, fixed: &[bool]) -> Result<(), MocapError> {
        let [first, last] = [self.t[0], self.t[self.t.len() - 1]];
        if !(first..=last).contains(&t) {
            let message = format!("{t} s is not within the record, {first} .. {last} s");
            return Err(MocapError::Content(message));
        }
        let complete = |sample: &usize| {
            self.bodies.iter().all(|body| body.is_empty() || body[*sample].is_some())
        };
        let away = |sample: &usize| (self.t[*sample] - t).abs();
        let flat = (0..self.t.len())
            .filter(complete)
            .min_by(|a, b| away(a).total_cmp(&away(b)))
            .ok_or_else(|| {
                MocapError::Content(
                    "there is no time at which all bodies were \
                                                measured"
                        .into(),
                )
            })?;
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
