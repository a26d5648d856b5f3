//! What `lamc fold` says: how far the sheet folds, with which mobility, what passes through what, and what ends
//! the fold.

use std::fmt::Write;

use lamc::arithmetic::largest;
use lamc_workbench::folding::{End, Facets, Fold, Path, Stuck, Violation};
use lamc_workbench::motion::Motion;

/// Most vertices, joints or pairs that are listed one by one.
pub const LISTED: usize = 6;
/// A joint that is bent by a smaller part of its share is at the least angle of its side.
const HARDLY: f64 = 0.021;

/// Returns a summary.
pub fn summary(fold: &Fold, path: &Path, motion: &Motion) -> String {
    let mut text = String::new();
    let Some(last) = path.samples.last() else { return text };
    let mechanism = &fold.topology().mechanism;
    let loops = fold.topology().loops.len();
    let joints = mechanism.joints.len();
    let flat = fold.mobility_of_all(&path.samples[0].q);
    let _ = write!(text, "{joints} joints, {} with a fold, {loops} loops; ", fold.creases());
    let middle = &path.samples[path.samples.len() / 2].q;
    let _ = match path.samples.len() > 2 {
        true => writeln!(text, "mobility {flat} flat, {} folded", fold.mobility_of_all(middle)),
        false => writeln!(text, "mobility {flat} flat"),
    };
    if path.samples.len() > 2 {
        of_vertices(&mut text, fold, middle);
    }
    let _ = writeln!(
        text,
        "folded to {:.4} %: the angles have come {:.2} % of the way to the finished fold",
        100.0 * last.progress,
        100.0 * last.reached
    );
    if path.samples.len() > 1 {
        sides(&mut text, fold, &last.q, last.progress);
        extremes(&mut text, fold, &last.q);
    }
    for progress in path.slides.iter().take(LISTED) {
        let _ = writeln!(text, "at {:.2} % the sheet moves on by itself", 100.0 * progress);
    }
    crossings(&mut text, fold, motion);
    let open = largest(motion.samples.iter().map(|sample| &sample.closure));
    let _ = writeln!(text, "closure: within {open:.1e} m, size {:.1} mm", motion.size * 1e3);
    text
}

/// The mobility of each vertex alone, by its number of creases.
fn of_vertices(text: &mut String, fold: &Fold, q: &[f64]) {
    let mut kinds: Vec<(usize, usize, usize)> = Vec::new();
    for number in 0..fold.topology().loops.len() {
        let (creases, mobility) = (fold.loop_joints(number).len(), fold.mobility(q, &[number]));
        match kinds.iter_mut().find(|kind| (kind.0, kind.1) == (creases, mobility)) {
            Some(kind) => kind.2 += 1,
            None => kinds.push((creases, mobility, 1)),
        }
    }
    kinds.sort_unstable();
    for (creases, mobility, count) in kinds {
        let loops = if count == 1 { "loop" } else { "loops" };
        let _ = writeln!(text, "  {count} {loops} of {creases} joints: mobility {mobility} alone");
    }
}

/// The joints that are bent farthest, and farthest from their targets.
fn extremes(text: &mut String, fold: &Fold, q: &[f64]) {
    let joints = &fold.topology().mechanism.joints;
    let folds = (0..q.len()).filter(|joint| fold.targets()[*joint] != 0.0);
    let by = |of: &dyn Fn(usize) -> f64| folds.clone().max_by(|a, b| of(*a).total_cmp(&of(*b)));
    let short = |joint: usize| (fold.targets()[joint] - q[joint]).abs();
    for (what, joint) in
        [("most bent", by(&|joint| q[joint].abs())), ("farthest from its fold", by(&short))]
    {
        let Some(joint) = joint else { continue };
        let [angle, target] = [q[joint], fold.targets()[joint]].map(f64::to_degrees);
        let _ =
            writeln!(text, "{what}: `{}` at {angle:.3} deg of {target:.3} deg", joints[joint].name);
    }
}

/// Facets that pass through each other, with the progress at which they first do.
fn crossings(text: &mut String, fold: &Fold, motion: &Motion) {
    let facets = Facets::new(&fold.topology().mechanism);
    let mut found: Vec<([usize; 2], f64)> = Vec::new();
    for sample in &motion.samples {
        for pair in facets.crossing(&sample.poses) {
            if !found.iter().any(|(known, _)| *known == pair) {
                found.push((pair, sample.t));
            }
        }
    }
    if found.is_empty() {
        let _ = writeln!(text, "no facets pass through each other");
        return;
    }
    let pairs = if found.len() == 1 { "pair" } else { "pairs" };
    let _ = writeln!(text, "{} {pairs} of facets pass through each other:", found.len());
    for ([one, other], progress) in found.iter().take(LISTED) {
        let [one, other] = [one, other].map(|body| &motion.bodies[*body]);
        let _ = writeln!(text, "  `{one}` and `{other}` from {progress:.2} % on");
    }
    if found.len() > LISTED {
        let _ = writeln!(text, "  ..");
    }
}

