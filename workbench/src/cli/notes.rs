//! Warnings about motions that the model allows but the robot does not.

use std::f64::consts::PI;

use lamc::laminate::Mechanism;
use lamc_workbench::motion::{Motion, Sample};

/// Excess over an angle below which it is a rounding error, rad.
const ROUNDING: f64 = 1e-9;

/// Joints that were driven beyond their limits, and those that turned past half a turn, where plates
/// of one hinge would meet.
pub fn transgressions(mechanism: &Mechanism, motion: &Motion) -> Vec<String> {
    let mut notes = Vec::new();
    for (index, joint) in mechanism.joints.iter().enumerate() {
        let name = &joint.name;
        let first = |is_beyond: &dyn Fn(f64) -> bool| -> Option<&Sample> {
            motion.samples.iter().find(|sample| is_beyond(sample.q[index]))
        };
        let [low, high] = joint.limits;
        let is_outside = |q: f64| q < low - ROUNDING || q > high + ROUNDING;
        if let Some(sample) = first(&is_outside).filter(|_| joint.drive.is_some()) {
            let [low, high, q] = [low, high, sample.q[index]].map(f64::to_degrees);
            notes.push(format!(
                "`{name}` is driven beyond its limits: to {q:.3} deg at t = {:.3} s, where {low:.3} .. \
                 {high:.3} deg are allowed",
                sample.t
            ));
        }
        if let Some(sample) = first(&|q: f64| q.abs() > PI + ROUNDING) {
            notes.push(format!(
                "`{name}` is turned past 180 deg at t = {:.3} s: plates stop each other only at points \
                 of `contacts`, and a joint only at its `limits`",
                sample.t
            ));
        }
    }
    notes
}
