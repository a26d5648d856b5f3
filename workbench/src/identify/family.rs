//! Polynomials of a family of hinges from a table of measured specimens.
//!
//! The form is that of Sharifzadeh, Khodambashi, Aukes, DETC2018-86359: powers of each variable up to
//! the second, no mixed terms; b by l, w and a, k by l and w. A variable has no more powers than it
//! has values in the table less one. Coefficients are those of least squares; the error of
//! prediction is cross-validated, each specimen against the fit to the others, e_i / (1 - h_i) with
//! the leverages h (D. M. Allen, "The relationship between variable selection and data augmentation
//! and a method for prediction", 1974).

use std::fmt::Write;

use nalgebra::{DMatrix, DVector};

use lamc::source::{Diagnostics, Polynomial, Term, is_identifier, is_keyword, read_in};

use crate::reading::Table;

/// Highest power of a variable.
const DEGREE: u8 = 2;
/// Columns of length one that differ by less are the same.
const DISTINCT: f64 = 1e-10;

/// A measured hinge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specimen {
    /// l (m), w (m), a (m^2).
    pub at: [f64; 3],
    /// k, N m/rad.
    pub stiffness: f64,
    /// b, N m s/rad.
    pub damping: f64,
}

/// A polynomial with its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct Regression {
    /// By l, w and a.
    pub polynomial: Polynomial,
    /// The mean absolute error.
    pub error: f64,
    /// The mean absolute error of prediction: each specimen is compared with the fit to the others. It is infinite if
    /// the others do not determine the polynomial.
    pub validated: f64,
    /// The mean of the measured values.
    pub mean: f64,
}

/// Why the regression failed.
#[derive(Debug, thiserror::Error)]
pub enum FamilyError {
    /// There are fewer specimens than coefficients.
    #[error(
        "{specimens} specimens are not enough to determine the {terms} coefficients of \
             {what}"
    )]
    TooFew {
        /// Measured.
        specimens: usize,
        /// Of the polynomial.
        terms: usize,
        /// Stiffness or damping.
        what: &'static str,
    },
    /// Lengths, widths and areas vary together.
    #[error("the specimens do not determine the terms of {0}: vary one dimension at a time")]
    Indistinct(&'static str),
}

/// Reads a table with the columns `l`, `w`, `a`, `k` and `b`, each with its unit or SI: `l [mm]`.
///
/// # Errors
/// Missing columns, units of another dimension, fields that are not positive numbers.
pub fn read(text: &str) -> Result<Vec<Specimen>, Diagnostics> {
    let table = Table::read(text)?;
    let known = [("l", "m"), ("w", "m"), ("a", "m^2"), ("k", "N*m/rad"), ("b", "N*m*s/rad")];
    let mut columns = [(0, 0.0); 5];
    for (place, (name, unit)) in columns.iter_mut().zip(known) {
        let named = |title: &str| title.split('[').next().is_some_and(|head| head.trim() == name);
        let found = table.names().enumerate().find(|(_, title)| named(title));
        let (column, title) =
            found.ok_or_else(|| table.missing(format!("there is no column `{name} [{unit}]`")))?;
        let given = title.split_once('[').map(|(_, rest)| rest.trim_end_matches(']'));
        let factor = given.map_or(Ok(1.0), |given| read_in(&format!("1 {given}"), unit));
        let factor = factor.map_err(|_| {
            let message = format!("`{title}` has no unit of `{name}`, as in `{name} [{unit}]`");
            table.wrong_column(column, message)
        })?;
        *place = (column, factor);
    }
    let mut specimens = Vec::new();
    table.rows(|row| {
        let number = |(column, factor): (usize, f64)| -> Result<f64, Diagnostics> {
            let number = row.number(column)?.map(|number| number * factor);
            let positive = number.filter(|x| x.is_finite() && *x > 0.0);
            positive.ok_or_else(|| row.wrong(column, "a positive number").into())
        };
        let [l, w, a, k, b] = columns.map(number);
        specimens.push(Specimen { at: [l?, w?, a?], stiffness: k?, damping: b? });
        Ok(())
    })?;
    Ok(specimens)
}

/// The polynomials k(l, w) and b(a, l, w) of a family.
///
/// # Errors
/// Too few specimens, or specimens that do not distinguish the terms.
pub fn regress(specimens: &[Specimen]) -> Result<[Regression; 2], FamilyError> {
    let of = |what: &'static str, variables: usize, value: fn(&Specimen) -> f64| {
        fit(specimens, &terms(specimens, variables), what, value)
    };
    Ok([
        of("stiffness", 2, |specimen| specimen.stiffness)?,
        of("damping", 3, |specimen| specimen.damping)?,
    ])
}

