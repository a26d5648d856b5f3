//! The tables of points, of forces at them and of the air.

use super::parts::POSITION;
use super::{Mapping, Range, Uses, Value, required};
use crate::source::units::{DENSITY, FORCE as FORCE_QUANTITY, NUMBER};

const NO_SPEED: Uses = Uses::Constants("the drag already contains the speed of the plate");

/// An entry of `points`.
pub static POINT: Mapping = Mapping {
    name: "point",
    title: "Points",
    path: "points.<point>",
    doc: "A point that is fixed to a body.",
    keys: &[
        required("body", Value::Reference { to: "body", among: "bodies" }, "arm", "The body."),
        required("at", POSITION, "[40, 10, 0.5]", "Its position in the flat sheet."),
    ],
    choices: &[],
};

/// An entry of `forces`.
pub static FORCE: Mapping = Mapping {
    name: "force",
    title: "Forces",
    path: "forces.<force>",
    doc: "A force at a point.",
    keys: &[
        required(
            "point",
            Value::Reference { to: "point", among: "points" },
            "tip",
            "The point at which it acts.",
        ),
        required(
            "force",
            Value::Array {
                of: &Value::Formula(&FORCE_QUANTITY, Uses::Motion),
                length: 3,
                form: "`[x, y, z]`",
            },
            "[0, 0, \"0.01*t\"]",
            "Its components in the base frame.",
        ),
    ],
    choices: &[],
};

/// `air`.
pub static AIR: Mapping = Mapping {
    name: "air",
    title: "Air",
    path: "air",
    doc: "Air that resists moving plates. See [HINGES.md](HINGES.md#other-laws-of-a-joint-and-air).",
    keys: &[
        required(
            "density",
            Value::Formula(&DENSITY, NO_SPEED),
            "1.2 kg/m^3",
            "Density of the air.",
        )
        .range(Range::NotNegative),
        required(
            "drag",
            Value::Formula(&NUMBER, NO_SPEED),
            "1.2",
            "Drag coefficient of a plate that is perpendicular to the flow.",
        )
        .range(Range::NotNegative),
    ],
    choices: &[],
};
