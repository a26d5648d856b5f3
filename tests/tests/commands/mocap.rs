//! Joint angles from quaternions: the angles of simulated motions are recovered, whatever the signs and lengths of
//! the quaternions, and in spite of gaps.

use lamc_tests::compare::{keep_largest, largest};
use std::f64::consts::TAU;

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::{Integrator, Mechanism, assemble};
use lamc_tests::{compile, compile_text, dopri5, random::Random, workspace};
use lamc_workbench::mocap::{Quaternions, angles, write};
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

/// The rotations of all bodies at some angles, each of either sign at random.
fn rotations(system: &Interpreter, motion: &[Vec<f64>]) -> Vec<Vec<Quaternion<f64>>> {
    let mut random = Random::new(5);
    let mut rows = Vec::new();
    for q in motion {
        let rotation = |pose: &[f64; 12]| {
            let matrix = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&pose[..9]));
            let rotation = UnitQuaternion::from_rotation_matrix(&matrix).into_inner();
            if random.range(0.0, 1.0) < 0.5 { -rotation } else { rotation }
        };
        rows.push(system.poses(q).unwrap().iter().map(rotation).collect());
    }
    rows
}

fn read(compiled: &Compiled, text: &str) -> Quaternions {
    let bodies = &compiled.topology.mechanism.bodies;
    let bodies: Vec<_> = bodies.iter().map(|body| (body.name.as_str(), body.fixed)).collect();
    Quaternions::read(text, &bodies).unwrap_or_else(|error| panic!("{error}"))
}

fn names(compiled: &Compiled) -> Vec<&str> {
    compiled.topology.mechanism.bodies.iter().map(|body| body.name.as_str()).collect()
}

/// Angles or speeds, by sample.
type Samples = Vec<Vec<f64>>;

/// The six-bar of the paper over a second, at the 360 Hz of its cameras.
fn six_bar() -> (Compiled, Interpreter, Vec<f64>, Samples, Samples) {
    let compiled = compile(&workspace().join("examples/sixbar.yaml"));
    let system = Interpreter::new(&compiled.program);
    let mut state = system.initial();
    let pinned: Vec<bool> = (0..6).map(|joint| system.is_pinned(joint)).collect();
    assemble(&system, 0.0, &mut state.q, &pinned, &mut system.workspace()).unwrap();
    let (mut t, mut q, mut u) = (Vec::new(), Vec::new(), Vec::new());
    let times = (0..=360).map(|k| f64::from(k) / 360.0);
    dopri5(&system, 1e-11)
        .sample(&system, &mut state, 1.0, times, |state| {
            t.push(state.t);
            q.push(state.q.clone());
            u.push(state.u.clone());
        })
        .unwrap();
    (compiled, system, t, q, u)
}

#[test]
fn a_six_bar_gives_its_angles_back() {
    let (compiled, system, t, motion, speeds) = six_bar();
    let text = write(&names(&compiled), &t, &rotations(&system, &motion));
    let found = angles(&compiled.topology.mechanism, &read(&compiled, &text));
    let (mut worst, mut slowest) = (0.0_f64, 0.0_f64);
    for (joint, measured) in found.iter().enumerate() {
        let measured = measured.as_ref().unwrap();
        assert!(measured.axis.is_some() && measured.misalignment < 1e-9, "{measured:?}");
        let moved = largest(motion.iter().map(|q| q[joint] - motion[0][joint]));
        assert!(moved > 0.1, "`{}` hardly moves", measured.name);
        for (sample, q) in motion.iter().enumerate() {
            worst = keep_largest(worst, (measured.angle[sample] - q[joint]).abs());
        }
        // Rates in the middle of the record.
        let fastest = largest(speeds.iter().map(|u| u[joint]));
        for (rate, u) in measured.rate.iter().zip(&speeds).take(300).skip(60) {
            slowest = keep_largest(slowest, (rate - u[joint]).abs() / fastest);
        }
    }
    println!("angles within {worst:e} rad, rates within {slowest:e} of the fastest");
    assert!(worst < 1e-9 && slowest < 0.01);
}

