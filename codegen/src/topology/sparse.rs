//! Rank and null space of the hinges' twists around loops, by sparse elimination row by row; and symmetric equations.
//!
//! A loop has entries only for its own hinges, so the rows of a sheet stay short. The pivot of a row is
//! its largest entry after the earlier pivot rows are taken from it.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BinaryHeap};

use clarabel::algebra::CscMatrix;
use clarabel::qdldl::{QDLDLFactorisation, QDLDLSettingsBuilder};
use nalgebra::{DMatrix, DVector};

use crate::arithmetic::larger;

/// Pivots are at first at least this fraction of the largest entry, then this fraction of that, and so on.
const STEP: f64 = 0.1;

/// Entries of a row by column. The column after those of the matrix is the right-hand side, if there is one.
pub type Row = BTreeMap<usize, f64>;

/// The same in order, for elimination.
type Entries = Vec<(usize, f64)>;

/// Rows in echelon form.
pub struct Echelon {
    columns: usize,
    /// Pivot column and the row divided by its pivot, without the pivot.
    rows: Vec<(usize, Entries)>,
    /// What is left of the other rows.
    pub rest: Vec<Row>,
}

impl Echelon {
    /// Eliminates rows of so many columns. What remains of a row counts as zero up to `tolerance` times
    /// the largest entry of all rows.
    pub fn new(rows: Vec<Row>, columns: usize, tolerance: f64) -> Self {
        let mut waiting: Vec<Entries> = rows.into_iter().map(Entries::from_iter).collect();
        let scale = waiting
            .iter()
            .filter_map(|row| largest(row, columns))
            .map(|(_, x)| x.abs())
            .fold(0.0, larger);
        let mut echelon = Self { columns, rows: Vec::new(), rest: Vec::new() };
        let mut place: Vec<Option<usize>> = vec![None; columns];
        let ends = waiting.iter().filter_map(|row| row.last());
        let mut sums = Sums::new(ends.map(|(column, _)| column + 1).max().unwrap_or(0));
        // Rows with small pivots come last, because division by them enlarges rounding errors.
        let mut least = 1.0;
        while least > tolerance {
            least = (STEP * least).max(tolerance);
            for mut row in std::mem::take(&mut waiting) {
                row = echelon.reduced(&row, &place, &mut sums);
                match largest(&row, columns).filter(|(_, x)| x.abs() > least * scale) {
                    None => waiting.push(row),
                    Some((pivot, value)) => {
                        row.retain(|(column, _)| *column != pivot);
                        row.iter_mut().for_each(|(_, x)| *x /= value);
                        place[pivot] = Some(echelon.rows.len());
                        echelon.rows.push((pivot, row));
                    }
                }
            }
        }
        echelon.rest = waiting.into_iter().map(Row::from_iter).collect();
        echelon
    }

    /// Returns a row after multiples of the pivot rows are taken from it, so that it has no entries in their
    /// columns. `place` is the pivot row of each column.
    fn reduced(&self, row: &Entries, place: &[Option<usize>], sums: &mut Sums) -> Entries {
        let place = |column: usize| place.get(column).copied().flatten();
        // Pivot rows have entries in columns of later pivot rows only.
        let mut waiting = BinaryHeap::new();
        sums.add(row, 1.0, |column| waiting.extend(place(column).map(Reverse)));
        while let Some(Reverse(first)) = waiting.pop() {
            let (pivot, pivot_row) = &self.rows[first];
            let factor = -sums.values[*pivot];
            sums.add(pivot_row, factor, |column| waiting.extend(place(column).map(Reverse)));
        }
        let mut entries = sums.take();
        entries.retain(|(column, _)| place(*column).is_none());
        entries
    }

    /// Returns the number of independent rows.
    pub fn rank(&self) -> usize {
        self.rows.len()
    }

    /// Returns the projections of vectors onto the null space: for each the nearest vector x with
    /// J x = 0.
    pub fn projected(&self, vector: &DVector<f64>) -> DVector<f64> {
        let basis = self.null_space();
        if basis.ncols() == 0 {
            return DVector::zeros(self.columns);
        }
        let products = basis.tr_mul(&basis);
        let along = products.cholesky().map(|factors| factors.solve(&basis.tr_mul(vector)));
        along.map_or_else(|| DVector::zeros(self.columns), |along| &basis * along)
    }

    /// Returns the x with J x = b that is zero in the columns without pivot.
    pub fn solution(&self) -> DVector<f64> {
        let mut x = DVector::zeros(self.columns);
        for (pivot, row) in self.rows.iter().rev() {
            let (within, right) = row.split_at(self.within(row));
            let within = within.iter().map(|(column, value)| value * x[*column]);
            let right = right.iter().map(|(_, value)| *value);
            x[*pivot] = right.sum::<f64>() - within.sum::<f64>();
        }
        x
    }

    /// Returns how many entries of a row are in columns of the matrix.
    fn within(&self, row: &Entries) -> usize {
        row.partition_point(|(column, _)| *column < self.columns)
    }

