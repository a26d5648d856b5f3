//! A body that swings on one hinge: stiffness and damping from its recorded angle.
//!
//! ```text
//! (I_G + m r^2) theta'' = -k theta - b theta' - m g r sin theta
//! ```
//!
//! (Sharifzadeh, Khodambashi, Aukes, DETC2018-86359; the arm r belongs to the last term, too.)
//! theta is measured from where the body hangs straight down and the spring is relaxed.

use lamc::source::SourceFile;
use nalgebra::{Matrix2, Vector2};

use super::fit::{Estimate, Fit, FitError, Problem};
use super::fourier::Fourier;
use super::record::Record;
use crate::execution::Jit;

/// The share of a record, at each end, in which the derivatives of the series are not used.
const ENDS: f64 = 0.1;

/// The body that swings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Swing {
    /// I_G, about the centre of mass, kg m^2.
    pub inertia: f64,
    /// m, kg.
    pub mass: f64,
    /// r, from the hinge to the centre of mass, m.
    pub arm: f64,
    /// g, m/s^2.
    pub gravity: f64,
}

impl Swing {
    /// The swing as a model of the joint `theta` with the parameters `k` and `b`.
    pub fn model(&self) -> SourceFile {
        let Self { inertia, mass, arm, gravity } = self;
        // It hangs along x and turns about y.
        let text = format!(
            "name: swing
gravity: [{gravity:e}, 0, 0]
bodies:
  base: {{ fixed: true }}
  body:
    mass: {mass:e}
    com: [{arm:e}, 0, 0]
    inertia: [[{inertia:e}, 0, 0], [0, {inertia:e}, 0], [0, 0, {inertia:e}]]
parameters: {{ k: 0, b: 0 }}
joints: {{ theta: {{ bodies: [base, body], axis: [[0, 0], [0, 1]], stiffness: k, damping: b }} }}
"
        );
        SourceFile { path: "swing.yaml".into(), text }
    }

    /// k and b by the method of the paper: a Fourier series is fitted to the angles, and the equation with its
    /// derivatives is solved by linear least squares. The standard errors assume that the residuals of the equation are
    /// independent noise, which is not the case. `None` if there is no series or no motion.
    pub fn by_derivatives(&self, t: &[f64], theta: &[f64]) -> Option<([Estimate; 2], Fourier)> {
        let series = Fourier::fit(t, theta)?;
        let about_hinge = self.inertia + self.mass * self.arm * self.arm;
        let (begin, end) = (t[0], t[t.len() - 1]);
        let margin = ENDS * (end - begin);
        let (mut normal, mut right) = (Matrix2::zeros(), Vector2::zeros());
        let mut rows = Vec::new();
        for &t in t.iter().filter(|t| (begin + margin..=end - margin).contains(*t)) {
            let [q, u, a] = [0, 1, 2].map(|order| series.derivative(order, t));
            let row = Vector2::new(-q, -u);
            let value = about_hinge * a + self.mass * self.gravity * self.arm * q.sin();
            normal += row * row.transpose();
            right += row * value;
            rows.push((row, value));
        }
        let inverse = normal.try_inverse()?;
        let found = inverse * right;
        let left: f64 = rows.iter().map(|(row, value)| (row.dot(&found) - value).powi(2)).sum();
        let variance = left / (rows.len().checked_sub(2).filter(|left| *left > 0)?) as f64;
        let estimate = |name: &str, k: usize| Estimate {
            name: name.into(),
            value: found[k],
            standard_error: (variance * inverse[(k, k)]).sqrt(),
        };
        Some(([estimate("k", 0), estimate("b", 1)], series))
    }

    /// k and b by fitting the simulated swing; the first guess is that of [`by_derivatives`](Self::by_derivatives).
    /// `system` is that of the compiled [`model`](Self::model).
    ///
    /// # Errors
    /// [`FitError`].
    pub fn by_trajectory(&self, system: &Jit, record: &Record) -> Result<Fit, FitError> {
        let (t, theta) = record.seen(0);
        let mut system = system.clone();
        if let Some((guess, _)) = self.by_derivatives(&t, &theta) {
            for Estimate { name, value, .. } in guess {
                // `compile` declares both.
                let _ = system.set_parameter(&name, value);
            }
        }
        Problem { system, record, free: vec![0, 1], from_rest: false, tolerance: 1e-9 }.solve()
    }
}
