//! The elimination of a free body: its articulated inertia as a factor L^T D L of six rows.
//!
//! The rows are those of the accelerations alpha and a of the frame's origin, in the frame, the rotation first.
//! A row is eliminated from those after it:
//!
//! ```text
//! D_k = A_kk       W_kj = A_kj / D_k       A_ij - W_ki A_kj is left
//! y_k = b_k - sum over j < k of W_jk y_j       x_k = y_k / D_k - sum over j > k of W_kj x_j
//! ```

use super::binder::Binder;
use super::vector::{Tensor, Vector};
use crate::program::Phase;
use crate::source::free::SPEEDS;
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// The factor of a free body's articulated inertia.
pub struct EliminatedBody {
    /// W above its diagonal, by rows.
    rows: [Vec<Expr>; SPEEDS],
    /// 1 / D.
    pub inverse_pivots: [Expr; SPEEDS],
}

/// Returns the place among the body's speeds, velocity first, at which a row's results stand.
pub fn place(row: usize) -> usize {
    (row + SPEEDS / 2) % SPEEDS
}

const NAMES: [&str; SPEEDS] = ["wx", "wy", "wz", "vx", "vy", "vz"];

impl EliminatedBody {
    /// Factors the inertia I, H, M.
    pub fn new(
        binder: &mut Binder,
        node: NodeId,
        inertia: &Tensor,
        coupling: &[Vector; 3],
        mass: &Tensor,
    ) -> Self {
        const ENTRY: [[usize; 3]; 3] = [[0, 1, 2], [1, 3, 4], [2, 4, 5]];
        let phase = Phase::FreeElimination;
        let mut a: [[Expr; SPEEDS]; SPEEDS] = std::array::from_fn(|i| {
            std::array::from_fn(|j| match (i, j) {
                (0..3, 0..3) => inertia[ENTRY[i][j]].clone(),
                (0..3, _) => coupling[i][j - 3].clone(),
                (_, 0..3) => coupling[j][i - 3].clone(),
                _ => mass[ENTRY[i - 3][j - 3]].clone(),
            })
        });
        let mut rows: [Vec<Expr>; SPEEDS] = Default::default();
        let inverse_pivots = std::array::from_fn(|k| {
            let name = format!("inverse_pivot_{}", NAMES[k]);
            let inverse = binder.scalar(node, phase, &name, a[k][k].power(-1));
            for j in k + 1..SPEEDS {
                let name = format!("row_{}_{}", NAMES[k], NAMES[j]);
                let factor = binder.scalar(node, phase, &name, &a[k][j] * &inverse);
                rows[k].push(factor.clone());
                for i in k + 1..=j {
                    let name = format!("left_{}_{}_{}", NAMES[k], NAMES[i], NAMES[j]);
                    let left = &a[i][j] - &(&factor * &a[k][i]);
                    a[i][j] = binder.scalar(node, phase, &name, left);
                }
            }
            inverse
        });
        Self { rows, inverse_pivots }
    }

    /// Returns y of b: the moment, then the force.
    pub fn reduce(
        &self,
        binder: &mut Binder,
        node: NodeId,
        phase: Phase,
        name: &str,
        mut b: [Expr; SPEEDS],
    ) -> [Expr; SPEEDS] {
        for k in 0..SPEEDS {
            let name = format!("{name}_{}", NAMES[k]);
            b[k] = binder.scalar(node, phase, &name, b[k].clone());
            for (ahead, factor) in self.rows[k].iter().enumerate() {
                let j = k + 1 + ahead;
                b[j] = &b[j] - &(factor * &b[k]);
            }
        }
        b
    }

    /// Returns the accelerations alpha and a of y / D.
    pub fn substitute(
        &self,
        binder: &mut Binder,
        node: NodeId,
        phase: Phase,
        mut x: [Expr; SPEEDS],
    ) -> [Vector; 2] {
        for k in (0..SPEEDS).rev() {
            for (ahead, factor) in self.rows[k].iter().enumerate() {
                x[k] = &x[k] - &(factor * &x[k + 1 + ahead]);
            }
            x[k] = binder.scalar(node, phase, &format!("own_{}", NAMES[k]), x[k].clone());
        }
        let [wx, wy, wz, vx, vy, vz] = x;
        [[wx, wy, wz], [vx, vy, vz]]
    }
}
