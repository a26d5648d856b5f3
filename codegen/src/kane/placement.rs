//! Placements of the nodes: axes and origins of their frames along the tree.
//!
//! Let A be the rotation from the node's frame to the ancestor's frame, and p the node's origin in the
//! ancestor's frame:
//!
//! ```text
//! A = A_parent R        p = p_parent + A_parent r
//! ```

use super::binder::Binder;
use super::link::{Freedom, Link};
use super::vector::{Vector, add, zero};
use crate::program::Phase;
use crate::symbolic::Expr;

/// Axes and origin of a node's frame relative to an ancestor, in the ancestor's components.
#[derive(Clone)]
pub struct Placement {
    /// The x, y and z axes.
    pub axes: [Vector; 3],
    /// The origin, m.
    pub origin: Vector,
}

impl Placement {
    /// Returns the placement of the ancestor relative to itself.
    pub fn identity() -> Self {
        let unit = |i: usize, j: usize| if i == j { Expr::one() } else { Expr::zero() };
        Self { axes: [0, 1, 2].map(|i| [0, 1, 2].map(|j| unit(i, j))), origin: zero() }
    }

    /// Derives the placement of a node from the placement of its parent.
    pub fn new(binder: &mut Binder, link: &Link, parent: &Self) -> Self {
        if let Freedom::Free(free) = &link.freedom {
            let origin = free.origin();
            let origin = binder.vector(link.node, Phase::Placement, "origin", origin);
            return Self { axes: free.axes.clone(), origin };
        }
        let (line_turn, joint_turn) = link.turns();
        let turned = |turn: &super::turn::Turn, x: &Vector, y: &Vector| {
            let pairs = [0, 1, 2].map(|i| turn.back(&x[i], &y[i]));
            [0, 1].map(|k| [0, 1, 2].map(|i: usize| pairs[i][k].clone()))
        };
        let node = link.node;
        let [x, y] = turned(line_turn, &parent.axes[0], &parent.axes[1]);
        let y = binder.vector(node, Phase::Placement, "axis_y_on_hinge", y);
        let [y, z] = turned(joint_turn, &y, &parent.axes[2]);
        let axes = [("axis_x", x), ("axis_y", y), ("axis_z", z)]
            .map(|(name, axis)| binder.vector(node, Phase::Placement, name, axis));
        let origin = parent.place(&link.offset);
        let origin = binder.vector(node, Phase::Placement, "origin", origin);
        Self { axes, origin }
    }

    /// Returns the components in the ancestor's frame of a vector given in the node's frame.
    pub fn turn(&self, v: &Vector) -> Vector {
        std::array::from_fn(|i| {
            let along = |k: usize| &self.axes[k][i] * &v[k];
            &(&along(0) + &along(1)) + &along(2)
        })
    }

    /// Returns the position in the ancestor's frame of a point given in the node's frame.
    pub fn place(&self, point: &Vector) -> Vector {
        add(&self.origin, &self.turn(point))
    }
}
