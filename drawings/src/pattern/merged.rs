//! Facets joined over edges of one role.

use super::network::{Line, Network};
use super::regions::Regions;
use super::sheet::Sheet;
use super::{Edge, Pattern, VertexId, build};
use crate::drawing::Role;

impl Pattern {
    /// Returns the pattern without the edges of a role that have two different facets on both sides:
    /// these facets are joined. For [`Role::Flat`], the facets of a pattern that was triangulated.
    ///
    /// Vertices of other edges stay where they are, also where two edges now meet on a straight line.
    pub fn merged(&self, role: Role) -> Self {
        let joins = |edge: &Edge| {
            let [left, right] = edge.facets;
            edge.role == role && left.is_some() && right.is_some() && left != right
        };
        let kept: Vec<&Edge> = self.edges.iter().filter(|edge| !joins(edge)).collect();
        let lines = kept.iter().map(|edge| Line {
            ends: edge.vertices.map(VertexId::index),
            role: edge.role,
            fold: edge.fold,
            angle: edge.angle,
            place: edge.place,
        });
        let network = Network { points: self.vertices.clone(), lines: lines.collect() };
        // A pattern that was made once can be made again: it is as large as before or smaller.
        let Ok(regions) = Regions::of(&network) else { return self.clone() };
        let mut is_sheet = vec![false; regions.loops.len()];
        for (index, edge) in kept.iter().enumerate() {
            for (region, facet) in regions.beside(index).into_iter().zip(edge.facets) {
                is_sheet[region] = facet.is_some();
            }
        }
        let mut pattern = build::pattern(&Sheet { network, regions, is_sheet });
        (pattern.mended, pattern.doubts) = (self.mended.clone(), self.doubts.clone());
        pattern
    }
}
