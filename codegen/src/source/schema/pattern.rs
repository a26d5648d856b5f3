//! The tables of `pattern`: a drawing whose facets become bodies and whose creases become joints.

use super::joints::CREASE_JOINT;
use super::parts::NO_MOTION;
use super::{Key, Mapping, Presence, Range, Value, key, optional, required};
use crate::source::units::{ANGLE, LENGTH, LINE_DAMPING, LINE_STIFFNESS, NUMBER};

/// A point of the drawing, in its units.
pub(crate) const DRAWN: Value =
    Value::Array { of: &Value::Number(&NUMBER), length: 2, form: "`[x, y]`" };
/// The words of `ground`.
pub(crate) const GROUNDS: &[&str] = &["largest", "none"];
/// Several layers of a drawing.
pub(crate) const LAYER_NAMES: Value =
    Value::List { of: &Value::Text, items: [1, usize::MAX], form: "a list of names" };

/// `pattern`.
pub static PATTERN: Mapping = Mapping {
    name: "pattern",
    title: "Patterns",
    path: "pattern",
    doc: "A crease pattern in SVG, FOLD or DXF. Each facet becomes a body in every layer of the `layup`, \
          and each crease between two facets becomes a joint. `bodies` and `joints` may add \
          others. See [PATTERNS.md](PATTERNS.md).",
    keys: &[
        required(
            "file",
            Value::Text,
            "miura_sheet.svg",
            "The drawing. Its path is relative to the folder of the model.",
        ),
        optional(
            "scale",
            Value::Number(&LENGTH),
            "the drawing itself says how long its unit is",
            "0.1 mm",
            "Length of one unit of the drawing. It is required if the drawing has no physical unit.",
        )
        .range(Range::Positive),
        key(
            "ground",
            Value::Either(&Value::Word(GROUNDS), &DRAWN),
            Presence::Default("largest"),
            "[40, -30]",
            "Which facet is fixed: the largest one of the piece with the most facets, or the one around a \
             point. The point is in units of the drawing, with y upwards. With `none`, \
             joints connect the facets with a fixed body under `bodies`.",
        ),
        key(
            "free",
            Value::Boolean,
            Presence::Default("false"),
            "true",
            "Whether the facet of `ground` is free instead of fixed: nothing holds the sheet.",
        ),
        optional(
            "crease",
            Value::Mapping(&CREASE),
            "creases have no width and no stiffness",
            "{ stiffness: 0.1 N/rad, damping: 1e-4 N*s/rad }",
            "The hinges at all creases.",
        ),
        optional(
            "fold",
            Value::Mapping(&FOLD),
            "mountains fold by -180 deg and valleys by 180 deg",
            "{ mountain: -120 deg, valley: 120 deg }",
            "The angles of the finished fold, for creases whose angle the drawing does not give: in SVG, those for \
             which no opacity is written.",
        ),
        key(
            "triangulate",
            Value::Boolean,
            Presence::Default("false"),
            "true",
            "Whether flat lines of the drawing, which divide facets into triangles, become hinges. Their \
             stiffness is that of the bending sheet. Otherwise the facets on both sides of \
             such a line are one body.",
        ),
        optional(
            "joints",
            Value::Per("joint", &Value::Mapping(&CREASE_JOINT)),
            "all creases are alike",
            "{ crease_48_m50: { drive: \"0.3*sin(2*pi*t)\" } }",
            "What acts at single creases: motors, stops, other springs.",
        ),
        optional(
            "layers",
            Value::Mapping(&LAYERS),
            "layers of DXF files have the meanings of their colours and names",
            "{ cut: OUTLINE }",
            "What the lines on the layers of a DXF file mean. Lines on other layers are ignored then.",
        ),
    ],
    choices: &[],
};

/// `pattern.crease`.
pub static CREASE: Mapping = Mapping {
    name: "crease",
    title: "Creases",
    path: "pattern.crease",
    doc: "The hinges of a pattern. Each is as wide as its crease is long.",
    keys: &[
        optional(
            "width",
            Value::Number(&LENGTH),
            "plates reach to the middle of the crease",
            "1 mm",
            "Width of the gap between the plates of all layers but the flexible one, which is that of \
             the hinge's `material`. It is the length of the part that bends. A `hinge` \
             needs it.",
        ),
        optional(
            "hinge",
            Value::Mapping(&CREASE_HINGE),
            "the spring has the constant `stiffness`",
            "{ model: beam, material: film }",
            "A model of the hinge, which computes the stiffness.",
        ),
        key(
            "stiffness",
            Value::Formula(&LINE_STIFFNESS, NO_MOTION),
            Presence::Default("0"),
            "0.1 N/rad",
            "Stiffness of the spring per length of the crease.",
        ),
        key(
            "damping",
            Value::Formula(&LINE_DAMPING, NO_MOTION),
            Presence::Default("0"),
            "1e-4 N*s/rad",
            "Damping per length of the crease. Hinge models other than `beam` compute it themselves.",
        )
        .range(Range::NotNegative),
    ],
    choices: &[&[&["hinge"], &["stiffness"]]],
};

/// `pattern.crease.hinge`.
pub static CREASE_HINGE: Mapping = Mapping {
    name: "crease hinge",
    title: "Hinges of creases",
    path: "pattern.crease.hinge",
    doc: "A model of the hinges at creases, as `hinge` of a joint. The `width` of the crease is the length \
          of the hinge, and the length of the crease is its width.",
    keys: &[
        required(
            "model",
            Value::Reference { to: "hinge model", among: "hinge_models" },
            "beam",
            "`beam`, `sharifzadeh2018`, or the name of a family.",
        ),
        optional(
            "material",
            Value::Reference { to: "material", among: "materials" },
            "no layer is flexible, and all plates reach to the middle of the crease",
            "film",
            "The material of the flexible layer, which is not cut at the creases. `beam` needs it.",
        ),
    ],
    choices: &[],
};

/// `pattern.fold`.
pub static FOLD: Mapping = Mapping {
    name: "fold",
    title: "Angles of the finished fold",
    path: "pattern.fold",
    doc: "The angles of the finished fold by the kind of crease.",
    keys: &[
        key(
            "mountain",
            Value::Number(&ANGLE),
            Presence::Default("-180 deg"),
            "-120 deg",
            "Angle of mountains, from -180 to 0 deg.",
        ),
        key(
            "valley",
            Value::Number(&ANGLE),
            Presence::Default("180 deg"),
            "120 deg",
            "Angle of valleys, from 0 to 180 deg.",
        ),
    ],
    choices: &[],
};

/// A key with the layers of one kind of line.
const fn layer(name: &'static str, example: &'static str, doc: &'static str) -> Key {
    const ONE_OR_MORE: Value = Value::Either(&Value::Text, &LAYER_NAMES);
    optional(name, ONE_OR_MORE, "no layer has this meaning", example, doc)
}

/// `pattern.layers`.
pub static LAYERS: Mapping = Mapping {
    name: "layers",
    title: "Layers of the drawing",
    path: "pattern.layers",
    doc: "The layers with each kind of line: a name or a list of names.",
    keys: &[
        layer("border", "EDGE", "Edges of the sheet."),
        layer("mountain", "FOLD_DOWN", "Mountains."),
        layer("valley", "[FOLD_UP, FOLD_UP_2]", "Valleys."),
        layer("flat", "TRIANGLES", "Lines of a triangulation."),
        layer("hinge", "FREE", "Creases without an angle of the finished fold."),
        layer("cut", "OUTLINE", "Cuts."),
    ],
    choices: &[],
};
