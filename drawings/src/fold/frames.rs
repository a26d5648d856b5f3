//! The frames of a FOLD file, with what they inherit.

use serde::Deserialize;
use serde_json::value::RawValue;

use super::json::{Text, syntax};
use crate::drawing::Place;
use crate::fault::Fault;

/// The deepest chain of frames that inherit from each other.
const MOST_ANCESTORS: usize = 100;

/// The most frames of a file: an animation of ten minutes has some ten thousand.
const MOST_FRAMES: usize = 20_000;

/// The properties of a frame that are read. Each is the text of its value.
#[derive(Clone, Default, Deserialize)]
pub(super) struct Frame<'a> {
    #[serde(borrow, default)]
    pub(super) vertices_coords: Option<&'a RawValue>,
    #[serde(borrow, default)]
    pub(super) edges_vertices: Option<&'a RawValue>,
    #[serde(borrow, default)]
    pub(super) edges_assignment: Option<&'a RawValue>,
    // FOLD 1.0 has the plural.
    #[serde(borrow, default, rename = "edges_foldAngle", alias = "edges_foldAngles")]
    pub(super) edges_fold_angle: Option<&'a RawValue>,
    #[serde(borrow, default)]
    pub(super) faces_vertices: Option<&'a RawValue>,
    #[serde(borrow, default)]
    frame_unit: Option<&'a RawValue>,
    #[serde(borrow, default)]
    frame_classes: Option<&'a RawValue>,
    #[serde(borrow, default)]
    frame_parent: Option<&'a RawValue>,
    #[serde(borrow, default)]
    frame_inherit: Option<&'a RawValue>,
    #[serde(borrow, default)]
    file_frames: Option<&'a RawValue>,
}

/// All frames of a file: the first is the file itself.
pub(super) struct Frames<'a> {
    text: Text<'a>,
    frames: Vec<(Frame<'a>, Place)>,
}

impl<'a> Frames<'a> {
    /// Finds the frames of a file.
    pub(super) fn of(text: &'a str) -> Result<Self, Fault> {
        // JSON has no byte order mark, but editors write one.
        let json = text.trim_start_matches('\u{feff}');
        let raw: &RawValue = serde_json::from_str(json).map_err(|error| {
            let start = text.len() - json.len() + super::json::offset(json, &error);
            let message = super::json::reason(&error);
            syntax(format!("the file is no JSON: {message}"), Place { start, end: start })
        })?;
        let text = Text(text);
        let first: Frame = text.value("the file", raw)?;
        let others = text.short_list("file_frames", first.file_frames, MOST_FRAMES)?;
        let place = text.place(raw);
        let frames = std::iter::once((first, place)).chain(others).collect();
        Ok(Self { text, frames })
    }

    /// Returns how many there are.
    pub(super) fn count(&self) -> usize {
        self.frames.len()
    }

    /// Whether a frame is of a class, such as `creasePattern`.
    pub(super) fn is(&self, frame: usize, class: &str) -> bool {
        let classes = self.frames[frame].0.frame_classes;
        classes
            .and_then(|raw| serde_json::from_str::<Vec<String>>(raw.get()).ok())
            .is_some_and(|classes| classes.iter().any(|other| other == class))
    }

    /// Returns a frame with all that it inherits.
    pub(super) fn resolve(&self, frame: usize) -> Result<Frame<'a>, Fault> {
        let mut resolved = self.frames[frame].0.clone();
        let mut at = frame;
        for _ in 0..MOST_ANCESTORS {
            let Some(parent) = self.parent(at)? else { return Ok(resolved) };
            let from = &self.frames[parent].0;
            resolved.vertices_coords = resolved.vertices_coords.or(from.vertices_coords);
            resolved.edges_vertices = resolved.edges_vertices.or(from.edges_vertices);
            resolved.edges_assignment = resolved.edges_assignment.or(from.edges_assignment);
            resolved.edges_fold_angle = resolved.edges_fold_angle.or(from.edges_fold_angle);
            resolved.faces_vertices = resolved.faces_vertices.or(from.faces_vertices);
            resolved.frame_unit = resolved.frame_unit.or(from.frame_unit);
            at = parent;
        }
        Err(syntax(
            format!(
                "frame {frame} inherits from itself, or through more than {MOST_ANCESTORS} frames"
            ),
            self.frames[frame].1,
        ))
    }

    /// Whether two frames have the same edges, by their text; if they list none, the same faces.
    pub(super) fn same_edges(&self, one: usize, other: usize) -> Result<bool, Fault> {
        let (one, other) = (self.resolve(one)?, self.resolve(other)?);
        let listed = |frame: &Frame<'a>| frame.edges_vertices.or(frame.faces_vertices);
        // A writer may indent the frames differently.
        let bytes =
            |raw: &'a RawValue| raw.get().bytes().filter(|byte| !byte.is_ascii_whitespace());
        Ok(match (listed(&one), listed(&other)) {
            (Some(one), Some(other)) => std::ptr::eq(one, other) || bytes(one).eq(bytes(other)),
            _ => false,
        })
    }

    /// Returns what a frame says itself, without what it inherits.
    pub(super) fn own(&self, frame: usize) -> &Frame<'a> {
        &self.frames[frame].0
    }

    /// Returns the position of a frame in the text.
    pub(super) fn place(&self, frame: usize) -> Place {
        self.frames[frame].1
    }

    /// Returns the frame from which a frame inherits.
    fn parent(&self, frame: usize) -> Result<Option<usize>, Fault> {
        let (this, place) = &self.frames[frame];
        let inherits = match this.frame_inherit {
            Some(raw) => self.text.value::<bool>("frame_inherit", raw)?,
            None => false,
        };
        if frame == 0 || !inherits {
            return Ok(None);
        }
        let parent = match this.frame_parent {
            Some(raw) => self.text.value::<usize>("frame_parent", raw)?,
            None => 0,
        };
        if parent < self.frames.len() {
            return Ok(Some(parent));
        }
        let last = self.frames.len() - 1;
        Err(syntax(format!("frame_parent is {parent}, and the last frame is {last}"), *place))
    }

    /// Returns the unit of a frame.
    pub(super) fn unit(&self, frame: &Frame<'a>) -> Result<Unit, Fault> {
        let Some(raw) = frame.frame_unit else { return Ok(Unit::None) };
        let name: String = self.text.value("frame_unit", raw)?;
        Ok(match UNITS.iter().find(|(other, _)| *other == name) {
            Some((_, length)) => Unit::Known(*length),
            None if name == NO_UNIT => Unit::None,
            None => Unit::Unknown(name),
        })
    }
}

/// What a frame says about the length of one unit.
pub(super) enum Unit {
    /// Nothing.
    None,
    /// A length, m.
    Known(f64),
    /// A name that FOLD does not define.
    Unknown(String),
}

/// The name by which FOLD says that there is no unit.
const NO_UNIT: &str = "unit";

/// The units of FOLD 1.2, m.
pub(super) const UNITS: [(&str, f64); 7] = [
    ("in", 0.0254),
    ("pt", 0.0254 / 72.0),
    ("m", 1.0),
    ("cm", 1e-2),
    ("mm", 1e-3),
    ("um", 1e-6),
    ("nm", 1e-9),
];
