//! Warnings about how a mechanism moves.

use nalgebra::DVector;

use super::Loop;
use super::closure::Closure;
use super::mobility::FLAT;
use crate::laminate::Mechanism;
use crate::source::codes;
use crate::source::{Diagnostic, JointId};

/// Warns of more prescribed joints than degrees of freedom. Those that hold infinitesimal motions do not count.
pub fn overdriven(
    mechanism: &Mechanism,
    mobility: usize,
    infinitesimal: &[JointId],
) -> Option<Diagnostic> {
    let joints = mechanism.joints.iter().enumerate();
    let moving = joints.filter(|(index, _)| !infinitesimal.contains(&JointId(*index)));
    let driven: Vec<_> =
        moving.map(|(_, joint)| joint).filter(|joint| joint.drive.is_some()).collect();
    let last = driven.last().filter(|_| driven.len() > mobility)?;
    let names: Vec<_> = driven.iter().map(|joint| format!("`{}`", joint.name)).collect();
    let message = format!(
        "{} are driven, but the mechanism has only {mobility} {}",
        names.join(", "),
        if mobility == 1 { "degree of freedom" } else { "degrees of freedom" }
    );
    Some(Diagnostic::warning(codes::OVERDRIVEN, last.span, message).hint(
        "unless the prescribed angles agree with the loops at all times, no motion is \
             possible",
    ))
}

/// Warns of loops that move alone but not together.
pub fn jointly_immobile(
    mechanism: &Mechanism,
    loops: &[Loop],
    group: &[usize],
    closure: &Closure,
    rank: usize,
) -> Diagnostic {
    let hinge = |index: usize| &mechanism.joints[loops[index].joint.index()];
    let names: Vec<_> = group.iter().map(|index| format!("`{}`", hinge(*index).name)).collect();
    let message = format!(
        "the loops closed by {} lock each other: their {} hinges cannot move ({rank} independent \
         equations)",
        names.join(", "),
        closure.joints.len()
    );
    Diagnostic::warning(codes::IMMOBILE, hinge(group[0]).span, message).hint(
        "remove a joint, or split bodies by further hinges, for instance all facets into triangles",
    )
}

/// Warns of joints that are stuck although their loops move.
pub fn stretched(mechanism: &Mechanism, stuck: &[JointId]) -> Diagnostic {
    let joints = || stuck.iter().map(|joint| &mechanism.joints[joint.index()]);
    let names: Vec<_> = joints().map(|joint| format!("`{}`", joint.name)).collect();
    let message = format!(
        "{} cannot turn, though the equations of their loops allow small motions, which do not exist",
        names.join(", ")
    );
    let span = joints().next().map(|joint| joint.span).unwrap_or_default();
    Diagnostic::warning(codes::IMMOBILE, span, message).hint(
        "hold them with `drive: 0`, or join their bodies; creases that end at a straight edge of a plate are \
         stretched between its two ends",
    )
}

/// Warns of hinges that do not turn in the motion that was found from the flat state, although they are not `stuck`: other
/// motions may fold them.
pub fn flat(
    mechanism: &Mechanism,
    closure: &Closure,
    angles: &DVector<f64>,
    stuck: &[usize],
) -> Option<Diagnostic> {
    let joints = closure.joints.iter().zip(angles).enumerate();
    let is_free = |column: usize| !closure.is_driven(column) && !stuck.contains(&column);
    let free: Vec<_> = joints.filter(|(column, _)| is_free(*column)).collect();
    let flat = free.iter().filter(|(_, (_, angle))| angle.abs() <= FLAT);
    let flat: Vec<&JointId> = flat.map(|(_, (joint, _))| *joint).collect();
    let first = &mechanism.joints[flat.first()?.index()];
    let message = format!(
        "{} of {} hinges stay flat in the motion that was found from the flat state",
        flat.len(),
        free.len()
    );
    let warning = Diagnostic::warning(codes::FLAT_HINGES, first.span, message).label("stays flat");
    let hint = "other motions may fold them: `fold` of each hinge, or angles in `initial`, say which one is meant";
    Some(warning.hint(hint))
}

/// Warns of loops with infinitesimal motions at all states near the guess, without a joint that is stuck.
pub fn shaky(mechanism: &Mechanism, loops: &[Loop], group: &[usize]) -> Diagnostic {
    let closing = |index: &usize| &mechanism.joints[loops[*index].joint.index()];
    let names: Vec<_> = group.iter().map(|index| format!("`{}`", closing(index).name)).collect();
    let message = format!(
        "the equations of the loops closed by {} allow small motions, which do not exist, at all states near the \
         initial ones",
        names.join(", ")
    );
    let span = group.first().map(|index| closing(index).span).unwrap_or_default();
    Diagnostic::warning(codes::IMMOBILE, span, message).hint(
        "there, forces between the plates are not determined: a hinge less or more, or other proportions, make the \
         motion a definite one",
    )
}
