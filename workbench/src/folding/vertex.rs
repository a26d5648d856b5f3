//! Inner vertices: their creases in order, and the conditions under which a vertex folds flat.
//!
//! A vertex of which all creases fold by half a turn can only do so if the numbers of its mountains and valleys
//! differ by two (Maekawa), and the alternating sum of its sector angles is zero, so that every other one adds up
//! to half a turn (Kawasaki; T. Hull, "On the mathematics of flat origamis", 1994).

use std::f64::consts::{PI, TAU};

use nalgebra::{RealField, Vector3};

use super::Fold;
use super::chain::Chain;

/// Sector angles of a drawing hold Kawasaki's condition up to this, rad.
const ANGLES: f64 = 1e-4;
/// A joint folds by half a turn up to this, rad.
const HALF_TURN: f64 = 1e-6;

/// A vertex is at the end of a hinge line up to this share of its length: hinge lines are moved to meet in one
/// point, by no more than a hundredth of the drawing.
const END: f64 = 0.02;

/// Why a vertex cannot fold flat.
#[derive(Clone, Debug, PartialEq)]
pub enum Violation {
    /// Maekawa: so many mountains and valleys do not differ by two.
    Maekawa {
        /// Number of mountains.
        mountains: usize,
        /// Number of valleys.
        valleys: usize,
    },
    /// Kawasaki: every other sector angle adds up to this, rad, and not to half a turn.
    Kawasaki(f64),
}

impl Fold {
    /// Returns the vertices that cannot fold flat although all their creases are to fold by half a turn.
    pub fn not_flat_foldable(&self) -> Vec<(usize, Violation)> {
        let mut found = Vec::new();
        for (index, chain) in self.problem.equations.chains.iter().enumerate() {
            let Some(centre) = chain.centre else { continue };
            let creases: Vec<usize> = chain.joints().collect();
            let targets = &self.problem.targets;
            if creases.iter().any(|joint| (targets[*joint].abs() - PI).abs() > HALF_TURN) {
                continue;
            }
            let valleys = creases.iter().filter(|joint| targets[**joint] > 0.0).count();
            let mountains = creases.len() - valleys;
            if mountains.abs_diff(valleys) != 2 {
                found.push((index, Violation::Maekawa { mountains, valleys }));
            }
            let sectors = self.sectors(chain, &centre);
            let every_other: f64 = sectors.iter().step_by(2).sum();
            if sectors.len() % 2 == 1 || (every_other - PI).abs() > ANGLES {
                found.push((index, Violation::Kawasaki(every_other)));
            }
        }
        found
    }

    /// Returns the angles between neighbouring creases of a vertex, rad.
    fn sectors(&self, chain: &Chain, centre: &Vector3<f64>) -> Vec<f64> {
        let passed: Vec<Vector3<f64>> = chain.directions().collect();
        let known: Vec<Option<Vector3<f64>>> =
            chain.joints().map(|joint| self.way_out(joint, centre)).collect();
        // Pieces of a crease on both sides of the vertex are one joint, and one of them is at this
        // vertex: the one whose sides are passed in the same order as those of the others.
        let mut sides =
            passed.iter().zip(&known).filter_map(|(passed, out)| Some(passed.dot(&(*out)?)));
        let side = sides.next().map_or(1.0, f64::signum);
        let mut directions: Vec<f64> = passed
            .iter()
            .zip(&known)
            .map(|(passed, out)| out.unwrap_or(passed * side))
            .map(|out| RealField::atan2(out.y, out.x))
            .collect();
        directions.sort_by(f64::total_cmp);
        let next = directions.iter().skip(1).chain(&directions[..1]);
        let between = directions.iter().zip(next).map(|(one, next)| (next - one).rem_euclid(TAU));
        between.collect()
    }

    /// Returns the direction in which a crease leaves a vertex, if it has no piece on the other side.
    fn way_out(&self, joint: usize, centre: &Vector3<f64>) -> Option<Vector3<f64>> {
        let joint = &self.topology.mechanism.joints[joint];
        let behind = joint.direction.dot(&(centre - joint.point)) / joint.length;
        if behind <= END {
            return Some(joint.direction);
        }
        (behind >= 1.0 - END).then_some(-joint.direction)
    }
}