#[test]
fn gaps_lengths_and_mounts_are_seen_through() {
    let (compiled, system, t, motion, _) = six_bar();
    let names = names(&compiled);
    let mut rows = rotations(&system, &motion);
    // The sheet flat, before it moves; then every body's frame sits askew on its body, and the
    // world is turned.
    let mut flat_rows = rotations(&system, &[vec![0.0; 6]]);
    let mut times = vec![-1.0];
    times.extend(&t);
    flat_rows.append(&mut rows);
    for row in &mut flat_rows {
        for (body, rotation) in row.iter_mut().enumerate() {
            let mount = UnitQuaternion::new(Vector3::new(0.3, -0.2, 0.1 * body as f64));
            *rotation *= mount.into_inner();
        }
    }
    let mut text = write(&names, &times, &flat_rows);
    // A gap, a row that is no rotation, one that is printed badly.
    let mut lines: Vec<String> = text.lines().map(String::from).collect();
    let field = |line: &str, column: usize, to: &dyn Fn(&str) -> String| -> String {
        let fields = line.split(',').enumerate();
        fields
            .map(|(k, text)| if k == column { to(text) } else { text.into() })
            .collect::<Vec<_>>()
            .join(",")
    };
    let scaled =
        |factor: f64| move |text: &str| (text.parse::<f64>().unwrap() * factor).to_string();
    lines[5] = field(&lines[5], 1, &|_| String::new());
    for column in 1..5 {
        lines[7] = field(&lines[7], column, &scaled(1.3));
        lines[9] = field(&lines[9], column, &scaled(1.004));
    }
    text = lines.join("\n") + "\n";
    let mut measured = read(&compiled, &text);
    assert_eq!(
        measured.notes,
        [
            format!(
                "1 rows of `{}` are left out because they are not rotations (their length differs from 1 by more than 1 %)",
                names[0]
            ),
            format!("1 rows of `{}` are normalised because their length is not 1", names[0]),
        ]
    );
    let fixed: Vec<bool> =
        compiled.topology.mechanism.bodies.iter().map(|body| body.fixed).collect();
    for outside in [f64::NAN, -1.1, 1e3] {
        assert!(measured.flatten(outside, &fixed).is_err(), "{outside} s");
    }
    measured.flatten(-1.0, &fixed).unwrap();
    let found = angles(&compiled.topology.mechanism, &measured);
    for (joint, found) in found.iter().enumerate() {
        let touches =
            compiled.topology.mechanism.joints[joint].bodies.iter().any(|b| b.index() == 0);
        for (sample, angle) in found.as_ref().unwrap().angle.iter().enumerate().skip(1) {
            if touches && (sample == 4 || sample == 6) {
                assert!(angle.is_nan(), "sample {sample} of joint {joint} was not seen");
            } else {
                assert!((angle - motion[sample - 1][joint]).abs() < 1e-9, "sample {sample}");
            }
        }
    }
}

