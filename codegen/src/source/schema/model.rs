//! The tables of the model itself and of its small mappings: units, materials, the initial state and
//! families of hinges.

use super::contacts::CONTACT;
use super::controllers::CONTROLLER;
use super::elements::{BAND, MOTOR, TENDON, TWIST};
use super::forces::{AIR, FORCE, POINT};
use super::initial::INITIAL;
use super::joints::JOINT;
use super::parts::{BODY, DRAWN_LENGTH, MAX_LAYERS};
use super::pattern::PATTERN;
use super::{Mapping, Presence, Range, TUNABLE, Uses, Value, key, optional, required};
use crate::source::names::Kind;
use crate::source::units::{ACCELERATION, ANGLE, DENSITY, LENGTH, NUMBER, PRESSURE};

const SAME_FOR_EVERY_POSE: Uses =
    Uses::Constants("gravity is the same for every configuration: it may not depend on q or u");

/// A term of a polynomial.
pub(crate) const TERM: Value = Value::Array {
    of: &Value::Number(&NUMBER),
    length: 4,
    form: "a coefficient and the exponents of length, width and area",
};
/// A hinge that was measured.
pub(crate) const SPECIMEN: Value =
    Value::Array { of: &Value::Number(&NUMBER), length: 3, form: "`[length, width, area]`" };
const TERMS: Value = Value::List {
    of: &TERM,
    items: [0, usize::MAX],
    form: "a list of terms, `[coefficient, l, w, a]`",
};

