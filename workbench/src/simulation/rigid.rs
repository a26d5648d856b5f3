//! Loops that cannot move, in a state in which their equations do not say so.
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

use lamc::topology::Topology;
use lamc_runtime::Mechanism;

use crate::execution::Jit;

/// What is left of a column of J without the others, over its length, is rounding below this. The angles of a
/// loop that closes in the flat state only are zero up to the root of the rounding errors.
const DEPENDENT: f64 = 1e-6;

/// Closure equations of a loop: three coordinates of three points.
const ROWS: usize = 9;

/// Joints that cannot move, and that are loose to first order.
#[derive(Clone, Debug, PartialEq)]
pub struct Loose {
    /// The names of the joints of a loop that cannot move; none if the loops of these joints do.
    pub joints: Vec<String>,
    /// The joints that hold the others if they are held, with their angles, rad.
    pub holding: Vec<(String, f64)>,
    /// Whether they turn in finite motions as well, so that they cannot be held.
    pub is_shaky: bool,
}

impl fmt::Display for Loose {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.joints.iter().map(|name| format!("`{name}`")).collect();
        // Adding zero turns -0 into 0.
        let lock = |(name, angle): &(String, f64)| {
            format!("--lock {name}={}deg", (angle.to_degrees() * 1e4).round() / 1e4 + 0.0)
        };
        let locks: Vec<_> = self.holding.iter().map(lock).collect();
        if self.is_shaky {
            return f.write_str(
                "the equations of the loops allow small motions, which do not exist, at all states near this one: a \
                 hinge less or more, or other proportions, make the motion a definite one",
            );
        }
        let what = match names.is_empty() {
            true => {
                let held: Vec<_> =
                    self.holding.iter().map(|(name, _)| format!("`{name}`")).collect();
                format!("{} cannot turn, but the equations of the loops", held.join(", "))
            }
            false => format!(
                "the loop of {} cannot move, but where its hinges lie in one plane, its equations",
                names.join(", ")
            ),
        };
        let it = if names.is_empty() && self.holding.len() > 1 { "them" } else { "it" };
        write!(
            f,
            "{what} allow small motions, which do not exist: hold {it} by `{}` (`drive` in the model), or join \
             the bodies",
            locks.join(" ")
        )
    }
}

/// Returns what cannot move but is loose to first order at these angles: the first such loop, else all single joints.
pub fn loose(topology: &Topology, system: &Jit, q: &[f64]) -> Option<Loose> {
    loose_rigid_loop(topology, system, q).or_else(|| {
        let joints = &topology.mechanism.joints;
        let at = topology.infinitesimal.iter().map(|joint| joint.index());
        let free = at.filter(|joint| joints[*joint].drive.is_none());
        let holding: Vec<_> = free.map(|joint| (joints[joint].name.clone(), q[joint])).collect();
        (!holding.is_empty()).then(|| Loose {
            joints: Vec::new(),
            holding,
            is_shaky: topology.is_shaky,
        })
    })
}

fn loose_rigid_loop(topology: &Topology, system: &Jit, q: &[f64]) -> Option<Loose> {
    let is_rigid = topology.loops.iter().any(|closed| closed.mobility == 0);
    if !is_rigid {
        return None;
    }
    let n = system.dimensions().speeds;
    let rows = ROWS * topology.loops.len();
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * n]);
    system.write_closure(q, &mut residual, &mut jacobian).ok()?;
    let joints = &topology.mechanism.joints;
    let rigid = topology.loops.iter().enumerate().filter(|(_, closed)| closed.mobility == 0);
    rigid.into_iter().find_map(|(number, closed)| {
        let free = closed.joints.iter().map(|joint| joint.index());
        let free: Vec<usize> = free.filter(|joint| joints[*joint].drive.is_none()).collect();
        let column = |joint: &usize| -> Vec<f64> {
            (ROWS * number..ROWS * (number + 1)).map(|row| jacobian[row * n + joint]).collect()
        };
        let columns: Vec<Vec<f64>> = free.iter().map(column).collect();
        let holding: Vec<(String, f64)> = dependent(columns)
            .into_iter()
            .map(|index| (joints[free[index]].name.clone(), q[free[index]]))
            .collect();
        let name = |joint: &lamc::source::JointId| joints[joint.index()].name.clone();
        let joints = closed.joints.iter().map(name).collect();
        let loose = Loose { joints, holding, is_shaky: false };
        (!loose.holding.is_empty()).then_some(loose)
    })
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
