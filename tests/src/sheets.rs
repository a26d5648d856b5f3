//! Origami sheets of any size, with which costs and closures of many loops are measured: card of 0.3 mm, hinges of
//! 1.3e-3 N m/rad and 2e-6 N m s/rad in the plane of the card's underside.

use std::fmt::Write;

/// A vertex of a drawing, mm.
type Vertex = [f64; 2];

/// Angle of a crease at rest over that at the start: folded by 40 degrees, at rest at 60.
const REST: f64 = 1.5;

/// Folded angle of the main creases at the start, degrees.
const FOLD: f64 = 40.0;

/// A hinge between two facets; `rest` and `fold` are its angles at rest and at the start, degrees.
struct Crease {
    name: String,
    facets: [usize; 2],
    axis: [Vertex; 2],
    /// Positive where the second facet turns down across a rising crease, or up across one to the right.
    rest: f64,
    fold: f64,
}

/// A sheet of Miura-ori of `rows` x `columns` parallelograms with sides of 30 mm and corners of 53.13 degrees
/// (K. Miura, "Method of packaging and deployment of large membranes in space", 1985): (rows - 1) (columns - 1)
/// spherical loops of four hinges each, mobility 1.
///
/// The zigzag creases between columns are all mountain or all valley; along each straight crease mountain and
/// valley alternate, with tan(straight / 2) = cos(53.13 deg) tan(zigzag / 2).
pub fn miura(rows: usize, columns: usize) -> String {
    let vertex = |row: usize, column: usize| {
        [30.0 * column as f64 + 18.0 * (row % 2) as f64, 24.0 * row as f64]
    };
    let facet = |row: usize, column: usize| row * columns + column;
    let sign = |even: bool| if even { 1.0 } else { -1.0 };
    let straight =
        |zigzag: f64| 2.0 * (0.6 * (zigzag / 2.0).to_radians().tan()).atan().to_degrees();
    let mut facets = Vec::new();
    let mut creases = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            facets.push(vec![
                vertex(row, column),
                vertex(row, column + 1),
                vertex(row + 1, column + 1),
                vertex(row + 1, column),
            ]);
            if column + 1 < columns {
                let side = sign(column % 2 == 0);
                creases.push(Crease {
                    name: format!("zigzag_{row}_{column}"),
                    facets: [facet(row, column), facet(row, column + 1)],
                    axis: [vertex(row, column + 1), vertex(row + 1, column + 1)],
                    rest: side * REST * FOLD,
                    fold: side * FOLD,
                });
            }
            if row + 1 < rows {
                let side = sign((row + column) % 2 == 0);
                creases.push(Crease {
                    name: format!("straight_{row}_{column}"),
                    facets: [facet(row, column), facet(row + 1, column)],
                    axis: [vertex(row + 1, column), vertex(row + 1, column + 1)],
                    rest: side * straight(REST * FOLD),
                    fold: side * straight(FOLD),
                });
            }
        }
    }
    written(&format!("miura{rows}x{columns}"), &facets, &creases)
}

/// A sheet of Yoshimura's diamonds of `rows` strips of 2 `columns` triangles (Y. Yoshimura, "On the mechanism of
/// buckling of a circular cylindrical shell under axial compression", 1955): (rows - 1) (columns - 1) spherical loops
/// of six hinges each.
///
/// It folds evenly: all diagonals and sides by the same angle d, mountain; the others by v, valley, with
/// cos(v / 2) = sin b sin d / sin p, cos p = cos^2 b + sin^2 b cos d, where b is the angle at the base of the triangles.
pub fn yoshimura(rows: usize, columns: usize) -> String {
    let vertex = |row: usize, column: usize| {
        [40.0 * column as f64 + 20.0 * (row % 2) as f64, 24.0 * row as f64]
    };
    let valley = |mountain: f64| {
        let (sin, cos) = (24.0_f64.atan2(20.0).sin(), 24.0_f64.atan2(20.0).cos());
        let mountain = mountain.to_radians();
        let between = (cos * cos + sin * sin * mountain.cos()).acos();
        2.0 * (sin * mountain.sin() / between.sin()).acos().to_degrees()
    };
    let facet = |row: usize, column: usize, half: usize| 2 * (row * columns + column) + half;
    let mut facets = Vec::new();
    let mut creases = Vec::new();
    let mut crease = |kind: &str, facets: [usize; 2], axis: [Vertex; 2]| {
        let name = format!("{kind}_{}_{}", facets[0], facets[1]);
        let angle = |mountain: f64| if kind == "valley" { valley(mountain) } else { mountain };
        let (rest, fold) = (angle(REST * FOLD), angle(FOLD));
        creases.push(Crease { name, facets, axis, rest, fold });
    };
    for row in 0..rows {
        for column in 0..columns {
            let [a, b] = [vertex(row, column), vertex(row, column + 1)];
            let [c, d] = [vertex(row + 1, column), vertex(row + 1, column + 1)];
            // The diagonal that is a side of isosceles triangles.
            let is_shifted = row % 2 == 1;
            let (halves, diagonal) = match is_shifted {
                false => ([[a, b, c], [b, d, c]], [b, c]),
                true => ([[a, d, c], [a, b, d]], [a, d]),
            };
            facets.extend(halves.map(|half| half.to_vec()));
            crease("diagonal", [facet(row, column, 0), facet(row, column, 1)], diagonal);
            if column + 1 < columns {
                let between = [facet(row, column, 1), facet(row, column + 1, 0)];
                crease("side", between, [b, d]);
            }
            if row + 1 < rows {
                // The halves with an upper edge, and in the next row with a lower one, have the same number.
                let half = usize::from(!is_shifted);
                let between = [facet(row, column, half), facet(row + 1, column, half)];
                crease("valley", between, [c, d]);
            }
        }
    }
    written(&format!("yoshimura{rows}x{columns}"), &facets, &creases)
}

/// The model in lamc's schema; the first facet is fixed.
fn written(name: &str, facets: &[Vec<Vertex>], creases: &[Crease]) -> String {
    let point = |[x, y]: Vertex| format!("[{x}, {y}]");
    let mut text = format!(
        "name: {name}
units: {{ length: mm, angle: deg }}
materials: {{ card: {{ density: 700, thickness: 0.3 }} }}
layup: [card]
bodies:
"
    );
    for (index, facet) in facets.iter().enumerate() {
        let corners: Vec<String> = facet.iter().copied().map(point).collect();
        let fixed = if index == 0 { "fixed: true, " } else { "" };
        let _ = writeln!(text, "  f{index}: {{ {fixed}outline: [{}] }}", corners.join(", "));
    }
    text.push_str("joints:\n");
    for Crease { name, facets: [first, second], axis: [from, to], rest, .. } in creases {
        let (from, to) = (point(*from), point(*to));
        let _ = writeln!(
            text,
            "  {name}: {{ bodies: [f{first}, f{second}], axis: [{from}, {to}], stiffness: 1.3e-3, \
             damping: 2e-6, rest: {rest}, fold: {} }}",
            180.0_f64.copysign(*rest)
        );
    }
    let angles: Vec<String> =
        creases.iter().map(|crease| format!("{}: {}", crease.name, crease.fold)).collect();
    let _ = writeln!(text, "initial: {{ q: {{ {} }} }}", angles.join(", "));
    text
}
