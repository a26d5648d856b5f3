//! States in lanes: each has the bits that it has alone, and one that is not finite is named and changes nothing.
//! `backends/lanes.rs` has designs in lanes, with and without vector instructions that fuse.

use lamc_generated::{sixbar::Sixbar, triple_pendulum::TriplePendulum};
use lamc_runtime::{Arithmetic, Batch, Error, Lanes, Mechanism, Rk4, State, f32x8, f64x4};

/// Assembled states with other speeds in each lane, projected by a step.
fn states<V: Lanes, B, const N: usize>(batch: &B, dt: V::Number) -> State<[V; N], V>
where
    B: Batch<V, Coordinates = [V; N], Speeds = [V; N]>,
    B::Lane: Mechanism<Scalar = V::Number, Coordinates = [V::Number; N], Speeds = [V::Number; N]>,
{
    let mut states = batch.assembled().unwrap();
    for lane in 0..V::COUNT {
        let mut state = states.lane(lane);
        for (index, u) in state.u.iter_mut().enumerate() {
            *u = V::Number::from_f64(((lane * N + index) as f64).sin());
        }
        states.set_lane(lane, &state);
    }
    batch.step(&mut states, dt).unwrap();
    states
}

fn check<V: Lanes, B, const N: usize>(batch: &B)
where
    B: Batch<V, Coordinates = [V; N], Speeds = [V; N]>,
    B::Lane: Mechanism<Scalar = V::Number, Coordinates = [V::Number; N], Speeds = [V::Number; N]>,
{
    let dt = V::Number::from_f64(1e-3);
    let mut together = states(batch, dt);
    let mut alone: Vec<_> = (0..V::COUNT).map(|lane| together.lane(lane)).collect();
    for _ in 0..50 {
        batch.step(&mut together, dt).unwrap();
        for (lane, state) in alone.iter_mut().enumerate() {
            let mechanism = batch.lane(lane);
            Rk4::new(&mechanism).step(&mechanism, state, dt).unwrap();
            assert_eq!(together.lane(lane), *state, "lane {lane}");
        }
    }
    for value in [f64::INFINITY, f64::NEG_INFINITY, f64::NAN] {
        for index in 0..2 * N {
            let mut spoiled = together;
            let lane = index % V::COUNT;
            let mut state = spoiled.lane(lane);
            let entry = if index < N { &mut state.q[index] } else { &mut state.u[index - N] };
            *entry = V::Number::from_f64(value);
            spoiled.set_lane(lane, &state);
            let error = batch.step(&mut spoiled, dt).unwrap_err();
            assert_eq!(error.lane, lane, "{value} at {index}");
            assert!(matches!(error.error, Error::NotFinite { .. }), "{error}");
            let other = (lane + 1) % V::COUNT;
            assert_eq!(spoiled.lane(other), together.lane(other), "{value} at {index}");
            let error = batch.acceleration(spoiled.t, &spoiled.q, &spoiled.u).unwrap_err();
            assert_eq!(error.lane, lane, "{value} at {index}");
        }
    }
}

#[test]
fn a_lane_has_the_bits_of_its_state_alone_or_names_what_is_wrong_with_it() {
    check(&Sixbar::<f64x4>::default());
    check(&Sixbar::<f32x8>::default());
    check(&TriplePendulum::<f64x4>::default());
    check(&TriplePendulum::<f32x8>::default());
}
