//! The tables of bodies and hinges.

use super::{Key, Mapping, Presence, Range, Uses, Value, key, optional, required};
use crate::source::units::{AREA, INERTIA, LENGTH, MASS};

/// Largest number of layers of a layup: an outline is copied to each of them.
pub(crate) const MAX_LAYERS: usize = 64;

pub(super) const NO_MOTION: Uses = Uses::Constants(
    "the spring k*(q - rest) and the damper b*u already contain q and u; write other formulas \
     with q and u into `torque`",
);

/// A length of the drawing.
pub(crate) const DRAWN_LENGTH: Value = Value::Formula(&LENGTH, Uses::Parameters);
/// A point of the flat sheet.
pub(crate) const VERTEX: Value = Value::Array { of: &DRAWN_LENGTH, length: 2, form: "`[x, y]`" };
/// A point of the flat sheet that is the same for all parameters.
pub(crate) const FIXED_VERTEX: Value =
    Value::Array { of: &Value::Number(&LENGTH), length: 2, form: "`[x, y]`" };
/// A point in space, given in the flat state.
pub(crate) const POSITION: Value =
    Value::Array { of: &DRAWN_LENGTH, length: 3, form: "`[x, y, z]`" };
/// A closed line.
pub(crate) const RING: Value =
    Value::List { of: &VERTEX, items: [3, usize::MAX], form: "a list of vertices `[x, y]`" };
/// A line without width.
pub(crate) const SLIT: Value = Value::Array {
    of: &FIXED_VERTEX,
    length: 2,
    form: "two points of the slit, `[[x, y], [x, y]]`",
};
const HOLES: Value = Value::List { of: &RING, items: [0, usize::MAX], form: "a list of outlines" };
/// The plates of one layer.
pub(crate) const PLATES: Value = Value::List {
    of: &Value::Mapping(&PLATE),
    items: [0, usize::MAX],
    form: "a list of plates, `[{ outline: .. }]`",
};
/// A row of a matrix of inertia.
pub(crate) const INERTIA_ROW: Value =
    Value::Array { of: &Value::Number(&INERTIA), length: 3, form: "a row of three" };

/// The built-in hinge models, and the families of the file.
pub(crate) const HINGES: &[(Option<&str>, &Mapping)] = &[
    (Some("beam"), &HINGE_BEAM),
    (Some("sharifzadeh2018"), &HINGE_SHARIFZADEH2018),
    (None, &HINGE_FAMILY),
];

/// An entry of `bodies`.
pub static BODY: Mapping = Mapping {
    name: "body",
    title: "Bodies",
    path: "bodies.<body>",
    doc: "A rigid body. Its mass comes from an `outline` that is the same in every layer, or \
          from `layers`, or from `mass`, `com` and `inertia`; `point_masses` are added to any of \
          these, or are used alone. A body that moves needs mass.",
    keys: &[
        key(
            "fixed",
            Value::Boolean,
            Presence::Default("false"),
            "true",
            "Whether the body is part of the ground. All fixed bodies count as one body.",
        ),
        key(
            "free",
            Value::Boolean,
            Presence::Default("false"),
            "true",
            "Whether the body moves in all six directions, without a hinge to the ground. A mechanism \
             with a free body needs no fixed one. See [FREE.md](FREE.md).",
        ),
        key(
            "outline",
            RING,
            Presence::Together,
            "[[0, 0], [40, 0], [40, 20], [0, 20]]",
            "Vertices of a plate that is the same in every layer of the `layup`, at least three, \
             in either orientation. The line does not cross itself; the first vertex may be \
             repeated at the end.",
        ),
        key(
            "holes",
            HOLES,
            Presence::Default("[]"),
            "[[[5, 5], [10, 5], [10, 10]]]",
            "Holes of the `outline`, each a list of vertices. Holes lie within the outline and \
             do not overlap.",
        ),
        optional(
            "layers",
            Value::List {
                of: &PLATES,
                items: [0, MAX_LAYERS],
                form: "one list of plates per layer of the layup",
            },
            "all layers are the same",
            "[[{ outline: [[0, 0], [40, 0], [40, 20]] }], [], []]",
            "One list of plates for each layer of the `layup`, bottom to top. A layer without plates is \
             `[]`.",
        ),
        key(
            "mass",
            Value::Formula(&MASS, Uses::Parameters),
            Presence::Together,
            "1.5 g",
            "The mass.",
        )
        .range(Range::Positive),
        key(
            "com",
            POSITION,
            Presence::Together,
            "[20, 10, 0.5]",
            "The position of the centre of mass in the flat sheet.",
        ),
        key(
            "inertia",
            Value::Array {
                of: &INERTIA_ROW,
                length: 3,
                form: "a 3x3 matrix, `[[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]`",
            },
            Presence::Together,
            "[[50 g*mm^2, 0, 0], [0, 200 g*mm^2, 0], [0, 0, 250 g*mm^2]]",
            "The inertia about the centre of mass, along the axes of the flat state. It is symmetric, and \
             no principal moment exceeds the sum of the two others. Products of inertia have a minus \
             sign: xy = -sum(m x y).",
        ),
        key(
            "slits",
            Value::List { of: &SLIT, items: [0, usize::MAX], form: "a list of slits" },
            Presence::Default("[]"),
            "[[[5, 5], [15, 5]]]",
            "Straight cuts without width within the plates, through all layers. `lamc cut` cuts them; the \
             body moves as without them.",
        ),
        key(
            "point_masses",
            Value::List {
                of: &Value::Mapping(&POINT_MASS),
                items: [0, usize::MAX],
                form: "a list of `{ mass: .., at: [x, y, z] }`",
            },
            Presence::Default("[]"),
            "[{ mass: 0.5 g, at: [20, 10, 1] }]",
            "Masses without extent that are fixed to the body.",
        ),
    ],
    choices: &[SHAPES, &[&["fixed"], &["free"]]],
};

