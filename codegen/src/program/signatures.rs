//! The table of signatures: every function of a compiled mechanism.

use super::argument::Argument;
use super::shape::{Array, Shape, Size, array, vector};
use super::signature::{FunctionKind, Role, Signature};

const POSITION: &[Argument] = &[Argument::Positions];
const TIME: &[Argument] = &[Argument::Time, Argument::Parameters, Argument::Inputs];
const PLACE: &[Argument] =
    &[Argument::Time, Argument::Positions, Argument::Parameters, Argument::Inputs];
const VELOCITY: &[Argument] = &[Argument::Positions, Argument::Speeds, Argument::Parameters];
const STATE: &[Argument] = &[
    Argument::Time,
    Argument::Positions,
    Argument::Speeds,
    Argument::Parameters,
    Argument::Inputs,
];
const SAMPLE: &[Argument] = &[
    Argument::Time,
    Argument::Positions,
    Argument::Speeds,
    Argument::Parameters,
    Argument::Inputs,
    Argument::Memory,
];
const BALANCE: &[Argument] = &[
    Argument::Time,
    Argument::Positions,
    Argument::Speeds,
    Argument::Parameters,
    Argument::Inputs,
    Argument::Accelerations,
    Argument::Multipliers,
];
const DIRECTION: &[Argument] = &[
    Argument::Time,
    Argument::Positions,
    Argument::Speeds,
    Argument::Parameters,
    Argument::Inputs,
    Argument::Accelerations,
    Argument::Multipliers,
    Argument::TimeChange,
    Argument::PositionChange,
    Argument::SpeedChange,
    Argument::ParameterChange,
    Argument::InputChange,
];

/// How far a solution can be trusted: it cannot where a number is not positive.
const MARGIN: Array = vector(
    "margin",
    Size::Fixed(3),
    "",
    "the least inverse pivot of M, the conditioning of the closure, then its smallest pivot over the length of its loop",
);

/// Velocities of the hinges at unit speed.
const AXES: Array = array(
    "axes",
    Shape(Size::Branches, Size::Fixed(6)),
    "m",
    "the hinges of the branches in the base frame: the unit vector, without a unit, then its moment about the origin",
);

/// Momenta at unit speed of the hinges.
const MOMENTA: Array = array(
    "momenta",
    Shape(Size::Branches, Size::Fixed(6)),
    "kg m^2, kg m",
    "the momentum of all that moves with each branch at its unit speed: its moment about the origin, then its force",
);

/// Inertia of rotors.
const ROTORS: Array =
    vector("rotors", Size::Branches, "kg m^2", "the inertia of the branches' rotors");

/// Rows of J.
const CLOSURE: Array = vector(
    "closure",
    Size::ClosureEntries,
    "",
    "the rows of J that determine the dependent joints, over the length of their loop",
);

