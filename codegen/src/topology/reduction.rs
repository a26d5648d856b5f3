//! Reduction to independent speeds: which joints have them, and by which closure rows, in which order,
//! they determine the speeds of all others.
//!
//! With the speeds y of the independent joints, every motion that keeps the loops closed is u = N y. The
//! rows of many loops depend on each other: in a sheet of n loops up to n rows follow from the others, and
//! a matrix of all of them has no inverse. Elimination with chosen pivots does not need one: a row whose
//! remainder vanishes at every closed state is dropped. The pivots are chosen once, at several closed
//! states, so that straight-line code can eliminate with them:
//!
//! - Independent joints: those for which the volume of N is largest, that is, for which no other choice of
//!   one joint makes the entries of N smaller on the whole (S. A. Goreinov, E. E. Tyrtyshnikov, "The
//!   maximal-volume concept in approximation by low-rank matrices", 2001).
//! - Pivots: those that fill in the fewest entries (H. M. Markowitz, "The elimination form of the inverse
//!   and its application to linear programming", 1957) among those that are not small in their row at any
//!   of the states.

use std::collections::{BTreeMap, BTreeSet};

use nalgebra::DVector;

use super::closure::Closure;
use super::graph::{Pivot, Reduction};
use super::mobility::{self, Random};
use crate::arithmetic::larger;
use crate::source::JointId;

/// Smallest pivots relative to the largest entry of their row, in the order in which they are tried.
const THRESHOLDS: [f64; 3] = [0.2, 0.05, 0.01];
/// Remainders of rows below this, relative to the loops' lengths, are rounding errors.
const VANISHING: f64 = 1e-7;
/// Angles of the states relative to those of the assembled state.
const FOLDS: [f64; 5] = [1.0, 0.5, 0.2, 0.05, 0.01];
/// Number of states beside the assembled one along random motions, and how far away they are, rad.
const BESIDE: usize = 6;
const REACH: f64 = 0.2;
/// Factor of volume below which an exchange of joints is not worth making.
const GAIN: f64 = 1.001;

/// Entries of a row by column, one number for each state.
type Row = BTreeMap<usize, Vec<f64>>;

/// An elimination at several states.
struct Elimination {
    /// Rows with their columns, as they were when they became pivots.
    pivots: Vec<(Pivot, Row)>,
}

/// Chooses independent joints and pivots for the rows of all loops, `rank` of which are independent.
/// `assembled` is a closed state with that rank. Returns nothing if there are no pivots that suit all
/// states.
pub fn reduction(closure: &Closure, assembled: &DVector<f64>, rank: usize) -> Option<Reduction> {
    let n = closure.joints.len();
    let states: Vec<Vec<Vec<(usize, f64)>>> =
        states(closure, assembled).iter().map(|q| closure.rows(q)).collect();
    let rows = rows(&states)?;
    let loops = closure.loops_of_rows();
    let free: Vec<usize> = THRESHOLDS.iter().find_map(|threshold| {
        let first = eliminate(rows.clone(), &loops, &[], *threshold, rank)?;
        Some(largest_volume(&first, n, states.len()))
    })?;
    let chosen =
        THRESHOLDS.iter().find_map(|t| eliminate(rows.clone(), &loops, &free, *t, rank))?;
    Some(Reduction {
        independent: free.into_iter().map(JointId).collect(),
        pivots: chosen.pivots.into_iter().map(|(pivot, _)| pivot).collect(),
    })
}

/// Returns closed states of the same motion as `assembled`: nearer to the flat state, and beside it.
fn states(closure: &Closure, assembled: &DVector<f64>) -> Vec<DVector<f64>> {
    let mut random = Random::new();
    let mut states = Vec::new();
    let mut add = |start: DVector<f64>| {
        let near = |q: &DVector<f64>| (q - &start).amax() <= 0.5 * start.amax();
        states.extend(mobility::assemble(closure, &start).filter(near));
    };
    for fold in FOLDS {
        add(assembled * fold);
    }
    for _ in 0..BESIDE {
        add(assembled + random.vector(assembled.len(), REACH));
    }
    states
}

