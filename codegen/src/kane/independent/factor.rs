//! The factor L D L^T of a symmetric matrix.

use super::{Groups, folded};
use crate::kane::binder::Binder;
use crate::program::{Phase, Section, Subject};
use crate::symbolic::{Expr, Function};

/// L and 1 / D.
pub struct Factor {
    /// L below its diagonal, by rows.
    lower: Vec<Vec<Expr>>,
    inverse_pivots: Vec<Expr>,
}

impl Factor {
    /// Factors a matrix given by its entries on and below the diagonal.
    pub fn new(binder: &mut Binder, mut entries: Vec<Vec<Expr>>) -> Self {
        let section = Section::mechanism(Phase::IndependentInertia);
        let d = entries.len();
        let mut lower = vec![vec![Expr::zero(); d]; d];
        let mut inverse_pivots = Vec::with_capacity(d);
        for k in 0..d {
            for row in k..d {
                let mut sum = entries[row][k].clone();
                for earlier in 0..k {
                    // lower holds L D until the column is divided.
                    sum = &sum - &(&lower[row][earlier] * &entries[k][earlier]);
                }
                entries[row][k] = binder.bind(section, format!("inertia_{row}_{k}"), sum);
            }
            let inverse = entries[k][k].power(-1);
            let inverse = binder.bind(section, format!("inverse_inertia_{k}"), inverse);
            for row in k + 1..d {
                let value = &entries[row][k] * &inverse;
                lower[row][k] = binder.bind(section, format!("lower_{row}_{k}"), value);
            }
            inverse_pivots.push(inverse);
        }
        Self { lower, inverse_pivots }
    }

    /// Returns the least of 1 / D.
    pub fn least_inverse_pivot(&self, binder: &mut Binder) -> Expr {
        let pivots = Groups::from([(Subject::Mechanism, self.inverse_pivots.clone())]);
        // Beside the pivots: a heading that waits for all of them would take their operands in as well.
        folded(binder, Phase::IndependentInertia, Function::Min, "inverse_inertia", pivots)
    }

    /// Returns the solution for b.
    pub fn solve(&self, binder: &mut Binder, mut b: Vec<Expr>, name: &str) -> Vec<Expr> {
        let section = Section::mechanism(Phase::IndependentAcceleration);
        let d = b.len();
        for k in 0..d {
            let terms = self.lower[k].iter().zip(&b[..k]).map(|(l, b)| l * b);
            let sum = terms.fold(b[k].clone(), |sum, term| &sum - &term);
            b[k] = binder.bind(section, format!("reduced_{name}_{k}"), sum);
        }
        for k in (0..d).rev() {
            let later = self.lower.iter().zip(&b).skip(k + 1).map(|(row, b)| &row[k] * b);
            let sum = later.fold(&self.inverse_pivots[k] * &b[k], |sum, term| &sum - &term);
            b[k] = binder.bind(section, format!("{name}_{k}"), sum);
        }
        b
    }
}
