//! Several designs or states of one mechanism at once, each in a lane of vectors.
//!
//! Functions in straight-line code know no branches: vectors serve them as numbers do. Where
//! a decision is needed, on the rank of the closure or on a step that has to be cut, a lane is done
//! once more by itself, by the algorithms for numbers. Either way each lane gets the bits that its
//! design would get alone.

use crate::acceleration::safe;
use crate::constants::PROJECTION_STEPS;
use crate::integrate::{Stages, is_forward};
use crate::linear::max_abs;
use crate::rank::closed;
use crate::{
    Arithmetic, Error, Margin, Mechanism, ProjectionMut, Rk4, State, Storage, StraightLine, System,
};

/// A vector of numbers. Sets of lanes are bits: bit k is lane k.
pub trait Lanes: Arithmetic {
    /// What a lane holds.
    type Number: crate::Scalar;
    /// Lanes, at most 32.
    const COUNT: usize;
    /// The numbers.
    fn lanes(&self) -> &[Self::Number];
    /// The numbers.
    fn lanes_mut(&mut self) -> &mut [Self::Number];
    /// The lanes in which `self < other`.
    fn less(self, other: Self) -> u32;

    /// The number in a lane; not a number where there is no such lane.
    #[inline]
    fn lane(&self, lane: usize) -> Self::Number {
        let nothing = Self::Number::from_f64(f64::NAN);
        self.lanes().get(lane).copied().unwrap_or(nothing)
    }

    /// The same number in every lane.
    #[inline]
    fn splat(number: Self::Number) -> Self {
        let mut vector = Self::ZERO;
        vector.lanes_mut().fill(number);
        vector
    }
}

/// What went wrong in which lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LaneError {
    /// The lane.
    pub lane: usize,
    /// Why it stopped.
    pub error: Error,
}

impl core::fmt::Display for LaneError {
    fn fmt(&self, out: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(out, "lane {}: {}", self.lane, self.error)
    }
}

impl core::error::Error for LaneError {}

/// Every lane.
const fn all<V: Lanes>() -> u32 {
    u32::MAX >> (u32::BITS - V::COUNT as u32)
}

/// The lanes of a set, in ascending order.
fn members(mut set: u32) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lane = set.trailing_zeros();
        set &= set.wrapping_sub(1);
        (lane < u32::BITS).then_some(lane as usize)
    })
}

impl<V: Lanes, const N: usize> State<[V; N], V> {
    /// The state in a lane.
    pub fn lane(&self, lane: usize) -> State<[V::Number; N], V::Number> {
        let of = |vectors: &[V; N]| core::array::from_fn(|i| vectors[i].lane(lane));
        State { t: self.t.lane(lane), q: of(&self.q), u: of(&self.u) }
    }

    /// Sets the state in a lane; a lane that there is not stays unset.
    pub fn set_lane(&mut self, lane: usize, state: &State<[V::Number; N], V::Number>) {
        set(&mut self.t, lane, state.t);
        set_all(&mut self.q, lane, &state.q);
        set_all(&mut self.u, lane, &state.u);
    }
}

fn set<V: Lanes>(vector: &mut V, lane: usize, number: V::Number) {
    if let Some(place) = vector.lanes_mut().get_mut(lane) {
        *place = number;
    }
}

fn set_all<V: Lanes>(vectors: &mut [V], lane: usize, numbers: &[V::Number]) {
    for (vector, &number) in vectors.iter_mut().zip(numbers) {
        set(vector, lane, number);
    }
}

/// A mechanism of N coordinates and C closure rows with a design (parameters, inputs) in each lane.
///
/// The compiler implements it for its modules; everything but the first items is provided.
///
/// ```text
/// let mut robots = Sixbar::<f64x4>::default();
/// robots.params.stiffness = f64x4::new([0.01, 0.02, 0.03, 0.04]);
/// let mut states = robots.assembled()?;
/// robots.step(&mut states, 1e-3)?;
/// ```
pub trait Batch<V: Lanes, const N: usize, const C: usize>: StraightLine<Number = V> {
    /// The mechanism of one lane.
    type Lane: Mechanism<V::Number, N, C>;
    /// `[V; 9 * L]`.
    type Residual: Storage + AsMut<[V]>;

    /// The mechanism of a lane, with its parameters and inputs.
    fn lane(&self, lane: usize) -> Self::Lane;

    /// The initial states with closed loops, as of [`Mechanism::assembled`].
    ///
    /// # Errors
    ///
    /// Of the first lane that cannot be assembled.
    fn assembled(&self) -> Result<State<[V; N], V>, LaneError> {
        let mut states = State { t: V::ZERO, q: [V::ZERO; N], u: [V::ZERO; N] };
        for lane in 0..V::COUNT {
            let state = self.lane(lane).assembled();
            states.set_lane(lane, &state.map_err(|error| LaneError { lane, error })?);
        }
        Ok(states)
    }

