//! A Fourier series fitted to samples, whose derivatives are exact: rates from recorded angles.
//!
//! ```text
//! y(t) = a_0 + sum_n a_n cos(n w s) + b_n sin(n w s),   s = t - t_0,   w = 2 pi / period
//! ```
//!
//! (the way of Sharifzadeh, Khodambashi, Aukes, DETC2018-86359, to the derivatives of a swing.) A
//! record does not end as it began, so the period is one of a few that are longer than the record;
//! period and order are those of the least criterion of Bayes and Schwarz, m ln(RSS / m) + p ln m
//! (G. Schwarz, "Estimating the dimension of a model", 1978). Towards the ends of a record
//! derivatives are poor.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};

/// The periods that are tried, divided by the length of the record.
const PERIODS: [f64; 3] = [1.0, 1.2, 1.6];
/// The highest order that is tried.
const MOST_HARMONICS: usize = 80;

/// A Fourier series.
#[derive(Clone, Debug, PartialEq)]
pub struct Fourier {
    /// t_0, s.
    pub begin: f64,
    /// w, rad/s.
    pub frequency: f64,
    /// a_0, a_1, b_1, a_2, b_2, ...
    pub coefficients: Vec<f64>,
    /// The root mean square of the residuals.
    pub rms: f64,
}

impl Fourier {
    /// The series of the best period and order through samples at ascending times (s); `None` for
    /// fewer than four of them.
    pub fn fit(t: &[f64], y: &[f64]) -> Option<Self> {
        let m = t.len().min(y.len());
        if m < 4 {
            return None;
        }
        let length = t[m - 1] - t[0];
        // With fewer than two samples per unknown, the series would fit the noise.
        let harmonics = MOST_HARMONICS.min((m - 2) / 4).max(1);
        let right = DVector::from_column_slice(&y[..m]);
        let mut best: Option<(f64, Self)> = None;
        for period in PERIODS {
            let frequency = TAU / (period * length);
            let columns = 1 + 2 * harmonics;
            let terms = |row: usize, column: usize| basis(column, frequency, t[row] - t[0], 0);
            let qr = DMatrix::from_fn(m, columns, terms).qr();
            let mut along = right.clone();
            qr.q_tr_mul(&mut along);
            let r = qr.r();
            let mut left = right.norm_squared() - along[0] * along[0];
            for order in 1..=harmonics {
                left -= along[2 * order - 1].powi(2) + along[2 * order].powi(2);
                let rss = left.max(1e-30 * right.norm_squared()).max(f64::MIN_POSITIVE);
                let unknowns = 1 + 2 * order;
                let (m, p) = (m as f64, unknowns as f64);
                let criterion = m * (rss / m).ln() + p * m.ln();
                if best.as_ref().is_some_and(|(least, _)| *least <= criterion) {
                    continue;
                }
                let r = r.view((0, 0), (unknowns, unknowns)).into_owned();
                let Some(solved) = r.solve_upper_triangular(&along.rows(0, unknowns).into_owned())
                else {
                    continue;
                };
                let coefficients = solved.as_slice().to_vec();
                let rms = (rss / m).sqrt();
                best = Some((criterion, Self { begin: t[0], frequency, coefficients, rms }));
            }
        }
        best.map(|(_, series)| series)
    }

    /// N.
    pub fn order(&self) -> usize {
        self.coefficients.len() / 2
    }

    /// The derivative of this order (0: the series itself) at a time (s).
    pub fn derivative(&self, order: u32, t: f64) -> f64 {
        let terms = self.coefficients.iter().enumerate();
        terms.map(|(column, a)| a * basis(column, self.frequency, t - self.begin, order)).sum()
    }
}

/// The derivative of 1, cos w s, sin w s, cos 2 w s, ... by s.
fn basis(column: usize, frequency: f64, s: f64, derivative: u32) -> f64 {
    let harmonic = column.div_ceil(2) as f64 * frequency;
    if column == 0 {
        return f64::from(u8::from(derivative == 0));
    }
    // Each derivative turns by a right angle; a sine is a cosine a right angle later.
    let behind = if column.is_multiple_of(2) { 3 } else { 0 };
    let (sin, cos) = (harmonic * s).sin_cos();
    let value = match (derivative + behind) % 4 {
        0 => cos,
        1 => -sin,
        2 => -cos,
        _ => sin,
    };
    value * harmonic.powi(derivative as i32)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sampled(f: impl Fn(f64) -> f64) -> (Vec<f64>, Vec<f64>) {
        let t: Vec<f64> = (0..400).map(|i| 3.0 + 0.005 * f64::from(i)).collect();
        let y = t.iter().map(|t| f(t - 3.0)).collect();
        (t, y)
    }

    /// A series is recovered from its samples, with its derivatives.
    #[test]
    fn a_series_is_its_own_fit() {
        let w = TAU / (1.2 * 1.995);
        let (t, y) = sampled(|s| 0.3 + (w * s).cos() - 0.5 * (2.0 * w * s).sin());
        let series = Fourier::fit(&t, &y).unwrap();
        for s in [0.0, 0.4, 1.9] {
            let first = -w * (w * s).sin() - w * (2.0 * w * s).cos();
            let second = -w * w * (w * s).cos() + 2.0 * w * w * (2.0 * w * s).sin();
            assert!((series.derivative(1, 3.0 + s) - first).abs() < 1e-9);
            assert!((series.derivative(2, 3.0 + s) - second).abs() < 1e-8);
        }
    }

    /// A decaying swing is not periodic: its derivatives are accurate except near the ends.
    #[test]
    fn a_decaying_swing_has_the_right_derivatives_inside() {
        let (decay, w) = (0.8, 9.0);
        let (t, y) = sampled(|s| (-decay * s).exp() * (w * s).cos());
        let series = Fourier::fit(&t, &y).unwrap();
        for s in [0.3, 0.8, 1.3, 1.7] {
            let wave = (-decay * s).exp();
            let first = -wave * (decay * (w * s).cos() + w * (w * s).sin());
            let second =
                wave * ((decay * decay - w * w) * (w * s).cos() + 2.0 * decay * w * (w * s).sin());
            assert!((series.derivative(0, 3.0 + s) - wave * (w * s).cos()).abs() < 1e-6);
            assert!((series.derivative(1, 3.0 + s) - first).abs() < 1e-4 * w);
            assert!((series.derivative(2, 3.0 + s) - second).abs() < 1e-2 * w * w);
        }
    }
}
