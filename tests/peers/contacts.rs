//! A robot on the ground for ctypes, with its contacts and without them: `contacts.py` calls these functions for many
//! states.
//!
//! The file that MODEL names defines `module` and `bare`, which lamc wrote with and without the contacts, and their
//! mechanisms as `Model` and `Bare`.

use std::hint::black_box;
use std::slice;

use lamc_runtime::{Mechanism, Rk4, State};
use module::{NQ, NU};

include!(env!("MODEL"));

/// s.
const STEP: f64 = 1e-5;

/// The accelerations of every state, `repeats` times.
///
/// # Safety
///
/// `q` points at as many rows of NQ numbers as there are states; `u` and `out` at as many of NU numbers.
unsafe fn accelerate<M>(q: *const f64, u: *const f64, out: *mut f64, states: usize, repeats: usize)
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; NQ], Speeds = [f64; NU]> + Default,
{
    // SAFETY: the caller's promise; rows of doubles are aligned as doubles are.
    let (q, u, out) = unsafe {
        (
            slice::from_raw_parts::<[f64; NQ]>(q.cast(), states),
            slice::from_raw_parts::<[f64; NU]>(u.cast(), states),
            slice::from_raw_parts_mut::<[f64; NU]>(out.cast(), states),
        )
    };
    let model = M::default();
    for _ in 0..repeats {
        for ((q, u), out) in q.iter().zip(u).zip(out.iter_mut()) {
            *out = model.acceleration(0.0, black_box(q), black_box(u)).unwrap_or([f64::NAN; NU]);
        }
    }
}

/// A step of Runge and Kutta's fourth order, with its projection, from every state: u after it.
///
/// # Safety
///
/// As [`accelerate`].
unsafe fn step<M>(q: *const f64, u: *const f64, out: *mut f64, states: usize, repeats: usize)
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; NQ], Speeds = [f64; NU]> + Default,
{
    // SAFETY: the caller's promise; rows of doubles are aligned as doubles are.
    let (q, u, out) = unsafe {
        (
            slice::from_raw_parts::<[f64; NQ]>(q.cast(), states),
            slice::from_raw_parts::<[f64; NU]>(u.cast(), states),
            slice::from_raw_parts_mut::<[f64; NU]>(out.cast(), states),
        )
    };
    let model = M::default();
    let mut rk4 = Rk4::new(&model);
    for _ in 0..repeats {
        for ((q, u), out) in q.iter().zip(u).zip(out.iter_mut()) {
            let mut state = State { t: 0.0, q: *black_box(q), u: *black_box(u) };
            let done = rk4.step(&model, &mut state, STEP).is_ok();
            *out = if done { state.u } else { [f64::NAN; NU] };
        }
    }
}

macro_rules! exported {
    ($($name:ident: $function:ident of $model:ident),+ $(,)?) => {
        $(
            /// # Safety
            ///
            /// As the function that it calls.
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn $name(
                q: *const f64,
                u: *const f64,
                out: *mut f64,
                states: usize,
                repeats: usize,
            ) {
                // SAFETY: the caller's promise.
                unsafe { $function::<$model>(q, u, out, states, repeats) }
            }
        )+
    };
}

exported! {
    accelerations: accelerate of Model,
    bare_accelerations: accelerate of Bare,
    rk4_steps: step of Model,
    bare_rk4_steps: step of Bare,
}
