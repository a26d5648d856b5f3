//! Elementary turns, and changes of frame for tensors from a node's frame to its parent's: first about
//! x by the joint's angle, then about z by the constant angle between the hinge lines.
//!
//! A turn does not change the trace and the antisymmetric part of a 2 x 2 block, which halves the
//! number of multiplications. With the cosine c and the sine s of the angle and the deviator d,
//!
//! ```text
//! d = s (m11 - m22) + c (m12 + m21)
//! m11' = m11 - s d   m12' = c d - m21   m21' = c d - m12   m22' = m22 + s d
//! ```

use super::binder::Binder;
use super::link::Link;
use super::vector::{Tensor, Vector};
use crate::program::Phase;
use crate::symbolic::Expr;

/// Cosine and sine of the angle of a turn.
#[derive(Clone)]
pub struct Turn {
    pub cos: Expr,
    pub sin: Expr,
}

impl Turn {
    /// Returns the components before the turn, in its plane, of a vector given after it.
    pub fn back(&self, x: &Expr, y: &Expr) -> [Expr; 2] {
        [&(&self.cos * x) + &(&self.sin * y), &(&self.cos * y) - &(&self.sin * x)]
    }

    /// Returns the components after the turn, in its plane, of a vector given before it.
    pub fn forth(&self, x: &Expr, y: &Expr) -> [Expr; 2] {
        [&(&self.cos * x) - &(&self.sin * y), &(&self.sin * x) + &(&self.cos * y)]
    }
}

/// Binds the intermediates of the two turns of one tensor.
struct TensorTurn<'b, 'a> {
    binder: &'b mut Binder<'a>,
    link: &'b Link,
    phase: Phase,
    /// Name of the tensor.
    name: &'b str,
}

impl TensorTurn<'_, '_> {
    /// Turns the 2 x 2 block m11, m12, m21, m22 in the plane of a turn, which is the turn about the
    /// `joint` or about the `hinge`.
    fn block(&mut self, which: &str, turn: &Turn, m: [&Expr; 4]) -> [Expr; 4] {
        let [m11, m12, m21, m22] = m;
        let d = &(&turn.sin * &(m11 - m22)) + &(&turn.cos * &(m12 + m21));
        let d = self.bind(which, "deviator", d);
        let normal = self.bind(which, "deviator_sin", &turn.sin * &d);
        let shear = self.bind(which, "deviator_cos", &turn.cos * &d);
        [m11 - &normal, &shear - m21, &shear - m12, m22 + &normal]
    }

    fn bind(&mut self, which: &str, part: &str, value: Expr) -> Expr {
        let name = format!("{}_{which}_{part}", self.name);
        self.binder.scalar(self.link.node, self.phase, &name, value)
    }
}

impl Link {
    /// Returns R T R^T: the components of a symmetric tensor in the parent's frame.
    pub fn turn_tensor(
        &self,
        binder: &mut Binder,
        phase: Phase,
        name: &str,
        tensor: &Tensor,
    ) -> Tensor {
        let mut turning = TensorTurn { binder, link: self, phase, name };
        let [xx, xy, xz, yy, yz, zz] = tensor;
        let (line_turn, turn) = self.turns();
        let [xy, xz] = turn.forth(xy, xz);
        let [yy, yz, _, zz] = turning.block("joint", turn, [yy, yz, yz, zz]);
        let axes = ["xy", "xz", "yy", "yz"];
        let values = [xy, xz, yy, yz];
        let name = format!("{name}_on_hinge");
        let [xy, xz, yy, yz] = turning.binder.components(self.node, phase, &name, axes, values);
        let turn = line_turn;
        let [xz, yz] = turn.forth(&xz, &yz);
        let [xx, xy, _, yy] = turning.block("hinge", turn, [xx, &xy, &xy, &yy]);
        [xx, xy, xz, yy, yz, zz]
    }

    /// Returns R T R^T: the components of any tensor in the parent's frame, by rows.
    pub fn turn_matrix(
        &self,
        binder: &mut Binder,
        phase: Phase,
        name: &str,
        rows: &[Vector; 3],
    ) -> [Vector; 3] {
        let mut turning = TensorTurn { binder, link: self, phase, name };
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = rows;
        let (line_turn, turn) = self.turns();
        let ([xy, xz], [yx, zx]) = (turn.forth(xy, xz), turn.forth(yx, zx));
        let [yy, yz, zy, zz] = turning.block("joint", turn, [yy, yz, zy, zz]);
        let about_x = [[xx.clone(), xy, xz], [yx, yy, yz], [zx, zy, zz]];
        let name = format!("{name}_on_hinge");
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] =
            turning.binder.matrix(self.node, phase, &name, about_x);
        let turn = line_turn;
        let ([xz, yz], [zx, zy]) = (turn.forth(&xz, &yz), turn.forth(&zx, &zy));
        let [xx, xy, yx, yy] = turning.block("hinge", turn, [&xx, &xy, &yx, &yy]);
        [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]
    }
}
