//! What a line means: by the user's mapping, by the name of its layer, by its colour.
//!
//! With a mapping, lines on other layers and in other colours are ignored. Without one, a layer whose name says
//! its role gives it (`Mountain`, `valley folds`, `CUT-1`), and otherwise the colour does, as in SVG
//! ([`crate::colour`]): of AutoCAD's palette, 1 is red, 2 yellow, 3 green, 5 blue, 6 magenta, 7 black or white.
//! A layer of creases or folds without kind, whose lines are red or blue, has mountains and valleys.

use std::collections::HashMap;

use super::entity::Colour;
use super::file::File;
use crate::colour::{role_of, role_of_hue};
use crate::drawing::Role;
use crate::fault::{Cause, Fault};

/// Words in names of layers, in the order in which they are looked for.
const WORDS: [(&str, Role); 13] = [
    ("mountain", Role::Mountain),
    ("valley", Role::Valley),
    ("flat", Role::Flat),
    ("triangulation", Role::Flat),
    ("cut", Role::Cut),
    ("slit", Role::Cut),
    ("border", Role::Border),
    ("boundary", Role::Border),
    ("outline", Role::Border),
    ("hinge", Role::Hinge),
    ("crease", Role::Hinge),
    ("fold", Role::Hinge),
    ("score", Role::Hinge),
];

/// Names of the first colours of the palette.
const COLOURS: [(&str, u8); 8] = [
    ("red", 1),
    ("yellow", 2),
    ("green", 3),
    ("cyan", 4),
    ("blue", 5),
    ("magenta", 6),
    ("white", 7),
    ("black", 7),
];

/// The rule of a file.
pub(super) enum Roles {
    Mapped {
        /// Roles by the number of the layer's name.
        layers: Vec<(usize, Role)>,
        colours: Vec<(u8, Role)>,
    },
    /// Roles by the name of the layer.
    Convention(HashMap<usize, Role>),
}

impl Roles {
    /// Finds the layers and colours of a mapping.
    ///
    /// # Errors
    ///
    /// A name that is neither a layer of the file nor a colour.
    pub(super) fn of(
        mapping: &[(Role, String)],
        file: &File,
        used: &[usize],
    ) -> Result<Roles, Vec<Fault>> {
        if mapping.is_empty() {
            let role = |number: &usize| Some((*number, role_of_name(file.names.name(*number))?));
            return Ok(Roles::Convention(used.iter().filter_map(role).collect()));
        }
        let is = |number: &usize, name: &str| {
            file.names.name(*number).to_lowercase() == name.to_lowercase()
        };
        let (mut layers, mut colours, mut faults) = (Vec::new(), Vec::new(), Vec::new());
        for (role, name) in mapping {
            if let Some(number) = used.iter().find(|number| is(number, name)) {
                layers.push((*number, *role));
            } else if let Some(colour) = colour(name) {
                colours.push((colour, *role));
            } else {
                let known: Vec<&str> =
                    used.iter().take(20).map(|number| file.names.name(*number)).collect();
                faults.push(Fault {
                    cause: Cause::Empty,
                    message: format!("the file has no layer `{name}`"),
                    place: None,
                    at: Vec::new(),
                    hint: Some(format!("its layers are: {}", known.join(", "))),
                });
            }
        }
        if faults.is_empty() { Ok(Roles::Mapped { layers, colours }) } else { Err(faults) }
    }

    /// Returns the role of a line on a layer, in a colour that is an index or true. None if it has none.
    pub(super) fn role(&self, layer: usize, colour: Colour) -> Option<Role> {
        match self {
            Roles::Mapped { layers, colours } => {
                let by_layer = layers.iter().find(|(number, _)| *number == layer);
                let by_colour =
                    || colours.iter().find(|(index, _)| Colour::Index(*index) == colour);
                by_layer.map(|(_, role)| *role).or_else(|| by_colour().map(|(_, role)| *role))
            }
            Roles::Convention(names) => {
                match (names.get(&layer).copied(), role_of_colour(colour)) {
                    (Some(Role::Hinge), Some(role @ (Role::Mountain | Role::Valley))) => Some(role),
                    (by_name, by_colour) => by_name.or(by_colour),
                }
            }
        }
    }
}

fn colour(name: &str) -> Option<u8> {
    let lower = name.to_lowercase();
    let named = COLOURS.iter().find(|(word, _)| *word == lower).map(|(_, index)| *index);
    named.or_else(|| lower.parse().ok().filter(|index| *index > 0))
}

/// The role that the words of a name say, in singular or plural.
fn role_of_name(name: &str) -> Option<Role> {
    let lower = name.to_lowercase();
    let words = lower.split(|c: char| !c.is_alphabetic());
    let first =
        words.filter_map(|word| WORDS.iter().position(|(wanted, _)| is_form(word, wanted))).min();
    first.map(|index| WORDS[index].1)
}

/// Whether a word is another one, or its plural and the like.
fn is_form(word: &str, wanted: &str) -> bool {
    match word.strip_prefix(wanted) {
        Some(ending) => ["", "s", "ing", "ting", "line", "lines"].contains(&ending),
        None => wanted.strip_suffix('y').is_some_and(|stem| word.strip_prefix(stem) == Some("ies")),
    }
}

/// The role of a colour. Of the palette, 10 to 249 are 24 hues in steps of 15 degrees, 250 to 255 greys.
fn role_of_colour(colour: Colour) -> Option<Role> {
    match colour {
        Colour::True(channels) => role_of(channels),
        Colour::Index(7 | 250) => Some(Role::Border),
        Colour::Index(index @ 1..=6) => role_of_hue(60.0 * f64::from(index - 1)),
        Colour::Index(index @ 10..=249) => role_of_hue(15.0 * f64::from(index / 10 - 1)),
        Colour::Index(_) | Colour::ByLayer | Colour::ByBlock => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn check_name(names: &[&str], role: Option<Role>) {
        names.iter().for_each(|name| assert_eq!(role_of_name(name), role, "{name}"));
    }

    #[test]
    fn names_say_roles() {
        check_name(
            &["Mountain", "MOUNTAINS", "mountain creases", "0-mountain_folds"],
            Some(Role::Mountain),
        );
        check_name(&["valley", "Valleys", "VALLEY-FOLD"], Some(Role::Valley));
        check_name(
            &["cut", "Cuts", "CUT-1", "cutting", "cut outline", "CutLines"],
            Some(Role::Cut),
        );
        check_name(&["Outline", "border", "boundary", "boundaries"], Some(Role::Border));
        check_name(&["creases", "FOLDS", "hinge", "score"], Some(Role::Hinge));
        check_name(&["triangulation", "flat"], Some(Role::Flat));
        check_name(&["0", "Layer 1", "shortcut", "", "unfolded", "scored-by"], None);
    }

    #[test]
    fn colours_of_the_palette_say_roles() {
        let indices: [(&[u8], Option<Role>); 7] = [
            (&[1, 10, 12, 14, 240], Some(Role::Mountain)),
            (&[2, 40, 50, 60], Some(Role::Flat)),
            (&[3, 90, 96, 100], Some(Role::Cut)),
            (&[30, 34, 4, 110, 130, 8, 9, 251, 255], None),
            (&[5, 150, 170, 178, 180], Some(Role::Valley)),
            (&[6, 190, 210, 220], Some(Role::Hinge)),
            (&[7, 250], Some(Role::Border)),
        ];
        for (indices, role) in indices {
            for index in indices {
                assert_eq!(role_of_colour(Colour::Index(*index)), role, "{index}");
            }
        }
    }
}
