//! A pattern as a mechanism: parts, the creases between them, and what is connected with the ground.

use std::collections::{BTreeMap, HashMap, VecDeque};

use lamc_drawings::{FacetId, Pattern, Place, Role};

use super::creases::{Line, lines, middle};
use super::names::Grid;
use super::outlines;
use super::{Drawn, Ground, faults};
use crate::arithmetic::hypot;
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, Severity, Span};

/// Areas that differ by less than this part are equal: they come from rounded coordinates.
const SAME_AREA: f64 = 1e-6;

/// A facet that becomes a body.
pub(in crate::source) struct Part {
    pub name: String,
    /// The facet of the pattern.
    pub facet: FacetId,
    /// Its centroid.
    pub centre: [f64; 2],
    pub area: f64,
    /// Steps to the ground.
    depth: usize,
}

/// A joint of the model, by the names of its bodies.
pub(in crate::source) type Link<'n> = [&'n str; 2];

/// The parts and creases of a pattern, with names.
pub(in crate::source) struct Sheet {
    /// The pattern from which the parts are: flat lines are gone unless they are hinges.
    pub pattern: Pattern,
    pub parts: Vec<Part>,
    pub lines: Vec<Line>,
    /// The part that is fixed.
    pub ground: Option<usize>,
}

impl Sheet {
    /// Finds the parts and creases of a drawing, without those that nothing connects with the ground. `links`
    /// are the joints of the model, and `fixed` its fixed bodies. `at` is where the model says which facet is
    /// fixed.
    pub fn of(
        drawn: &Drawn,
        triangulate: bool,
        (ground, at): (Ground, Option<Span>),
        (links, fixed): (&[Link], &[&str]),
        found: &mut Diagnostics,
    ) -> Option<Self> {
        let pattern = match triangulate {
            true => drawn.pattern.clone(),
            false => drawn.pattern.merged(Role::Flat),
        };
        let parts = parts(&pattern);
        let lines = lines(&pattern, &parts);
        let mut sheet = Self { pattern, parts, lines, ground: None };
        if sheet.lines.is_empty() {
            let message = "no crease is between two facets".to_owned();
            let error = drawn.finding(Severity::Error, codes::NO_CREASE, None, message);
            found.push(error.hint(
                "mountains, valleys and undriven creases become joints; flat lines only with \
                 `triangulate`",
            ));
            return None;
        }
        match ground {
            Ground::None => {}
            Ground::Largest => sheet.ground = Some(sheet.largest()),
            Ground::Around(point) => {
                sheet.ground = sheet.around(point);
                if sheet.ground.is_none() {
                    found.push(sheet.no_ground(drawn, point, at));
                    return None;
                }
            }
        }
        sheet.keep_connected(drawn, links, fixed, found);
        if sheet.lines.is_empty() {
            let message = "no crease is connected with the ground".to_owned();
            found.push(drawn.finding(Severity::Error, codes::NO_GROUND, None, message));
            return None;
        }
        sheet.orient();
        sheet.report_lines(drawn, found);
        Some(sheet)
    }

    /// The largest part of the piece with the most parts; of equal ones the first.
    fn largest(&self) -> usize {
        let pieces = self.pieces();
        let mut counts = vec![0_usize; self.parts.len()];
        pieces.iter().for_each(|piece| counts[*piece] += 1);
        let mut best = 0;
        for (index, part) in self.parts.iter().enumerate() {
            let [count, most] = [index, best].map(|part| counts[pieces[part]]);
            let area = self.parts[best].area;
            if count > most || (count == most && part.area > area * (1.0 + SAME_AREA)) {
                best = index;
            }
        }
        best
    }

    /// The piece of each part: the index of its first part.
    fn pieces(&self) -> Vec<usize> {
        let around = self.around_parts();
        let mut pieces = vec![usize::MAX; self.parts.len()];
        for start in 0..self.parts.len() {
            let mut open = vec![start];
            while let Some(part) = open.pop() {
                if pieces[part] == usize::MAX {
                    pieces[part] = start;
                    open.extend(&around[part]);
                }
            }
        }
        pieces
    }

