//! Accelerations, ranks, reactions and motions next to the flat, singular state: against states known
//! from 60 digits, against the laws of equilibrium, and against each other.

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_generated::fourbar::Fourbar;
use lamc_generated::sixbar::Sixbar;
use lamc_runtime::plumbing::Balance;
use lamc_runtime::{
    Integrator, Mechanism, Rodas, State, acceleration, acceleration_and_forces,
    acceleration_in_motion, assemble, equilibrium, project,
};
use lamc_tests::compare::largest;
use lamc_tests::near_flat::{NearFlat, NearFlatState};
use lamc_tests::{EXAMPLES, compile, dopri5, relative_error, workspace};
use lamc_workbench::execution::Jit;
use lamc_workbench::motion::{Motion, Sample};
use nalgebra::{Matrix3, Vector3};

/// States nearer than this to the flat one need not be as exact as [`EXACT`], rad.
const NEAREST: f64 = 1e-4;

/// Largest relative error of an acceleration down to [`NEAREST`].
const EXACT: f64 = 1e-7;

/// The same of accelerations in a motion.
const MOVING: f64 = 1e-6;

/// `rocker_hinge` of the four-bar.
const ROCKER: usize = 1;

fn example(name: &str) -> Compiled {
    compile(&workspace().join("examples").join(format!("{name}.yaml")))
}

/// The known states of a model.
fn states(name: &str) -> Vec<NearFlatState> {
    let mut models = NearFlat::read();
    models.retain(|model| model.name() == name);
    models.remove(0).states
}

/// The model's guess with one joint elsewhere, closed and at rest.
fn started<Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>>(
    system: &Y,
    given: &[(usize, f64)],
) -> State<Vec<f64>, f64> {
    let mut state = system.initial();
    let mut pinned: Vec<bool> = (0..state.q.len()).map(|joint| system.is_pinned(joint)).collect();
    for &(joint, angle) in given {
        (state.q[joint], pinned[joint]) = (angle, true);
    }
    let mut workspace = system.workspace();
    let workspace = workspace.as_mut();
    assemble(system, 0.0, &mut state.q, &pinned, workspace).unwrap();
    project(system, 0.0, &mut state.q, &mut state.u, workspace).unwrap();
    state
}

#[test]
fn accelerations_agree_with_sixty_digits() {
    for model in NearFlat::read() {
        let compiled = compile(&workspace().join(&model.model));
        let system = Interpreter::new(&compiled.program);
        let d = system.dimensions();
        let mut workspace = system.workspace();
        let mut checked = 0;
        for state in model.states.iter().filter(|state| state.distance >= NEAREST) {
            let State { t, q, u } = State { t: 0.0, q: &state.q[..], u: &state.u[..] };
            let name = format!("{} at {:e} rad, u {u:?}", model.name(), state.distance);
            let mut plain = vec![0.0; q.len()];
            let found = acceleration(&system, t, q, u, &mut workspace, &mut plain).unwrap();
            let mut forced = vec![0.0; q.len()];
            let mut lambda = vec![0.0; d.rows + d.drives];
            let out = (&mut forced, &mut lambda);
            let other = acceleration_and_forces(&system, t, q, u, &mut workspace, out.0, out.1);
            assert_eq!([found.rank, other.unwrap().rank], [state.rank; 2], "{name}");
            let mut moving = vec![0.0; q.len()];
            acceleration_in_motion(&system, t, q, u, &mut workspace, &mut moving).unwrap();
            for (found, bound) in [(plain, EXACT), (forced, EXACT), (moving, MOVING)] {
                let error = relative_error(&found, &state.acceleration);
                assert!(error <= bound, "{name}: {error:e}");
            }
            checked += 1;
        }
        assert_eq!(checked, 8, "{}", model.name());
    }
}

/// Next to flat the rows of a sheet fade together with their pivots: elimination serves, and is exact.
#[test]
fn sheets_are_eliminated_next_to_flat() {
    for name in ["miura", "yoshimura"] {
        let compiled = compile(&workspace().join("tests/near_flat").join(format!("{name}.yaml")));
        let system = Interpreter::new(&compiled.program);
        let (mut workspace, mut found) = (system.workspace(), system.speeds());
        let mut eliminated = system.speeds();
        // Speeds make what divides by a short row uncertain.
        let suits = |state: &&NearFlatState| {
            state.distance >= NEAREST * if state.is_at_rest() { 1.0 } else { 10.0 }
        };
        for state in states(name).iter().filter(suits) {
            let (q, u) = (&state.q[..], &state.u[..]);
            let constraint = acceleration(&system, 0.0, q, u, &mut workspace, &mut found).unwrap();
            assert_eq!(constraint.is_weak, state.distance < 0.02, "{name}: {:e}", state.distance);
            system.write_acceleration(0.0, q, u, &mut eliminated).unwrap();
            assert_eq!(found, eliminated, "{name}: {:e}", state.distance);
            let error = relative_error(&found, &state.acceleration);
            assert!(error <= 1e-13, "{name} at {:e} rad: {error:e}", state.distance);
        }
    }
}

