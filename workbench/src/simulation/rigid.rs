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

use std::fmt;

use lamc::topology::Topology;
use lamc_runtime::Mechanism;

use crate::execution::Jit;

/// What is left of a column of J without the others, over its length, is rounding below this. The angles of a
/// loop that closes in the flat state only are zero up to the root of the rounding errors.
const DEPENDENT: f64 = 1e-6;

/// Closure equations of a loop: three coordinates of three points.
const ROWS: usize = 9;

/// A loop that cannot move, and that is loose to first order.
#[derive(Clone, Debug, PartialEq)]
pub struct LooseRigidLoop {
    /// The names of its joints.
    pub joints: Vec<String>,
    /// The joints that hold it if they are held, with their angles, rad.
    pub holding: Vec<(String, f64)>,
}

impl fmt::Display for LooseRigidLoop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names: Vec<_> = self.joints.iter().map(|name| format!("`{name}`")).collect();
        // Adding zero turns -0 into 0.
        let lock = |(name, angle): &(String, f64)| {
            format!("--lock {name}={}deg", (angle.to_degrees() * 1e4).round() / 1e4 + 0.0)
        };
        let locks: Vec<_> = self.holding.iter().map(lock).collect();
        write!(
            f,
            "the loop of {} cannot move, but where its hinges lie in one plane, its equations allow small \
             motions, which do not exist: hold it by `{}` (`drive` in the model), or join its bodies",
            names.join(", "),
            locks.join(" ")
        )
    }
}

/// Returns the first loop that cannot move, alone, but is loose to first order at these angles.
pub fn loose_rigid_loop(topology: &Topology, system: &Jit, q: &[f64]) -> Option<LooseRigidLoop> {
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
        let loose = LooseRigidLoop { joints: closed.joints.iter().map(name).collect(), holding };
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
