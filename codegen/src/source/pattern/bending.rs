//! Stiffness of flat creases: the sheet between two parts of a facet bends.
//!
//! A strip of a plate of length s, measured across, and width L, measured along the line about which it
//! bends, has the bending stiffness
//!
//! ```text
//! k = D L / s,    D = E t^3 / (12 (1 - nu^2))
//! ```
//!
//! (S. Timoshenko, S. Woinowsky-Krieger: *Theory of Plates and Shells*, 2nd ed. 1959, chapter 1). L is the
//! length of the flat crease. The span s is that of the strip that has the area which bends about this
//! crease: each facet's area is divided equally among its n flat creases, so s = (A1/n1 + A2/n2) / L. If every
//! side of every triangle bends, n = 3, and s is a third of the mean height of the two triangles, as in
//! E. Grinspun, A. N. Hirani, M. Desbrun, P. Schröder: *Discrete Shells*, SCA 2003.
//!
//! For a laminate, D is the integral of E z^2 / (1 - nu^2) over the thickness, z from the neutral surface.

use super::build::Stack;

/// Poisson's ratio of all materials. Paper, card and polyester have 0.2 to 0.4; between these, D
/// changes by 12 %.
pub(super) const POISSON: f64 = 0.3;

/// A material of the layup without Young's modulus: its index.
pub(super) struct NoModulus(pub usize);

/// Returns the bending stiffness D of the layup per length, N m.
///
/// # Errors
/// [`NoModulus`].
pub(super) fn plate(stack: &Stack) -> Result<f64, NoModulus> {
    let mut layers = Vec::new();
    let mut bottom = 0.0;
    for &index in stack.layup {
        let material = &stack.materials[index];
        let modulus = material.youngs_modulus.as_ref().ok_or(NoModulus(index))?;
        let top = bottom + material.thickness.value;
        layers.push((modulus.value, bottom, top));
        bottom = top;
    }
    let sum = |of: &dyn Fn(f64, f64, f64) -> f64| -> f64 {
        layers.iter().map(|(modulus, bottom, top)| of(*modulus, *bottom, *top)).sum()
    };
    let neutral = sum(&|e, low, high| e * (high * high - low * low) / 2.0)
        / sum(&|e, low, high| e * (high - low));
    let cube = |z: f64| (z - neutral) * (z - neutral) * (z - neutral);
    let flexural = sum(&|e, low, high| e * (cube(high) - cube(low)) / 3.0);
    Ok(flexural / (1.0 - POISSON * POISSON))
}

/// Returns the stiffness of a flat crease, N m/rad: `rigidity` D in N m, its length in m, and for each of its two
/// facets the area in m^2 and the number of its flat creases.
pub(super) fn stiffness(rigidity: f64, length: f64, facets: [(f64, usize); 2]) -> f64 {
    let area: f64 = facets.iter().map(|(area, creases)| area / *creases as f64).sum();
    rigidity * length * length / area
}
