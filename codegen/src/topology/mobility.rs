//! Generic rank and mobility, from closed configurations away from the flat state.
//!
//! At the flat state the closure Jacobian loses rank, so it is sampled elsewhere: the generic rank
//! is the largest found, since rank can only drop at special configurations.

use nalgebra::DMatrix;

use super::graph::{LoopClass, Topology};
use super::kinematics::{assemble, closure};
use crate::source::Diagnostic;

/// Closed configurations wanted, and attempts made to find them.
const WANTED: usize = 5;
const ATTEMPTS: usize = 40;
/// A configuration with some joint beyond this is away from the flat state, rad.
const AWAY: f64 = 0.05;
/// Singular values below this fraction of the largest count as zero.
const RANK_TOLERANCE: f64 = 1e-6;

/// Fills in ranks, mobilities and a closed configuration.
pub fn sample(topology: &mut Topology) {
    let n = topology.mechanism.joints.len();
    if topology.loops.is_empty() {
        return;
    }
    let mut noise = Noise(0x9e37_79b9_7f4a_7c15);
    let mut found: Vec<Vec<f64>> = Vec::new();
    for attempt in 0..ATTEMPTS {
        if found.len() == WANTED {
            break;
        }
        let spread = [0.3, 0.6, 1.0, 1.5][attempt % 4];
        let first = attempt == 0 && !topology.mechanism.initial_given.is_empty();
        let guess: Vec<f64> = (0..n)
            .map(|j| if first { topology.mechanism.initial_q[j] } else { spread * noise.next() })
            .collect();
        let closed = assemble(topology, &guess);
        found.extend(closed.filter(|q| q.iter().any(|q| q.abs() > AWAY)));
    }
    let moves = !found.is_empty();
    let samples = if moves { found.clone() } else { vec![vec![0.0; n]] };
    for q in &samples {
        let (_, jacobian) = closure(topology, q);
        topology.rank = topology.rank.max(rank(&jacobian));
        for (index, closed) in topology.loops.iter_mut().enumerate() {
            let rows = jacobian.rows(9 * index, 9).into_owned();
            closed.rank = closed.rank.max(rank(&rows));
        }
    }
    for closed in &mut topology.loops {
        closed.mobility = closed.joints.len() - closed.rank;
    }
    topology.mobility = if moves { n - topology.rank } else { 0 };
    topology.assembled = found.into_iter().next();
    if topology.mobility == 0 {
        let hinge = &topology.mechanism.joints[topology.loops[0].joint.index()];
        let (message, hint) = if moves {
            (
                "the mechanism cannot move: its loops leave no degree of freedom",
                "as drawn it is a structure",
            )
        } else {
            (
                "no closed configuration was found but the flat one",
                "the mechanism seems unable to fold; check hinge lines and limits",
            )
        };
        topology.warnings.push(Diagnostic::warning("immobile", hinge.span, message).hint(hint));
    }
}

fn rank(jacobian: &DMatrix<f64>) -> usize {
    let values = jacobian.clone().singular_values();
    values.iter().filter(|&&value| value > RANK_TOLERANCE * values.amax()).count()
}

impl Topology {
    /// One line per loop: `loop 0: spherical, 9 equations, 3 independent, mobility 3`.
    pub fn summary_lines(&self) -> Vec<String> {
        let line = |(index, closed): (usize, &super::graph::Loop)| {
            format!(
                "loop {index}: {}, 9 equations, {} independent, mobility {}",
                closed.class, closed.rank, closed.mobility
            )
        };
        self.loops.iter().enumerate().map(line).collect()
    }
}

impl std::fmt::Display for LoopClass {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Planar { .. } => "planar",
            Self::Spherical { .. } => "spherical",
            Self::Spatial => "spatial",
        })
    }
}

/// Uniform numbers in -1 .. 1, the same every time (xorshift64*; Vigna 2016).
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        let bits = self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 11;
        bits as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