#[test]
fn reactions_balance_the_weight_at_rest() {
    let compiled = example("fourbar");
    let system = Interpreter::new(&compiled.program);
    let mut state = started(&system, &[]);
    let mut workspace = system.workspace();
    equilibrium(&system, 0.0, &mut state.q, &mut workspace).unwrap();
    let (q, u) = (&state.q[..], vec![0.0; state.q.len()]);
    let furthest = largest(q);
    assert!(furthest > 1e-4 && furthest < 1e-3, "not next to flat: {q:?}");

    let d = system.dimensions();
    let (mut rates, mut lambda) = (vec![0.0; q.len()], vec![0.0; d.rows]);
    let out = (&mut rates, &mut lambda);
    let found = acceleration_and_forces(&system, 0.0, q, &u, &mut workspace, out.0, out.1).unwrap();
    assert_eq!(found.rank, 3);
    // Beside what springs and weights do to it 1 mrad further.
    let mut beside = vec![0.0; q.len()];
    let away = started(&system, &[(ROCKER, q[ROCKER] + 1e-3)]);
    acceleration(&system, 0.0, &away.q, &u, &mut workspace, &mut beside).unwrap();
    let (left, beside) = (largest(&rates), largest(beside));
    assert!(left <= 1e-9 * beside, "{left:e} rad/s^2 at rest, {beside:e} beside");

    let mut reactions = vec![0.0; 6 * q.len()];
    let (acceleration, multipliers) = (&rates[..], &lambda[..]);
    system
        .write_reactions(Balance { t: 0.0, q, u: &u, acceleration, multipliers }, &mut reactions)
        .unwrap();
    let poses = system.poses(&state.q).unwrap().into_flattened();
    let mechanism = &compiled.topology.mechanism;
    let mut carried = Vector3::zeros();
    for (joint, reaction) in mechanism.joints.iter().zip(reactions.chunks(6)) {
        let [first, second] = joint.bodies.map(|body| body.index());
        let is_fixed = |body: usize| mechanism.bodies[body].fixed;
        assert!(!is_fixed(second), "the ground is the first body of its hinges");
        if is_fixed(first) {
            let (x, z) = (joint.direction, Vector3::z());
            let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
            let pose = Matrix3::from_row_slice(&poses[12 * second..12 * second + 9]);
            carried += pose * axes * Vector3::from_row_slice(&reaction[..3]);
        }
    }
    let moving = mechanism.bodies.iter().filter(|body| !body.fixed);
    let mass: f64 = moving.map(|body| body.mass_properties.mass).sum();
    let weight = -mass * mechanism.gravity[2].constant().unwrap();
    assert!((carried.z - weight).abs() <= 1e-9 * weight, "{carried:?} N, weight {weight} N");
    assert!(carried.x.abs() + carried.y.abs() <= 1e-9 * weight, "{carried:?} N");
}

/// Records `count` samples `step` (s) apart.
fn record(system: &Jit, mut state: State<Vec<f64>, f64>, step: f64, count: usize) -> Motion {
    let mut motion = Motion::new(system.interface());
    let mut integrator = dopri5(system, 1e-12);
    for sample in 0..count {
        let t = step * sample as f64;
        if sample > 0 {
            integrator.run(system, &mut state, t, |_| ()).unwrap();
        }
        motion.record(system, &state).unwrap();
    }
    motion
}

/// When the accelerations of a motion are not the derivatives of the speeds, by central differences over
/// one and over two steps, whose difference bounds the error of the extrapolated one; `noise` is
/// allowed on top, as a share of the acceleration, and 1e-10 of the largest of the motion.
fn off(name: &str, motion: &Motion, noise: f64) -> Vec<f64> {
    let mut off = Vec::new();
    let mut blurred = 0;
    let rates = motion.samples.iter().flat_map(|sample| &sample.acceleration);
    let rounding = 1e-10 * largest(rates.copied());
    for window in motion.samples.windows(5) {
        let [far_before, before, at, after, far_after] = window else { unreachable!() };
        let joints = 0..at.u.len();
        let slope = |from: &Sample, to: &Sample, i: usize| (to.u[i] - from.u[i]) / (to.t - from.t);
        let one = |i| slope(before, after, i);
        let change = |i| one(i) - slope(far_before, far_after, i);
        let own = largest(joints.clone().map(change));
        let fastest = largest(&at.acceleration);
        let bound = own + noise * fastest + rounding;
        let error = largest(joints.map(|i| one(i) + change(i) / 3.0 - at.acceleration[i]));
        if error > bound || error.is_infinite() {
            off.push(at.t);
        }
        blurred += usize::from(bound > 2e-3 * fastest);
    }
    // A bound as large as the acceleration would pass anything.
    assert!(20 * blurred < motion.samples.len(), "{name}: {blurred} samples are too far apart");
    off
}

