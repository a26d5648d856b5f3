//! Several designs or states of one mechanism at once, each in a lane of vectors.
//!
//! Functions in straight-line code know no branches: vectors serve them as numbers do. Where
//! a decision is needed, on the rank of the closure or on a step that has to be cut, a lane is done
//! once more by itself, by the algorithms for numbers. Either way each lane gets the bits that its
//! design would get alone.

use crate::constants::{LEAST_PIVOT, PROJECTION_STEPS, WEAK_SHARE};
use crate::integrate::{Stages, is_forward};
use crate::linear::max_abs;
use crate::plumbing::{Margin, ProjectionMut};
use crate::rank::{acceptable_residual, closed};
use crate::trust::safe;
use crate::{Arithmetic, Error, Mechanism, Rk4, State, StateOf};

/// A vector of numbers. Sets of lanes are bits: bit k is lane k.
pub trait Lanes: Arithmetic {
    /// Contents of a lane.
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

/// An error and the lane in which it occurred.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
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

impl<V: Lanes, const NQ: usize, const NU: usize> State<[V; NQ], V, [V; NU]> {
    /// The state in a lane.
    pub fn lane(&self, lane: usize) -> State<[V::Number; NQ], V::Number, [V::Number; NU]> {
        State {
            t: self.t.lane(lane),
            q: self.q.map(|vector| vector.lane(lane)),
            u: self.u.map(|vector| vector.lane(lane)),
        }
    }

    /// Sets the state in a lane; a lane that there is not stays unset.
    pub fn set_lane(
        &mut self,
        lane: usize,
        state: &State<[V::Number; NQ], V::Number, [V::Number; NU]>,
    ) {
        set_state(self, lane, state);
    }
}

fn set_state<V: Lanes, Q, U, R, W>(
    states: &mut State<Q, V, U>,
    lane: usize,
    state: &State<R, V::Number, W>,
) where
    Q: AsMut<[V]>,
    U: AsMut<[V]>,
    R: AsRef<[V::Number]>,
    W: AsRef<[V::Number]>,
{
    set(&mut states.t, lane, state.t);
    set_all(states.q.as_mut(), lane, state.q.as_ref());
    set_all(states.u.as_mut(), lane, state.u.as_ref());
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

/// Numbers become those in a lane.
fn take_all<V: Lanes>(numbers: &mut [V::Number], lane: usize, vectors: &[V]) {
    for (number, vector) in numbers.iter_mut().zip(vectors) {
        *number = vector.lane(lane);
    }
}

/// The states of a batch.
pub type StatesOf<B, V> = State<<B as Batch<V>>::Coordinates, V, <B as Batch<V>>::Speeds>;

/// A mechanism with a design (parameters, inputs) in each lane of vectors.
///
/// The compiler implements it for its modules; everything but the first items is provided.
///
/// ```text
/// let mut robots = Sixbar::<f64x4>::default();
/// robots.params.stiffness = f64x4::new([0.01, 0.02, 0.03, 0.04]);
/// let mut states = robots.assembled()?;
/// robots.step(&mut states, 1e-3)?;
/// ```
pub trait Batch<V: Lanes>: Sized {
    /// The mechanism of one lane.
    type Lane: Mechanism<Scalar = V::Number>;
    /// NQ vectors.
    type Coordinates: Copy + AsRef<[V]> + AsMut<[V]>;
    /// NU vectors.
    type Speeds: Copy + AsRef<[V]> + AsMut<[V]>;
    /// 9 L vectors.
    type Residual: AsMut<[V]>;

    /// The mechanism of a lane, with its parameters and inputs.
    fn lane(&self, lane: usize) -> Self::Lane;

    /// States of zeros.
    fn zeros(&self) -> StatesOf<Self, V>;

    /// 9 L zeros.
    fn residual(&self) -> Self::Residual;

    /// As [`Mechanism::write_acceleration`], in all lanes. Provided: there is no such code.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_acceleration(
        &self,
        t: V,
        q: &[V],
        u: &[V],
        out: &mut [V],
    ) -> Result<Option<Margin<V>>, Error> {
        let _ = (t, q, u, out);
        Ok(None)
    }

    /// As [`Mechanism::write_projection`], in all lanes. Provided: there is no such code.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_projection(
        &self,
        q: &[V],
        u: &[V],
        out: ProjectionMut<'_, V>,
    ) -> Result<Option<Margin<V>>, Error> {
        let _ = (q, u, out);
        Ok(None)
    }

