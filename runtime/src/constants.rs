//! Tolerances, limits of iterations and thresholds that this crate and generated C modules share.
//!
//! This table is the only place where such a number is written. The algorithms of this crate name
//! these constants; the C backend prints each of them from [`ALL`], under the same name and in front of
//! the same algorithms in C. A constant that is changed here changes in both.
//!
//! Constants that only one algorithm of this crate uses, and that C does not have, are next to that
//! algorithm.

use crate::Arithmetic;

/// A tolerance that suits `f64` as stated and is as wide as rounding makes necessary in `f32`: the larger
/// of a constant and a multiple of the machine epsilon.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// The constant.
    pub constant: f64,
    /// The multiple of the machine epsilon.
    pub epsilons: f64,
}

impl Tolerance {
    const fn new(constant: f64, epsilons: f64) -> Self {
        Self { constant, epsilons }
    }

    /// The tolerance for a type of number.
    #[inline]
    pub fn of<S: Arithmetic>(self) -> S {
        S::from_f64(self.constant).max(S::from_f64(self.epsilons) * S::EPSILON)
    }
}

/// The value of a constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// A whole number, such as a limit of iterations.
    Count(usize),
    /// A number, rounded to the type that an algorithm computes with.
    Number(f64),
    /// A number that depends on the machine epsilon.
    Tolerance(Tolerance),
    /// A pattern of 64 bits.
    Bits(u64),
}

/// A constant as an entry of the table.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Constant {
    /// The name, in Rust and in C.
    pub name: &'static str,
    /// Documentation of the constant.
    pub doc: &'static str,
    /// The value.
    pub value: Value,
}

