//! What a closure force of 1 along a row of the closure does to the tree.

use super::binder::Binder;
use super::closure::{Closure, Row};
use super::kinematics::Kinematics;
use super::link::Link;
use super::wrench::{Wrench, accumulate};
use crate::program::Phase;
use crate::symbolic::Expr;

/// Returns the loads of a closure force of 1 along one row: on both tips, and, if their sum is not
/// zero, on the node at which the two sides meet.
pub fn row_loads(
    binder: &mut Binder,
    kinematics: &Kinematics,
    row: &Row,
    number: usize,
) -> Vec<Option<Wrench>> {
    let mut loads: Vec<Option<Wrench>> = vec![None; kinematics.links().len()];
    let closed = kinematics.closed(row.closed);
    let (name, phase) = (format!("unit_row{number}"), Phase::ClosureRowForce);
    for ((side, sign), row) in closed.sides().into_iter().zip(row.sides()) {
        if side.path.is_empty() {
            continue;
        }
        let load = row.unit_wrench(sign);
        if let Some(meeting) = closed.ancestor {
            let mut balance = load.clone();
            for &node in side.path.iter().rev() {
                balance = binder.wrench(node, phase, &name, balance);
                balance = kinematics.link(node).carry_wrench(binder, phase, &name, &balance);
            }
            accumulate(&mut loads[meeting.index()], balance.opposite());
        }
        loads[side.tip.index()] = Some(load);
    }
    loads
}

/// Returns the torques by speed of a closure force of 1 along a row of a loop of copies, and loads that
/// make the sweep begin at these nodes.
pub fn row_torques(
    kinematics: &Kinematics,
    closure: &Closure,
    number: usize,
    speeds: usize,
) -> (Vec<Expr>, Vec<Option<Wrench>>) {
    let torques = closure.jacobian[number * speeds..][..speeds].to_vec();
    let begins = |link: &Link| {
        let acts = link.speeds().any(|speed| !torques[speed].is_zero());
        acts.then(Wrench::zero)
    };
    let loads = kinematics.links().iter().map(begins).collect();
    (torques, loads)
}
