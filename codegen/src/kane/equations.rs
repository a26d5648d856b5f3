//! Kane's equations as bound symbolic expressions, in the order in which they were formed.

use crate::laminate::Mechanism;
use crate::program::{Fact, ReductionInfo, Section};
use crate::source::ids::index;
use crate::source::{CoordinateId, InputId, MemoryId, ParameterId, SpeedId};
use crate::symbolic::Tree;
use crate::topology::Topology;

index!(
    /// A bound intermediate of [`Equations`].
    BindingId
);

/// Meaning of a symbol in a [`Tree`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Leaf {
    /// Time t, s.
    Time,
    /// Coordinate q: rad, of free bodies m and pure numbers.
    Position(CoordinateId),
    /// Speed u: rad/s, of free bodies m/s too.
    Rate(SpeedId),
    /// A parameter.
    Parameter(ParameterId),
    /// An input.
    Input(InputId),
    /// Given du/dt: rad/s^2, of free bodies m/s^2 too.
    Acceleration(SpeedId),
    /// Given closure force lambda of a row, N.
    Multiplier(usize),
    /// What a controller remembers.
    Memory(MemoryId),
    /// An intermediate bound earlier.
    Bound(BindingId),
}

/// A named intermediate: `name = tree`.
#[derive(Clone, Debug)]
pub struct Binding {
    /// Name that the reader of the generated module sees: `omega_left_x`.
    pub name: String,
    /// The body or loop and the phase of the derivation that it belongs to.
    pub section: Section,
    /// Its value, as an expression of leaves and earlier bindings.
    pub tree: Tree<Leaf>,
}

/// The equations of motion of one mechanism.
///
/// Shapes: N speeds, J joints, C acceleration rows (sum of [`Loop::rows`](crate::topology::Loop::rows)),
/// L loops, B bodies, P points. Matrices are row-major.
#[derive(Clone, Debug)]
pub struct Equations {
    /// The mechanism with its tree and loops.
    pub topology: Topology,
    /// Whether numbers of the drawing depend on parameters.
    pub is_parametric: bool,
    /// Named numbers of the model.
    pub facts: Vec<Fact>,
    /// Intermediates, each an expression of earlier ones.
    pub bindings: Vec<Binding>,
    /// M of `M du/dt = f`, N x N, symmetric, kg m^2.
    pub mass: Vec<Tree<Leaf>>,
    /// f(t, q, u), N, N m.
    pub forcing: Vec<Tree<Leaf>>,
    /// J of `J du/dt = -gamma`, C x N, m.
    pub jacobian: Vec<Tree<Leaf>>,
    /// gamma(q, u), C, m/s^2.
    pub gamma: Vec<Tree<Leaf>>,
    /// The same equations of the tree, solved by elimination without M. Missing if it would cost more than
    /// the reduction to independent speeds.
    pub elimination: Option<Elimination>,
    /// The equations of motion with all loops, solved for independent speeds. Only mechanisms of several
    /// loops have it.
    pub reduced: Option<Reduced>,
    /// What the runtime needs to solve for independent speeds, in place of `reduced`.
    pub terms: Option<Terms>,
    /// J u, C, m/s.
    pub row_velocity: Vec<Tree<Leaf>>,
    /// Closure residuals along the rows of J, C, m. Their rate of change is J u if the loops are
    /// closed.
    pub row_residual: Vec<Tree<Leaf>>,
    /// Closure residuals, 9 L, m. For each loop, they are the position in the ghost minus the position
    /// in the original of P1, P2 and P3, in components of the frame of the nearest common ancestor of
    /// the two.
    pub residual: Vec<Tree<Leaf>>,
    /// Jacobian of all nine closure rows by q, 9 L x N, m.
    pub residual_jacobian: Vec<Tree<Leaf>>,
    /// Poses, 12 numbers per body: R row-major, then p, so that the point drawn at x lies at R x + p.
    pub poses: Vec<Tree<Leaf>>,
    /// Position of each point in the base frame, m.
    pub points: Vec<Tree<Leaf>>,
    /// Position (m) of each contact point and the force (N) on its body, in the base frame, K x 6.
    pub contacts: Vec<Tree<Leaf>>,
    /// What rigid contacts need.
    pub gaps: GapTrees,
    /// Prescribed angles of the driven joints, rad.
    pub drives: Vec<Tree<Leaf>>,
    /// f - M du/dt + J^T lambda at given du/dt and lambda, N, N m.
    pub imbalance: Vec<Tree<Leaf>>,
    /// gamma + J du/dt at given du/dt, C, m/s^2.
    pub opening: Vec<Tree<Leaf>>,
    /// Force (N) and moment (N m) that the hinge of each joint transmits at given du/dt and lambda,
    /// J x 6.
    pub reactions: Vec<Tree<Leaf>>,
    /// Centre of mass (m), linear momentum (kg m/s) and angular momentum about that centre (kg m^2/s) of all
    /// moving bodies, 9. Only mechanisms with free bodies have it.
    pub momentum: Option<Vec<Tree<Leaf>>>,
    /// Memory at the next sample, and commands, of all controllers. Only mechanisms with controllers have them.
    pub control: Option<[Vec<Tree<Leaf>>; 2]>,
    /// Kinetic energy, J.
    pub kinetic_energy: Tree<Leaf>,
    /// Potential energy of gravity and springs, J.
    pub potential_energy: Tree<Leaf>,
}

