//! Names of facets and creases from their positions (see the [module](super)).

use std::collections::BTreeMap;

use crate::arithmetic::{hypot, log10, powi};

/// A position in steps: the row, then the column, so that positions sort from the bottom to the top.
type Cell = [i64; 2];

/// Least number of steps across the drawing, so that facets can be told apart.
const LEAST_STEPS: f64 = 30.0;

/// The grid to which positions are rounded.
pub(super) struct Grid {
    /// Steps per unit of the drawing: 1, 10, 100, ...
    steps: f64,
}

impl Grid {
    /// The grid of a drawing with these vertices.
    pub fn of(vertices: &[[f64; 2]]) -> Self {
        let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
        for vertex in vertices {
            for axis in 0..2 {
                low[axis] = low[axis].min(vertex[axis]);
                high[axis] = high[axis].max(vertex[axis]);
            }
        }
        let across = hypot(high[0] - low[0], high[1] - low[1]);
        if !(across.is_finite() && across > 0.0) {
            return Self { steps: 1.0 };
        }
        /// Names of drawings that are smaller than this power of ten are not told apart.
        const FINEST: f64 = 300.0;
        let power = log10(LEAST_STEPS / across).ceil().clamp(0.0, FINEST) as i32;
        Self { steps: powi(10.0, power) }
    }

    fn cell(&self, [x, y]: [f64; 2]) -> Cell {
        // The conversion saturates; coordinates that large share a cell.
        [y, x].map(|value| (value * self.steps).round() as i64)
    }

    /// Sorts positions, and gives each a name: the index of the position, and the name.
    pub fn names(&self, kind: &str, positions: &[[f64; 2]]) -> Vec<(usize, String)> {
        let mut cells: BTreeMap<Cell, Vec<usize>> = BTreeMap::new();
        for (index, position) in positions.iter().enumerate() {
            cells.entry(self.cell(*position)).or_default().push(index);
        }
        let mut named = Vec::with_capacity(positions.len());
        for ([y, x], mut there) in cells {
            there.sort_by(|a, b| {
                let [[ax, ay], [bx, by]] = [positions[*a], positions[*b]];
                ay.total_cmp(&by).then(ax.total_cmp(&bx))
            });
            let base = format!("{kind}_{}_{}", written(x), written(y));
            named.extend(there.into_iter().enumerate().map(|(number, index)| match number {
                0 => (index, base.clone()),
                _ => (index, format!("{base}_{}", number + 1)),
            }));
        }
        named
    }
}

/// A whole number as a part of an identifier: `m30` is -30.
fn written(number: i64) -> String {
    match number < 0 {
        true => format!("m{}", number.unsigned_abs()),
        false => number.to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_made_from_positions() {
        let across = |size: f64| Grid::of(&[[0.0, 0.0], [size, 0.0]]);
        for (size, position, name) in [
            (500.0, [120.4, -29.6], "at_120_m30"),
            (30.0, [12.0, 0.4], "at_12_0"),
            (29.0, [12.0, 0.4], "at_120_4"),
            (1.5, [0.25, -0.004], "at_25_0"),
            (0.0, [7.0, 7.0], "at_7_7"),
            (1e300, [1e300, 0.0], "at_9223372036854775807_0"),
        ] {
            assert_eq!(across(size).names("at", &[position]), [(0, name.to_owned())], "{size}");
        }
    }

    #[test]
    fn positions_are_sorted_and_names_differ() {
        let positions = [[9.0, 5.0], [1.2, 2.0], [1.1, 2.0], [5.0, -3.0], [1.3, 1.9]];
        let expected = [(3, "f_5_m3"), (4, "f_1_2"), (2, "f_1_2_2"), (1, "f_1_2_3"), (0, "f_9_5")];
        let expected = expected.map(|(index, name)| (index, name.to_owned()));
        assert_eq!(Grid::of(&[[0.0, 0.0], [300.0, 0.0]]).names("f", &positions), expected);
    }
}
