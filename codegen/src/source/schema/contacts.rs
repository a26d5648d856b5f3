//! The tables of contacts and of their planes.

use super::parts::POSITION;
use super::{Mapping, Presence, Range, Uses, Value, key, optional, required};
use crate::source::units::{LINEAR_STIFFNESS, NUMBER, SLOWNESS, SPEED};

const NO_MOTION: Uses = Uses::Constants(
    "the law of the contact already contains the penetration and the velocity of its points",
);

/// The word for every moving body.
pub(crate) const ALL: &str = "all";
/// The word for the vertices of a body's plates.
pub(crate) const CORNERS: &str = "corners";
/// The word for the outline of a body's plates.
pub(crate) const OUTLINE: &str = "outline";

/// What `bodies` may be, for messages.
pub(crate) const BODIES_FORM: &str = "`all` or a list of bodies";
/// What `points` may be, for messages.
pub(crate) const POINTS_FORM: &str = "`corners` or a list of points";

const BODIES: Value = Value::List {
    of: &Value::Reference { to: "body", among: "bodies" },
    items: [0, usize::MAX],
    form: BODIES_FORM,
};
const POINTS: Value = Value::List {
    of: &Value::Reference { to: "point", among: "points" },
    items: [0, usize::MAX],
    form: POINTS_FORM,
};

/// An entry of `contacts`.
pub static CONTACT: Mapping = Mapping {
    name: "contact",
    title: "Contacts",
    path: "contacts.<contact>",
    doc: "Points of bodies that may touch a plane. A point that is a depth d beyond the plane is pushed \
          back with f = k d max(0, 1 + c d'), with the `stiffness` k and the `dissipation` c, and \
          against its sliding velocity v with mu f v / sqrt(v^2 + s^2), with the `friction` mu and the \
          `slip_speed` s. See [CONTACT.md](CONTACT.md).",
    keys: &[
        required(
            "plane",
            Value::Mapping(&PLANE),
            "{ point: [0, 0, 0], normal: [0, 0, 1] }",
            "The plane that the points touch.",
        ),
        key(
            "bodies",
            Value::Either(&Value::Word(&[ALL]), &BODIES),
            Presence::Default("all"),
            "[arm, foot]",
            "The bodies that touch the plane with the corners of their plates. `all` are all moving \
             bodies with plates but the plane's own.",
        ),
        key(
            "points",
            Value::Either(&Value::Word(&[CORNERS]), &POINTS),
            Presence::Default("corners"),
            "[tip]",
            "The points that touch the plane. `corners` are the vertices of the convex hull of each \
             body's plates, on both outer faces; other points are named, and `bodies` is then left out.",
        ),
        optional(
            "stiffness",
            Value::Formula(&LINEAR_STIFFNESS, NO_MOTION),
            "one point that carries the weight of all moving bodies sinks in by 1 % of the layup's \
             thickness",
            "2000 N/m",
            "Stiffness k of each point.",
        )
        .range(Range::Positive),
        key(
            "dissipation",
            Value::Formula(&SLOWNESS, NO_MOTION),
            Presence::Default("0.5 s/m"),
            "0.3 s/m",
            "Dissipation c: near 0, the share of the speed that an impact at speed v loses is 2 c v / 3.",
        )
        .range(Range::NotNegative),
        required(
            "friction",
            Value::Formula(&NUMBER, NO_MOTION),
            "0.6",
            "Coefficient mu of the friction; 0 is a smooth plane.",
        )
        .range(Range::NotNegative),
        key(
            "slip_speed",
            Value::Number(&SPEED),
            Presence::Default("1 mm/s"),
            "2 mm/s",
            "Speed s at which 71 % of the friction acts. What should stick creeps at less than this.",
        )
        .range(Range::Positive),
    ],
    choices: &[],
};

/// `plane` of a contact.
pub static PLANE: Mapping = Mapping {
    name: "plane",
    title: "Planes of contacts",
    path: "contacts.<contact>.plane",
    doc: "A plane that is fixed to the ground or to a body.",
    keys: &[
        required("point", POSITION, "[0, 0, 0]", "A point of the plane, in the flat sheet."),
        required(
            "normal",
            Value::Array { of: &Value::Number(&NUMBER), length: 3, form: "`[x, y, z]`" },
            "[0, 0, 1]",
            "The direction, of any length, in which the plane pushes, in the flat sheet.",
        ),
        optional(
            "body",
            Value::Reference { to: "body", among: "bodies" },
            "the plane is fixed to the ground",
            "arm",
            "The body that carries the plane. The opposite force acts on it.",
        ),
        optional(
            "within",
            Value::Word(&[OUTLINE]),
            "the plane has no edge, and what is behind it has no end",
            "outline",
            "`outline` limits the contact to the plate of the `body`: to its outline, which is convex \
             and the same in every layer, and to its thickness.",
        ),
    ],
    choices: &[],
};