/// Defines each constant and its entry in [`ALL`].
macro_rules! constants {
    ($($(#[doc = $doc:literal])+ $name:ident: $type:ident = $value:expr;)+) => {
        $($(#[doc = $doc])+ pub const $name: $type = $value;)+

        /// Every constant of this module, in order.
        pub const ALL: &[Constant] = &[$(Constant {
            name: stringify!($name),
            doc: concat!($($doc, "\n"),+),
            value: constants!(@value $type $name),
        }),+];
    };
    (@value usize $name:ident) => { Value::Count($name) };
    (@value f64 $name:ident) => { Value::Number($name) };
    (@value Tolerance $name:ident) => { Value::Tolerance($name) };
    (@value u64 $name:ident) => { Value::Bits($name) };
}

constants! {
    // Linear algebra.

    /// A row counts as zero below this many epsilons of the length of all entries of its matrix.
    ///
    /// Each entry is rounded to half an epsilon, and a Householder reflection adds about one per row.
    NEGLIGIBLE_EPSILONS: f64 = 8.0;

    /// Two rows count as orthogonal while the cosine of their angle is below this many epsilons.
    ///
    /// Rotations of rows that are closer to orthogonal only exchange rounding.
    ORTHOGONAL_EPSILONS: f64 = 4.0;

    /// Limit on the sweeps of the one-sided Jacobi method over all pairs of rows.
    ///
    /// Convergence is quadratic and takes about six sweeps; the limit bounds the time for values that are
    /// not numbers.
    JACOBI_SWEEPS: usize = 40;

    /// Up to so many speeds, independent rows are found by singular values at once.
    ///
    /// There they cost no more than the factorisations that avoid them.
    FEW_SPEEDS: usize = 12;

    /// Residuals of a loop, of which six are independent at most.
    RESIDUALS_OF_LOOP: usize = 9;

    /// Without singular values, a direction counts or not if it is this many times above or below the cut.
    ///
    /// A diagonal of R may differ from the singular value by the square root of the number of rows, and
    /// hardly ever does by more than ten.
    CLEAR_FACTOR: f64 = 100.0;

    /// Passes of orthogonalisation over all pairs of rows.
    ///
    /// Two are enough (W. Kahan, in B. N. Parlett, "The Symmetric Eigenvalue Problem", 6-9).
    ORTHOGONAL_PASSES: usize = 2;

    /// Parts in which a scalar product of long rows is summed side by side.
    ///
    /// They do not wait for each other.
    PARTS_OF_SUM: usize = 8;

    // Constrained acceleration.

    /// Conditioning of J M^-1 J^T above which its Cholesky factor serves.
    ///
    /// Solving by J M^-1 J^T loses as many digits as its condition number has: in `f64` ten are kept.
    SAFE_CONDITIONING: Tolerance = Tolerance::new(1e-4, 1e5);

    /// In a reduction to independent speeds, an entry of N counts as a conditioning of the inverse square of this many
    /// times it.
    ///
    /// Errors grow as the square of the entries: 20 is the largest that is trusted in `f64`.
    WEIGHT_OF_ENTRY: f64 = 5.0;

    /// As [`SAFE_CONDITIONING`], of a reduction whose results are refined by what is left of the equations.
    REFINED_CONDITIONING: Tolerance = Tolerance::new(1e-8, 1e5);

    /// Largest change by this refinement, as a share of the acceleration.
    ///
    /// What is wrong after it is the square of that.
    CHANGE_OF_REFINEMENT: f64 = 1e-4;

    /// Pivot of the closure below which a reduction to independent speeds is not trusted, over its loop's length.
    ///
    /// Rows fade together with their pivots, so that elimination loses no digits. But closed loops leave the direction of a
    /// row uncertain by rounding divided by the square of its singular value, of which a pivot may be some twenty times.
    LEAST_PIVOT: Tolerance = Tolerance::new(1e-5, 9e5);

    /// Share of an acceleration that rounding of the state may make where its own rows count.
    ///
    /// Above it, a direction that has nearly faded is taken along the motion instead.
    NOISE_OF_ACCELERATION: f64 = 1e-6;

    // The decision on the rank.

    /// Residual of loops closed to rounding, in epsilons of the size of the mechanism.
    CLOSED_EPSILONS: f64 = 4.0;

    /// Newton's method finds its way along a direction while g / s^2 is below this bound.
    ///
    /// Here g is the residual and s the singular value, both as shares (L. V. Kantorovich, "Functional
    /// analysis and applied mathematics", 1948, for closures that curve by their size per rad^2).
    KANTOROVICH_BOUND: f64 = 0.25;

    /// A direction is weak below this share of the strongest singular value.
    ///
    /// So it is within some 0.1 rad of a singular state: loops are closed to rounding there.
    WEAK_SHARE: f64 = 1e-2;

    /// A motion takes a direction along its path below this multiple of the fourth root of rounding.
    ///
    /// There the acceleration at the state depends on rounding divided by the third power of the distance
    /// from the singular state; along the motion, on the distance.
    PASSING_FACTOR: f64 = 0.3;

    /// A redundant row may be this many times longer than the openness of the loops makes it.
    REDUNDANT_FACTOR: f64 = 16.0;

    /// Residual at which a loop counts as closed where no direction is weak, by the mechanism's size.
    CLOSED: Tolerance = Tolerance::new(1e-12, 16.0);

    /// Largest residual with which rounding or a singular state may stop a projection, relative to
    /// the size.
    ACCEPTABLE: Tolerance = Tolerance::new(1e-9, 1000.0);

    /// A state that is open by more, by the size, has the rank of one that is open by this much.
    LARGEST_GAP: Tolerance = Tolerance::new(1e-9, 16.0);

    // Motions through singular states.

    /// A row that changes by less than this share of the strongest per rad is redundant all along.
    FADING_RATE: f64 = 1e-3;

    /// Largest fraction of the speeds across a faded direction with which they still determine the
    /// branch.
    SPEED_ACROSS: f64 = 0.1;

    /// Speeds lie along a branch if no more of a row's change is along them than this times the row.
    ///
    /// The row is measured as a share of the strongest: rows fade by at least a hundredth per rad.
    SPEED_ALONG: f64 = 100.0;

    /// Rows that fade may lie aside of what they change by, by twice this share.
    FADING_ASIDE: f64 = 1e-4;

    // Projection.

    /// Limit on the Newton steps of a projection.
    ///
    /// Convergence is quadratic from where an integrator leaves the state: it takes two or three.
    PROJECTION_STEPS: usize = 16;

    /// Loops open by this multiple of rounding are open because no branch is chosen.
    UNDECIDED_FACTOR: f64 = 4.0;

    /// Limit on how often a step to the nearest branch is halved.
    STEP_HALVINGS: usize = 8;

    // Assembly: restarts.

    /// Limit on the perturbed guesses that an assembly tries.
    RESTARTS: usize = 40;

    /// Guesses tried to find a branch with the signs of the guess once another branch is found.
    SIGN_RESTARTS: usize = 4;

    /// Guesses tried, the unperturbed one included, to find a nearer branch if there is none.
    BRANCH_RESTARTS: usize = 4;

    /// Each restart perturbs the guess by so much more than the last one, rad.
    RESTART_REACH: f64 = 0.1;

    /// Loops that the pinned angles leave open by no more than this, over the mechanism's size, are nearly closed: what is
    /// given are rounded numbers.
    NEARLY_CLOSED: f64 = 1e-2;

    /// A joint is bent to one side from this angle on, rad.
    BENT_ANGLE: f64 = 1e-4;

    /// In single precision, a guess of more turns than this has no meaningful direction.
    MOST_TURNS: f64 = 1e6;

    // Assembly: steps that close loops (Levenberg-Marquardt).

    /// Limit on the steps that close loops.
    CLOSING_STEPS: usize = 80;

    /// Limit on the dampings tried in one closing step.
    CLOSING_TRIALS: usize = 10;

    /// Longest step of a joint, rad: longer ones jump to another branch.
    LONGEST_STEP: f64 = 0.5;

    /// Damping of the first step, as a share of the largest entry of J^T J and of the residual.
    FIRST_DAMPING: f64 = 1e-2;

    /// The damping after a step that helped, as a multiple of the damping before.
    DAMPING_DECREASE: f64 = 0.2;

    /// The damping after a step that did not help, as a multiple of the damping before.
    DAMPING_INCREASE: f64 = 8.0;

    /// A damping that has to grow starts at least here.
    DAMPING_RESTART: f64 = 1e-6;

    /// A step that leaves more than this share of the squared residual is slow.
    SLOW_RATIO: f64 = 0.9;

    /// After more slow steps than this in a row an attempt is given up.
    SLOW_STEPS: usize = 4;

    /// Damping, as a share of the largest entry of J^T J, that rounding makes necessary.
    LEAST_DAMPING: Tolerance = Tolerance::new(1e-13, 4.0);

    /// The damping where the normal equations have no factor, as a multiple of the damping before.
    SINGULAR_INCREASE: f64 = 16.0;

    // Assembly: steps along the closure.

    /// Limit on the steps along the closure.
    SLIDING_STEPS: usize = 60;

    /// Limit on how often a step along the closure is shortened.
    SLIDING_TRIALS: usize = 6;

    /// Joints that a step leads out of their limits by this share of the joint furthest out are led to their limits with it; in each
    /// further pass by this share of the share before.
    SLIDING_EXCESS: f64 = 0.9;

    /// A step along the closure that leads away from the guess is shortened to this share.
    SLIDING_DECREASE: f64 = 0.3;

    /// Shortest step along the closure by Barzilai and Borwein, as a multiple of the tangent step.
    SHORTEST_SLIDE: f64 = 0.1;

    /// Longest step along the closure by Barzilai and Borwein, as a multiple of the tangent step.
    LONGEST_SLIDE: f64 = 10.0;

    /// A search ends where steps along the closure are shorter than this, rad.
    ///
    /// Each step squares the remaining distance.
    SEARCH_NEAR: Tolerance = Tolerance::new(5e-2, 32.0);

    /// The result of an assembly is reached where steps along the closure are shorter than this, rad.
    RESULT_NEAR: Tolerance = Tolerance::new(1e-6, 32.0);

    /// Damping of steps along the closure: rounding divided by less would drown what is along it.
    SLIDING_DAMPING: Tolerance = Tolerance::new(1e-6, 16.0);

    // Perturbations: SplitMix64 (G. L. Steele, D. Lea, C. H. Flood, "Fast splittable pseudorandom number
    // generators", 2014), with the shifts and factors of D. Stafford's thirteenth variant.

    /// Distance of the seeds of two restarts: more than there are joints.
    NOISE_STRIDE: u64 = 0x1_0001;

    /// Increment of the seed: 2^64 over the golden ratio, odd.
    NOISE_INCREMENT: u64 = 0x9e37_79b9_7f4a_7c15;

    /// First shift of the mixing function.
    NOISE_SHIFT_1: usize = 30;

    /// First factor of the mixing function.
    NOISE_FACTOR_1: u64 = 0xbf58_476d_1ce4_e5b9;

    /// Second shift of the mixing function.
    NOISE_SHIFT_2: usize = 27;

    /// Second factor of the mixing function.
    NOISE_FACTOR_2: u64 = 0x94d0_49bb_1331_11eb;

    /// Low bits that are discarded: 53 remain.
    NOISE_DROPPED: usize = 11;

    /// Half the range of the remaining bits.
    NOISE_HALF: u64 = 1 << 52;

    // Integrators of fixed step.

    /// A step that leads to values that are not finite is cut into at most this many equal pieces.
    ///
    /// The step is tried whole, then in 2, 4, 8 and 16 pieces, each time from its start: at most 31 attempts,
    /// which are 124 accelerations and 31 projections for a Runge-Kutta step. Every other error ends the
    /// step at its first attempt. Pieces help where a law leaves its domain for a moment;
    /// where a step of a sixteenth does not, the motion is too fast for the step.
    STEP_PIECES: usize = 16;

    // Free bodies.

    /// Rotation vectors shorter than this turn nothing, rad. Their length is not zero, so that it can divide.
    LEAST_TURN: f64 = 1e-30;
}
