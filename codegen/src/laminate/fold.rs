//! The angles at which joints start: those of `initial.q`, and for other joints the share
//! `initial.fold` of their finished fold, as far as their limits allow.

use crate::source::codes;
use crate::source::{Diagnostic, Diagnostics, Joint, SourceModel};

/// Returns the guess of the initial angle of each joint, rad. A share of a fold that no joint has is
/// reported.
pub fn initial_angles(model: &SourceModel, found: &mut Diagnostics) -> Vec<f64> {
    let share = model.initial_fold.as_ref().map_or(0.0, |share| share.value);
    let mut angles: Vec<f64> = model.joints.iter().map(|joint| folded(joint, share)).collect();
    for (joint, angle) in &model.initial_q {
        angles[joint.index()] = *angle;
    }
    if let Some(share) = &model.initial_fold
        && model.joints.iter().all(|joint| joint.fold.is_none())
    {
        let message = "no joint has a `fold` of which this is a share";
        found.push(
            Diagnostic::error(codes::NO_FOLD, share.span, message)
                .hint("give the joints that fold an angle, as in `fold: -180 deg` for a mountain"),
        );
    }
    angles
}

/// Returns this share of a joint's fold, within its limits, rad.
fn folded(joint: &Joint, share: f64) -> f64 {
    let angle = joint.fold.as_ref().map_or(0.0, |fold| share * fold.value);
    match &joint.limits {
        // A joint without a fold starts flat, also beside its limits, where a guess may be.
        Some(limits) if joint.fold.is_some() => angle.max(limits.value[0]).min(limits.value[1]),
        _ => angle,
    }
}