/// Returns the rows of all states together; nothing if there is no state.
fn rows(states: &[Vec<Vec<(usize, f64)>>]) -> Option<Vec<Row>> {
    let mut rows = vec![Row::new(); states.first()?.len()];
    for (index, state) in states.iter().enumerate() {
        for (row, entries) in rows.iter_mut().zip(state) {
            for &(column, value) in entries {
                row.entry(column).or_insert_with(|| vec![0.0; states.len()])[index] = value;
            }
        }
    }
    Some(rows)
}

/// Eliminates loop by loop, with pivots that are at least `threshold` of the largest entry of their row at every state,
/// in columns that are not `free`. Returns nothing if there are not `rank` such pivots, or if more rows are
/// left than vanish.
fn eliminate(
    mut rows: Vec<Row>,
    loops: &[usize],
    free: &[usize],
    threshold: f64,
    rank: usize,
) -> Option<Elimination> {
    let mut left: Vec<usize> = (0..rows.len()).collect();
    let mut pivots = Vec::with_capacity(rank);
    while pivots.len() < rank {
        let before = pivots.len();
        for chosen in by_cost(&rows, &left, loops, free) {
            while pivots.len() < rank
                && let Some((row, column)) =
                    next_pivot(&rows, &left, |row| loops[row] == chosen, free, threshold)
            {
                left.retain(|other| *other != row);
                let pivot_row = std::mem::take(&mut rows[row]);
                take_out(&mut rows, &left, &pivot_row, column);
                pivots.push((Pivot { row, joint: JointId(column) }, pivot_row));
            }
            if pivots.len() > before {
                break;
            }
        }
        if pivots.len() == before {
            return None;
        }
    }
    let rest = left.iter().flat_map(|row| rows[*row].values()).flatten();
    rest.map(|x| x.abs()).fold(0.0, larger).le(&VANISHING).then_some(Elimination { pivots })
}

/// Eliminates a column from the rows that are left.
fn take_out(rows: &mut [Row], left: &[usize], pivot_row: &Row, column: usize) {
    let pivot = &pivot_row[&column];
    for &other in left {
        let Some(entries) = rows[other].remove(&column) else { continue };
        let factors: Vec<f64> = entries.iter().zip(pivot).map(|(a, p)| a / p).collect();
        for (&at, values) in pivot_row.iter().filter(|(at, _)| **at != column) {
            let place = rows[other].entry(at).or_insert_with(|| vec![0.0; factors.len()]);
            for ((x, factor), value) in place.iter_mut().zip(&factors).zip(values) {
                *x -= factor * value;
            }
        }
    }
}

/// Returns the loops that have rows left, first those whose elimination fills in the fewest entries: at most as many as the
/// product of the columns that they leave and the loops that have these or the eliminated columns.
fn by_cost(rows: &[Row], left: &[usize], loops: &[usize], free: &[usize]) -> Vec<usize> {
    let mut columns: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    let mut users: BTreeMap<usize, BTreeSet<usize>> = BTreeMap::new();
    let mut count: BTreeMap<usize, usize> = BTreeMap::new();
    for &row in left {
        *count.entry(loops[row]).or_default() += 1;
        for &column in rows[row].keys().filter(|column| !free.contains(column)) {
            columns.entry(loops[row]).or_default().insert(column);
            users.entry(column).or_default().insert(loops[row]);
        }
    }
    let cost = |(at, columns): (&usize, &BTreeSet<usize>)| {
        let others: BTreeSet<usize> =
            columns.iter().flat_map(|column| users[column].iter().copied()).collect();
        let rest = columns.len().saturating_sub(count[at]);
        (rest * (others.len() - 1), *at)
    };
    let mut costs: Vec<(usize, usize)> = columns.iter().map(cost).collect();
    costs.sort_unstable();
    costs.into_iter().map(|(_, at)| at).collect()
}