    /// As [`Mechanism::advance`], in all lanes.
    #[inline]
    fn advance(&self, q: &mut [V], step: &[V]) {
        for (q, &step) in q.iter_mut().zip(step) {
            *q += step;
        }
    }

    /// As [`Mechanism::write_rates`], in all lanes.
    #[inline]
    fn write_rates(&self, q: &[V], u: &[V], out: &mut [V]) {
        let _ = q;
        out.copy_from_slice(u);
    }

    /// As [`Mechanism::normalise`], in all lanes.
    #[inline]
    fn normalise(&self, q: &mut [V]) {
        let _ = q;
    }

    /// The initial states with closed loops, as of [`Mechanism::assembled`].
    ///
    /// # Errors
    ///
    /// Of the first lane that cannot be assembled.
    fn assembled(&self) -> Result<StatesOf<Self, V>, LaneError> {
        let mut states = self.zeros();
        for lane in 0..V::COUNT {
            let state = self.lane(lane).assembled();
            set_state(&mut states, lane, &state.map_err(|error| LaneError { lane, error })?);
        }
        Ok(states)
    }

    /// du/dt, rad/s^2, with closed loops.
    ///
    /// # Errors
    ///
    /// As [`Mechanism::acceleration`], of the first lane concerned.
    fn acceleration(
        &self,
        t: V,
        q: &Self::Coordinates,
        u: &Self::Speeds,
    ) -> Result<Self::Speeds, LaneError> {
        let mut out = self.zeros().u;
        let done = accelerate(self, t, q, u, &mut out);
        for lane in members(all::<V>() & !done) {
            let mechanism = self.lane(lane);
            let State { t, q, u } = state_of(&mechanism, &State { t, q: *q, u: *u }, lane);
            let found = mechanism.acceleration(t, &q, &u);
            let found = found.map_err(|error| LaneError { lane, error })?;
            set_all(out.as_mut(), lane, found.as_ref());
        }
        Ok(out)
    }

    /// Advances every lane by `dt` (s) as [`Rk4::step`] does, with projection.
    ///
    /// # Errors
    ///
    /// As [`Rk4::step`], of the first lane concerned; no lane is then changed.
    fn step(&self, states: &mut StatesOf<Self, V>, dt: V::Number) -> Result<(), LaneError> {
        if !is_forward(dt) {
            return Err(LaneError { lane: 0, error: Error::Time });
        }
        let mut next = *states;
        let done = advance(self, &mut next, dt) & finite(&[states.t]);
        for lane in members(all::<V>() & !done) {
            let mechanism = self.lane(lane);
            let mut state = state_of(&mechanism, states, lane);
            let stepped = Rk4::new(&mechanism).step(&mechanism, &mut state, dt);
            stepped.map_err(|error| LaneError { lane, error })?;
            set_state(&mut next, lane, &state);
        }
        *states = next;
        Ok(())
    }
}

/// The state in a lane.
fn state_of<M: Mechanism, V: Lanes<Number = M::Scalar>, Q: AsRef<[V]>, U: AsRef<[V]>>(
    mechanism: &M,
    states: &State<Q, V, U>,
    lane: usize,
) -> StateOf<M> {
    let mut state = mechanism.initial();
    state.t = states.t.lane(lane);
    take_all(state.q.as_mut(), lane, states.q.as_ref());
    take_all(state.u.as_mut(), lane, states.u.as_ref());
    state
}

/// du/dt by elimination, and the lanes in which that holds: as `direct` for numbers.
#[inline]
fn accelerate<V: Lanes, B: Batch<V>>(
    batch: &B,
    t: V,
    q: &B::Coordinates,
    u: &B::Speeds,
    out: &mut B::Speeds,
) -> u32 {
    if batch.lane(0).dimensions().drives != 0 {
        return 0;
    }
    match batch.write_acceleration(t, q.as_ref(), u.as_ref(), out.as_mut()) {
        Ok(Some(margin)) => holds(&margin) & finite(out.as_ref()),
        _ => 0,
    }
}

