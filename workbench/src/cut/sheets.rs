//! The layers that have plates, and which of them bridges each hinge.

use super::edges::{Edges, Hinge, Joint, Plate};
use super::{Loose, MM, pieces};
use lamc::source::SourceModel;

/// A layer that has plates.
pub struct Sheet {
    /// Its number in the layup, from 1 at the bottom.
    pub number: usize,
    /// The name of its material.
    pub material: String,
    /// Heights of its lower and upper face, mm.
    pub z: [f64; 2],
    /// Its plates.
    pub plates: Vec<Plate>,
    /// Their edges.
    pub edges: Edges,
    /// For each joint how the plates touch at it; None if this layer does not bridge the joint.
    pub hinges: Vec<Option<Hinge>>,
}

/// The layers of a model that have plates, and the numbers of those that have none.
pub fn sheets(model: &SourceModel) -> (Vec<Sheet>, Vec<usize>) {
    let (mut sheets, mut empty, mut top) = (Vec::new(), Vec::new(), 0.0);
    for (index, material) in model.layup.iter().enumerate() {
        let material = &model.materials[*material];
        let bottom = top;
        top += material.thickness.value * MM;
        let plates = pieces::plates(model, index);
        if plates.is_empty() {
            empty.push(index + 1);
            continue;
        }
        sheets.push(Sheet {
            number: index + 1,
            material: material.name.value.clone(),
            z: [bottom, top],
            edges: Edges::new(&plates),
            plates,
            hinges: Vec::new(),
        });
    }
    (sheets, empty)
}

/// Determines the layers that bridge each joint, and returns the joints that none bridges.
///
/// These are the layers of the material `film`, if one is named. Without a name it is one layer: that
/// with the narrowest gap; of equal gaps, the layer at the height of the hinge line; then the thinnest.
pub fn bridge(
    sheets: &mut [Sheet],
    joints: &[Joint],
    reach: f64,
    film: Option<&str>,
) -> Vec<Loose> {
    let mut loose = Vec::new();
    for joint in joints {
        let found: Vec<Hinge> =
            sheets.iter().map(|sheet| sheet.edges.hinge(joint, reach)).collect();
        let gap = |index: usize| found[index].gap.unwrap_or(f64::INFINITY);
        let order = |&a: &usize, &b: &usize| {
            // A height of zero is the default, and on a face of a layer it says nothing.
            let is_away = |sheet: &Sheet| joint.height <= sheet.z[0] || joint.height >= sheet.z[1];
            let thickness = |sheet: &Sheet| sheet.z[1] - sheet.z[0];
            let gaps = match (gap(a) - gap(b)).abs() <= reach {
                true => std::cmp::Ordering::Equal,
                false => gap(a).total_cmp(&gap(b)),
            };
            let (a, b) = (&sheets[a], &sheets[b]);
            let heights = is_away(a).cmp(&is_away(b));
            gaps.then(heights).then(thickness(a).total_cmp(&thickness(b)))
        };
        let is_film = |index: &usize| film.is_none_or(|film| sheets[*index].material == film);
        let candidates =
            || (0..sheets.len()).filter(is_film).filter(|index| found[*index].gap.is_some());
        let best = candidates().min_by(order);
        let bridges: Vec<bool> = (0..sheets.len())
            .map(|index| match film {
                Some(_) => is_film(&index) && !found[index].shared.is_empty(),
                None => best == Some(index) && !found[index].shared.is_empty(),
            })
            .collect();
        if !bridges.contains(&true) {
            let gap = best.map(|index| (gap(index), sheets[index].number));
            loose.push(Loose { joint: joint.name.clone(), gap });
        }
        for ((sheet, hinge), bridges) in sheets.iter_mut().zip(found).zip(bridges) {
            sheet.hinges.push(bridges.then_some(hinge));
        }
    }
    loose
}