/// The ways to give a body its mass properties.
pub(crate) const SHAPES: super::Choice =
    &[&["outline", "holes"], &["layers"], &["mass", "com", "inertia"]];

/// An item of a layer.
pub static PLATE: Mapping = Mapping {
    name: "plate",
    title: "Plates of a layer",
    path: "bodies.<body>.layers[][]",
    doc: "A plate in one layer.",
    keys: &[
        required(
            "outline",
            RING,
            "[[0, 0], [40, 0], [40, 20], [0, 20]]",
            "Vertices of the plate, as those of a body's `outline`.",
        ),
        key(
            "holes",
            HOLES,
            Presence::Default("[]"),
            "[[[5, 5], [10, 5], [10, 10]]]",
            "Holes of the plate, each a list of vertices.",
        ),
    ],
    choices: &[],
};

/// An item of `point_masses`.
pub static POINT_MASS: Mapping = Mapping {
    name: "point mass",
    title: "Point masses",
    path: "bodies.<body>.point_masses[]",
    doc: "A mass without extent.",
    keys: &[
        required("mass", Value::Formula(&MASS, Uses::Parameters), "0.5 g", "The mass.")
            .range(Range::Positive),
        required("at", POSITION, "[20, 10, 1]", "Its position in the flat sheet."),
    ],
    choices: &[],
};

const fn hinge_length(value: Value) -> Key {
    let doc = "Length of the part that bends, across the hinge line.";
    required("length", value, "1 mm", doc).range(Range::Positive)
}
const fn hinge_width(value: Value) -> Key {
    let doc = "Width of the hinge along the hinge line.";
    required("width", value, "50 mm", doc).range(Range::Positive)
}
const HINGE_LENGTH: Key = hinge_length(Value::Number(&LENGTH));
const HINGE_WIDTH: Key = hinge_width(Value::Number(&LENGTH));
const HINGE_AREA: Key = optional(
    "area",
    Value::Number(&AREA),
    "the damping by the air is left out",
    "50 cm^2",
    "Area of the body that swings.",
);

/// `hinge` of a joint: a strip in bending.
pub static HINGE_BEAM: Mapping = Mapping {
    name: "beam",
    title: "Beam hinges",
    path: "joints.<joint>.hinge",
    doc: "A strip of a material that bends: k = E I / length with I = w t^3 / 12, where w is the \
          `width` minus the `gaps`. See [HINGES.md](HINGES.md#models).",
    keys: &[
        required("model", Value::Word(&["beam"]), "beam", "Selects this model."),
        required(
            "material",
            Value::Reference { to: "material", among: "materials" },
            "film",
            "The material. Its `youngs_modulus` and its `thickness` are used.",
        ),
        hinge_length(DRAWN_LENGTH),
        hinge_width(DRAWN_LENGTH),
        optional(
            "gaps",
            DRAWN_LENGTH,
            "nothing is cut out",
            "5 mm",
            "Total length that is cut out of the width. It is less than the width.",
        )
        .range(Range::NotNegative),
    ],
    choices: &[],
};

/// `hinge` of a joint: the polynomials of DETC2018-86359.
pub static HINGE_SHARIFZADEH2018: Mapping = Mapping {
    name: "sharifzadeh2018",
    title: "Hinges of sharifzadeh2018",
    path: "joints.<joint>.hinge",
    doc: "The polynomials of the paper DETC2018-86359, for lengths from 0.5 to 4.9 mm, widths \
          from 5 to 140 mm and areas up to 75 cm^2. They also give the damping. See \
          [HINGES.md](HINGES.md#models).",
    keys: &[
        required(
            "model",
            Value::Word(&["sharifzadeh2018"]),
            "sharifzadeh2018",
            "Selects this \
                                                                                 model.",
        ),
        HINGE_LENGTH,
        HINGE_WIDTH,
        HINGE_AREA,
        key(
            "coefficients",
            Value::Word(&["corrected", "printed"]),
            Presence::Default("corrected"),
            "corrected",
            "Two coefficients of the paper contradict the errors that are printed with them. \
             `printed` uses them nevertheless.",
        ),
    ],
    choices: &[],
};

/// `hinge` of a joint: one of `hinge_models`.
pub static HINGE_FAMILY: Mapping = Mapping {
    name: "family",
    title: "Hinges of a family",
    path: "joints.<joint>.hinge",
    doc: "A hinge of one of the families in `hinge_models`, which gives the damping too.",
    keys: &[
        required(
            "model",
            Value::Reference { to: "hinge model", among: "hinge_models" },
            "tape",
            "The name of the family.",
        ),
        HINGE_LENGTH,
        HINGE_WIDTH,
        HINGE_AREA,
    ],
    choices: &[],
};
