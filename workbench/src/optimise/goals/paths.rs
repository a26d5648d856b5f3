//! Paths of points: inline, or as a table (CSV).

use std::sync::Arc;

use lamc::source::fields::{Fields, items};
use lamc::source::yaml::{Content, Entry, Node};
use lamc::source::{Diagnostic, Diagnostics, SourceFile, codes, has_no_unit, read_in};

use super::measures::text;
use super::path_keys::{ANSWERS, PATH, PLANES};
use super::read::Reader;
use super::{MOST_POINTS, Path, Target};
use crate::reading::{MAX_TABLE_BYTES, Table, Terms};

/// Points with the angles that a table gives them, rad.
type Points = (Vec<Vec<f64>>, Option<Vec<f64>>);

impl Reader<'_> {
    /// The path of a goal.
    pub(super) fn path(&mut self, entry: &Entry) -> Option<Path> {
        let at = entry.key.span;
        let fields = Fields::new(&entry.value, at, "a path", &PATH, &mut self.found)?;
        let interface = self.interface;
        let points: Vec<&str> = interface.points.iter().map(String::as_str).collect();
        let joints: Vec<&str> = interface.joints.iter().map(|joint| joint.name.as_str()).collect();
        let named = |key, known: &[&str], kind, reader: &mut Self| {
            let node = fields.require(key, &mut reader.found)?;
            reader.name(node.span, text(node), known, kind)
        };
        let point = named("point", &points, "point", self);
        let joint = named("drive", &joints, "joint", self);
        self.moves_in_one_way(&fields);
        let timed = self.word(&fields, "timed", ANSWERS)? == "true";
        let axes = self.axes(&fields);
        let angles = self.angles(&fields);
        let through = fields.require("through", &mut self.found)?;
        let (points, own) = self.points(&fields, through, &axes?)?;
        let angles = own.filter(|_| timed).or(angles)?;
        let path = Path {
            point: point?,
            joint: joint?,
            angles: [*angles.first()?, *angles.last()?],
            axes: self.axes(&fields)?,
            timed,
            targets: self.targets(&fields, through, points, &angles, timed)?,
        };
        Some(path)
    }

    /// Reports a mechanism that moves in several ways, or not at all, when one joint is turned.
    pub(super) fn moves_in_one_way(&mut self, fields: &Fields) {
        let mobility = self.interface.mobility;
        let Some(node) = fields.get("drive").filter(|_| mobility != 1) else { return };
        let message =
            format!("the mechanism has mobility {mobility}: its motion is not that of one joint");
        let error = Diagnostic::error(codes::BAD_GOALS, node.span, message);
        self.found.push(error.hint("`lamc check` says which loops there are"));
    }

    /// The coordinates of `plane`.
    fn axes(&mut self, fields: &Fields) -> Option<Vec<usize>> {
        let plane = self.word(fields, "plane", PLANES)?;
        Some(plane.bytes().map(|axis| usize::from(axis - b'x')).collect())
    }

    /// The angles of the joint that is turned, rad.
    pub(super) fn angles(&mut self, fields: &Fields) -> Option<Vec<f64>> {
        let node = fields.require("angles", &mut self.found)?;
        self.angles_of(node)
    }

    /// The angles of a list, rad.
    pub(super) fn angles_of(&mut self, node: &Node) -> Option<Vec<f64>> {
        let list = items(node, "`[first, last]`, or an angle for each point", &mut self.found)?;
        let angles: Vec<f64> =
            list.iter().map(|node| self.angle(node)).collect::<Option<Vec<_>>>()?;
        if angles.len() < 2 || angles.first() == angles.last() {
            self.wrong(node.span, "at least two different angles are needed");
            return None;
        }
        Some(angles)
    }

    /// The points, m.
    fn points(&mut self, fields: &Fields, node: &Node, axes: &[usize]) -> Option<Points> {
        if node.scalar().is_some() {
            return self.table(node, axes);
        }
        let list = items(node, "a list of points, or the path of a table", &mut self.found)?;
        let unit = fields.get("unit").map_or("m", text);
        if read_in(&format!("1 {unit}"), "m").is_err() {
            let at = fields.get("unit")?.span;
            self.wrong(at, format!("`{unit}` is not a unit of length"));
            return None;
        }
        let mut points = Vec::with_capacity(list.len());
        for item in list {
            let Content::Sequence(numbers) = &item.content else {
                self.wrong(item.span, format!("expected a point with {} coordinates", axes.len()));
                return None;
            };
            if numbers.len() != axes.len() {
                let message = format!(
                    "this point has {} coordinates instead of {}",
                    numbers.len(),
                    axes.len()
                );
                let error = Diagnostic::error(codes::WRONG_LENGTH, item.span, message);
                self.found.push(error.hint("`plane` says which coordinates points have"));
                return None;
            }
            let read = numbers.iter().map(|node| self.coordinate(node, unit));
            points.push(read.collect::<Option<Vec<_>>>()?);
        }
        Some((points, None))
    }

    /// A coordinate, m; NaN for `~`.
    fn coordinate(&mut self, node: &Node, unit: &str) -> Option<f64> {
        if node.is_null() {
            return Some(f64::NAN);
        }
        let text = text(node).trim();
        let with_unit = if has_no_unit(text) { format!("{text} {unit}") } else { text.to_owned() };
        read_in(&with_unit, "m").map_err(|reason| self.not_a_number(node, reason)).ok()
    }

    /// Points of a table beside the file of goals.
    fn table(&mut self, node: &Node, axes: &[usize]) -> Option<Points> {
        let path = self.file.beside(text(node));
        let file = match SourceFile::read_at_most(&path.to_string_lossy(), MAX_TABLE_BYTES) {
            Ok(file) => file,
            Err(error) => {
                self.wrong(node.span, error.to_string());
                return None;
            }
        };
        match read_table(&file.text, axes) {
            Ok(points) => Some(points),
            Err(problems) => {
                let file = Arc::new(file);
                let located = problems.0.into_iter();
                self.found.extend(located.map(|it| Diagnostic { file: Some(file.clone()), ..it }));
                None
            }
        }
    }

    /// The points with their angles.
    fn targets(
        &mut self,
        fields: &Fields,
        node: &Node,
        mut points: Vec<Vec<f64>>,
        angles: &[f64],
        timed: bool,
    ) -> Option<Vec<Target>> {
        if let Some(samples) = fields.get("samples") {
            let count = self.whole(fields, "samples")? as usize;
            if !timed || points.len() != 1 || !(2..=MOST_POINTS).contains(&count) {
                let message =
                    "`samples` repeats the single point of a path that is timed, at least twice";
                self.wrong(samples.span, message);
                return None;
            }
            points = vec![points[0].clone(); count];
        }
        let count = points.len();
        if count == 0 || count > MOST_POINTS {
            self.wrong(node.span, format!("a path has 1 to {MOST_POINTS} points"));
            return None;
        }
        if !timed && points.iter().flatten().any(|number| number.is_nan()) {
            self.wrong(node.span, "a free coordinate (`~`) needs a path that is timed");
            return None;
        }
        if points.iter().any(|point| point.iter().all(|number| number.is_nan())) {
            self.wrong(node.span, "a point needs at least one coordinate");
            return None;
        }
        if angles.len() != 2 && (!timed || angles.len() != count) {
            let at = fields.get("angles")?.span;
            let message = format!(
                "{} angles for {count} points: give the first and the last, or, for a path that is timed, one for each",
                angles.len()
            );
            self.wrong(at, message);
            return None;
        }
        let angle = |index: usize| match angles {
            &[from, to] => from + (to - from) * index as f64 / (count - 1).max(1) as f64,
            each => each[index],
        };
        let targets = points.into_iter().enumerate();
        Some(targets.map(|(index, at)| Target { angle: angle(index), at }).collect())
    }
}

