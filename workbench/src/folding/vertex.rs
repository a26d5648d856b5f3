//! Inner vertices: their creases in order, and the conditions under which a vertex folds flat.
//!
//! A vertex of which all creases fold by half a turn can only do so if the numbers of its mountains and valleys
//! differ by two (Maekawa), and the alternating sum of its sector angles is zero, so that every other one adds up
//! to half a turn (Kawasaki; T. Hull, "On the mathematics of flat origamis", 1994).

use std::f64::consts::{PI, TAU};

use nalgebra::{RealField, Vector3};

use super::Fold;

/// Sector angles of a drawing hold Kawasaki's condition up to this, rad.
const ANGLES: f64 = 1e-4;
/// A joint folds by half a turn up to this, rad.
const HALF_TURN: f64 = 1e-6;

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
            let sectors = self.sectors(&creases, &centre);
            let every_other: f64 = sectors.iter().step_by(2).sum();
            if sectors.len() % 2 == 1 || (every_other - PI).abs() > ANGLES {
                found.push((index, Violation::Kawasaki(every_other)));
            }
        }
        found
    }

    /// Returns the angles between neighbouring creases of a vertex, rad.
    fn sectors(&self, creases: &[usize], centre: &Vector3<f64>) -> Vec<f64> {
        let mut directions: Vec<f64> = creases
            .iter()
            .map(|joint| {
                let joint = &self.topology.mechanism.joints[*joint];
                let out = joint.point + joint.direction * (joint.length / 2.0) - centre;
                RealField::atan2(out.y, out.x)
            })
            .collect();
        directions.sort_by(f64::total_cmp);
        let next = directions.iter().skip(1).chain(&directions[..1]);
        let between = directions.iter().zip(next).map(|(one, next)| (next - one).rem_euclid(TAU));
        between.collect()
    }
}
