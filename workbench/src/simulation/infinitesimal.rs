//! Motions that end as they begin: the equations of loops allow them in a state, and they do not exist.
//!
//! In the flat state the hinge lines of a vertex lie in one plane, and its closure
//!
//! ```text
//! J u = 0
//! ```
//!
//! has a solution u of small speeds even where no motion follows it: for three creases that meet in a point
//! the angles are zero, but J has rank 2. No state next to this one is closed, so accelerations, modes and
//! equilibria would be those of a motion that does not exist. Which loops cannot move is known from the topology.
//! So are single joints that cannot move in loops that do: creases of a vertex that end at the straight edge of a plate.

use std::fmt;

use lamc::laminate::Mechanism;
use lamc::source::JointId;
use lamc::topology::Topology;
use lamc_runtime::Mechanism as _;

use crate::execution::Jit;

/// What is left of a column of J without the others, over its length, is rounding below this. The angles of a
/// loop that closes in the flat state only are zero up to the root of the rounding errors.
const DEPENDENT: f64 = 1e-6;

/// Closure equations of a loop: three coordinates of three points.
const ROWS: usize = 9;

/// Small motions that the equations of closure allow in a state, and to which no finite motion belongs.
#[derive(Clone, Debug, PartialEq)]
pub enum Infinitesimal {
    /// A loop that cannot move.
    Loop {
        /// The names of its joints.
        joints: Vec<String>,
        /// Those that hold the others.
        held: Vec<Held>,
    },
    /// Joints that cannot turn, in loops that move.
    Joints(Vec<Held>),
    /// Of joints that turn in finite motions as well, so that none can be held.
    Shaky,
}

/// A joint that must be held.
#[derive(Clone, Debug, PartialEq)]
pub struct Held {
    /// Its name.
    pub name: String,
    /// Its angle in the state, rad.
    pub angle: f64,
}

impl Infinitesimal {
    /// Looks for such motions at these angles, rad: of the first loop that cannot move, or else of joints.
    pub fn find(topology: &Topology, system: &Jit, q: &[f64]) -> Option<Self> {
        let loops = topology.loops.iter().enumerate();
        let mut rigid = loops.filter(|(_, closed)| closed.mobility == 0).peekable();
        if rigid.peek().is_some() {
            let n = system.dimensions().speeds;
            let rows = ROWS * topology.loops.len();
            let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * n]);
            system.write_closure(q, &mut residual, &mut jacobian).ok()?;
            let mechanism = &topology.mechanism;
            let found = rigid.find_map(|(number, closed)| {
                let rows = &jacobian[ROWS * n * number..ROWS * n * (number + 1)];
                let column = |joint: usize| rows.iter().skip(joint).step_by(n).copied().collect();
                let free = undriven(mechanism, &closed.joints);
                let columns = free.iter().map(|joint| column(*joint)).collect();
                let held: Vec<_> = dependent(columns)
                    .into_iter()
                    .map(|index| Held::new(mechanism, free[index], q))
                    .collect();
                let name = |joint: &JointId| mechanism.joints[joint.index()].name.clone();
                let joints = closed.joints.iter().map(name).collect();
                (!held.is_empty()).then_some(Self::Loop { joints, held })
            });
            if found.is_some() {
                return found;
            }
        }
        let mechanism = &topology.mechanism;
        let stuck = undriven(mechanism, &topology.infinitesimal);
        let held = stuck.iter().map(|joint| Held::new(mechanism, *joint, q)).collect();
        match (stuck.is_empty(), topology.is_shaky) {
            (true, _) => None,
            (false, true) => Some(Self::Shaky),
            (false, false) => Some(Self::Joints(held)),
        }
    }
}

impl Held {
    fn new(mechanism: &Mechanism, joint: usize, q: &[f64]) -> Self {
        Self { name: mechanism.joints[joint].name.clone(), angle: q[joint] }
    }
}

fn undriven(mechanism: &Mechanism, joints: &[JointId]) -> Vec<usize> {
    let indices = joints.iter().map(|joint| joint.index());
    indices.filter(|joint| mechanism.joints[*joint].drive.is_none()).collect()
}

impl fmt::Display for Infinitesimal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Loop { joints, held } => write!(
                f,
                "the loop of {} cannot move, but where its hinges lie in one plane, its equations {}",
                names(joints),
                hold("it", held)
            ),
            Self::Joints(held) => {
                let them = if held.len() > 1 { "them" } else { "it" };
                let joints = names(held.iter().map(|held| &held.name));
                write!(f, "{joints} cannot turn, but the equations of the loops {}", hold(them, held))
            }
            Self::Shaky => f.write_str(
                "the equations of the loops allow small motions, which do not exist, at all states near this one: a \
                 hinge less or more, or other proportions, make the motion a definite one",
            ),
        }
    }
}

fn names<'a>(joints: impl IntoIterator<Item = &'a String>) -> String {
    let names: Vec<_> = joints.into_iter().map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

/// What holds `it`.
fn hold(it: &str, held: &[Held]) -> String {
    let lock = |Held { name, angle }: &Held| {
        // Adding zero turns -0 into 0.
        format!("--lock {name}={}deg", (angle.to_degrees() * 1e4).round() / 1e4 + 0.0)
    };
    let locks: Vec<_> = held.iter().map(lock).collect();
    format!(
        "allow small motions, which do not exist: hold {it} by `{}` (`drive` in the model), or join the bodies",
        locks.join(" ")
    )
}

/// Returns which columns depend on those before them (Gram and Schmidt, each step twice).
fn dependent(columns: Vec<Vec<f64>>) -> Vec<usize> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let mut basis: Vec<Vec<f64>> = Vec::new();
    let mut dependent = Vec::new();
    for (index, mut column) in columns.into_iter().enumerate() {
        let length = dot(&column, &column).sqrt();
        for direction in basis.iter().chain(&basis) {
            let along = dot(direction, &column);
            column.iter_mut().zip(direction).for_each(|(x, d)| *x -= along * d);
        }
        let left = dot(&column, &column).sqrt();
        if left > DEPENDENT * length {
            column.iter_mut().for_each(|x| *x /= left);
            basis.push(column);
        } else {
            dependent.push(index);
        }
    }
    dependent
}