    /// du/dt, rad/s^2, with closed loops.
    ///
    /// # Errors
    ///
    /// As [`Mechanism::acceleration`], of the first lane concerned.
    fn acceleration(&self, t: V, q: &[V; N], u: &[V; N]) -> Result<[V; N], LaneError> {
        let mut out = [V::ZERO; N];
        let done = accelerate(self, t, q, u, &mut out);
        for lane in members(all::<V>() & !done) {
            let State { t, q, u } = State { t, q: *q, u: *u }.lane(lane);
            let found = self.lane(lane).acceleration(t, &q, &u);
            set_all(&mut out, lane, &found.map_err(|error| LaneError { lane, error })?);
        }
        Ok(out)
    }

    /// Advances every lane by `dt` (s) as [`Rk4::step`] does, with projection.
    ///
    /// # Errors
    ///
    /// As [`Rk4::step`], of the first lane concerned; no lane is then changed.
    fn step(&self, states: &mut State<[V; N], V>, dt: V::Number) -> Result<(), LaneError> {
        if !is_forward(dt) {
            return Err(LaneError { lane: 0, error: Error::Time });
        }
        let mut next = *states;
        let done = advance(self, &mut next, dt);
        for lane in members(all::<V>() & !done) {
            let (mechanism, mut state) = (self.lane(lane), states.lane(lane));
            let stepped = Rk4::new(&mechanism).step(&mechanism, &mut state, dt);
            stepped.map_err(|error| LaneError { lane, error })?;
            next.set_lane(lane, &state);
        }
        *states = next;
        Ok(())
    }
}

/// du/dt by elimination, and the lanes in which that holds: as `direct` for numbers.
#[inline]
fn accelerate<B, V: Lanes, const N: usize, const C: usize>(
    batch: &B,
    t: V,
    q: &[V; N],
    u: &[V; N],
    out: &mut [V; N],
) -> u32
where
    B: Batch<V, N, C> + ?Sized,
{
    if batch.lane(0).dimensions().drives != 0 {
        return 0;
    }
    let margin = batch.write_acceleration(t, q, u, out);
    holds(&margin) & finite(out)
}

/// The lanes in which results of a straight-line elimination hold.
#[inline]
fn holds<V: Lanes>(margin: &Margin<V>) -> u32 {
    V::ZERO.less(margin.inverse_pivot) & safe::<V>().less(margin.conditioning)
}

/// The lanes in which every number is finite.
#[inline]
fn finite<V: Lanes>(vectors: &[V]) -> u32 {
    let infinity = V::from_f64(f64::INFINITY);
    vectors.iter().fold(all::<V>(), |lanes, vector| lanes & vector.abs().less(infinity))
}

/// A step with projection, and the lanes in which it holds.
fn advance<B, V: Lanes, const N: usize, const C: usize>(
    batch: &B,
    state: &mut State<[V; N], V>,
    dt: V::Number,
) -> u32
where
    B: Batch<V, N, C> + ?Sized,
{
    let mut done = all::<V>();
    let mut stages = Stages::new([V::ZERO; N]);
    let accelerate = |t, q: &[V; N], u: &[V; N], out: &mut [V; N]| {
        done &= accelerate(batch, t, q, u, out);
        if done == 0 { Err(()) } else { Ok(()) }
    };
    let stopped = stages.advance(state, V::splat(dt), accelerate, |_, _| Ok(()));
    match stopped {
        Ok(()) => done & project(batch, &mut state.q, &mut state.u),
        Err(()) => 0,
    }
}

/// Moves q onto the closure and u onto its tangent, and the lanes in which that holds: as the
/// projection for numbers by the system's own elimination.
fn project<B, V: Lanes, const N: usize, const C: usize>(
    batch: &B,
    q: &mut [V; N],
    u: &mut [V; N],
) -> u32
where
    B: Batch<V, N, C> + ?Sized,
{
    let mechanism = batch.lane(0);
    if mechanism.dimensions().loops == 0 {
        return finite(q) & finite(u);
    }
    let enough = V::splat(closed(&mechanism));
    let mut residual = B::Residual::zeros();
    let [mut positions, mut speeds] = [[V::ZERO; N]; 2];
    let (mut open, mut done) = (all::<V>(), 0);
    let mut before = V::from_f64(f64::INFINITY);
    for _ in 0..PROJECTION_STEPS {
        let residual = residual.as_mut();
        let out = ProjectionMut { residual, positions: &mut positions, speeds: &mut speeds };
        let margin = batch.write_projection(q, u, out);
        let size = max_abs(residual);
        // Lanes that fail are open no more, and never done.
        open &= holds(&margin) & finite(&[size]);
        let closing = open & !enough.less(size);
        subtract(closing, u, &speeds);
        done |= closing;
        open &= !closing & (size + size).less(before);
        if open == 0 {
            break;
        }
        before = size;
        subtract(open, q, &positions);
    }
    done & finite(q) & finite(u)
}

/// `x -= y` in some lanes.
#[inline]
fn subtract<V: Lanes>(lanes: u32, x: &mut [V], y: &[V]) {
    for (x, &y) in x.iter_mut().zip(y) {
        let difference = *x - y;
        if lanes == all::<V>() {
            *x = difference;
        } else {
            members(lanes).for_each(|lane| set(x, lane, difference.lane(lane)));
        }
    }
}
