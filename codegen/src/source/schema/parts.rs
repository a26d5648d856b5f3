//! The tables of bodies and joints.

use super::{Key, Mapping, Presence, Range, Uses, Value, key, optional, required};
use crate::source::units::{
    ANGLE, ANGULAR_SPEED, AREA, CUBIC_STIFFNESS, DAMPING, INERTIA, LENGTH, MASS, STIFFNESS, TORQUE,
};

/// Largest number of layers of a layup: an outline is copied to each of them.
pub(crate) const MAX_LAYERS: usize = 64;

const PRESCRIBED: Uses = Uses::Constants(
    "a prescribed angle is a function of t, parameters and inputs; write a formula with q and u \
     into `torque`",
);
pub(super) const NO_MOTION: Uses = Uses::Constants(
    "the spring k*(q - rest) and the damper b*u already contain q and u; write other formulas \
     with q and u into `torque`",
);

/// A point of the flat sheet.
pub(crate) const VERTEX: Value =
    Value::Array { of: &Value::Number(&LENGTH), length: 2, form: "`[x, y]`" };
/// A point in space, given in the flat state.
pub(crate) const POSITION: Value =
    Value::Array { of: &Value::Number(&LENGTH), length: 3, form: "`[x, y, z]`" };
/// A closed line.
pub(crate) const RING: Value =
    Value::List { of: &VERTEX, items: [3, usize::MAX], form: "a list of vertices `[x, y]`" };
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

/// A key with a formula that is 0 if it is left out.
const fn law(name: &'static str, value: Value, example: &'static str, doc: &'static str) -> Key {
    key(name, value, Presence::Default("0"), example, doc)
}

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
        key("mass", Value::Number(&MASS), Presence::Together, "1.5 g", "The mass.")
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
    choices: &[&[&["outline", "holes"], &["layers"], &["mass", "com", "inertia"]]],
};

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
        required("mass", Value::Number(&MASS), "0.5 g", "The mass.").range(Range::Positive),
        required("at", POSITION, "[20, 10, 1]", "Its position in the flat sheet."),
    ],
    choices: &[],
};

/// An entry of `joints`.
pub static JOINT: Mapping = Mapping {
    name: "joint",
    title: "Joints",
    path: "joints.<joint>",
    doc: "A flexure hinge between two bodies. Its angle q is 0 in the flat sheet, its speed is u. The \
          torque on the second body about the hinge line is -k (q - rest) - k3 (q - rest)^3 - b u \
          - T tanh(u / speed) + `torque`, with the `stiffness` k, the `cubic_stiffness` k3, the `damping` \
          b and the `friction` T. See [HINGES.md](HINGES.md).",
    keys: &[
        required(
            "bodies",
            Value::Array {
                of: &Value::Reference { to: "body", among: "bodies" },
                length: 2,
                form: "two bodies, `[first, second]`",
            },
            "[base, arm]",
            "The angle turns the second body relative to the first by the right-hand rule. At \
             least one of them is not fixed.",
        ),
        required(
            "axis",
            Value::Array {
                of: &VERTEX,
                length: 2,
                form: "two points of the hinge line, `[[x, y], [x, y]]`",
            },
            "[[0, 0], [0, 20]]",
            "Two different points of the hinge line in the flat sheet. The joint turns about the line \
             from the first to the second.",
        ),
        law("z", Value::Number(&LENGTH), "0.25 mm", "Height of the hinge line in the stack."),
        law(
            "stiffness",
            Value::Formula(&STIFFNESS, NO_MOTION),
            "11.4 mN*m/rad",
            "Stiffness k of the spring. A negative one is allowed, with a warning.",
        ),
        law("damping", Value::Formula(&DAMPING, NO_MOTION), "3.5e-6 N*m*s/rad", "Damping b.")
            .range(Range::NotNegative),
        law(
            "rest",
            Value::Formula(&ANGLE, NO_MOTION),
            "15 deg",
            "The angle at which the spring is relaxed.",
        ),
        optional(
            "limits",
            Value::Array { of: &Value::Number(&ANGLE), length: 2, form: "`[lowest, highest]`" },
            "the joint has no stops",
            "[-90 deg, 90 deg]",
            "The angles of the joint's stops, the lower one first.",
        ),
        law(
            "torque",
            Value::Formula(&TORQUE, Uses::Motion),
            "\"motor - 0.02*sin(2*pi*t)\"",
            "A torque on the second body about the hinge line.",
        ),
        optional(
            "hinge",
            Value::OneOf { by: "model", variants: HINGES },
            "the spring has the constant `stiffness`",
            "{ model: beam, material: film, length: 1 mm, width: 20 mm }",
            "A model of the hinge, which computes the stiffness. `sharifzadeh2018` and the \
             models of `hinge_models` compute the damping too, so `damping` is not allowed with \
             them.",
        ),
        optional(
            "drive",
            Value::Formula(&ANGLE, PRESCRIBED),
            "the joint moves freely",
            "\"0.3*sin(2*pi*t)\"",
            "The prescribed angle. The torque of the motor is then computed. Constant angles lie \
             within `limits`.",
        ),
        optional(
            "fold",
            Value::Number(&ANGLE),
            "the joint has no part in the fold",
            "-180 deg",
            "The angle of the finished fold, from -180 to 180 deg: positive for a valley, whose sides come \
             up, and negative for a mountain, if the first body is to the right of the way along \
             the axis. `initial` and `lamc fold` use it. See [FOLDING.md](FOLDING.md).",
        ),
        law(
            "cubic_stiffness",
            Value::Formula(&CUBIC_STIFFNESS, NO_MOTION),
            "2 mN*m/rad^3",
            "Cubic stiffness k3 of the spring.",
        ),
        optional(
            "friction",
            Value::Mapping(&FRICTION),
            "there is no friction",
            "{ torque: 0.1 mN*m, speed: 2 deg/s }",
            "Dry friction.",
        ),
    ],
    choices: &[&[&["hinge"], &["stiffness"]], &[&["drive"], &["torque"]]],
};

/// `friction` of a joint.
pub static FRICTION: Mapping = Mapping {
    name: "friction",
    title: "Friction",
    path: "joints.<joint>.friction",
    doc: "Coulomb's friction, smoothed: the torque -T tanh(u / speed).",
    keys: &[
        required("torque", Value::Formula(&TORQUE, NO_MOTION), "0.1 mN*m", "The torque T.")
            .range(Range::NotNegative),
        required(
            "speed",
            Value::Number(&ANGULAR_SPEED),
            "2 deg/s",
            "The speed at which 76 % of the torque acts.",
        )
        .range(Range::Positive),
    ],
    choices: &[],
};

const HINGE_LENGTH: Key = required(
    "length",
    Value::Number(&LENGTH),
    "1 mm",
    "Length of the part that bends, across the hinge line.",
)
.range(Range::Positive);
const HINGE_WIDTH: Key =
    required("width", Value::Number(&LENGTH), "50 mm", "Width of the hinge along the hinge line.")
        .range(Range::Positive);
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
        HINGE_LENGTH,
        HINGE_WIDTH,
        optional(
            "gaps",
            Value::Number(&LENGTH),
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
