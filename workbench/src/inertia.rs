//! How many digits of an acceleration the mass matrix leaves.
//!
//! The accelerations of independent speeds u_i, u = N u_i, are those of the mass matrix R = N^T M N. With rows and
//! columns scaled so that its diagonal is 1, its condition number times the rounding of numbers is what rounding
//! may make of them, relative to the largest (N. J. Higham, "Accuracy and Stability of Numerical Algorithms", 2002,
//! section 10.1).

use lamc::arithmetic::largest;
use lamc::program::Interface;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism, State};
use nalgebra::DMatrix;

/// Of more speeds the condition number is not computed: it takes longer than everything else before a motion.
const MOST_SPEEDS: usize = 200;
/// Rows of the closure shorter than this share of the longest are redundant, or have faded.
const INDEPENDENT: f64 = 1e-9;
/// Accelerations that may have fewer digits in `f64` than this are warned of.
const FEW_DIGITS: u32 = 7;

/// What the mass matrix leaves.
#[derive(Clone, Debug, PartialEq)]
pub struct Digits {
    /// The condition number of the scaled mass matrix of independent speeds.
    pub condition: f64,
    /// The speed in the direction of least inertia.
    pub speed: String,
}

impl Digits {
    /// At a state whose loops are closed; `None` if there are more than 200 speeds, none, or values that are not finite.
    pub fn at(
        system: &impl Mechanism<Scalar = f64>,
        interface: &Interface,
        state: &State<Vec<f64>, f64>,
    ) -> Option<Self> {
        let size = system.dimensions();
        let (count, rows) = (interface.speeds(), size.rows);
        if count > MOST_SPEEDS {
            return None;
        }
        let [mut mass, mut jacobian] =
            [count * count, rows * count].map(|length| vec![0.0; length]);
        let [mut forcing, mut gamma] = [count, rows].map(|length| vec![0.0; length]);
        let out = EquationsMut {
            mass: &mut mass,
            forcing: &mut forcing,
            jacobian: &mut jacobian,
            gamma: &mut gamma,
        };
        system.write_equations(state.t, &state.q, &state.u, out).ok()?;
        let mass = DMatrix::from_row_slice(count, count, &mass);
        let is_driven =
            |speed: &usize| interface.joints.get(*speed).is_some_and(|joint| joint.driven);
        let kept: Vec<usize> = (0..count).filter(|speed| !is_driven(speed)).collect();
        let mass = mass.select_rows(&kept).select_columns(&kept);
        let jacobian = DMatrix::from_row_slice(rows, count, &jacobian).select_columns(&kept);
        let (scaled, lengths) = scaled(&mass)?;
        let mut weighted = jacobian;
        for (mut column, length) in weighted.column_iter_mut().zip(&lengths) {
            column /= *length;
        }
        let (independent, basis) = independent(&weighted);
        let (reduced, _) = self::scaled(&(basis.transpose() * scaled * &basis))?;
        let eigen = reduced.symmetric_eigen();
        let (least, _) = eigen.eigenvalues.argmin();
        let weights = eigen.eigenvectors.column(least);
        let speed = kept[independent[weights.iamax()]];
        Some(Self {
            condition: eigen.eigenvalues.max() / eigen.eigenvalues[least],
            speed: interface.speed_columns().nth(speed)?.0,
        })
    }

    /// How many digits rounding may take from accelerations.
    pub fn lost(&self) -> u32 {
        // Written so that a condition that is negative by rounding, or not finite, takes all.
        if self.condition < 1.0 / f64::EPSILON && self.condition > 0.0 {
            self.condition.log10().ceil() as u32
        } else {
            f64::DIGITS + 1
        }
    }

    /// A warning of accelerations with few digits.
    pub fn warning(&self) -> Option<String> {
        let left = (f64::DIGITS + 1).saturating_sub(self.lost());
        (left < FEW_DIGITS).then(|| {
            format!(
                "the mass matrix is nearly singular: accelerations may have only {left} digits, because `{}` moves \
                 almost nothing that other joints do not move as well (are masses far apart, or is one very small?)",
                self.speed
            )
        })
    }
}

/// A symmetric matrix with rows and columns scaled to a diagonal of ones, and the lengths by which they were divided.
/// `None` if its diagonal is not positive.
fn scaled(matrix: &DMatrix<f64>) -> Option<(DMatrix<f64>, Vec<f64>)> {
    let lengths: Vec<f64> = matrix.diagonal().iter().map(|entry| entry.sqrt()).collect();
    let is_good =
        !lengths.is_empty() && lengths.iter().all(|length| *length > 0.0 && length.is_finite());
    let entry = |i: usize, k: usize| matrix[(i, k)] / (lengths[i] * lengths[k]);
    is_good.then(|| (DMatrix::from_fn(matrix.nrows(), matrix.ncols(), entry), lengths.clone()))
}

/// Which columns of a matrix are independent of its rows, and the columns of N: what all speeds are at a speed of 1 of each.
fn independent(rows: &DMatrix<f64>) -> (Vec<usize>, DMatrix<f64>) {
    let count = rows.ncols();
    if rows.nrows() == 0 {
        return ((0..count).collect(), DMatrix::identity(count, count));
    }
    let factor = rows.clone().col_piv_qr();
    let triangle = factor.r();
    let mut order = nalgebra::RowDVector::from_fn(count, |_, at| at as f64);
    factor.p().permute_columns(&mut order);
    let order: Vec<usize> = order.iter().map(|&at| at as usize).collect();
    let pivots: Vec<f64> =
        (0..triangle.nrows().min(count)).map(|at| triangle[(at, at)].abs()).collect();
    let cut = INDEPENDENT * largest(&pivots);
    let rank = pivots.iter().take_while(|pivot| **pivot > cut).count();
    let follows = triangle
        .view((0, 0), (rank, rank))
        .solve_upper_triangular(&triangle.view((0, rank), (rank, count - rank)));
    let mut basis = DMatrix::zeros(count, count - rank);
    for column in 0..count - rank {
        basis[(order[rank + column], column)] = 1.0;
        for row in 0..rank {
            basis[(order[row], column)] =
                -follows.as_ref().map_or(0.0, |follows| follows[(row, column)]);
        }
    }
    (order[rank..].to_vec(), basis)
}
