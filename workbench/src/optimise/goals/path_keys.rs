//! The keys of measures that are mappings of their own, such as paths.

use lamc::source::schema::{
    ANGLE, Key, LENGTH, Mapping, NUMBER, Presence, Range, TIME, Value, key,
};

/// The words of `plane`, each with the coordinates that it has.
pub const PLANES: &[&str] = &["xyz", "xy", "xz", "yz"];
/// The words of `timed`.
pub const ANSWERS: &[&str] = &["true", "false"];

/// `path`.
pub static PATH: Mapping = Mapping {
    name: "path",
    title: "Paths",
    path: "goals.<goal>.path",
    doc: "The mechanism must move in one way when the joint is turned. It has to close everywhere in the range of \
          angles, and joints with `limits` keep them there.",
    keys: &[
        key(
            "point",
            Value::Reference { to: "point", among: "points" },
            Presence::Required,
            "pen",
            "The point that moves.",
        ),
        key(
            "drive",
            Value::Reference { to: "joint", among: "joints" },
            Presence::Required,
            "crank",
            "The joint that is turned.",
        ),
        key(
            "angles",
            Value::List {
                of: &Value::Number(&ANGLE),
                items: [2, usize::MAX],
                form: "`[first, last]`, or an angle for each point",
            },
            Presence::Required,
            "[0deg, 90deg]",
            "The first and the last angle of that joint, or one angle for each point of a path that is timed.",
        ),
        key(
            "through",
            Value::Either(
                &Value::List {
                    of: &Value::Parameter,
                    items: [1, usize::MAX],
                    form: "a list of points",
                },
                &Value::Text,
            ),
            Presence::Required,
            "[[0, 0, 0], [0.02, 0, 0]]",
            "The points, each with the coordinates of `plane`; or a file (CSV) with columns such as `x [mm]`, and \
             for a path that is timed `angle [deg]`. With `~` in place of a coordinate of a path that is timed, it is free.",
        ),
        key(
            "plane",
            Value::Word(PLANES),
            Presence::Default("xyz"),
            "xz",
            "Which coordinates the points have; the others do not matter.",
        ),
        key(
            "unit",
            Value::Unit(&LENGTH),
            Presence::Default("m"),
            "mm",
            "The unit of coordinates without a unit.",
        ),
        key(
            "timed",
            Value::Boolean,
            Presence::Default("false"),
            "true",
            "Whether each point belongs to an angle: the given ones, or angles with equal steps from the first to the \
             last. If not, each point is compared with the nearest of the path.",
        ),
        key(
            "samples",
            Value::Number(&NUMBER),
            Presence::Optional("as many as there are points"),
            "37",
            "Repeats a single point of a path that is timed at so many angles: with `~` it is a straight line.",
        ),
    ],
    choices: &[],
};

/// `stroke`.
pub static STROKE: Mapping = Mapping {
    name: "stroke",
    title: "Strokes",
    path: "goals.<goal>.stroke",
    doc: "Of a point the distance between its first and its last place, of a joint the difference of its largest and its \
          smallest angle. As for a path, the mechanism must move in one way when the joint is turned.",
    keys: &[
        key(
            "point",
            Value::Reference { to: "point", among: "points" },
            Presence::Optional("a joint is given"),
            "pen",
            "The point that moves.",
        ),
        key(
            "joint",
            Value::Reference { to: "joint", among: "joints" },
            Presence::Optional("a point is given"),
            "crank",
            "The joint that moves.",
        ),
        key(
            "drive",
            Value::Reference { to: "joint", among: "joints" },
            Presence::Required,
            "crank",
            "The joint that is turned.",
        ),
        key(
            "angles",
            Value::Array { of: &Value::Number(&ANGLE), length: 2, form: "`[first, last]`" },
            Presence::Required,
            "[0deg, 90deg]",
            "The first and the last angle of that joint.",
        ),
    ],
    choices: &[&[&["point"], &["joint"]]],
};

/// `clearance`.
pub static CLEARANCE: Mapping = Mapping {
    name: "clearance",
    title: "Clearances",
    path: "goals.<goal>.clearance",
    doc: "Plates count without thickness, in the plane of their hinges. Where two pass through each other, the clearance is \
          negative: minus the shortest way by which they come apart.",
    keys: &[
        key(
            "between",
            Value::Array {
                of: &Value::Reference { to: "body", among: "bodies" },
                length: 2,
                form: "two bodies",
            },
            Presence::Optional("any two bodies that share no hinge"),
            "[left, right]",
            "Two bodies.",
        ),
        key(
            "drive",
            Value::Reference { to: "joint", among: "joints" },
            Presence::Optional("at rest"),
            "crank",
            "The joint that is turned: the least clearance counts, of states that are at most 3 deg apart.",
        ),
        key(
            "angles",
            Value::Array { of: &Value::Number(&ANGLE), length: 2, form: "`[first, last]`" },
            Presence::Optional("at rest"),
            "[0deg, 90deg]",
            "The first and the last angle of that joint.",
        ),
    ],
    choices: &[],
};

/// `settle`.
pub static SETTLE: Mapping = Mapping {
    name: "settle",
    title: "Times to settle",
    path: "goals.<goal>.settle",
    doc: "The time of the motion from the initial state, with constant inputs, after which an angle or a position stays near \
          its value at rest.",
    keys: &[
        key(
            "angle",
            Value::Reference { to: "joint", among: "joints" },
            Presence::Optional("a position is given"),
            "knee",
            "The joint.",
        ),
        key(
            "position",
            Value::Text,
            Presence::Optional("an angle is given"),
            "tip.z",
            "The coordinate of a point: its name, a dot, and `x`, `y` or `z`.",
        ),
        Key {
            range: Range::Positive,
            ..key(
                "within",
                Value::Parameter,
                Presence::Required,
                "1deg",
                "How far from its value at rest it may stay.",
            )
        },
        Key {
            range: Range::Positive,
            ..key(
                "until",
                Value::Number(&TIME),
                Presence::Required,
                "2 s",
                "A design that has not settled until then counts as one that cannot be evaluated.",
            )
        },
    ],
    choices: &[&[&["angle"], &["position"]]],
};
