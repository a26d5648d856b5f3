//! How far a point or a joint moves while another joint is turned.

use nalgebra::RowDVector;

use super::design::Design;
use super::drive::{Closed, Driven};
use super::goals::{Moved, Stroke};
use super::number::{Number, length};
use super::path::STEP;

/// The stroke of a design: of a point the distance between its first and its last place, m; of a joint the difference of
/// its largest and its smallest angle, rad.
///
/// # Errors
/// The mechanism does not close in the whole range; the text says where.
pub fn stroke(stroke: &Stroke, design: &Design<'_>) -> Result<Number, String> {
    let driven = Driven::new(&design.system, stroke.drive);
    let states = driven.sweep(stroke.angles, STEP)?;
    match stroke.of {
        Moved::Point(point) => {
            let [Some(first), Some(last)] = [states.first(), states.last()] else {
                return Err("the range of angles is empty".to_owned());
            };
            let (from, moves_from) = design.point(point, &first.q, &driven.follows(design, first)?);
            let (to, moves_to) = design.point(point, &last.q, &driven.follows(design, last)?);
            let part = |axis: usize| Number {
                value: to[axis] - from[axis],
                slope: moves_to.row(axis) - moves_from.row(axis),
            };
            Ok(length(&[0, 1, 2].map(part)))
        }
        Moved::Joint(joint) => {
            let [top, bottom] =
                [1.0, -1.0].map(|sign| extreme(&driven, design, &states, joint, sign));
            let ((top, top_slope), (bottom, bottom_slope)) = (top?, bottom?);
            Ok(Number { value: top - bottom, slope: top_slope - bottom_slope })
        }
    }
}

/// The largest (sign 1) or smallest (-1) angle of a joint, with its derivatives: where the joint turns back, it does not
/// matter that the angle of the drive changes with the design.
fn extreme(
    driven: &Driven<'_>,
    design: &Design<'_>,
    states: &[Closed],
    joint: usize,
    sign: f64,
) -> Result<(f64, RowDVector<f64>), String> {
    let size = |index: &usize| sign * states[*index].q[joint];
    let farthest = (0..states.len()).max_by(|a, b| size(a).total_cmp(&size(b))).unwrap_or(0);
    let mut state = states[farthest].clone();
    let speed = |state: &Closed| {
        let tangent = driven.tangent(state).ok_or("the mechanism is in a singular state")?;
        Ok(tangent[(joint, 0)])
    };
    // The joint turns back on one side of the sample, unless that is an end of the range.
    for other in [farthest.wrapping_sub(1), farthest + 1] {
        let Some(beside) = states.get(other) else { continue };
        let found = driven.root([&states[farthest], beside], speed)?;
        if sign * found.q[joint] > sign * state.q[joint] {
            state = found;
        }
    }
    let follows = driven.follows(design, &state)?;
    Ok((state.q[joint], follows.row(joint).into_owned()))
}
