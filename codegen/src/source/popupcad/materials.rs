//! The materials of the layers: equal materials are shared, different materials with the same name
//! are renamed.

use super::{Import, head};
use crate::source::diagnostic::Spanned;
use crate::source::model::Material;
use crate::source::names::identifier_from;
use crate::source::units;
use crate::source::yaml::Node;

/// The contents of a `MaterialProperty`, and of the `Material2` of older exports.
#[rustfmt::skip]
const KEYS: &[&str] = &[
    "E1", "E2", "color", "density", "id", "is_adhesive", "is_conductive", "is_flexible", "is_rigid",
    "name", "poisson", "thickness",
];

impl Import {
    /// Returns the materials, and the material of each layer (bottom to top).
    pub(super) fn materials<'n>(
        &mut self,
        layers: impl IntoIterator<Item = &'n Node>,
    ) -> Option<(Vec<Material>, Vec<usize>)> {
        let read: Vec<_> = layers.into_iter().map(|layer| self.material(layer)).collect();
        let mut materials: Vec<Material> = Vec::new();
        let mut layup = Vec::new();
        for mut material in read.into_iter().collect::<Option<Vec<_>>>()? {
            let same = |a: &Material| {
                a.density.value == material.density.value
                    && a.thickness.value == material.thickness.value
            };
            let stem = material.name.value.clone();
            let mut number = 1;
            // `adhesive`, `adhesive_2`, ...: the first name that is free or has this same material.
            let position = loop {
                let named = |a: &Material| a.name.value == material.name.value;
                match materials.iter().position(named) {
                    Some(i) if same(&materials[i]) => break i,
                    Some(_) => {
                        number += 1;
                        material.name.value = format!("{stem}_{number}");
                    }
                    None => {
                        materials.push(material);
                        break materials.len() - 1;
                    }
                }
            };
            layup.push(position);
        }
        Some((materials, layup))
    }

    fn material(&mut self, node: &Node) -> Option<Material> {
        self.warn_of_others(node, KEYS);
        let at = node.tag.as_ref().map_or(head(node), |tag| tag.span);
        let name = self.require(node, at, "name").and_then(|node| {
            let value = identifier_from(&self.id(node)?);
            Some(Spanned { value, span: node.span })
        });
        let density = self.required_number(node, at, "density", units::SI);
        let thickness = self.required_number(node, at, "thickness", self.length);
        Some(Material {
            name: name?,
            density: density?.into(),
            thickness: thickness?.into(),
            youngs_modulus: None,
            yield_stress: None,
        })
    }
}
