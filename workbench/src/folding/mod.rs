//! `lamc fold`: the path of a sheet from the flat state towards the angles of its finished fold.
//!
//! ```text
//! model, topology -> chain (hinges around loops) -> system (sparse equations of a step)
//!     -> depart (leaves the flat state), state (nearest closed state) -> path -> Motion
//! ```
//!
//! No equations are derived: a loop closes if the product of its rotations is one, so the size of a
//! sheet costs as much as its loops together. At progress s the state minimises
//!
//! ```text
//! 1/2 sum_i w_i (q_i - s t_i)^2
//! ```
//!
//! among the closed ones that are reached without a jump. t_i is the joint's `fold`. w_i is 1 for joints with a
//! `fold`, whatever their stiffness and length, so that the path depends on the drawing only; joints
//! without one have t_i = 0 and a small weight, as a weak spring.

mod chain;
mod contact;
mod depart;
mod gap;
mod path;
mod state;
mod system;
#[cfg(test)]
mod tests;
mod vertex;

pub use contact::Facets;
pub use depart::Stuck;
pub use path::{End, Path, Sample};
pub use vertex::Violation;

use lamc::source::SourceModel;
use lamc::topology::{Echelon, Topology};
use lamc_runtime::Energy;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

use crate::motion::{self, Course, Motion, Pose};
use chain::Chain;
use state::{Problem, WEAK, WEIGHT};
use system::Equations;

/// What is left of a row of the closure below this share counts as zero.
const RANK_TOLERANCE: f64 = 1e-7;

/// A sheet that folds.
pub struct Fold {
    topology: Topology,
    problem: Problem,
}

impl Fold {
    /// Returns the fold of a model, whose topology is given; nothing if no joint has a `fold` other than 0.
    pub fn new(model: &SourceModel, topology: Topology) -> Option<Self> {
        let chains = topology.loops.iter().map(|closed| Chain::new(&topology, closed)).collect();
        let folds = model.joints.iter().map(|joint| joint.fold.as_ref().map(|fold| fold.value));
        let folds: Vec<Option<f64>> = folds.collect();
        let joints = &topology.mechanism.joints;
        let problem = Problem {
            equations: Equations::new(chains, joints.len()),
            targets: folds.iter().map(|fold| fold.unwrap_or(0.0)).collect(),
            weights: folds.iter().map(|fold| if fold.is_some() { WEIGHT } else { WEAK }).collect(),
            bounds: joints.iter().map(|joint| Problem::bounds(joint.limits)).collect(),
        };
        let folds = problem.targets.iter().any(|target| *target != 0.0);
        folds.then_some(Self { topology, problem })
    }

    /// The mechanism with its loops.
    pub fn topology(&self) -> &Topology {
        &self.topology
    }

    /// Follows the fold up to a progress, in so many steps. `go_on` is asked before each.
    pub fn follow(&mut self, to: f64, steps: usize, go_on: impl FnMut(usize) -> bool) -> Path {
        path::follow(&mut self.problem, to, steps, go_on)
    }

    /// Returns whether a loop alone can leave the flat state by its assignment.
    pub fn leaves_alone(&self, number: usize) -> bool {
        let chain = self.problem.equations.chains[number].clone();
        let mut targets = vec![0.0; self.problem.targets.len()];
        chain.joints().for_each(|joint| targets[joint] = self.problem.targets[joint]);
        if targets.iter().all(|target| *target == 0.0) {
            return true;
        }
        let mut alone = Problem {
            equations: Equations::new(vec![chain], targets.len()),
            weights: self.problem.weights.clone(),
            bounds: self.problem.bounds.clone(),
            targets,
        };
        depart::depart(&mut alone).is_ok()
    }

    /// Returns the mobility at some angles: the number of joints less the rank of the closure of these loops.
    pub fn mobility(&self, q: &[f64], loops: &[usize]) -> usize {
        let chains = loops.iter().map(|number| &self.problem.equations.chains[*number]);
        let mut joints: Vec<usize> = Vec::new();
        let mut rows = Vec::new();
        for chain in chains {
            let placed = chain.place(q);
            joints.extend(chain.joints());
            rows.extend((0..chain.rows).map(|row| {
                chain
                    .joints()
                    .zip(&placed.twists)
                    .map(|(joint, twist)| (joint, twist[row]))
                    .collect()
            }));
        }
        joints.sort_unstable();
        joints.dedup();
        joints.len() - Echelon::new(rows, q.len(), RANK_TOLERANCE).rank()
    }

