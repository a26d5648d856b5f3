//! A design or a state in each lane: the same bits as the scalar module's, in a package of its own,
//! with and without vector instructions that fuse.

use std::path::Path;
use std::process::Command;
use std::{fs, io};

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc_tests::{compile_text, not_checked, workspace};

const MAIN: &str = r#"//! Compares lanes with the scalar module.

mod fourbar;
mod sixbar;
mod triple_pendulum;
#[allow(dead_code, reason = "the tests' own, of which this program uses a part")]
mod uniform;

use lamc_runtime::{
    Arithmetic, Batch, Error, Lanes, Mechanism, Rk4, f32x8, f64x4,
};
use uniform::Random;

/// A number about `middle`, another in each lane.
fn about<V: Lanes>(random: &mut Random, middle: V, spread: f64) -> V {
    let mut vector = middle;
    for lane in vector.lanes_mut() {
        *lane *= V::Number::from_f64(1.0 + spread * random.range(-1.0, 1.0));
    }
    vector
}

/// Motions of designs from states of their own; a lane starts flat, where it has loops.
fn check<V: Lanes, B, const N: usize>(name: &str, batch: &B, dt: f64, random: &mut Random)
where
    B: Batch<V, Coordinates = [V; N], Speeds = [V; N]>,
    B::Lane: Mechanism<Scalar = V::Number, Coordinates = [V::Number; N], Speeds = [V::Number; N]>,
{
    let dt = V::Number::from_f64(dt);
    let is_closed = batch.lane(0).dimensions().rows > 0;
    let mut states = batch.assembled().unwrap();
    let flat = 1;
    if is_closed {
        let mut state = states.lane(flat);
        state.q = [V::Number::ZERO; N];
        state.u = [V::Number::ZERO; N];
        states.set_lane(flat, &state);
        let margin = batch.write_acceleration(states.t, &states.q, &states.u, &mut [V::ZERO; N]);
        let margin = margin.unwrap().expect("it is solved");
        let flat = margin.conditioning.lane(flat);
        assert!(!(flat > V::Number::from_f64(1e-4)), "{name}: flat, yet regular: {flat:?}");
    }
    let mut designs: Vec<_> = (0..V::COUNT)
        .map(|lane| {
            let mut state = states.lane(lane);
            if !is_closed {
                state.q = state.q.map(|q| q + V::Number::from_f64(random.range(-1.0, 1.0)));
            }
            // The first step takes to the closure what of this is not; flat, nothing can.
            if !is_closed || lane != flat {
                state.u = state.u.map(|u| u + V::Number::from_f64(random.range(-1.0, 1.0)));
            }
            states.set_lane(lane, &state);
            let mechanism = batch.lane(lane);
            (Rk4::new(&mechanism), mechanism, state)
        })
        .collect();
    let mut together = 0;
    for step in 0..300 {
        let rates = batch.acceleration(states.t, &states.q, &states.u).unwrap();
        batch.step(&mut states, dt).unwrap();
        for (lane, (rk4, mechanism, state)) in designs.iter_mut().enumerate() {
            let alone = mechanism.acceleration(state.t, &state.q, &state.u).unwrap();
            assert_eq!(rates.map(|rate| rate.lane(lane)), alone, "{name}, lane {lane}, step {step}");
            rk4.step(mechanism, state, dt).unwrap();
            assert_eq!(states.lane(lane), *state, "{name}, lane {lane}, step {step}");
        }
        let mut out = [V::ZERO; N];
        let margin = batch.write_acceleration(states.t, &states.q, &states.u, &mut out).unwrap().expect("it is solved");
        together += margin.conditioning.lanes().iter().filter(|&&x| x > V::Number::from_f64(1e-4)).count();
    }
    println!("{name}: {together} of {} together", 300 * V::COUNT);
    fails(name, batch, states);
}

/// A state that is not a number is named, and changes nothing.
fn fails<V: Lanes, B, const N: usize>(
    name: &str,
    batch: &B,
    mut states: lamc_runtime::State<[V; N], V>,
) where
    B: Batch<V, Coordinates = [V; N], Speeds = [V; N]>,
{
    let last = V::COUNT - 1;
    let mut state = states.lane(last);
    state.u[N - 1] = V::Number::from_f64(f64::NAN);
    states.set_lane(last, &state);
    let before = states;
    let error = batch.step(&mut states, V::Number::from_f64(1e-3)).unwrap_err();
    assert_eq!(error.lane, last, "{name}");
    assert!(matches!(error.error, Error::NotFinite { .. }), "{name}: {error}");
    let found = batch.acceleration(states.t, &states.q, &states.u).unwrap_err();
    assert_eq!(found.lane, last, "{name}");
    for lane in 0..last {
        assert_eq!(states.lane(lane), before.lane(lane), "{name}");
    }
}

