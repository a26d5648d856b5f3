//! Changes of frame of tensors, from a node's frame to its parent's: about x by the joint's angle,
//! then about z by the constant angle between the hinge lines.
//!
//! A turn leaves of a 2 x 2 block its trace and its antisymmetric part as they are, which halves
//! the multiplications:
//!
//! ```text
//! w = s (m11 - m22) + c (m12 + m21)
//! m11' = m11 - s w   m12' = c w - m21   m21' = c w - m12   m22' = m22 + s w
//! ```

use super::derivation::Derivation;
use super::section::Phase;
use super::vector::{Tensor, Vector};
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// Cosine and sine of a turn.
struct Turn {
    cos: Expr,
    sin: Expr,
}

impl Turn {
    /// Components of a vector in the plane of the turn.
    fn vector(&self, x: &Expr, y: &Expr) -> [Expr; 2] {
        [&(&self.cos * x) - &(&self.sin * y), &(&self.sin * x) + &(&self.cos * y)]
    }
}

impl Derivation<'_> {
    /// About x by the joint's angle.
    fn joint_turn(&self, node: NodeId) -> Turn {
        let [sin, cos] = self.sin_cos[self.joint_of(node)].clone();
        Turn { cos, sin }
    }

    /// About z by the angle between the hinge lines.
    fn hinge_turn(&mut self, node: NodeId) -> Turn {
        let [cos, sin] = self.turn(node);
        let [cos, sin] = self.constants([cos, sin]);
        Turn { cos, sin }
    }

    /// The 2 x 2 block m11, m12, m21, m22 in the plane of the turn.
    fn turn_block(&mut self, node: NodeId, phase: Phase, turn: &Turn, m: [&Expr; 4]) -> [Expr; 4] {
        let [m11, m12, m21, m22] = m;
        let w = &(&turn.sin * &(m11 - m22)) + &(&turn.cos * &(m12 + m21));
        let w = self.bind_scalar(node, phase, "twist", w);
        let bend = self.bind_scalar(node, phase, "bend", &turn.sin * &w);
        let shear = self.bind_scalar(node, phase, "shear", &turn.cos * &w);
        [m11 - &bend, &shear - m21, &shear - m12, m22 + &bend]
    }

    /// Changes a symmetric tensor's components from the node's frame to the parent's.
    pub fn turn_tensor(&mut self, node: NodeId, phase: Phase, tensor: &Tensor) -> Tensor {
        let [xx, xy, xz, yy, yz, zz] = tensor;
        let turn = self.joint_turn(node);
        let [xy, xz] = turn.vector(xy, xz);
        let [yy, yz, _, zz] = self.turn_block(node, phase, &turn, [yy, yz, yz, zz]);
        let [xy, xz, yy, yz] = [("xy", xy), ("xz", xz), ("yy", yy), ("yz", yz)]
            .map(|(axes, value)| self.bind_scalar(node, phase, &format!("turned_{axes}"), value));
        let turn = self.hinge_turn(node);
        let [xz, yz] = turn.vector(&xz, &yz);
        let [xx, xy, _, yy] = self.turn_block(node, phase, &turn, [xx, &xy, &xy, &yy]);
        [xx, xy, xz, yy, yz, zz]
    }

    /// Changes the components of any tensor, rows, from the node's frame to the parent's.
    pub fn turn_matrix(&mut self, node: NodeId, phase: Phase, rows: &[Vector; 3]) -> [Vector; 3] {
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = rows;
        let turn = self.joint_turn(node);
        let ([xy, xz], [yx, zx]) = (turn.vector(xy, xz), turn.vector(yx, zx));
        let [yy, yz, zy, zz] = self.turn_block(node, phase, &turn, [yy, yz, zy, zz]);
        let about_x = [[xx.clone(), xy, xz], [yx, yy, yz], [zx, zy, zz]];
        let [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] =
            about_x.map(|row| self.bind_vector(node, phase, "turned", row));
        let turn = self.hinge_turn(node);
        let ([xz, yz], [zx, zy]) = (turn.vector(&xz, &yz), turn.vector(&zx, &zy));
        let [xx, xy, yx, yy] = self.turn_block(node, phase, &turn, [&xx, &xy, &yx, &yy]);
        [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]]
    }

    /// Names the components of a symmetric tensor of a node.
    pub fn bind_tensor(
        &mut self,
        node: NodeId,
        phase: Phase,
        name: &str,
        tensor: Tensor,
    ) -> Tensor {
        let mut axes = ["xx", "xy", "xz", "yy", "yz", "zz"].into_iter();
        tensor.map(|component| {
            let axis = axes.next().unwrap_or_default();
            self.bind_scalar(node, phase, &format!("{name}_{axis}"), component)
        })
    }
}