/// Reads points (m) from the columns `x`, `y`, `z` of these axes, and angles (rad) from a column `angle`.
fn read_table(text: &str, axes: &[usize]) -> Result<Points, Diagnostics> {
    let table = Table::read(text)?;
    let angle = only_column(&table, "angle", &[("deg", 1_f64.to_radians()), ("rad", 1.0)])?;
    let mut columns = Vec::new();
    let mut missing = Diagnostics::default();
    for name in axes.iter().map(|axis| ["x", "y", "z"][*axis]) {
        match only_column(&table, name, &[("mm", 1e-3), ("m", 1.0)])? {
            Some(column) => columns.push(column),
            None => missing
                .push(table.missing(format!(
                    "there is no column `{name} [mm]`, `{name} [m]` or `{name}`"
                ))),
        }
    }
    if missing.has_errors() {
        return Err(missing);
    }
    let (mut points, mut angles) = (Vec::new(), Vec::new());
    table.rows(|row| {
        let number = |&(column, factor): &(usize, f64)| -> Result<f64, Diagnostics> {
            let number = row.number(column)?.map(|number| factor * number);
            number.ok_or_else(|| row.wrong(column, "a number").into())
        };
        points.push(columns.iter().map(number).collect::<Result<Vec<_>, _>>()?);
        angles.extend(angle.as_ref().map(number).transpose()?);
        Ok(())
    })?;
    Ok((points, angle.is_some().then_some(angles)))
}

/// The column of a quantity, with one of these units or none, and the factor to SI.
fn only_column(
    table: &Table<'_>,
    name: &str,
    units: &[(&str, f64)],
) -> Result<Option<(usize, f64)>, Diagnostics> {
    let factor = |header: &str| match header.strip_prefix(name)? {
        "" => Some(1.0),
        unit => units.iter().find(|it| unit == format!(" [{}]", it.0)).map(|it| it.1),
    };
    let all = table.names().enumerate();
    let mut found = all.filter_map(|(column, header)| Some((column, factor(header)?)));
    let first = found.next();
    match found.next() {
        Some((second, _)) => {
            Err(table.wrong_column(second, format!("this is a second column of `{name}`")).into())
        }
        None => Ok(first),
    }
}
