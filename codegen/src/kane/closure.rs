//! Phase 7, closure: V2 - V1 = 0 for three points of every cut body (paper, eq. 9-11, as vectors:
//! the Jacobian of their squared length vanishes where it is satisfied).
//!
//! ```text
//! residual = P_ghost - P_original          nine numbers per loop
//! J du/dt  = -gamma                        the same, differentiated twice
//! ```
//!
//! All quantities are relative to the nearest common ancestor of ghost and original, whose own motion
//! cancels. The rows of J are components along directions that are fixed to the cut body: each side is
//! written in its own copy of the frame, and both copies coincide if the loop is closed.

use crate::program::{Phase, Section};
use nalgebra::Vector3;

use super::binder::Binder;
use super::frame::Drawing;
use super::kinematics::{Kinematics, LoopKinematics, Side};
use super::vector::{Vector, cross, dot, sub, zero};
use super::wrench::Wrench;
use crate::laminate::Number;
use crate::symbolic::Expr;
use crate::topology::{Loop, LoopId, NodeId};

/// The closure of every loop; see [`Equations`](super::Equations) for shapes.
#[derive(Default)]
pub struct Closure {
    pub jacobian: Vec<Expr>,
    pub gamma: Vec<Expr>,
    pub row_velocity: Vec<Expr>,
    pub row_residual: Vec<Expr>,
    pub residual: Vec<Expr>,
    pub residual_jacobian: Vec<Expr>,
    rows: Vec<Row>,
}

/// A row of J: the relative velocity of a point of the cut body along a direction fixed to it.
pub struct Row {
    pub closed: LoopId,
    pub ghost: RowSide,
    pub original: RowSide,
}

/// One side of a row: the row's direction and point on one of the two copies of the cut body, in the
/// frame of that copy.
pub struct RowSide {
    pub direction: Vector,
    /// Position of the point, m.
    pub arm: Vector,
}

impl RowSide {
    /// Returns the wrench of a force of `sign` (1 or -1) along the direction, at the point.
    pub fn unit_wrench(&self, sign: f64) -> Wrench {
        let wrench = Wrench::at(&self.arm, self.direction.clone());
        if sign < 0.0 { wrench.opposite() } else { wrench }
    }
}

impl Row {
    /// Returns both sides, ghost first, in the same order as [`LoopKinematics::sides`].
    pub fn sides(&self) -> [&RowSide; 2] {
        [&self.ghost, &self.original]
    }
}

/// Name of the points at which a loop closes.
const CLOSURE_POINT: &str = "closure_point";