fn designs<V: Lanes>(kind: &str) {
    let mut random = Random::new(7);
    let mut robots = sixbar::Sixbar::<V>::default();
    let params = &mut robots.params;
    params.stiffness_ground_west = about(&mut random, params.stiffness_ground_west, 0.5);
    params.damping_south_east_east = about(&mut random, params.damping_south_east_east, 0.5);
    params.mass_south = about(&mut random, params.mass_south, 0.5);
    check(&format!("six-bar, {kind}"), &robots, 1e-3, &mut random);
    let mut robots = fourbar::Fourbar::<V>::default();
    robots.params.rest_crank_hinge = about(&mut random, V::from_f64(1.0), 0.3);
    check(&format!("four-bar, {kind}"), &robots, 2e-5, &mut random);
    let mut robots = triple_pendulum::TriplePendulum::<V>::default();
    robots.inputs.push = about(&mut random, V::from_f64(2.0), 0.9);
    check(&format!("triple pendulum, {kind}"), &robots, 1e-3, &mut random);
}

fn main() {
    println!("fused: {}", 0.1_f64.mul_add(10.0, -1.0) == Arithmetic::mul_add(0.1, 10.0, -1.0));
    designs::<f64x4>("f64");
    designs::<f32x8>("f32");
}
"#;

#[test]
fn a_lane_has_the_bits_of_its_design_alone() {
    let folder = tempfile::tempdir().unwrap();
    write_package(folder.path()).unwrap();
    let plain = run(folder.path(), "x86-64");
    assert!(plain.contains("fused: false"), "{plain}");
    #[cfg(target_arch = "x86_64")]
    if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
        let fused = run(folder.path(), "x86-64-v3");
        assert!(fused.contains("fused: true"), "{fused}");
    } else {
        not_checked("lanes with vector instructions that fuse, which this processor does not have");
    }
}

/// The modules of three examples, with something to vary, and what compares them.
fn write_package(folder: &Path) -> io::Result<()> {
    let runtime = workspace().join("runtime").canonicalize()?;
    let manifest = format!(
        "[package]\nname = \"lanes\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n[dependencies]\n\
         lamc-runtime = {{ path = {runtime:?}, features = [\"simd\"] }}\n\n\
         [profile.release]\nopt-level = 1\n\n[workspace]\n"
    );
    fs::write(folder.join("Cargo.toml"), manifest)?;
    let source = folder.join("src");
    fs::create_dir(&source)?;
    fs::write(source.join("main.rs"), MAIN)?;
    fs::write(source.join("uniform.rs"), include_str!("../../src/uniform.rs"))?;
    let joints = "\njoints:\n";
    for (name, place, variation) in [
        ("sixbar", joints, "\ntunable: [stiffness, damping, mass]\njoints:\n"),
        ("fourbar", joints, "\ntunable: [rest]\njoints:\n"),
        ("triple_pendulum", "damping: 10.0,", "damping: 10.0, torque: push,"),
    ] {
        let text = fs::read_to_string(workspace().join(format!("examples/{name}.yaml")))?;
        let inputs = if name == "triple_pendulum" { "inputs: [push]\n" } else { "" };
        let text = format!("{inputs}{}", text.replacen(place, variation, 1));
        let module = rust_module(&compile_text(&text), &Options::default()).unwrap();
        fs::write(source.join(format!("{name}.rs")), module)?;
    }
    Ok(())
}

/// Builds for a processor, without warnings, and runs; its output.
fn run(folder: &Path, processor: &str) -> String {
    let target = folder.join(processor);
    let output = Command::new(env!("CARGO"))
        .args(["run", "--release", "--offline"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", &target)
        .env(
            "RUSTFLAGS",
            if cfg!(target_arch = "x86_64") {
                format!("-C target-cpu={processor}")
            } else {
                String::new()
            },
        )
        .output()
        .unwrap();
    let problems = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success() && !problems.contains("warning:"), "{processor}: {problems}");
    let found = String::from_utf8_lossy(&output.stdout).into_owned();
    println!("{processor}: {found}");
    found
}