    /// Returns the mobility of the whole at some angles.
    pub fn mobility_of_all(&self, q: &[f64]) -> usize {
        let all: Vec<usize> = (0..self.topology.loops.len()).collect();
        let mut free = vec![true; q.len()];
        let chains = &self.problem.equations.chains;
        chains.iter().flat_map(Chain::joints).for_each(|joint| free[joint] = false);
        self.mobility(q, &all) + free.iter().filter(|free| **free).count()
    }

    /// Number of joints with a `fold` that is not 0.
    pub fn creases(&self) -> usize {
        self.problem.targets.iter().filter(|target| **target != 0.0).count()
    }

    /// Angles of the finished fold, rad; 0 for joints without.
    pub fn targets(&self) -> &[f64] {
        &self.problem.targets
    }

    /// Returns what a loop is called in messages: the place of a vertex, and its joints.
    pub fn loop_name(&self, number: usize) -> String {
        /// More joints than these are not listed.
        const LISTED: usize = 8;
        let chain = &self.problem.equations.chains[number];
        let joints = &self.topology.mechanism.joints;
        let mut names: Vec<String> =
            chain.joints().take(LISTED).map(|joint| format!("`{}`", joints[joint].name)).collect();
        if chain.joints().len() > LISTED {
            names.push("..".into());
        }
        let names = names.join(", ");
        match chain.centre {
            Some(at) => {
                format!("the vertex at ({:.4}, {:.4}) mm of {names}", at.x * 1e3, at.y * 1e3)
            }
            None => format!("the loop of {names}"),
        }
    }

    /// Returns the joints of a loop, in order.
    pub fn loop_joints(&self, number: usize) -> Vec<usize> {
        self.problem.equations.chains[number].joints().collect()
    }

    /// Returns the poses of all bodies at some angles; free bodies stay as drawn.
    pub fn poses(&self, q: &[f64]) -> Vec<Pose> {
        let mechanism = &self.topology.mechanism;
        let mut placed: Vec<(Matrix3<f64>, Vector3<f64>)> =
            Vec::with_capacity(self.topology.nodes.len());
        let mut poses = vec![(Matrix3::identity(), Vector3::zeros()); mechanism.bodies.len()];
        for node in &self.topology.nodes {
            let ground = (Matrix3::identity(), Vector3::zeros());
            let Some(id) = node.joint() else {
                placed.push(ground);
                continue;
            };
            let joint = &mechanism.joints[id.index()];
            let (turn, shift) = node.parent.map_or(ground, |parent| placed[parent.index()]);
            let about = Unit::new_unchecked(joint.direction);
            let angle = node.sense * q[id.index()];
            let turned = turn * Rotation3::from_axis_angle(&about, angle).into_inner();
            let pose = (turned, turn * joint.point + shift - turned * joint.point);
            if node.ghost.is_none() {
                poses[node.body.index()] = pose;
            }
            placed.push(pose);
        }
        let numbers = |(turn, shift): (Matrix3<f64>, Vector3<f64>)| Pose {
            rotation: turn.transpose().data.0,
            translation: shift.into(),
        };
        poses.into_iter().map(numbers).collect()
    }

    /// Returns the path as a motion over the progress in percent, without speeds and energies.
    pub fn motion(&self, path: &Path) -> Motion {
        let mechanism = &self.topology.mechanism;
        let still = vec![0.0; mechanism.joints.len()];
        let sample = |sample: &Sample| {
            let poses = self.poses(&sample.q);
            let at = |point: &lamc::laminate::Point| {
                crate::scene::Placement::of(&poses, point.body.index()).apply(&point.at).into()
            };
            motion::Sample {
                t: 100.0 * sample.progress,
                q: sample.q.clone(),
                u: still.clone(),
                acceleration: still.clone(),
                energy: Energy { kinetic: 0.0, potential: 0.0 },
                closure: sample.open * mechanism.size,
                points: mechanism.points.iter().map(at).collect(),
                poses,
                contacts: Vec::new(),
                tensions: Vec::new(),
                inputs: Vec::new(),
            }
        };
        Motion {
            name: mechanism.name.clone(),
            course: Course::Progress,
            free: Vec::new(),
            joints: mechanism.joints.iter().map(|joint| joint.name.clone()).collect(),
            bodies: mechanism.bodies.iter().map(|body| body.name.clone()).collect(),
            points: mechanism.points.iter().map(|point| point.name.clone()).collect(),
            contacts: Vec::new(),
            tensions: Vec::new(),
            inputs: Vec::new(),
            size: mechanism.size,
            samples: path.samples.iter().map(sample).collect(),
            complete: path.end == End::Reached,
        }
    }
}
