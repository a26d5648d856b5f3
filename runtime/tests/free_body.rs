//! A mechanism with more coordinates than speeds: a free body whose orientation is a unit quaternion.

mod common;

use common::free_body::{FreeBody, cross, orientation, product, quaternion, rotated};
use lamc_runtime::{
    Dopri5, Error, Integrator, Mechanism, Rk4, Rodas, SemiImplicitEuler, State, StateOf,
};

type Motion = State<[f64; 7], f64, [f64; 6]>;

/// A symmetric top: two moments are the same.
fn top() -> FreeBody {
    FreeBody { mass: 2.0, inertia: [0.3, 0.3, 0.5], u: [0.4, -0.2, 0.1, 0.7, 0.0, 3.0] }
}

/// No symmetry: turns over about its middle axis.
fn tumbling() -> FreeBody {
    FreeBody { mass: 1.0, inertia: [0.2, 0.3, 0.4], u: [0.0, 0.1, 0.0, 0.01, 4.0, 0.02] }
}

/// The motion of a top from its initial state, in closed form: a turn about the angular momentum by
/// L / I_1 t, after a turn about the body's own axis by (I_1 - I_3) / I_1 w_3 t.
fn exact(top: &FreeBody, t: f64) -> Motion {
    let start = top.initial();
    let [i1, _, i3] = top.inertia;
    let spin = (i1 - i3) / i1 * start.u[5] * t;
    let about_momentum = top.angular_momentum(&start.q, &start.u).map(|l| l / i1 * t);
    let p = product(quaternion(about_momentum), quaternion([0.0, 0.0, spin]));
    let mut state = start;
    state.t = t;
    for k in 0..3 {
        state.q[k] = start.u[k] * t;
    }
    state.q[3..].copy_from_slice(&p);
    // The angular velocity turns the other way in the body's frame.
    let turned = rotated(quaternion([0.0, 0.0, -spin]), [start.u[3], start.u[4], start.u[5]]);
    state.u[3..].copy_from_slice(&turned);
    state
}

/// How far two states are apart, with p and -p the same orientation.
fn distance(a: &Motion, b: &Motion) -> f64 {
    let same: f64 = orientation(&a.q).iter().zip(orientation(&b.q)).map(|(a, b)| a * b).sum();
    let sign = same.signum();
    let q = (0..7).map(|k| a.q[k] - if k < 3 { b.q[k] } else { sign * b.q[k] });
    let u = (0..6).map(|k| a.u[k] - b.u[k]);
    q.chain(u).map(|x| x * x).sum::<f64>().sqrt()
}

/// Drift of momentum and energy since the start, and of the quaternion's norm from 1.
fn drift(body: &FreeBody, state: &Motion) -> [f64; 3] {
    let start = body.initial();
    let before = body.angular_momentum(&start.q, &start.u);
    let now = body.angular_momentum(&state.q, &state.u);
    let momentum = (0..3).map(|k| (now[k] - before[k]).powi(2)).sum::<f64>().sqrt();
    let kinetic = |state: &Motion| body.energy(state.t, &state.q, &state.u).unwrap().kinetic;
    let norm = orientation(&state.q).iter().map(|x| x * x).sum::<f64>().sqrt();
    [momentum, (kinetic(state) - kinetic(&start)).abs(), (norm - 1.0).abs()]
}

#[test]
fn the_closed_form_solves_the_equations() {
    let (top, h) = (top(), 1e-5);
    for t in [0.0, 0.3, 1.7] {
        let [before, now, after] = [t - h, t, t + h].map(|t| exact(&top, t));
        let mut rates = [0.0; 7];
        top.write_rates(&now.q, &now.u, &mut rates);
        let du = top.acceleration(t, &now.q, &now.u).unwrap();
        for (k, rate) in rates.into_iter().enumerate() {
            let difference = (after.q[k] - before.q[k]) / (2.0 * h);
            assert!((difference - rate).abs() < 1e-8, "q{k}: {difference} {rate}");
        }
        for (k, rate) in du.into_iter().enumerate() {
            let difference = (after.u[k] - before.u[k]) / (2.0 * h);
            assert!((difference - rate).abs() < 1e-8, "u{k}: {difference} {rate}");
        }
    }
}