    /// Returns a basis of the null space, as columns.
    fn null_space(&self) -> DMatrix<f64> {
        let mut is_pivot = vec![false; self.columns];
        self.rows.iter().for_each(|(pivot, _)| is_pivot[*pivot] = true);
        let free: Vec<usize> = (0..self.columns).filter(|column| !is_pivot[*column]).collect();
        // Columns of the transposed basis belong to the columns of J, so each is contiguous.
        let mut basis: DMatrix<f64> = DMatrix::zeros(free.len(), self.columns);
        for (k, column) in free.iter().enumerate() {
            basis[(k, *column)] = 1.0;
        }
        for (pivot, row) in self.rows.iter().rev() {
            let mut sum = DVector::zeros(free.len());
            for (column, value) in &row[..self.within(row)] {
                sum.axpy(-value, &basis.column(*column), 1.0);
            }
            basis.set_column(*pivot, &sum);
        }
        basis.transpose()
    }
}

/// Returns the solution of equations with a symmetric matrix that is definite, or quasidefinite, so that it has a factor in every order
/// (R. J. Vanderbei, "Symmetric quasidefinite matrices", 1995); and how many of the matrix's eigenvalues are positive. Given are the columns
/// of its upper triangle, each with an entry on the diagonal.
pub fn symmetric_solution(columns: &[Row], mut right: Vec<f64>) -> Option<(Vec<f64>, usize)> {
    let size = columns.len();
    let ends = columns.iter().scan(0, |end, column| {
        *end += column.len();
        Some(*end)
    });
    let starts = std::iter::once(0).chain(ends).collect();
    let (places, values) = columns.iter().flatten().unzip();
    let matrix = CscMatrix::new(size, size, starts, places, values);
    let settings = QDLDLSettingsBuilder::default().regularize_enable(false).build().ok();
    let mut factors = QDLDLFactorisation::new(&matrix, settings).ok()?;
    factors.solve(&mut right);
    Some((right, factors.positive_inertia()))
}

/// Returns the entry of largest magnitude in the columns of the matrix.
fn largest(row: &Entries, columns: usize) -> Option<(usize, f64)> {
    let entries = row.iter().copied().take_while(|(column, _)| *column < columns);
    entries.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs()))
}

/// The sum of rows, with a place for every column.
struct Sums {
    values: Vec<f64>,
    is_used: Vec<bool>,
    used: Vec<usize>,
}

impl Sums {
    fn new(columns: usize) -> Self {
        Self { values: vec![0.0; columns], is_used: vec![false; columns], used: Vec::new() }
    }

    /// Adds a multiple of a row, and shows the columns that had no entry before.
    fn add(&mut self, row: &Entries, factor: f64, mut show: impl FnMut(usize)) {
        for &(column, value) in row {
            self.values[column] += factor * value;
            if !std::mem::replace(&mut self.is_used[column], true) {
                self.used.push(column);
                show(column);
            }
        }
    }

    /// Returns the entries, and begins again.
    fn take(&mut self) -> Entries {
        self.used.sort_unstable();
        let used = std::mem::take(&mut self.used);
        let entry = |column: usize| {
            self.is_used[column] = false;
            (column, std::mem::take(&mut self.values[column]))
        };
        used.into_iter().map(entry).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rows(matrix: &DMatrix<f64>) -> Vec<Row> {
        let entries = |i: usize| matrix.row(i).iter().copied().enumerate().collect::<Row>();
        (0..matrix.nrows()).map(entries).collect()
    }

    #[test]
    fn rank_and_null_space_are_those_of_the_factors() {
        for rank in 0..5_usize {
            let left = DMatrix::from_fn(7, rank, |i, j| ((i * i + 3 * j * j * i + j) as f64).sin());
            let right = DMatrix::from_fn(rank, 6, |i, j| ((i * j * j + 2 * j + i) as f64).cos());
            let matrix = left * &right;
            let echelon = Echelon::new(rows(&matrix), 6, 1e-9);
            assert_eq!(echelon.rank(), rank);
            let vector = DVector::from_fn(6, |i, _| (i as f64).exp());
            let nearest = echelon.projected(&vector);
            assert!((&right * &nearest).amax() <= 1e-9, "rank {rank}");
            let mut equations = rows(&matrix);
            let right = &matrix * &vector;
            equations.iter_mut().zip(&right).for_each(|(row, b)| {
                row.insert(6, *b);
            });
            let solution = Echelon::new(equations, 6, 1e-9).solution();
            assert!((&matrix * solution - right).amax() <= 1e-9);
            // What was taken away is a combination of the rows.
            let removed = &vector - &nearest;
            assert!(removed.dot(&nearest).abs() <= 1e-9 * vector.norm_squared());
            assert!((echelon.projected(&nearest) - &nearest).amax() <= 1e-9 * vector.norm());
        }
    }
}