/// The whole file.
pub static MODEL: Mapping = Mapping {
    name: "model",
    title: "The file",
    path: "",
    doc: "The file is one mapping. A model has `bodies`, or a `pattern` that makes them; it has `joints` too, unless its moving bodies are free.",
    keys: &[
        optional(
            "name",
            Value::Name(Kind::Other("a model")),
            "the name of the file without its extension",
            "fourbar",
            "The name of the mechanism. Generated types and files get this name.",
        ),
        optional(
            "units",
            Value::Mapping(&UNITS),
            "they are in SI units and radians",
            "{ length: mm, angle: deg }",
            "The units of lengths and angles that are written without a unit.",
        ),
        key(
            "gravity",
            Value::Array {
                of: &Value::Formula(&ACCELERATION, SAME_FOR_EVERY_POSE),
                length: 3,
                form: "`[x, y, z]`",
            },
            Presence::Default("[0, 0, -9.81]"),
            "[0, -9.81, 0]",
            "The acceleration of gravity in the base frame, whose z axis is normal to the flat sheet.",
        ),
        optional(
            "materials",
            Value::Named(Kind::Other("a material"), &Value::Mapping(&MATERIAL)),
            "there are no materials",
            "{ card: { density: 700, thickness: 0.4 mm } }",
            "Sheet materials by name.",
        ),
        optional(
            "layup",
            Value::List {
                of: &Value::Reference { to: "material", among: "materials" },
                items: [1, MAX_LAYERS],
                form: "a list of materials, bottom to top",
            },
            "bodies cannot have plates",
            "[card, film, card]",
            "The materials of the layers, from the bottom (z = 0) to the top. All bodies are cut from \
             this stack.",
        ),
        optional(
            "pattern",
            Value::Mapping(&PATTERN),
            "all bodies and joints are under `bodies` and `joints`",
            "{ file: miura_sheet.svg, scale: 1 mm }",
            "A drawing whose facets become bodies and whose creases become joints.",
        ),
        key(
            "bodies",
            Value::Named(Kind::Other("a body"), &Value::Mapping(&BODY)),
            Presence::Without("pattern"),
            "{ base: { fixed: true }, arm: { outline: [[0, 0], [40, 0], [40, 20], [0, 20]] } }",
            "Rigid bodies by name. At least one of them is fixed.",
        ),
        optional(
            "parameters",
            Value::Named(
                Kind::Symbol("a parameter"),
                &Value::Either(&Value::Parameter, &Value::Mapping(&PARAMETER)),
            ),
            "there are no parameters",
            "{ k: 11.4 mN*m/rad, amplitude: 0.3 }",
            "Numbers by name that formulas use and that can be set at run time. The value in the \
             file is the default. If it has a unit, the parameter can only be used for this \
             quantity.",
        ),
        key(
            "inputs",
            Value::List {
                of: &Value::Name(Kind::Symbol("an input")),
                items: [0, usize::MAX],
                form: "a list of input names",
            },
            Presence::Default("[]"),
            "[motor]",
            "Names of the numbers that formulas use and that the caller sets at every step. They \
             start at 0.",
        ),
        key(
            "tunable",
            Value::List {
                of: &Value::Word(TUNABLE),
                items: [0, usize::MAX],
                form: "a list of `stiffness`, `damping`, `rest` and `mass`",
            },
            Presence::Default("[]"),
            "[stiffness, mass]",
            "Constants that become parameters, for every joint (`stiffness_<joint>`) or for every moving \
             body (`mass_<body>`, with which the inertia scales).",
        ),
        key(
            "joints",
            Value::Named(Kind::Other("a joint"), &Value::Mapping(&JOINT)),
            Presence::Optional("there are no hinges but those of a `pattern`"),
            "{ knee: { bodies: [base, arm], axis: [[0, 0], [0, 20]] } }",
            "Flexure hinges by name. Their order is the order of the coordinates q and the speeds u.",
        ),
        optional(
            "initial",
            Value::Mapping(&INITIAL),
            "all angles and speeds start at 0",
            "{ q: { knee: 30 deg } }",
            "The initial state. It is a guess, from which the loops are closed.",
        ),
        optional(
            "points",
            Value::Named(Kind::Other("a point"), &Value::Mapping(&POINT)),
            "there are no output points",
            "{ tip: { body: arm, at: [40, 10, 0.5] } }",
            "Points of bodies by name. Their positions and velocities are computed.",
        ),
        optional(
            "forces",
            Value::Named(Kind::Other("a force"), &Value::Mapping(&FORCE)),
            "no forces act at points",
            "{ pull: { point: tip, force: [0, 0, \"0.01*t\"] } }",
            "Forces by name.",
        ),
        optional(
            "springs",
            Value::Named(
                Kind::Other("a spring"),
                &Value::Either(&Value::Mapping(&BAND), &Value::Mapping(&TWIST)),
            ),
            "only joints have springs",
            "{ band: { from: tip, to: hook, stiffness: 20 N/m, tension_only: true } }",
            "Springs by name: between two points, or torsion springs between two bodies.",
        ),
        optional(
            "tendons",
            Value::Named(Kind::Other("a tendon"), &Value::Mapping(&TENDON)),
            "there are no tendons",
            "{ flexor: { through: [hook, guide, tip], tension: 0.5 N } }",
            "Tendons by name.",
        ),
        optional(
            "motors",
            Value::Named(Kind::Other("a motor"), &Value::Mapping(&MOTOR)),
            "there are no motors",
            "{ hip: { joint: knee, torque_constant: 5 mN*m/A, resistance: 8 ohm, gear: 50, voltage: motor } }",
            "Motors by name.",
        ),
        optional(
            "contacts",
            Value::Named(Kind::Other("a contact"), &Value::Mapping(&CONTACT)),
            "nothing touches anything",
            "{ ground: { plane: { point: [0, 0, -20], normal: [0, 0, 1] }, friction: 0.6 } }",
            "Contacts of points with planes by name.",
        ),
        optional(
            "controllers",
            Value::Named(Kind::Other("a controller"), &Value::Mapping(&CONTROLLER)),
            "the caller sets all inputs",
            "{ servo: { sample: 5 ms, inputs: { motor: \"k*(1 - q.knee)\" } } }",
            "Controllers in discrete time by name, which drive inputs.",
        ),
        optional(
            "air",
            Value::Mapping(&AIR),
            "there is no air",
            "{ density: 1.2, drag: 1.2 }",
            "The air, which resists moving plates.",
        ),
        optional(
            "hinge_models",
            Value::Named(Kind::Other("a hinge model"), &Value::Mapping(&HINGE_MODEL)),
            "there are only the built-in hinge models",
            "{ tape: { stiffness: [[0.02, 0, 0, 0]], damping: [[2e-5, 0, 0, 0]], specimens: [[1e-3, 0.05, 5e-3]] } }",
            "Families of measured hinges by name. `lamc hinge family` writes them.",
        ),
        optional(
            "tolerance",
            Value::Number(&LENGTH),
            "half a unit of the last decimal in the drawing",
            "0.005 mm",
            "The largest rounding error of the coordinates of hinge lines, at most a hundredth \
             of the drawing's size. Hinge lines are moved by no more than this to be exactly \
             parallel or concurrent; 0 uses them as they are drawn. See \
             [DRAWINGS.md](DRAWINGS.md).",
        )
        .range(Range::NotNegative),
    ],
    choices: &[],
};