#[test]
fn advance_and_difference_are_inverse_and_agree_with_the_rates() {
    let body = tumbling();
    let mut q = exact(&top(), 0.8).q;
    let from = q;
    let step = [0.1, -0.2, 0.3, 0.4, -0.5, 0.6];
    body.advance(&mut q, &step);
    let mut back = [0.0; 6];
    body.write_difference(&from, &q, &mut back);
    for (back, step) in back.iter().zip(step) {
        assert!((back - step).abs() < 1e-14, "{back} is not {step}");
    }
    let (mut rates, mut near) = ([0.0; 7], from);
    body.write_rates(&from, &step, &mut rates);
    body.advance(&mut near, &step.map(|x| 1e-6 * x));
    for k in 0..7 {
        assert!(((near[k] - from[k]) / 1e-6 - rates[k]).abs() < 1e-6, "{k}");
    }
    assert_eq!(cross([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
}

#[test]
fn steps_of_fixed_length_converge_to_the_closed_form() {
    let top = top();
    type Step = fn(&FreeBody, &mut StateOf<FreeBody>, f64, f64) -> Result<(), Error>;
    let methods: [(&str, Step, f64); 2] = [
        ("rk4", |m, state, end, dt| Rk4::new(m).run(m, state, end, dt, |_| ()), 4.0),
        (
            "euler",
            |m, state, end, dt| SemiImplicitEuler::new(m).run(m, state, end, dt, |_| ()),
            1.0,
        ),
    ];
    for (name, run, order) in methods {
        let error = |steps: u32| {
            let mut state = top.initial();
            run(&top, &mut state, 2.0, 2.0 / f64::from(steps)).unwrap();
            let norm = drift(&top, &state)[2];
            assert!(norm < 4e-16, "{name}: the norm is off by {norm:e}");
            distance(&state, &exact(&top, 2.0))
        };
        let (coarse, fine) = (error(200), error(400));
        let found = (coarse / fine).log2();
        println!("{name}: {coarse:e}, {fine:e}, order {found}");
        assert!((found - order).abs() < 0.1, "{name} has order {found}");
    }
}

#[test]
fn adaptive_steps_keep_momentum_and_energy() {
    for (body, name) in [(top(), "top"), (tumbling(), "tumbling")] {
        let mut worst = [0.0_f64; 3];
        let mut watch = |state: &Motion| {
            let now = drift(&body, state);
            for (worst, now) in worst.iter_mut().zip(now) {
                assert!(!now.is_nan());
                *worst = worst.max(now);
            }
        };
        let mut state = body.initial();
        let mut dopri5 = Dopri5::new(&body);
        (dopri5.relative, dopri5.absolute) = (1e-10, 1e-12);
        dopri5.run(&body, &mut state, 20.0, &mut watch).unwrap();
        println!("{name}: momentum {:e}, energy {:e}, norm {:e}", worst[0], worst[1], worst[2]);
        assert!(worst[0] < 2e-8 && worst[1] < 2e-8 && worst[2] < 4e-16, "{name}: {worst:?}");
    }

    let top = top();
    let mut state = top.initial();
    let mut dopri5 = Dopri5::new(&top);
    (dopri5.relative, dopri5.absolute) = (1e-10, 1e-12);
    let mut samples = 0;
    dopri5
        .sample(&top, &mut state, 5.0, (1..500).map(|k| f64::from(k) * 0.01), |state| {
            samples += 1;
            let error = distance(state, &exact(&top, state.t));
            assert!(error < 1e-7, "{error:e} at {}", state.t);
        })
        .unwrap();
    assert_eq!(samples, 499);
    assert!(distance(&state, &exact(&top, 5.0)) < 1e-8);
}

#[test]
fn an_implicit_method_follows_the_closed_form_to_second_order() {
    let top = top();
    let error = |tolerance: f64| {
        let mut state = top.initial();
        let mut rodas = Rodas::new(&top);
        (rodas.relative, rodas.absolute) = (tolerance, tolerance);
        let mut steps = 0;
        rodas.run(&top, &mut state, 2.0, |_| steps += 1).unwrap();
        let error = distance(&state, &exact(&top, 2.0));
        println!("rodas to {tolerance:e}: {steps} steps, {error:e}");
        assert!(drift(&top, &state)[2] < 4e-16);
        error
    };
    let (coarse, fine) = (error(1e-5), error(1e-8));
    assert!(coarse < 5e-3 && fine < coarse / 15.0, "{coarse:e}, {fine:e}");
}

#[test]
fn a_free_body_is_assembled_and_at_rest_where_it_is() {
    let body = FreeBody { u: [0.0; 6], ..top() };
    let state = body.assembled().unwrap();
    assert_eq!(state, body.initial());
    let (rest, found) = body.settled().unwrap();
    assert_eq!((rest, found.force), (state, 0.0));
    let mut state = body.initial();
    let wrong =
        lamc_runtime::project(&body, 0.0, &mut state.q[..6], &mut state.u, &mut body.workspace());
    assert_eq!(wrong, Err(Error::Length { expected: 7, given: 6 }));
}