/// What rigid contacts need of K points.
#[derive(Clone, Debug)]
pub struct GapTrees {
    /// Height over the plane, and distance within the edges and the back of its plate, K x 2, m.
    pub gap: Vec<Tree<Leaf>>,
    /// Coefficient of friction, K.
    pub friction: Vec<Tree<Leaf>>,
    /// Unit normal of the plane in the base frame, K x 3.
    pub normal: Vec<Tree<Leaf>>,
    /// Velocity relative to the body of the plane in the base frame, K x 3, m/s.
    pub velocity: Vec<Tree<Leaf>>,
}

/// M = L^T D L, and the solution of M du/dt = f + J^T lambda with it.
#[derive(Clone, Debug)]
pub struct Elimination {
    /// 1 / D, N, 1/(kg m^2).
    pub inverse_pivots: Vec<Tree<Leaf>>,
    /// L^-T f, N, N m.
    pub reduced: Vec<Tree<Leaf>>,
    /// J L^-1, C x N, m.
    pub reduced_rows: Vec<Tree<Leaf>>,
    /// L^-1 a at given a, N, rad/s^2: du/dt where a = D^-1 L^-T (f + J^T lambda).
    pub accelerations: Vec<Tree<Leaf>>,
}

/// The solution for independent speeds: no row of the closure has to be independent of the others.
#[derive(Clone, Debug)]
pub struct Reduced {
    /// du/dt, N, rad/s^2.
    pub accelerations: Vec<Tree<Leaf>>,
    /// How far du/dt can be trusted, 2: the least inverse pivot of N^T M N, and the square of the smallest
    /// pivot of the closure over its loop's length.
    pub margin: Vec<Tree<Leaf>>,
    /// What closes the loops, to be taken from q, to first order, N, rad.
    pub positions: Vec<Tree<Leaf>>,
    /// What keeps them closed, to be taken from u, N, rad/s.
    pub speeds: Vec<Tree<Leaf>>,
    /// How far these two can be trusted, 2, as `margin`.
    pub projection_margin: Vec<Tree<Leaf>>,
}

/// What a solution for independent speeds needs, with B joints in the order of the pattern's branches.
#[derive(Clone, Debug)]
pub struct Terms {
    /// Which speeds are independent, and which joints the others follow from.
    pub pattern: ReductionInfo,
    /// Velocity of each hinge at unit speed about the origin of the base frame: turn and displacement, B x 6.
    pub axes: Vec<Tree<Leaf>>,
    /// Inertia of the rotors, B, kg m^2.
    pub rotors: Vec<Tree<Leaf>>,
    /// Rows of J over their loops' lengths, 1: the entries that the pattern's `closure` names.
    pub closure: Vec<Tree<Leaf>>,
    /// Momentum of all that moves with each hinge at unit speed, about the origin of the base frame: moment and
    /// force, B x 6.
    pub momenta: Vec<Tree<Leaf>>,
    /// These rows times du/dt, in the order of the elimination, rad/s^2.
    pub opening: Vec<Tree<Leaf>>,
    /// f, N, N m.
    pub forces: Vec<Tree<Leaf>>,
    /// As `momenta`, for the M of the tree.
    pub projection_momenta: Vec<Tree<Leaf>>,
    /// What these rows have to take from q, to first order, rad.
    pub row_residual: Vec<Tree<Leaf>>,
    /// The same for u, rad/s.
    pub row_velocity: Vec<Tree<Leaf>>,
}

impl Equations {
    /// Returns the mechanism that the equations describe.
    pub fn mechanism(&self) -> &Mechanism {
        &self.topology.mechanism
    }
}