    /// The neighbours of each part.
    fn around_parts(&self) -> Vec<Vec<usize>> {
        let mut around = vec![Vec::new(); self.parts.len()];
        for Line { parts: [one, other], .. } in &self.lines {
            around[*one].push(*other);
            around[*other].push(*one);
        }
        around
    }

    /// The part around a point.
    fn around(&self, point: [f64; 2]) -> Option<usize> {
        let is_around = |part: &Part| outlines::contains(&self.pattern, part.facet, point);
        self.parts.iter().position(is_around)
    }

    fn no_ground(&self, drawn: &Drawn, point: [f64; 2], at: Option<Span>) -> Diagnostic {
        let message = format!("no facet is around the point {} of `ground`", faults::shown(point));
        let error = match at {
            Some(span) => Diagnostic::error(codes::NO_GROUND, span, message),
            None => drawn.finding(Severity::Error, codes::NO_GROUND, None, message),
        };
        let distance = |part: &&Part| hypot(part.centre[0] - point[0], part.centre[1] - point[1]);
        let nearest = self.parts.iter().min_by(|a, b| distance(a).total_cmp(&distance(b)));
        let nearest = nearest.map_or(String::new(), |part| {
            format!("; the nearest facet has its middle at {}", faults::shown(part.centre))
        });
        error
            .at(vec![point])
            .hint(format!("the point is in units of the drawing, with y upwards{nearest}"))
    }

    /// Leaves out the pieces that nothing connects with the ground, and says where they are.
    fn keep_connected(
        &mut self,
        drawn: &Drawn,
        links: &[Link],
        fixed: &[&str],
        found: &mut Diagnostics,
    ) {
        let depths = self.depths(links, fixed);
        let pieces = self.pieces();
        let mut loose: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (part, piece) in pieces.iter().enumerate().filter(|(part, _)| depths[*part].is_none()) {
            loose.entry(*piece).or_default().push(part);
        }
        if !loose.is_empty() {
            let points: Vec<[f64; 2]> = loose.keys().map(|part| self.parts[*part].centre).collect();
            let facets: usize = loose.values().map(Vec::len).sum();
            let message = match (loose.len(), facets) {
                (1, 1) => "a facet is not connected with the ground and is left out".into(),
                (1, _) => format!(
                    "a piece of {facets} facets is not connected with the ground and is left out"
                ),
                (pieces, _) => format!(
                    "{pieces} pieces of {facets} facets are not connected with the ground and are \
                     left out"
                ),
            };
            let place = self.place_of(self.parts[*loose.keys().next().unwrap_or(&0)].facet);
            let warning = drawn.finding(Severity::Warning, codes::LOOSE_PIECE, place, message);
            found.push(
                warning.at(points).hint("creases connect facets, cuts and borders separate them"),
            );
        }
        let mut kept = vec![None; self.parts.len()];
        let mut parts = Vec::new();
        for (index, mut part) in std::mem::take(&mut self.parts).into_iter().enumerate() {
            if let Some(depth) = depths[index] {
                part.depth = depth;
                kept[index] = Some(parts.len());
                parts.push(part);
            }
        }
        self.parts = parts;
        self.ground = self.ground.and_then(|ground| kept[ground]);
        self.lines.retain_mut(|line| match line.parts.map(|part| kept[part]) {
            [Some(one), Some(other)] => {
                line.parts = [one, other];
                true
            }
            _ => false,
        });
    }

