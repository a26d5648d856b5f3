//! Numbers at a time of the motion from the initial state, with derivatives by the variables: the discrete adjoint.
//!
//! The steps are as short as the error needs, and their number may change from design to design. What that changes is within
//! the tolerance.

use lamc::pipeline::Compiled;
use lamc_runtime::{Mechanism as _, State};
use nalgebra::RowDVector;

use super::design::Design;
use super::goals::{Moving, OfState};
use super::number::Number;
use crate::adjoint::{Course, Differentiated, Method, Sample, Schedule, Slopes, Undifferentiable};
use crate::simulation::{Asked, describe, start};

/// The error of angles (rad) and speeds (rad/s) at that time.
pub const TOLERANCE: f64 = 1e-8;

/// The state from which the motion begins; its speeds are those that are asked for, so that their dependence on the design
/// counts when they are projected.
///
/// # Errors
/// The mechanism does not assemble; the text says so.
pub fn begin(compiled: &Compiled, differentiated: &Differentiated) -> Result<Sample, String> {
    let asked = Asked::of(&differentiated.system, &[]);
    let State { t, q, .. } = start(&compiled.topology, &differentiated.system, &asked, |_| ())?;
    Ok(State { t, q, u: asked.state.u })
}

/// The motion to these times within the tolerance.
///
/// # Errors
/// The motion has no derivatives; the text says so.
pub fn accurate(
    differentiated: &Differentiated,
    begin: &Sample,
    samples: &[f64],
) -> Result<Course, String> {
    let run = |method| {
        let schedule = Schedule { method, samples, steps: 1, inputs: &[] };
        Course::accurate(differentiated, begin, schedule, TOLERANCE)
    };
    let course = match run(Method::Rk4) {
        // Another method comes to the same stop.
        Err(reason) if !matches!(reason, Undifferentiable::Stop { .. }) => run(Method::Rodas),
        other => other,
    };
    course.map_err(|reason| reason.describe(differentiated.system.interface()))
}

/// The number at a time.
///
/// # Errors
/// The mechanism does not assemble, or the motion has no derivatives; the text says so.
pub fn at(
    compiled: &Compiled,
    differentiated: &Differentiated,
    design: &Design<'_>,
    Moving { of, at }: Moving,
) -> Result<Number, String> {
    let system = &differentiated.system;
    let interface = system.interface();
    let begin = begin(compiled, differentiated)?;
    let course = accurate(differentiated, &begin, &[begin.t + at])?;
    let end = &course.samples[1];
    let failure = |error| describe(&error, interface);
    let mut slopes = Slopes::default();
    let value = match of {
        OfState::Angle(joint) => {
            let mut ends = vec![0.0; end.q.len() + end.u.len()];
            ends[joint] = 1.0;
            slopes.states = vec![vec![0.0; ends.len()], ends];
            end.q[joint]
        }
        OfState::Position { point, axis } => {
            let mut ends = vec![0.0; 3 * interface.points.len()];
            ends[3 * point + axis] = 1.0;
            slopes.points = vec![vec![0.0; ends.len()], ends];
            system.points(&end.q).map_err(failure)?[point][axis]
        }
        OfState::Energy(which) => {
            let mut ends = [0.0; 2];
            ends[which] = 1.0;
            slopes.energies = vec![[0.0; 2], ends];
            let energy = system.energy(end.t, &end.q, &end.u).map_err(failure)?;
            [energy.kinetic, energy.potential][which]
        }
    };
    let asked = Asked::of(system, &[]);
    let gradient = course
        .pull(&[slopes])
        .and_then(|gradients| {
            differentiated.assembled(&course.samples[0], &asked.pinned, &gradients[0])
        })
        .map_err(|reason| reason.describe(interface))?;
    let slope =
        design.widths().iter().map(|(parameter, width)| gradient.parameters[*parameter] * width);
    Ok(Number { value, slope: RowDVector::from_iterator(design.variables(), slope) })
}
