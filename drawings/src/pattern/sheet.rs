//! Which regions are sheet, and which lines are no part of it.
//!
//! The rules are those in the documentation of [`Pattern`](super::Pattern). They spread from the
//! regions that are decided, first from those with creases, over borders and cuts.

use std::collections::VecDeque;

use super::network::Network;
use super::regions::{OUTSIDE, Regions};
use super::report::{Report, Sites};
use crate::drawing::Role;
use crate::fault::{Cause, Fault};

/// A planar network whose lines all are edges of facets.
#[derive(Debug)]
pub(super) struct Sheet {
    pub(super) network: Network,
    pub(super) regions: Regions,
    /// Whether each region is sheet.
    pub(super) is_sheet: Vec<bool>,
}

impl Sheet {
    /// Finds the regions of the sheet, and leaves out lines that are no edges of facets.
    pub(super) fn of(
        mut network: Network,
        mut regions: Regions,
        report: &mut Report,
    ) -> Result<Self, Fault> {
        let mut inside = Sites::default();
        let mut outside = Sites::default();
        loop {
            let is_sheet = material(&network, &regions);
            let before = network.lines.len();
            let mut lines = Vec::with_capacity(before);
            for (index, line) in std::mem::take(&mut network.lines).into_iter().enumerate() {
                let [left, right] = regions.beside(index);
                let bounds = if is_crease(line.role) {
                    left != right
                } else {
                    is_sheet[left] || is_sheet[right]
                };
                if bounds {
                    lines.push(line);
                } else {
                    let [a, b] = network.ends(&line);
                    let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
                    let sites = if is_sheet[left] { &mut inside } else { &mut outside };
                    sites.note(middle, line.place);
                }
            }
            network.lines = lines;
            if network.lines.len() == before {
                report_loose(inside, outside, report);
                return Ok(Self { network, regions, is_sheet });
            }
            regions = Regions::of(&network)?;
        }
    }
}

fn report_loose(inside: Sites, outside: Sites, report: &mut Report) {
    report.doubt(
        Cause::Dangling,
        inside,
        "a crease ends at the outline, at a cut, or where other creases meet",
        |sites| {
            let (count, was) = (sites.count("piece"), sites.was());
            format!("{count} of creases that end inside a facet {was} left out")
        },
    );
    report.doubt(
        Cause::Dangling,
        outside,
        "leave out frames, legends and dimensions, or close the outline around these lines",
        |sites| {
            let (count, was) = (sites.count("line"), sites.was());
            format!("{count} outside of the sheet {was} left out")
        },
    );
}

/// Whether a line of this role joins the facets on both sides.
pub(super) fn is_crease(role: Role) -> bool {
    !matches!(role, Role::Border | Role::Cut)
}

/// Decides which regions are sheet.
fn material(network: &Network, regions: &Regions) -> Vec<bool> {
    let mut state: Vec<Option<bool>> = vec![None; regions.loops.len()];
    let mut queue = VecDeque::new();
    for (index, line) in network.lines.iter().enumerate() {
        let [left, right] = regions.beside(index);
        if is_crease(line.role) && left != right {
            for region in [left, right] {
                if region != OUTSIDE && state[region].is_none() {
                    state[region] = Some(true);
                    queue.push_back(region);
                }
            }
        }
    }
    state[OUTSIDE] = Some(false);
    queue.push_back(OUTSIDE);
    let alone = components_of_walls(network, regions);
    while let Some(region) = queue.pop_front() {
        let sheet = state[region].expect("what is in the queue is decided");
        // Borders come first: a region that a border and a cut separate from the sheet is no sheet.
        for role in [Role::Border, Role::Cut] {
            for &half_edge in regions.loops[region].iter().flatten() {
                let line = &network.lines[half_edge / 2];
                let other = regions.left[half_edge ^ 1];
                if line.role != role || state[other].is_some() {
                    continue;
                }
                let falls_out =
                    || regions.component[line.ends[0]].is_some_and(|component| alone[component]);
                let joined = role == Role::Cut && sheet && !falls_out();
                state[other] = Some(joined || !sheet);
                queue.push_back(other);
            }
        }
    }
    state.into_iter().map(|state| state == Some(true)).collect()
}

/// Returns for each component whether it is inside another one and has no crease.
fn components_of_walls(network: &Network, regions: &Regions) -> Vec<bool> {
    let mut alone: Vec<bool> = regions.around.iter().map(|&around| around != OUTSIDE).collect();
    for line in network.lines.iter().filter(|line| is_crease(line.role)) {
        if let Some(component) = regions.component[line.ends[0]] {
            alone[component] = false;
        }
    }
    alone
}