/// `units`.
pub static UNITS: Mapping = Mapping {
    name: "units",
    title: "Units of numbers without a unit",
    path: "units",
    doc: "The units of numbers that are written without a unit. Formulas and parameters are always in SI \
          units and radians.",
    keys: &[
        key("length", Value::Unit(&LENGTH), Presence::Default("m"), "mm", "Unit of lengths."),
        key(
            "angle",
            Value::Unit(&ANGLE),
            Presence::Default("rad"),
            "deg",
            "Unit of angles and, per second, of angular speeds.",
        ),
    ],
    choices: &[],
};

/// An entry of `parameters` with a range.
pub static PARAMETER: Mapping = Mapping {
    name: "parameter with a range",
    title: "Parameters with a range",
    path: "parameters.<parameter>",
    doc: "A parameter of the drawing. The loops keep their kind over the whole range, and all plates are possible: \
          lamc checks this. See [PARAMETERS.md](PARAMETERS.md).",
    keys: &[
        required("value", Value::Parameter, "40 mm", "The default."),
        optional(
            "range",
            Value::Array { of: &Value::Parameter, length: 2, form: "`[smallest, largest]`" },
            "the parameter is checked near its default only",
            "[30 mm, 60 mm]",
            "The values for which the model has to hold. Others are refused.",
        ),
    ],
    choices: &[],
};

/// An entry of `materials`.
pub static MATERIAL: Mapping = Mapping {
    name: "material",
    title: "Materials",
    path: "materials.<material>",
    doc: "A sheet material.",
    keys: &[
        required("density", Value::Formula(&DENSITY, Uses::Parameters), "1380", "Mass per volume.")
            .range(Range::Positive),
        required("thickness", DRAWN_LENGTH, "0.127 mm", "Thickness of the sheet.")
            .range(Range::Positive),
        optional(
            "youngs_modulus",
            Value::Formula(&PRESSURE, Uses::Parameters),
            "the material cannot be a `beam` hinge",
            "4383 MPa",
            "Young's modulus, for `beam` hinges.",
        )
        .range(Range::Positive),
        optional(
            "yield_stress",
            Value::Number(&PRESSURE),
            "`beam` hinges are taken as linear at every angle",
            "42.84 MPa",
            "Yield stress. It bounds the angle up to which a `beam` hinge is linear.",
        )
        .range(Range::Positive),
    ],
    choices: &[],
};

/// An entry of `hinge_models`.
pub static HINGE_MODEL: Mapping = Mapping {
    name: "hinge model",
    title: "Families of hinges",
    path: "hinge_models.<model>",
    doc: "Stiffness and damping of a family of hinges as polynomials of the hinge's length l, its width w \
          and the area a of the body that swings. Numbers are in SI units, whatever `units` says. See \
          [HINGES.md](HINGES.md#families-of-hinges).",
    keys: &[
        required(
            "stiffness",
            TERMS,
            "[[0.02, 0, 0, 0], [0.1, 0, 1, 0]]",
            "Terms of the stiffness, N m/rad: `[coefficient, i, j, k]` is coefficient l^i w^j a^k, with \
             whole exponents from 0 to 9.",
        ),
        required(
            "damping",
            TERMS,
            "[[2e-5, 0, 0, 0], [1e-3, 0, 0, 1]]",
            "Terms of the damping, N m s/rad.",
        ),
        required(
            "specimens",
            Value::List {
                of: &SPECIMEN,
                items: [0, usize::MAX],
                form: "a list of `[length, width, area]`",
            },
            "[[1e-3, 0.03, 3e-3], [1e-3, 0.05, 5e-3], [2e-3, 0.05, 3e-3]]",
            "Length (m), width (m) and area (m^2) of the hinges that were measured. A hinge outside of \
             their convex hull is compiled with a warning.",
        ),
    ],
    choices: &[],
};
