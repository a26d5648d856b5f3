//! Open chains of any length, with which costs are measured.

use std::fmt::Write;

/// The text of a chain of plates of card with springs and dampers, hanging from the ground, its
/// hinges in a film on one face of the card.
///
/// No two plates are equal, and no two neighbouring hinge lines are parallel or at right angles. The text depends
/// on the number of hinges only.
pub fn chain(hinges: usize) -> String {
    let mut text = format!(
        "name: chain{hinges}
units: {{ length: mm, angle: deg }}
materials:
  card: {{ density: 700, thickness: 0.4 }}
  polyester: {{ density: 1380, thickness: 0.05 }}
layup: [card, polyester]
bodies:
  b0: {{ fixed: true }}
"
    );
    let mut joints = "joints:\n".to_owned();
    let mut x = 0.0;
    for k in 1..=hinges {
        // Multiples of the golden ratio are spread evenly over 0 .. 1, without repetition.
        let spread = |step: f64| (step * k as f64).fract();
        let (length, width) = (16.0 + 8.0 * spread(0.618), 18.0 + 6.0 * spread(0.382));
        let (left, right, upper) = (x + 0.5, x + length - 0.5, width - 4.0 * spread(0.236));
        let outline = format!(
            "[[{left:.3}, 0], [{right:.3}, 1.5], [{right:.3}, {upper:.3}], [{left:.3}, {width:.3}]]"
        );
        let _ = writeln!(text, "  b{k}: {{ outline: {outline} }}");
        // Alternately to the left and to the right of the normal: neighbours differ by 15 to 30 degrees.
        let angle: f64 = 90.0 + if k % 2 == 0 { 1.0 } else { -1.0 } * (7.5 + 7.5 * spread(0.618));
        let (cos, sin) = (angle.to_radians().cos(), angle.to_radians().sin());
        let axis = format!("[[{x:.3}, 0], [{:.3}, {:.3}]]", x + 20.0 * cos, 20.0 * sin);
        let stiffness = 0.008 + 0.006 * spread(0.382);
        let _ = writeln!(
            joints,
            "  j{k}: {{ bodies: [b{}, b{k}], axis: {axis}, z: 0.425, stiffness: {stiffness:.5}, \
             damping: 1.0e-5, rest: {:.1} }}",
            k - 1,
            20.0 * spread(0.236) - 10.0
        );
        x += length;
    }
    text.push_str(&joints);
    text
}
