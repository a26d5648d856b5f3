//! Rigid origami: sheets of facets joined by their creases.

use crate::topology::LoopClass;

use super::{Hinge, codes, hinge, largest_gap, topology};

/// A Miura-ori sheet of n x n facets: parallelograms in columns that zigzag.
fn miura(n: usize) -> Vec<Hinge> {
    let vertex = |row: usize, column: usize| {
        let lean = if row.is_multiple_of(2) { 0.0 } else { 0.6 };
        [column as f64 + lean, row as f64]
    };
    let facet = |row: usize, column: usize| row * n + column;
    let mut hinges = Vec::new();
    for row in 0..n {
        for column in 0..n {
            if column + 1 < n {
                let bodies = [facet(row, column), facet(row, column + 1)];
                hinges.push(hinge(bodies, vertex(row, column + 1), vertex(row + 1, column + 1)));
            }
            if row + 1 < n {
                let bodies = [facet(row, column), facet(row + 1, column)];
                hinges.push(hinge(bodies, vertex(row + 1, column), vertex(row + 1, column + 1)));
            }
        }
    }
    hinges
}

#[test]
fn miura_sheets_have_one_degree_of_freedom() {
    for n in [2, 3, 4, 6] {
        let hinges = miura(n);
        let topology = topology(&hinges);
        assert_eq!(hinges.len(), 2 * n * (n - 1));
        assert_eq!(topology.loops.len(), (n - 1) * (n - 1));
        assert_eq!((topology.rank, topology.mobility), (hinges.len() - 1, 1), "{n} x {n}");
        assert_eq!(codes(&topology.warnings), [""; 0]);
        // The loops are those about the inner vertices, wherever they are in the tree.
        for closed in &topology.loops {
            let spherical = matches!(closed.class, LoopClass::Spherical { .. });
            assert!(spherical && closed.joints.len() == 4, "{closed}");
        }
        let q = topology.assembled.as_ref().unwrap();
        assert!(largest_gap(&topology, q) < 1e-10);
        // The Miura motion folds every crease; larger sheets have many others of its rank.
        assert!(n > 4 || q.iter().all(|q| q.abs() > 1e-2), "{q:?}");
    }
}