/// The powers of the first variables that the specimens can determine.
fn terms(specimens: &[Specimen], variables: usize) -> Vec<[u8; 3]> {
    let mut terms = vec![[0; 3]];
    for variable in 0..variables {
        let mut values: Vec<f64> = specimens.iter().map(|specimen| specimen.at[variable]).collect();
        values.sort_by(f64::total_cmp);
        values.dedup_by(|a, b| (*a - *b).abs() <= 1e-9 * b.abs());
        for power in (1..=DEGREE).filter(|power| usize::from(*power) < values.len()) {
            let mut powers = [0; 3];
            powers[variable] = power;
            terms.push(powers);
        }
    }
    terms
}

fn fit(
    specimens: &[Specimen],
    terms: &[[u8; 3]],
    what: &'static str,
    value: fn(&Specimen) -> f64,
) -> Result<Regression, FamilyError> {
    if specimens.len() < terms.len() {
        return Err(FamilyError::TooFew { specimens: specimens.len(), terms: terms.len(), what });
    }
    let (m, p) = (specimens.len(), terms.len());
    let monomial = |row: usize, column: usize| {
        Term { coefficient: 1.0, powers: terms[column] }.monomial(specimens[row].at)
    };
    let mut design = DMatrix::from_fn(m, p, monomial);
    let lengths: Vec<f64> = design.column_iter().map(|column| column.norm()).collect();
    for (mut column, length) in design.column_iter_mut().zip(&lengths) {
        column /= *length;
    }
    let right = DVector::from_iterator(m, specimens.iter().map(value));
    let qr = design.qr();
    let (q, r) = (qr.q(), qr.r());
    if (0..p).any(|k| r[(k, k)].abs() <= DISTINCT) {
        return Err(FamilyError::Indistinct(what));
    }
    let along = q.transpose() * &right;
    let solved = r.solve_upper_triangular(&along).ok_or(FamilyError::Indistinct(what))?;
    let left = &right - &q * &along;
    let validated = left.iter().zip(q.row_iter()).map(|(error, row)| {
        let rest = 1.0 - row.norm_squared();
        if rest > 1e-9 { (error / rest).abs() } else { f64::INFINITY }
    });
    let mean_of = |sum: f64| sum / m as f64;
    let coefficients = solved.iter().zip(&lengths).zip(terms);
    let term = |((x, length), powers): ((&f64, &f64), &[u8; 3])| Term {
        coefficient: x / length,
        powers: *powers,
    };
    Ok(Regression {
        polynomial: Polynomial(coefficients.map(term).collect()),
        error: mean_of(left.iter().map(|error| error.abs()).sum()),
        validated: mean_of(validated.sum()),
        mean: mean_of(right.sum()),
    })
}

/// Returns why this is not a valid name of a family.
pub fn unusable(name: &str) -> Option<String> {
    if ["beam", "sharifzadeh2018"].contains(&name) {
        return Some(format!("`{name}` is the name of a built-in model"));
    }
    let usable = is_identifier(name) && !is_keyword(name);
    (!usable).then(|| {
        format!(
            "`{name}` is not a valid name: it must have letters, digits and `_` only, not \
                 start with a digit and not be a keyword"
        )
    })
}

/// Writes the family as an entry of `hinge_models`.
pub fn to_yaml(
    name: &str,
    [stiffness, damping]: &[Regression; 2],
    specimens: &[Specimen],
) -> String {
    let mut text = format!("hinge_models:\n  {name}:\n");
    let known = [("stiffness", stiffness, "N m/rad"), ("damping", damping, "N m s/rad")];
    for (what, regression, unit) in known {
        let Regression { error, validated, mean, .. } = regression;
        let percent = 100.0 * error / mean;
        let validated = match validated.is_finite() {
            true => format!("{validated:.3e} {unit} cross-validated"),
            false => "not cross-validated: one of the terms depends on a single specimen".into(),
        };
        let _ = writeln!(text, "    # mean error {error:.3e} {unit} ({percent:.2} %), {validated}");
        let _ = writeln!(text, "    {what}:  # [coefficient, powers of length, width, area], SI");
        for Term { coefficient, powers: [l, w, a] } in &regression.polynomial.0 {
            let _ = writeln!(text, "      - [{coefficient:e}, {l}, {w}, {a}]");
        }
    }
    let _ = writeln!(text, "    specimens:  # [length, width, area], m and m^2");
    for Specimen { at: [l, w, a], .. } in specimens {
        let _ = writeln!(text, "      - [{l:e}, {w:e}, {a:e}]");
    }
    text
}