/// Returns the pivot of the rows of a loop that fills in the fewest entries.
fn next_pivot(
    rows: &[Row],
    left: &[usize],
    is_candidate: impl Fn(usize) -> bool,
    free: &[usize],
    threshold: f64,
) -> Option<(usize, usize)> {
    let candidates = || left.iter().copied().filter(|row| is_candidate(*row));
    let mut in_column: BTreeMap<usize, usize> =
        candidates().flat_map(|row| rows[row].keys().map(|column| (*column, 0))).collect();
    for row in left {
        for column in rows[*row].keys() {
            if let Some(count) = in_column.get_mut(column) {
                *count += 1;
            }
        }
    }
    let mut best: Option<(usize, (usize, usize))> = None;
    for row in candidates() {
        let entries = &rows[row];
        let Some(states) = entries.values().next().map(Vec::len) else { continue };
        let mut largest = vec![0.0; states];
        for values in entries.values() {
            for (largest, value) in largest.iter_mut().zip(values) {
                *largest = larger(*largest, value.abs());
            }
        }
        if largest.iter().any(|largest| *largest <= VANISHING) {
            continue;
        }
        let suits = |values: &[f64]| {
            values.iter().zip(&largest).all(|(x, largest)| x.abs() >= threshold * largest)
        };
        for (&column, values) in entries {
            let fill = (entries.len() - 1) * (in_column[&column] - 1);
            let is_better = best.is_none_or(|(least, _)| fill < least);
            if is_better && !free.contains(&column) && suits(values) {
                best = Some((fill, (row, column)));
            }
        }
    }
    best.map(|(_, pivot)| pivot)
}

/// Exchanges joints until no exchange enlarges the volume of N over all states. Returns the independent
/// columns in order.
fn largest_volume(elimination: &Elimination, n: usize, states: usize) -> Vec<usize> {
    let mut dependent: Vec<usize> =
        elimination.pivots.iter().map(|(pivot, _)| pivot.joint.index()).collect();
    let mut free: Vec<usize> = (0..n).filter(|column| !dependent.contains(column)).collect();
    let mut tables: Vec<Vec<Vec<f64>>> =
        (0..states).map(|state| null_space(elimination, &free, n, state)).collect();
    loop {
        let gain =
            |i: usize, k: usize| -> f64 { tables.iter().map(|table| table[i][k].abs()).product() };
        let pairs = (0..dependent.len()).flat_map(|i| (0..free.len()).map(move |k| (i, k)));
        let best = pairs.map(|(i, k)| (gain(i, k), i, k)).max_by(|a, b| a.0.total_cmp(&b.0));
        let Some((_, i, k)) = best.filter(|(gain, ..)| *gain > GAIN) else { break };
        tables.iter_mut().for_each(|table| exchange(table, i, k));
        std::mem::swap(&mut dependent[i], &mut free[k]);
    }
    free.sort_unstable();
    free
}

/// Returns the rows of N of the dependent columns at a state, in the order of the pivots.
fn null_space(elimination: &Elimination, free: &[usize], n: usize, state: usize) -> Vec<Vec<f64>> {
    let mut speeds = vec![vec![0.0; free.len()]; n];
    for (k, column) in free.iter().enumerate() {
        speeds[*column][k] = 1.0;
    }
    for (Pivot { joint, .. }, row) in elimination.pivots.iter().rev() {
        let mut sum = vec![0.0; free.len()];
        for (column, values) in row.iter().filter(|(column, _)| **column != joint.index()) {
            for (sum, speed) in sum.iter_mut().zip(&speeds[*column]) {
                *sum -= values[state] * speed;
            }
        }
        let pivot = row[&joint.index()][state];
        speeds[joint.index()] = sum.into_iter().map(|sum| sum / pivot).collect();
    }
    elimination.pivots.iter().map(|(pivot, _)| speeds[pivot.joint.index()].clone()).collect()
}

/// Exchanges the dependent column of row i and the independent column k.
fn exchange(table: &mut [Vec<f64>], i: usize, k: usize) {
    let pivot = table[i][k];
    // y_k = (u_i - sum of the others) / pivot
    let mut solved: Vec<f64> = table[i].iter().map(|x| -x / pivot).collect();
    solved[k] = 1.0 / pivot;
    for (at, row) in table.iter_mut().enumerate() {
        if at == i {
            continue;
        }
        let factor = row[k];
        for (column, (x, solved)) in row.iter_mut().zip(&solved).enumerate() {
            *x = if column == k { factor * solved } else { *x + factor * solved };
        }
    }
    table[i] = solved;
}
