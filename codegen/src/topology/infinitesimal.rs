//! Joints that can begin to turn but not go on: infinitesimal motions.
//!
//! Where a vertex has a plate with a corner of half a turn, the creases inside the other half lie in one plane with it at
//! every state. They satisfy the equations of closure for velocities, but no finite motion turns them: their end points
//! are already as far apart as they can be. Such states have more null vectors than motions (R. Connelly & W. Whiteley,
//! "Second-order rigidity and prestress stability for tensegrity frameworks", 1996). A step along a motion stays where
//! it goes when the loops are closed again, up to its square; a step along an infinitesimal one falls back.

use nalgebra::{DMatrix, DVector, RowDVector};

use super::closure::Closure;
use super::mobility::{self, Random};
use super::sparse::Echelon;

/// Lengths of the steps, rad. What falls back of a step along a motion is its square over the distance from the next
/// singular state, so that both would fall back only next to one.
const STEPS: [f64; 2] = [1e-3, 1e-4];
/// What is left of a row is zero below this fraction of the largest entry: the root of rounding errors.
const ROUNDING: f64 = 1e-4;
/// How far the loops are open after the shorter step, over that after the longer one, is less than this if it is a
/// square: the squares are as 1 to 100.
const SQUARE: f64 = 0.03;
/// Share of a step of which more must fall back.
const FALLS_BACK: f64 = 0.1;
/// What falls back is zero below this share of the largest: entries and singular values.
const SMALL: f64 = 0.1;
/// Weight of joints that are taken after others.
const LATER: f64 = 1e-3;
/// Steps along random null vectors, before all null vectors are looked at.
const TRIALS: usize = 4;

/// What of the null space at a closed state is no motion.
#[derive(Debug, Default)]
pub struct Infinitesimal {
    /// Columns of the joints that turn in it and in no motion.
    pub stuck: Vec<usize>,
    /// Columns of as many joints as it has dimensions: if these are held, all are. Those that are stuck come first, and
    /// among them those that are driven.
    pub holding: Vec<usize>,
    /// The rank of the closure, if there is such a motion. Stuck joints are known to the root of rounding errors only,
    /// so that a rank may seem larger.
    pub rank: usize,
}

impl Infinitesimal {
    /// Looks at the null space at the closed state `q`.
    pub fn at(closure: &Closure, q: &DVector<f64>) -> Self {
        let n = q.len();
        let echelon = Echelon::new(closure.twists(q), n, ROUNDING);
        let mut random = Random::new();
        let mut direction = || {
            let direction = echelon.projected(&random.vector(n, 1.0));
            direction.scale(1.0 / direction.amax())
        };
        let open =
            |direction: &DVector<f64>, step| closure.largest_residual(&(q + direction * step));
        let is_no_motion = |direction: &DVector<f64>| {
            let [long, short] = STEPS;
            // Next to a singular state, small pivots may be none of rounding: then what opens is not a square.
            let is_square = open(direction, short) < SQUARE * open(direction, long);
            let falls_back = |step: &f64| {
                fallen_back(closure, q, direction, *step)
                    .is_some_and(|fallen| fallen.amax() > FALLS_BACK)
            };
            is_square && STEPS.iter().all(falls_back)
        };
        if echelon.rank() == n || !(0..TRIALS).any(|_| is_no_motion(&direction())) {
            return Self::default();
        }
        // A row for each direction. Angles at a double root are known to some 1e-5 rad, which is little beside the longer step.
        let mut fallen = DMatrix::zeros(n - echelon.rank(), n);
        let mut stays = fallen.clone();
        for (mut fallen, mut stays) in fallen.row_iter_mut().zip(stays.row_iter_mut()) {
            let direction = direction();
            if let Some(found) = fallen_back(closure, q, &direction, STEPS[0]) {
                fallen.copy_from(&found.transpose());
                stays.copy_from(&(direction - found).transpose());
            }
        }
        let sizes = fallen.singular_values();
        let dimensions = sizes.iter().filter(|size| **size > SMALL * sizes.amax()).count();
        let is_stuck =
            |column: usize| stays.column(column).amax() < SMALL * fallen.column(column).amax();
        let stuck: Vec<usize> = (0..n).filter(|column| is_stuck(*column)).collect();
        let mut weighed = fallen.clone();
        for (column, mut entries) in weighed.column_iter_mut().enumerate() {
            entries *= match (is_stuck(column), closure.is_driven(column)) {
                (true, true) => 1.0 / LATER,
                (true, false) => 1.0,
                (false, _) => LATER,
            };
        }
        let mut order = RowDVector::from_fn(n, |_, column| column);
        weighed.col_piv_qr().p().permute_columns(&mut order);
        let holding = order.iter().take(dimensions).copied().collect();
        Self { stuck, holding, rank: echelon.rank() }
    }
}

/// What is lost of a step along `direction`, over its length, when the loops are closed again.
fn fallen_back(
    closure: &Closure,
    q: &DVector<f64>,
    direction: &DVector<f64>,
    step: f64,
) -> Option<DVector<f64>> {
    let next = mobility::assemble(closure, &(q + direction * step))?;
    Some(direction - (next - q) / step)
}