/// The lanes in which results of a straight-line elimination hold, and no singular state is near.
#[inline]
fn holds<V: Lanes>(margin: &Margin<V>) -> u32 {
    let pivot = V::from_f64(WEAK_SHARE).max(LEAST_PIVOT.of());
    V::ZERO.less(margin.inverse_pivot)
        & safe::<V>().less(margin.conditioning)
        & pivot.less(margin.pivot)
}

/// The lanes in which every number is finite.
#[inline]
fn finite<V: Lanes>(vectors: &[V]) -> u32 {
    let infinity = V::from_f64(f64::INFINITY);
    vectors.iter().fold(all::<V>(), |lanes, vector| lanes & vector.abs().less(infinity))
}

/// A step with projection, and the lanes in which it holds.
fn advance<V: Lanes, B: Batch<V>>(batch: &B, state: &mut StatesOf<B, V>, dt: V::Number) -> u32 {
    let mut done = all::<V>();
    let State { q, u, .. } = batch.zeros();
    let mut stages = Stages::new(q, u);
    let differentiate =
        |t, q: &B::Coordinates, u: &B::Speeds, dq: &mut B::Coordinates, du: &mut B::Speeds| {
            batch.write_rates(q.as_ref(), u.as_ref(), dq.as_mut());
            done &= accelerate(batch, t, q, u, du);
            if done == 0 { Err(()) } else { Ok(()) }
        };
    let stopped = stages.advance(state, V::splat(dt), differentiate);
    match stopped {
        Ok(()) => {
            batch.normalise(state.q.as_mut());
            done & project(batch, state)
        }
        Err(()) => 0,
    }
}

/// Moves q onto the closure and u onto its tangent, and the lanes in which that holds: as the
/// projection for numbers by the system's own elimination.
fn project<V: Lanes, B: Batch<V>>(batch: &B, state: &mut StatesOf<B, V>) -> u32 {
    let mechanism = batch.lane(0);
    let (q, u) = (state.q.as_mut(), state.u.as_mut());
    if mechanism.dimensions().loops == 0 {
        return finite(q) & finite(u);
    }
    let enough = V::splat(closed(&mechanism));
    let acceptable = V::splat(acceptable_residual(&mechanism));
    let extent = V::splat(mechanism.size());
    let mut residual = batch.residual();
    let [mut positions, mut speeds] = [batch.zeros().u, batch.zeros().u];
    let (mut open, mut done) = (all::<V>(), 0);
    let mut before = V::from_f64(f64::INFINITY);
    for _ in 0..PROJECTION_STEPS {
        let residual = residual.as_mut();
        let (positions, speeds) = (positions.as_mut(), speeds.as_mut());
        let out = ProjectionMut { residual, positions, speeds };
        let Ok(Some(margin)) = batch.write_projection(q, u, out) else { return 0 };
        let size = max_abs(residual);
        // Lanes that fail are open no more, and never done.
        open &= holds(&margin) & finite(&[size]);
        let follows = !acceptable.less(size) & !enough.less(extent * max_abs(positions));
        let closing = open & (!enough.less(size) | follows);
        let step = |x: &mut V, lanes: u32| *x = -kept(*x, lanes);
        speeds.iter_mut().for_each(|speed| step(speed, closing));
        for (u, &step) in u.iter_mut().zip(&*speeds) {
            *u += step;
        }
        done |= closing;
        open &= !closing & (size + size).less(before);
        if open == 0 {
            break;
        }
        before = size;
        positions.iter_mut().for_each(|position| step(position, open));
        batch.advance(q, positions);
    }
    done & finite(q) & finite(u)
}

/// The vector in some lanes, and zero in others.
#[inline]
fn kept<V: Lanes>(vector: V, lanes: u32) -> V {
    if lanes == all::<V>() {
        return vector;
    }
    let mut kept = V::ZERO;
    members(lanes).for_each(|lane| set(&mut kept, lane, vector.lane(lane)));
    kept
}