#[test]
fn accelerations_are_the_derivatives_of_the_speeds() {
    for name in EXAMPLES {
        let system = Jit::new(&example(name).program);
        let motion = record(&system, started(&system, &[]), 1e-5, 400);
        assert_eq!(off(name, &motion, 0.0), [0.0; 0], "{name}");
    }
    // To rest, next to flat.
    let system = Jit::new(&example("fourbar").program);
    let start = started(&system, &[(ROCKER, 8_f64.to_radians())]);
    let motion = record(&system, start, 1e-5, 13_000);
    let end = motion.samples.last().unwrap();
    assert!(largest(&end.q) < 1e-2, "not next to flat: {end:?}");
    assert_eq!(off("to rest", &motion, MOVING), [0.0; 0]);
    // Three freedoms: most motions pass by the flat state, not through it.
    for state in states("sixbar").iter().filter(|state| state.distance >= NEAREST) {
        let system = Jit::new(&example("sixbar").program);
        let start = State { t: 0.0, q: state.q.clone(), u: state.u.clone() };
        let motion = record(&system, start, 1e-7, 100);
        assert_eq!(off("sixbar", &motion, MOVING), [0.0; 0], "at {:e} rad", state.distance);
    }
    // From exactly flat: the pseudo-inverse says where to, and the first step turns to a branch. Speeds
    // are corrected when the branch comes to be known better.
    let flat = State { t: 0.0, q: vec![0.0; 4], u: vec![0.0; 4] };
    let motion = record(&system, flat, 1e-5, 1000);
    assert_eq!(off("from flat", &motion, 1e-3), [0.0; 0]);
}

#[test]
fn methods_leave_a_state_next_to_flat_by_the_same_branch() {
    let compiled = example("fourbar");
    let system = Interpreter::new(&compiled.program);
    let start = started(&system, &[(ROCKER, 3e-3)]);
    let mut explicit = start.clone();
    dopri5(&system, 1e-10).run(&system, &mut explicit, 0.05, |_| ()).unwrap();
    let mut implicit = start;
    let mut rodas = Rodas::new(&system);
    (rodas.relative, rodas.absolute) = (1e-9, 1e-9);
    rodas.run(&system, &mut implicit, 0.05, |_| ()).unwrap();
    let apart = largest(explicit.q.iter().zip(&implicit.q).map(|(x, y)| x - y));
    assert!(apart <= 1e-6, "{apart:e} rad apart");
}

/// Checks a generic module in `f32` at rest, its initial angles scaled down by halves, against the
/// interpreter in `f64`. Down to a largest angle of `good` rad it is exact and of true rank; from `lost` rad on the
/// rank is one less.
fn check_single<M, const N: usize>(model: &M, name: &str, good: f64, lost: f64)
where
    M: Mechanism<Scalar = f32, Coordinates = [f32; N], Speeds = [f32; N]>,
{
    let system = Interpreter::new(&example(name).program);
    let mut workspace = system.workspace();
    let mut single = model.workspace();
    let guess = system.initial().q;
    for halves in 0..16 {
        let scale = 0.5_f64.powi(halves);
        let given: Vec<_> = (0..N)
            .filter(|&joint| system.is_pinned(joint))
            .map(|joint| (joint, scale * guess[joint]))
            .collect();
        let State { q, u, .. } = started(&system, &given);
        let mut expected = vec![0.0; N];
        let true_rank =
            acceleration(&system, 0.0, &q, &u, &mut workspace, &mut expected).unwrap().rank;
        let rounded: [f32; N] = std::array::from_fn(|joint| q[joint] as f32);
        let (rest, mut out) = ([0.0; N], [0.0; N]);
        let found = acceleration(model, 0.0, &rounded, &rest, single.as_mut(), &mut out).unwrap();
        let error = relative_error(&out.map(f64::from), &expected);
        let distance = largest(q);
        if distance >= good {
            assert!(error <= 1e-5, "{name} at {distance:e} rad: {error:e}");
            assert_eq!(found.rank, true_rank, "{name} at {distance:e} rad");
        }
        if distance <= lost {
            assert_eq!(found.rank + 1, true_rank, "{name} at {distance:e} rad");
        }
    }
}

/// As [`check_single`], for the states known from 60 digits, at rest and moving, at 0.1 rad.
fn check_single_moving<M, const N: usize>(model: &M, name: &str)
where
    M: Mechanism<Scalar = f32, Coordinates = [f32; N], Speeds = [f32; N]>,
{
    let states = states(name);
    let far: Vec<_> = states.iter().filter(|state| state.distance >= 0.1).collect();
    assert_eq!(far.len(), 2, "{name}");
    for state in far {
        let array = |x: &[f64]| -> [f32; N] { std::array::from_fn(|joint| x[joint] as f32) };
        let rates = model.acceleration(0.0, &array(&state.q), &array(&state.u)).unwrap();
        let error = relative_error(&rates.map(f64::from), &state.acceleration);
        assert!(error <= 1e-5, "{name}: {error:e}");
    }
}

#[test]
fn single_precision_is_exact_as_far_as_its_digits_go() {
    check_single_moving(&Fourbar::<f32>::default(), "fourbar");
    check_single_moving(&Sixbar::<f32>::default(), "sixbar");
    check_single(&Fourbar::<f32>::default(), "fourbar", 2e-2, 1.2e-2);
    check_single(&Sixbar::<f32>::default(), "sixbar", 5e-3, 2.8e-3);
}
