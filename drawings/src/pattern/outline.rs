//! Outlines that do not close.

use super::limits::fault;
use super::network::{Network, distance};
use super::regions::{OUTSIDE, Regions};
use super::report::{Report, Sites, number, point};
use super::sheet::{Sheet, is_crease};
use crate::drawing::{Place, Role};
use crate::fault::{Cause, Fault};

/// The most gaps that are reported.
const MOST_GAPS: usize = 10;

/// The most free ends that are compared with each other; a drawing with more has another problem.
const MOST_ENDS: usize = 1000;

/// Checks that the outline around the creases is closed.
///
/// Where it is open, the space around the drawing reaches the creases: lines of the outline that
/// have this space on both sides end freely, and creases have it on one side, or there is no facet.
pub(super) fn check_closed(network: &Network, regions: &Regions) -> Result<(), Vec<Fault>> {
    let mut degree = vec![0_usize; network.points.len()];
    for end in network.lines.iter().flat_map(|line| line.ends) {
        degree[end] += 1;
    }
    let mut free: Vec<(usize, Place)> = Vec::new();
    let mut reached = regions.loops.len() == 1;
    for (index, line) in network.lines.iter().enumerate() {
        let beside = regions.beside(index);
        if is_crease(line.role) {
            reached |= beside.contains(&OUTSIDE) && beside != [OUTSIDE; 2];
        } else if beside == [OUTSIDE; 2] {
            let ends = line.ends.into_iter().filter(|&end| degree[end] == 1);
            free.extend(ends.map(|end| (end, line.place)));
        }
    }
    if !reached {
        return Ok(());
    }
    if !free.is_empty() {
        return Err(gaps(network, &free));
    }
    if regions.loops.len() > 1 {
        return Ok(());
    }
    Err(vec![fault(
        Cause::OpenOutline,
        "the lines of the drawing enclose no facet".to_owned(),
        "draw the outline of the sheet: border lines (or cuts) that close",
    )])
}

/// Returns a fault for each gap: an end and the free end nearest to it.
fn gaps(network: &Network, free: &[(usize, Place)]) -> Vec<Fault> {
    let mut open: Vec<(usize, Place)> = free.iter().copied().take(MOST_ENDS).collect();
    // The first of the file is popped first.
    open.sort_by_key(|&(end, place)| std::cmp::Reverse((place, end)));
    let mut faults = Vec::new();
    while faults.len() < MOST_GAPS
        && let Some((end, place)) = open.pop()
    {
        let at = network.points[end];
        let away = |other: usize| distance(network.points[other], at);
        let nearest = (0..open.len()).min_by(|&a, &b| away(open[a].0).total_cmp(&away(open[b].0)));
        let (message, at, hint) = match nearest.map(|nearest| open.swap_remove(nearest)) {
            Some((other, _)) => (
                format!(
                    "the outline of the sheet is open between {} and {}",
                    point(at),
                    point(network.points[other])
                ),
                vec![at, network.points[other]],
                format!(
                    "draw the line between them, or give a tolerance above the gap of {}",
                    number(away(other))
                ),
            ),
            None => (
                format!("the outline of the sheet ends at {}", point(at)),
                vec![at],
                "continue it until it meets another line of the outline".to_owned(),
            ),
        };
        faults.push(Fault {
            cause: Cause::OpenOutline,
            message,
            place: Some(place),
            at,
            hint: Some(hint),
        });
    }
    faults
}

/// Reports creases at the edge of the sheet, which have a facet on one side only.
///
/// If the drawing has neither borders nor cuts, the hinges among them become border: they are edges to
/// which the file assigns nothing. Mountains, valleys and flat lines keep the role that was drawn.
pub(super) fn settle_rim(sheet: &mut Sheet, report: &mut Report) {
    let has_walls = sheet.network.lines.iter().any(|line| !is_crease(line.role));
    let mut sites = Sites::default();
    for index in 0..sheet.network.lines.len() {
        let one_sided = sheet.regions.beside(index).iter().any(|&region| !sheet.is_sheet[region]);
        let line = &mut sheet.network.lines[index];
        if is_crease(line.role) && one_sided {
            if !has_walls && line.role == Role::Hinge {
                (line.role, line.fold, line.angle) = (Role::Border, None, None);
            } else {
                let (place, [a, b]) = (line.place, line.ends.map(|end| sheet.network.points[end]));
                sites.note([0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])], place);
            }
        }
    }
    report.doubt(Cause::Rim, sites, "draw the edge of the sheet as border", |sites| {
        let (count, has) =
            (sites.count("crease"), if sites.at.len() == 1 { "has" } else { "have" });
        format!("{count} at the edge of the sheet {has} a facet on one side only")
    });
}