impl Closure {
    /// Derives the closure of every loop.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics) -> Self {
        let mut closure = Self::default();
        for (index, closed) in binder.topology().loops.iter().enumerate() {
            let id = LoopId(index);
            let first = closure.rows.len();
            closure.acceleration_rows(binder, kinematics, id, closed);
            let gaps = closure.residuals(binder, kinematics, id, closed);
            closure.row_residuals(binder, kinematics, id, closed, first, &gaps);
        }
        closure
    }

    /// Returns the rows of J of all loops, in order.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }

    /// Returns the rows of J of one loop, with their indices among all rows.
    pub fn rows_of(&self, id: LoopId) -> impl Iterator<Item = (usize, &Row)> {
        self.rows.iter().enumerate().filter(move |(_, row)| row.closed == id)
    }

    /// Derives the rows of J and gamma: V_ghost - V_original and its acceleration at du/dt = 0.
    fn acceleration_rows(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        id: LoopId,
        closed: &Loop,
    ) {
        let speeds = binder.mechanism().speeds();
        let (points, frame) = drawing(binder).closure(closed);
        for (number, row) in closed.rows.iter().enumerate() {
            let point = &points[row.point];
            let along = frame.column(row.axis).into_owned();
            let [ghost, original] = [closed.ghost, closed.original].map(|tip| {
                let link = kinematics.link(tip);
                let direction = link.direction(binder, "closure_direction", &along);
                RowSide { direction, arm: link.point(binder, CLOSURE_POINT, point) }
            });
            let of = |node: NodeId, RowSide { direction, arm }: &RowSide| {
                let motion = kinematics.on_loop(kinematics.closed(id), node).motion;
                [motion.velocity_at(arm), motion.acceleration_at(arm)].map(|v| dot(direction, &v))
            };
            let [velocity, gamma] = of(closed.ghost, &ghost);
            let [carried, bias] = of(closed.original, &original);
            let (velocity, gamma) = (&velocity - &carried, &gamma - &bias);
            for speed in 0..speeds {
                let joint = closed.joints.iter().find(|joint| joint.index() == speed);
                let entry = joint.map(|joint| binder.by_speed(&velocity, *joint));
                let entry = entry.unwrap_or_else(Expr::zero);
                let name = binder.speed_name(speed);
                let name = format!("jacobian_loop{}_{number}_{name}", id.index());
                let section = Section::closure(id, Phase::ClosureJacobian);
                self.jacobian.push(binder.bind(section, name, entry));
            }
            let name = format!("gamma_loop{}_{number}", id.index());
            self.gamma.push(binder.bind(Section::closure(id, Phase::ClosureBias), name, gamma));
            self.row_velocity.push(velocity);
            self.rows.push(Row { closed: id, ghost, original });
        }
    }

    /// Derives all nine residuals and their Jacobian, and returns the residuals by point.
    fn residuals(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        id: LoopId,
        closed: &Loop,
    ) -> Vec<Vector> {
        let sides = kinematics.closed(id);
        let mut gaps = Vec::new();
        let (points, _) = drawing(binder).closure(closed);
        for (number, flat) in points.iter().enumerate() {
            let name = |side: &str| format!("point{number}_{side}");
            let mut point =
                |side: &Side, name: String| point(binder, kinematics, sides, side, flat, &name);
            let ghost = point(&sides.ghost, name("ghost"));
            let original = point(&sides.original, name("original"));
            let gap = sub(&ghost, &original);
            gaps.push(gap.clone());
            self.residual.extend(gap);
            let mut columns = vec![zero(); binder.mechanism().speeds()];
            for ((side, sign), at) in sides.sides().into_iter().zip([ghost, original]) {
                for (node, moved) in moved(binder, kinematics, id, side, &at, number) {
                    // The sides of a loop have hinges only.
                    for speed in kinematics.link(node).speeds() {
                        let moved = moved.clone();
                        columns[speed] = if sign < 0.0 { moved.map(|x| -&x) } else { moved };
                    }
                }
            }
            for row in 0..3 {
                self.residual_jacobian.extend(columns.iter().map(|column| column[row].clone()));
            }
        }
        gaps
    }

    /// Derives the residuals along the rows of J. `first` is the index of the first row of this loop.
    fn row_residuals(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        id: LoopId,
        closed: &Loop,
        first: usize,
        gaps: &[Vector],
    ) {
        let placement = kinematics.on_loop(kinematics.closed(id), closed.ghost).placement;
        for (number, row) in closed.rows.iter().enumerate() {
            let along = placement.turn(&self.rows[first + number].ghost.direction);
            let residual = dot(&along, &gaps[row.point]);
            let name = format!("residual_loop{}_{number}", id.index());
            let section = Section::closure(id, Phase::ClosureResidual);
            self.row_residual.push(binder.bind(section, name, residual));
        }
    }
}

/// Returns the drawing, which says where loops close.
fn drawing<'a>(binder: &Binder<'a>) -> Drawing<'a> {
    Drawing { topology: binder.topology(), geometry: binder.geometry() }
}

/// Binds the position of a point of a tip relative to the common ancestor.
fn point(
    binder: &mut Binder,
    kinematics: &Kinematics,
    closed: &LoopKinematics,
    side: &Side,
    flat: &Vector3<Number>,
    name: &str,
) -> Vector {
    let arm = kinematics.link(side.tip).point(binder, CLOSURE_POINT, flat);
    let position = kinematics.on_loop(closed, side.tip).placement.place(&arm);
    if side.path.is_empty() {
        return position;
    }
    binder.vector(side.tip, Phase::ClosurePoint, name, position)
}

/// Returns the velocity of the point at `at` per unit speed of each hinge on a side:
/// e_x x (P - origin of the hinge).
fn moved(
    binder: &mut Binder,
    kinematics: &Kinematics,
    id: LoopId,
    side: &Side,
    at: &Vector,
    number: usize,
) -> Vec<(NodeId, Vector)> {
    let name = format!("arm_loop{}_{number}", id.index());
    let nodes = side.path.iter().rev();
    nodes
        .map(|&node| {
            let hinge = kinematics.on_loop(kinematics.closed(id), node).placement;
            let arm = sub(at, &hinge.origin);
            let arm = binder.vector(node, Phase::ResidualJacobian, &name, arm);
            (node, cross(&hinge.axes[0], &arm))
        })
        .collect()
}
