//! How far plates of a design are apart.
//!
//! The least distance changes with the design as the two places do that are nearest to each other: the states that the
//! plates are in move along their derivatives, and the rest is differences.

use lamc_runtime::Mechanism as _;
use nalgebra::DMatrix;

use super::balance::Resting;
use super::design::Design;
use super::drawn::slope;
use super::drive::Driven;
use super::evaluate::Problem;
use super::goals::Clearance;
use super::number::Number;
use super::path::STEP;
use crate::folding::Facets;
use crate::motion::Pose;

impl Problem<'_> {
    /// The clearance at rest, m.
    pub(super) fn clearance_at_rest(
        &self,
        of: &Clearance,
        x: &[f64],
        resting: &Resting,
    ) -> Result<Number, String> {
        self.clearance_at(of, x, &resting.q, &resting.follows)
    }

    /// The least clearance while a joint is turned, m.
    pub(super) fn clearance_on_the_way(
        &self,
        of: &Clearance,
        (joint, angles): (usize, [f64; 2]),
        design: &Design<'_>,
        x: &[f64],
    ) -> Result<Number, String> {
        let driven = Driven::new(&design.system, joint);
        let facets = Facets::new(self.drawn(&self.parameters(x))?.as_ref());
        let mut least = None;
        for state in driven.sweep(angles, STEP)? {
            let gap = gap(&facets, design, of, &state.q)?;
            if least.as_ref().is_none_or(|(known, _)| gap < *known) {
                least = Some((gap, state));
            }
        }
        let (_, state) = least.ok_or("the range of angles is empty")?;
        let follows = driven.follows(design, &state)?;
        self.clearance_at(of, x, &state.q, &follows)
    }

    /// The clearance at a state that follows the design.
    fn clearance_at(
        &self,
        of: &Clearance,
        x: &[f64],
        q: &[f64],
        follows: &DMatrix<f64>,
    ) -> Result<Number, String> {
        let at = |x: &[f64], q: &[f64]| {
            let facets = Facets::new(self.drawn(&self.parameters(x))?.as_ref());
            gap(&facets, &self.design(x), of, q)
        };
        let slope = slope(x, |moved, (variable, by)| {
            let follows = follows.column(variable);
            let along = q.iter().zip(&follows);
            at(moved, &along.map(|(q, follows)| q + by * follows).collect::<Vec<_>>())
        });
        Ok(Number { value: at(x, q)?, slope: slope? })
    }
}

/// The clearance in a state, m.
fn gap(facets: &Facets, design: &Design<'_>, of: &Clearance, q: &[f64]) -> Result<f64, String> {
    let poses = design.system.poses(&q.to_vec()).map_err(|error| error.to_string())?;
    let poses: Vec<Pose> = poses.iter().map(Pose::from).collect();
    facets.clearance(&poses, of.between).ok_or_else(|| "no two plates are apart".to_owned())
}