    /// The number of joints between each part and the ground; None without a connection.
    fn depths(&self, links: &[Link], fixed: &[&str]) -> Vec<Option<usize>> {
        let mut numbers: HashMap<&str, usize> = HashMap::new();
        for (index, part) in self.parts.iter().enumerate() {
            numbers.insert(&part.name, index);
        }
        for name in links.iter().flatten().chain(fixed) {
            let next = numbers.len();
            numbers.entry(name).or_insert(next);
        }
        let mut around = self.around_parts();
        around.resize(numbers.len(), Vec::new());
        for [one, other] in links.iter().map(|link| link.map(|name| numbers[name])) {
            around[one].push(other);
            around[other].push(one);
        }
        let mut depths = vec![None; numbers.len()];
        let mut open = VecDeque::new();
        for start in fixed.iter().map(|name| numbers[name]).chain(self.ground) {
            depths[start] = Some(0);
            open.push_back((start, 0));
        }
        while let Some((node, depth)) = open.pop_front() {
            for next in &around[node] {
                if depths[*next].is_none() {
                    depths[*next] = Some(depth + 1);
                    open.push_back((*next, depth + 1));
                }
            }
        }
        depths.truncate(self.parts.len());
        depths
    }

    /// Puts the part that is nearer to the ground first, at every crease.
    fn orient(&mut self) {
        for line in &mut self.lines {
            let [one, other] = line.parts.map(|part| (self.parts[part].depth, part));
            if one > other {
                line.parts.reverse();
                line.ends.reverse();
            }
        }
    }

    /// Says which facets lock each other, and which creases are drawn in two ways.
    fn report_lines(&self, drawn: &Drawn, found: &mut Diagnostics) {
        let mixed: Vec<&Line> = self.lines.iter().filter(|line| line.is_mixed).collect();
        if let Some(first) = mixed.first() {
            let points: Vec<[f64; 2]> = mixed.iter().map(|line| middle(line.ends)).collect();
            let what = match mixed.len() {
                1 => "the pieces of a crease have different angles".to_owned(),
                count => format!("the pieces of {count} creases have different angles"),
            };
            let place = Some(first.place);
            let warning = drawn.finding(Severity::Warning, codes::MIXED_CREASE, place, what);
            found.push(warning.at(points).hint("the angle of the longest piece is taken"));
        }
        let mut shared: BTreeMap<[usize; 2], Vec<&Line>> = BTreeMap::new();
        self.lines.iter().for_each(|line| shared.entry(line.parts).or_default().push(line));
        let locked: Vec<Vec<&Line>> =
            shared.into_values().filter(|lines| lines.len() > 1).collect();
        if let Some(first) = locked.first() {
            let points: Vec<[f64; 2]> =
                locked.iter().flatten().map(|line| middle(line.ends)).collect();
            let what = match locked.len() {
                1 => "two facets cannot move against each other: their creases are not on one line"
                    .to_owned(),
                count => format!(
                    "{count} pairs of facets cannot move against each other: their creases are not on \
                     one line"
                ),
            };
            let place = Some(first[0].place);
            let note = drawn.finding(Severity::Note, codes::LOCKED_FACETS, place, what);
            found.push(note.at(points));
        }
    }

    /// The position in the text of an edge of a facet.
    fn place_of(&self, facet: FacetId) -> Option<Place> {
        let edge = self.pattern.edges.iter().find(|edge| edge.facets.contains(&Some(facet)));
        edge.map(|edge| edge.place)
    }
}

/// The facets with their names, sorted.
fn parts(pattern: &Pattern) -> Vec<Part> {
    let measured: Vec<([f64; 2], f64)> =
        (0..pattern.facets.len()).map(|facet| outlines::centre(pattern, FacetId(facet))).collect();
    let centres: Vec<[f64; 2]> = measured.iter().map(|(centre, _)| *centre).collect();
    let named = Grid::of(&pattern.vertices).names("facet", &centres);
    let part = |(facet, name): (usize, String)| {
        let (centre, area) = measured[facet];
        Part { name, facet: FacetId(facet), centre, area, depth: 0 }
    };
    named.into_iter().map(part).collect()
}
