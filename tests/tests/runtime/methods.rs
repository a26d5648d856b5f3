//! Properties of the integrators: order, continuous extension, stabilisation, single precision.

use lamc_generated::{fourbar::Fourbar, sixbar::Sixbar, triple_pendulum::TriplePendulum};
use lamc_runtime::{
    Dopri5, Error, Integrator, Mechanism, Rk4, Rodas, Scalar, SemiImplicitEuler, Stabilisation,
    State,
};
use lamc_tests::compare::{largest, largest_difference};

/// Errors of RODASP at steps of fixed length fall as the fourth power, those of its continuous
/// extension as the third at least, for free and for closed chains, in time-invariant models.
fn order<M, const N: usize>(model: &M, end: f64, longest: f64)
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; N], Speeds = [f64; N]>,
{
    let start = model.assembled().unwrap();
    let mut reference = start;
    let mut exact = Dopri5::new(model);
    (exact.relative, exact.absolute) = (1e-13, 1e-13);
    exact.run(model, &mut reference, end, |_| ()).unwrap();
    let error = |step: f64| {
        let mut rodas = Rodas::new(model);
        (rodas.relative, rodas.absolute, rodas.max_step) = (1e9, 1e9, step);
        let (mut state, mut steps) = (start, 0);
        rodas.run(model, &mut state, end, |_| steps += 1).unwrap();
        // The controller starts small and grows by tens.
        let least = (end / step) as usize;
        assert!((least..least + 12).contains(&steps), "{steps} steps of {step}");
        largest_difference(&state.q, &reference.q)
    };
    let errors: Vec<f64> = (0..3).map(|k| error(longest / f64::from(1 << k))).collect();
    println!("{errors:?}");
    for pair in errors.windows(2) {
        let order = (pair[0] / pair[1]).log2();
        assert!(order > 3.5, "order {order}: {errors:?}");
    }
}

#[test]
fn rodasp_is_of_fourth_order() {
    order(&TriplePendulum::<f64>::default(), 0.4, 0.02);
    order(&Sixbar::<f64>::default(), 0.1, 0.005);
}

#[test]
fn samples_between_implicit_steps_lie_on_the_motion() {
    let robot = Sixbar::<f64>::default();
    let start = robot.assembled().unwrap();
    let times: Vec<f64> = (0..=40).map(|k| f64::from(k) * 0.005).collect();
    let run = |integrator: &mut dyn FnMut(&mut Vec<[f64; 6]>)| {
        let mut samples = Vec::new();
        integrator(&mut samples);
        samples
    };
    let implicit = run(&mut |samples| {
        let mut rodas = Rodas::new(&robot);
        (rodas.relative, rodas.absolute) = (1e-7, 1e-7);
        let mut state = start;
        rodas.sample(&robot, &mut state, 0.2, times.clone(), |s| samples.push(s.q)).unwrap();
    });
    let explicit = run(&mut |samples| {
        let mut dopri5 = Dopri5::new(&robot);
        (dopri5.relative, dopri5.absolute) = (1e-11, 1e-11);
        let mut state = start;
        dopri5.sample(&robot, &mut state, 0.2, times.clone(), |s| samples.push(s.q)).unwrap();
    });
    assert_eq!((implicit.len(), explicit.len()), (41, 41));
    let worst = largest_difference(implicit.as_flattened(), explicit.as_flattened());
    assert!(worst < 1e-5, "{worst:e}");
}

fn drift(robot: &Sixbar<f64>, state: &State<[f64; 6], f64>) -> f64 {
    let residual = robot.closure(&state.q).residual;
    largest(residual) / robot.size()
}

/// Projection keeps loops closed to 1e-9, Baumgarte's way nearly, nothing not; in every integrator
/// that offers the choice.
#[test]
fn ways_to_keep_loops_closed() -> Result<(), Error> {
    let robot = Sixbar::<f64>::default();
    let start = robot.assembled()?;
    for (way, low, high) in [
        (Stabilisation::Projection, 0.0, 1e-9),
        (Stabilisation::Baumgarte, 1e-12, 1e-4),
        (Stabilisation::Off, 1e-6, 1.0),
    ] {
        let (mut a, mut b) = (start, start);
        let mut rk4 = Rk4::new(&robot);
        rk4.stabilisation = way;
        rk4.run(&robot, &mut a, 2.0, 2e-3, |_| ())?;
        let mut euler = SemiImplicitEuler::new(&robot);
        euler.stabilisation = way;
        euler.run(&robot, &mut b, 2.0, 5e-4, |_| ())?;
        let found = [drift(&robot, &a), drift(&robot, &b)];
        println!("{way:?}: {found:?}");
        assert!(found.iter().all(|drift| (low..high).contains(drift)), "{way:?}: {found:?}");
    }
    Ok(())
}

/// Single precision follows double, within what it has digits for.
#[test]
fn single_precision_settles_and_moves() -> Result<(), Error> {
    let (wide, narrow) = (Sixbar::<f64>::default(), Sixbar::<f32>::default());
    let ((a, found), (b, short)) = (wide.settled()?, narrow.settled()?);
    assert!(found.stable && short.stable);
    for (a, b) in a.q.iter().zip(b.q) {
        assert!((a - b.to_f64()).abs() < 1e-3, "{a} is not {b}");
    }
    let (mut a, mut b) = (wide.assembled()?, narrow.assembled()?);
    Rodas::new(&wide).run(&wide, &mut a, 0.1, |_| ())?;
    Rodas::new(&narrow).run(&narrow, &mut b, 0.1, |_| ())?;
    for (a, b) in a.q.iter().zip(b.q) {
        assert!((a - b.to_f64()).abs() < 1e-2, "{a} is not {b}");
    }
    let stiff = Fourbar::<f32>::default();
    let mut state = stiff.assembled()?;
    let before = state.q;
    // As far as its digits tell it from the flat, singular state.
    Rodas::new(&stiff).run(&stiff, &mut state, 0.02, |_| ())?;
    for (before, now) in before.iter().zip(state.q) {
        assert!(now.abs() < 0.2 * before.abs() && now.abs() > 1e-3, "{:?}", state.q);
    }
    Ok(())
}

/// Speeds whose squares overflow: no step, however it keeps loops closed, leaves numbers that are not finite.
fn overflows<M, const N: usize>(model: &M)
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; N], Speeds = [f64; N]>,
{
    let start = State { u: [1e200; N], ..model.assembled().unwrap() };
    for stabilisation in [Stabilisation::Projection, Stabilisation::Baumgarte, Stabilisation::Off] {
        let (mut rk4, mut euler) = (Rk4::new(model), SemiImplicitEuler::new(model));
        (rk4.stabilisation, euler.stabilisation) = (stabilisation, stabilisation);
        let (mut a, mut b) = (start, start);
        for outcome in [rk4.step(model, &mut a, 1e-3), euler.step(model, &mut b, 1e-3)] {
            assert!(
                matches!(outcome, Err(Error::NotFinite { .. })),
                "{stabilisation:?}: {outcome:?}"
            );
        }
        assert_eq!([(a.t, a.q, a.u), (b.t, b.q, b.u)], [(start.t, start.q, start.u); 2]);
    }
}

#[test]
fn steps_that_overflow_are_refused() {
    overflows(&TriplePendulum::<f64>::default());
    overflows(&Fourbar::<f64>::default());
    overflows(&Sixbar::<f64>::default());
}