/// Every function, in the order of [`FunctionKind`].
pub const SIGNATURES: [Signature; 19] = [
    Signature {
        kind: FunctionKind::Equations,
        name: "equations",
        role: Role::Required,
        inputs: STATE,
        outputs: &[
            array("mass", Shape(Size::Speeds, Size::Speeds), "kg m^2", "M"),
            vector("forcing", Size::Speeds, "N m", "f"),
            array("jacobian", Shape(Size::Rows, Size::Speeds), "m", "J"),
            vector("gamma", Size::Rows, "m/s^2", "gamma"),
        ],
        doc: "The equations of motion M du/dt = f + J^T lambda, J du/dt = -gamma",
    },
    Signature {
        kind: FunctionKind::Closure,
        name: "closure",
        role: Role::Required,
        inputs: POSITION,
        outputs: &[
            vector("residual", Size::Residuals, "m", "the residuals, nine of each loop"),
            array("jacobian", Shape(Size::Residuals, Size::Speeds), "m", "their Jacobian by q"),
        ],
        doc: "How far the loops are open",
    },
    Signature {
        kind: FunctionKind::Poses,
        name: "poses",
        role: Role::Output,
        inputs: POSITION,
        outputs: &[array(
            "poses",
            Shape(Size::Bodies, Size::Fixed(12)),
            "m",
            "R, row-major and without a unit, then p",
        )],
        doc: "The pose of each body: what is drawn at x lies at R x + p in the base frame",
    },
    Signature {
        kind: FunctionKind::Points,
        name: "points",
        role: Role::Output,
        inputs: POSITION,
        outputs: &[array(
            "points",
            Shape(Size::Points, Size::Fixed(3)),
            "m",
            "x, y and z in the base frame",
        )],
        doc: "The positions of the output points",
    },
    Signature {
        kind: FunctionKind::Energy,
        name: "energy",
        role: Role::Output,
        inputs: STATE,
        outputs: &[
            array("kinetic", Shape::SCALAR, "J", "the energy of motion"),
            array("potential", Shape::SCALAR, "J", "the energy of gravity and springs"),
        ],
        doc: "The energies of the whole mechanism",
    },
    Signature {
        kind: FunctionKind::Drives,
        name: "drives",
        role: Role::Required,
        inputs: TIME,
        outputs: &[array(
            "drives",
            Shape(Size::Drives, Size::Fixed(4)),
            "rad/s^k",
            "the angle and its first three derivatives by t",
        )],
        doc: "The prescribed angle of each driven joint, in the order of the joints",
    },
    Signature {
        kind: FunctionKind::Contacts,
        name: "contacts",
        role: Role::Output,
        inputs: STATE,
        outputs: &[array(
            "contacts",
            Shape(Size::Contacts, Size::Fixed(6)),
            "m, N",
            "the position, then the force on the body, in the base frame",
        )],
        doc: "Where each contact point is, and the force on its body",
    },
    Signature {
        kind: FunctionKind::Gaps,
        name: "gaps",
        role: Role::Output,
        inputs: PLACE,
        outputs: &[
            array(
                "gap",
                Shape(Size::Contacts, Size::Fixed(2)),
                "m",
                "the height over the plane, then the distance within the edges and the back of its plate",
            ),
            vector("friction", Size::Contacts, "", "the coefficient of friction"),
            array(
                "normal",
                Shape(Size::Contacts, Size::Fixed(3)),
                "",
                "the unit normal of the plane in the base frame",
            ),
            array(
                "rows",
                Shape(Size::ContactRows, Size::Speeds),
                "m",
                "the velocity relative to the body of the plane by u, in the base frame",
            ),
        ],
        doc: "How far each contact point is from its plane, and how it moves relative to the body of the plane",
    },
    Signature {
        kind: FunctionKind::Reactions,
        name: "reactions",
        role: Role::Output,
        inputs: BALANCE,
        outputs: &[array(
            "reactions",
            Shape(Size::Joints, Size::Fixed(6)),
            "N, N m",
            "the force, then the moment",
        )],
        doc: "The force and the moment that each hinge transmits",
    },
    Signature {
        kind: FunctionKind::Momentum,
        name: "momentum",
        role: Role::Output,
        inputs: VELOCITY,
        outputs: &[array(
            "momentum",
            Shape(Size::Fixed(3), Size::Fixed(3)),
            "m, kg m/s, kg m^2/s",
            "the centre of mass, the linear momentum, and the angular momentum about that centre",
        )],
        doc: "The centre of mass of all moving bodies together, and their momenta, in the base frame",
    },
    Signature {
        kind: FunctionKind::Control,
        name: "control",
        role: Role::Output,
        inputs: SAMPLE,
        outputs: &[
            vector("next", Size::Memory, "SI", "the memory at the next sample"),
            vector("commands", Size::Commands, "SI", "the inputs that controllers drive"),
        ],
        doc: "What all controllers remember and command if they sample now",
    },
    Signature {
        kind: FunctionKind::Tangent,
        name: "tangent",
        role: Role::Output,
        inputs: DIRECTION,
        outputs: &[
            vector("forces", Size::Speeds, "N m", "the change of f - M du/dt + J^T lambda"),
            vector("closure", Size::Rows, "m/s^2", "the change of gamma + J du/dt"),
        ],
        doc: "The change of the equations' imbalance along a direction, at constant du/dt and lambda",
    },
    Signature {
        kind: FunctionKind::Acceleration,
        name: "acceleration",
        role: Role::Solution,
        inputs: STATE,
        outputs: &[vector("acceleration", Size::Speeds, "rad/s^2", "du/dt"), MARGIN],
        doc: "du/dt by elimination",
    },
    Signature {
        kind: FunctionKind::Projection,
        name: "projection",
        role: Role::Solution,
        inputs: VELOCITY,
        outputs: &[
            vector("residual", Size::Residuals, "m", "the closure residuals"),
            vector(
                "positions",
                Size::Speeds,
                "rad",
                "M^-1 J^T (J M^-1 J^T)^-1 times the residuals along the rows of J",
            ),
            vector("speeds", Size::Speeds, "rad/s", "the same times J u"),
            MARGIN,
        ],
        doc: "What closes the loops, to be taken from q and u",
    },
    Signature {
        kind: FunctionKind::Reduction,
        name: "reduction",
        role: Role::Solution,
        inputs: STATE,
        outputs: &[
            AXES,
            MOMENTA,
            ROTORS,
            CLOSURE,
            vector(
                "opening",
                Size::Dependent,
                "rad/s^2",
                "what the rows of J times du/dt are, in the order of the elimination",
            ),
            vector("forces", Size::Speeds, "N m", "f"),
        ],
        doc: "What du/dt by independent speeds needs",
    },
    Signature {
        kind: FunctionKind::ProjectionReduction,
        name: "projection_reduction",
        role: Role::Solution,
        inputs: VELOCITY,
        outputs: &[
            AXES,
            MOMENTA,
            ROTORS,
            CLOSURE,
            vector("residual", Size::Residuals, "m", "the closure residuals"),
            vector(
                "row_residual",
                Size::Dependent,
                "rad",
                "what the rows of J have to take from q, in the order of the elimination",
            ),
            vector("row_velocity", Size::Dependent, "rad/s", "the same for u"),
        ],
        doc: "What a projection by independent speeds needs",
    },
    Signature {
        kind: FunctionKind::Jacobian,
        name: "jacobian",
        role: Role::Solution,
        inputs: STATE,
        outputs: &[
            vector("acceleration", Size::Speeds, "rad/s^2", "du/dt"),
            array("dq", Shape(Size::Speeds, Size::Speeds), "1/s^2", "its derivative by q"),
            array("du", Shape(Size::Speeds, Size::Speeds), "1/s", "its derivative by u"),
            vector("dt", Size::Speeds, "rad/s^3", "its derivative by t"),
            MARGIN,
        ],
        doc: "du/dt by elimination, and its derivatives",
    },
    Signature {
        kind: FunctionKind::JacobianParams,
        name: "jacobian_params",
        role: Role::Solution,
        inputs: STATE,
        outputs: &[
            vector("acceleration", Size::Speeds, "rad/s^2", "du/dt"),
            array(
                "dp",
                Shape(Size::Speeds, Size::Parameters),
                "rad/s^2",
                "its derivative by the parameters, per unit of each in SI",
            ),
            MARGIN,
        ],
        doc: "du/dt by elimination, and its derivative by the parameters",
    },
    Signature {
        kind: FunctionKind::Drawing,
        name: "drawing",
        role: Role::Output,
        inputs: &[Argument::Parameters],
        outputs: &[vector("numbers", Size::Drawn, "SI", "the numbers")],
        doc: "The numbers that follow from the parameters alone, which the other functions read",
    },
];