#[test]
fn a_wheel_turns_on_and_on() {
    let compiled = compile_text(
        "
bodies:
  base: { fixed: true }
  wheel: { mass: 1, com: [0, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }
joints: { axle: { bodies: [wheel, base], axis: [[0, 0], [3, -4]] } }
",
    );
    let system = Interpreter::new(&compiled.program);
    let t: Vec<f64> = (0..200).map(|k| f64::from(k) / 100.0).collect();
    let motion: Vec<Vec<f64>> = t.iter().map(|t| vec![-0.4 - 3.0 * TAU * t]).collect();
    let text = write(&names(&compiled), &t, &rotations(&system, &motion));
    let found = angles(&compiled.topology.mechanism, &read(&compiled, &text));
    let axle = found[0].as_ref().unwrap();
    // From half a turn of flat on, through six turns.
    for (angle, exact) in axle.angle.iter().zip(&motion) {
        assert!((angle - exact[0]).abs() < 1e-9, "{angle} is not {}", exact[0]);
    }
}

/// A body mounted askew by an angle about z: the axis is off by as much, the angle is right.
#[test]
fn misalignment_is_reported() {
    let (compiled, system, t, motion, _) = six_bar();
    let mut rows = rotations(&system, &motion);
    let joint = &compiled.topology.mechanism.joints[0];
    let first = joint.bodies[0].index();
    let askew = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.02);
    // Both bodies of the joint: the relative rotation turns its axis, not its angle.
    for row in &mut rows {
        for body in joint.bodies {
            row[body.index()] *= askew.into_inner();
        }
    }
    let text = write(&names(&compiled), &t, &rows);
    let found = angles(&compiled.topology.mechanism, &read(&compiled, &text));
    let found = found[0].as_ref().unwrap();
    assert!((found.misalignment - 0.02).abs() < 1e-9, "{} of body {first}", found.misalignment);
    for (angle, exact) in found.angle.iter().zip(&motion) {
        assert!((angle - exact[0]).abs() < 1e-9);
    }
}

#[test]
fn what_is_wrong_is_said() {
    let bodies = [("base", true), ("arm", false)];
    for (text, says) in [
        ("arm.w,arm.x,arm.y,arm.z\n1,0,0,0\n", "there is no column `t [s]`"),
        ("t,arm.w,arm.x,arm.y\n0,1,0,0\n", "`arm` needs all of .w, .x, .y and .z"),
        ("t,hand.w\n0,1\n", "no column belongs to a body; possible columns are `base.w`, `arm.w`"),
        ("t,arm.w,arm.x,arm.y,arm.z\n0,1,0,0,0\n0,1,0,0,0\n", "times do not increase"),
        ("t,arm.w,arm.x,arm.y,arm.z\n0,1,0,0,no\n", "`no` is not a number"),
        ("t,arm.w,arm.x,arm.y,arm.z\n0,1,0,0,0\n", "1 samples are too few"),
    ] {
        let errors = Quaternions::read(text, &bodies).unwrap_err();
        assert_eq!(errors.0[0].message, says);
    }
}

/// Cameras see the world from anywhere, and frames that follow the drawing need no mending.
#[test]
fn a_turned_world_turns_no_angle() {
    let compiled = compile_text(
        "
bodies:
  base: { fixed: true }
  arm: { mass: 1, com: [0, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }
  end: { mass: 1, com: [0, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }
joints:
  hip: { bodies: [base, arm], axis: [[0, 0], [0, 1]] }
  knee: { bodies: [end, arm], axis: [[1, 0], [2, 3]] }
",
    );
    let system = Interpreter::new(&compiled.program);
    let t: Vec<f64> = (0..50).map(|k| f64::from(k) / 50.0).collect();
    let motion: Vec<Vec<f64>> = t.iter().map(|t| vec![0.7 * (3.0 * t).sin(), -0.4 * t]).collect();
    let mut seen = rotations(&system, &motion);
    let world = UnitQuaternion::from_euler_angles(2.9, -0.4, 3.0).into_inner();
    seen.iter_mut().flatten().for_each(|rotation| *rotation = world * *rotation);
    let text = write(&names(&compiled), &t, &seen);
    let fixed = [true, false, false];
    for flat_at in [None, Some(0.0)] {
        let mut measured = read(&compiled, &text);
        if let Some(t) = flat_at {
            measured.flatten(t, &fixed).unwrap();
        }
        for (joint, found) in angles(&compiled.topology.mechanism, &measured).iter().enumerate() {
            for (angle, q) in found.as_ref().unwrap().angle.iter().zip(&motion) {
                assert!((angle - q[joint]).abs() < 1e-12, "{angle} is not {}", q[joint]);
            }
        }
    }
}
