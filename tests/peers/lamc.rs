//! A module of lamc for ctypes: `peers.py` calls these functions for many states.
//!
//! The file that MODEL names defines `module`, which lamc wrote, and its mechanism as `Model`.

use std::cell::RefCell;
use std::hint::black_box;
use std::slice;

use lamc_runtime::{Integrator, Mechanism, Rk4, Rodas, State, acceleration};
use module::NQ as N;

include!(env!("MODEL"));

/// s.
const STEP: f64 = 1e-5;

thread_local! {
    /// Kept from call to call: that of a large sheet takes longer to clear than a step.
    static WORKSPACE: RefCell<Vec<f64>> = RefCell::new(Model::default().workspace().to_vec());
    static RK4: RefCell<Box<Rk4<Model>>> = RefCell::new(Box::new(Rk4::new(&Model::default())));
}

type Rows<'a> = (&'a [[f64; N]], &'a [[f64; N]], &'a mut [[f64; N]]);

/// # Safety
/// `q`, `u` and `out` point at as many rows as there are states.
unsafe fn rows<'a>(q: *const f64, u: *const f64, out: *mut f64, states: usize) -> Rows<'a> {
    // SAFETY: the caller's promise; rows of doubles are aligned as doubles are.
    unsafe {
        (
            slice::from_raw_parts(q.cast(), states),
            slice::from_raw_parts(u.cast(), states),
            slice::from_raw_parts_mut(out.cast(), states),
        )
    }
}

/// The acceleration of every state, `repeats` times.
///
/// # Safety
/// As [`rows`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn accelerations(
    q: *const f64,
    u: *const f64,
    out: *mut f64,
    states: usize,
    repeats: usize,
) {
    let (q, u, out) = unsafe { rows(q, u, out, states) };
    let model = Model::default();
    WORKSPACE.with_borrow_mut(|workspace| {
        for _ in 0..repeats {
            for ((q, u), out) in q.iter().zip(u).zip(out.iter_mut()) {
                let found =
                    acceleration(&model, 0.0, black_box(q), black_box(u), workspace, &mut *out);
                if found.is_err() {
                    *out = [f64::NAN; N];
                }
            }
        }
    });
}

/// As [`accelerations`], where each evaluation waits for the one before, as in an integration.
///
/// # Safety
/// As [`rows`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn chained_accelerations(
    q: *const f64,
    u: *const f64,
    out: *mut f64,
    states: usize,
    repeats: usize,
) {
    let (q, u, out) = unsafe { rows(q, u, out, states) };
    let model = Model::default();
    // Too small to change an angle, which the compiler cannot know.
    let nothing = black_box(1e-300);
    let mut last = [0.0; N];
    for _ in 0..repeats {
        for ((q, u), out) in q.iter().zip(u).zip(out.iter_mut()) {
            let q = std::array::from_fn(|joint| q[joint] + nothing * last[joint]);
            last = model.acceleration(0.0, &q, black_box(u)).unwrap_or([f64::NAN; N]);
            *out = last;
        }
    }
}

/// The derivatives of the acceleration by q, u and t at every state.
///
/// # Safety
/// As [`rows`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn jacobians(
    q: *const f64,
    u: *const f64,
    out: *mut f64,
    states: usize,
    repeats: usize,
) {
    let (q, u, _) = unsafe { rows(q, u, out, states) };
    let model = Model::default();
    for _ in 0..repeats {
        for (q, u) in q.iter().zip(u) {
            _ = black_box(model.jacobian(0.0, black_box(q), black_box(u)));
        }
    }
}

/// A step of Runge and Kutta's fourth order, with its projection, from every state.
///
/// # Safety
/// As [`rows`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rk4_steps(
    q: *const f64,
    u: *const f64,
    out: *mut f64,
    states: usize,
    repeats: usize,
) {
    let model = Model::default();
    RK4.with_borrow_mut(|rk4| {
        let step = |state: &mut _| rk4.step(&model, state, STEP).is_ok();
        steps(step, unsafe { rows(q, u, out, states) }, repeats);
    });
}

/// A step of RODASP, with its derivatives and its projection, from every state.
///
/// # Safety
/// As [`rows`].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn rodas_steps(
    q: *const f64,
    u: *const f64,
    out: *mut f64,
    states: usize,
    repeats: usize,
) {
    let model = Model::default();
    let mut rodas = Rodas::new(&model);
    let step = |state: &mut _| rodas.step(&model, state, STEP).is_ok();
    steps(step, unsafe { rows(q, u, out, states) }, repeats);
}

fn steps(mut step: impl FnMut(&mut State<[f64; N], f64>) -> bool, rows: Rows<'_>, repeats: usize) {
    let (q, u, out) = rows;
    for _ in 0..repeats {
        for ((q, u), out) in q.iter().zip(u).zip(out.iter_mut()) {
            let mut state = State { t: 0.0, q: *black_box(q), u: *black_box(u) };
            *out = if step(&mut state) { state.q } else { [f64::NAN; N] };
        }
    }
}