/// The joints that bend to the other side than their fold, and those that hardly bend.
fn sides(text: &mut String, fold: &Fold, q: &[f64], progress: f64) {
    let share = |joint: usize| q[joint] / (progress * fold.targets()[joint]);
    let folds = (0..q.len()).filter(|joint| fold.targets()[*joint] != 0.0);
    let (wrong, right): (Vec<usize>, Vec<usize>) = folds.partition(|joint| share(*joint) < 0.0);
    if wrong.is_empty() {
        text.push_str("all joints bend to the side of their fold\n");
    } else {
        let _ = writeln!(text, "bent to the other side: {}", names(fold, &wrong));
    }
    let hardly = right.into_iter().filter(|joint| share(*joint) < HARDLY);
    let hardly: Vec<usize> = hardly.collect();
    if !hardly.is_empty() {
        let _ = writeln!(text, "kept from bending to the other side: {}", names(fold, &hardly));
    }
}

/// What a vertex breaks.
pub fn broken(violation: &Violation) -> String {
    match violation {
        Violation::Maekawa { mountains, valleys } => format!(
            "it has {mountains} mountains and {valleys} valleys, which should differ by two (Maekawa)"
        ),
        Violation::Kawasaki(angle) => format!(
            "every other sector angle adds up to {:.4} deg, not to 180 deg (Kawasaki)",
            angle.to_degrees()
        ),
    }
}

/// Why a path ends early.
pub fn ended(fold: &Fold, path: &Path, end: &End) -> String {
    let last = path.samples.last();
    let progress = last.map_or(0.0, |last| 100.0 * last.progress);
    let angles = |joints: &[usize]| -> String {
        let joints = joints.iter().filter_map(|joint| {
            let name = &fold.topology().mechanism.joints[*joint].name;
            Some(format!("`{name}` at {:.3} deg", last?.q[*joint].to_degrees()))
        });
        let shown: Vec<String> = joints.collect();
        let rest = if shown.len() > LISTED { ", .." } else { "" };
        shown[..shown.len().min(LISTED)].join(", ") + rest
    };
    match end {
        End::Reached | End::Interrupted => String::new(),
        End::Flat(stuck) => flat(fold, stuck),
        End::AtBounds { most, least } => {
            let mut why = Vec::new();
            if !most.is_empty() {
                why.push(format!("{} can turn no further", angles(most)));
            }
            if !least.is_empty() {
                why.push(format!("{} would bend to the other side", angles(least)));
            }
            format!(
                "the fold ends at {progress:.2} %: {}, and no joint comes nearer to its fold",
                why.join(", ")
            )
        }
        End::Locked { loops, joint, is_open } => {
            let why = match is_open {
                true => "the loops do not close farther on",
                false => "the angles no longer come nearer to their folds",
            };
            let target = fold.targets()[*joint].to_degrees();
            let lock = loops.first().map_or(String::new(), |number| {
                format!(
                    "; {} locks ({})",
                    fold.loop_name(*number),
                    angles(&fold.loop_joints(*number))
                )
            });
            format!(
                "the fold ends at {progress:.2} %: {why}{lock}; {} of {target:.3} deg is farthest from its fold",
                angles(&[*joint])
            )
        }
    }
}

/// Why the sheet does not leave the flat state.
fn flat(fold: &Fold, stuck: &Stuck) -> String {
    let locks = |number: &usize| !fold.leaves_alone(*number);
    let alone: Vec<usize> = stuck.loops.iter().copied().filter(locks).collect();
    let why = match (&alone[..], &stuck.loops[..]) {
        ([vertex], _) => format!("{} does not close with these signs", fold.loop_name(*vertex)),
        ([vertex, others @ ..], _) => format!(
            "{} does not close with these signs, nor {}",
            fold.loop_name(*vertex),
            match others.len() {
                1 => "does another".to_owned(),
                count => format!("do {count} others"),
            }
        ),
        ([], [vertex, ..]) => format!(
            "each loop closes alone, but not all together; {} stays open most",
            fold.loop_name(*vertex)
        ),
        ([], []) => format!("{} stay flat", names(fold, &stuck.joints)),
    };
    format!("the sheet cannot leave the flat state as its folds say: {why}")
}

/// The names of joints, the first ones.
fn names(fold: &Fold, joints: &[usize]) -> String {
    let all = &fold.topology().mechanism.joints;
    let named = joints.iter().take(LISTED).map(|joint| format!("`{}`", all[*joint].name));
    let rest = if joints.len() > LISTED { ", .." } else { "" };
    named.collect::<Vec<_>>().join(", ") + rest
}
