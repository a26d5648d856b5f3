//! Recorded motions: poses against points, accelerations against differences of rates.

use lamc_runtime::{Dopri5, Integrator, Mechanism, assemble};
use lamc_tests::compare::largest;
use lamc_tests::{EXAMPLES, ROBOTS, compile, workspace};
use lamc_workbench::execution::Jit;
use lamc_workbench::motion::Motion;

#[test]
fn poses_carry_points_and_accelerations_are_those_of_the_rates() {
    for name in EXAMPLES.into_iter().chain(ROBOTS) {
        let compiled = compile(&workspace().join("examples").join(format!("{name}.yaml")));
        let mechanism = &compiled.topology.mechanism;
        let system = Jit::new(&compiled.program);
        let mut state = system.initial();
        let given: Vec<bool> =
            (0..system.dimensions().joints).map(|joint| system.is_pinned(joint)).collect();
        let assembled = assemble(&system, 0.0, &mut state.q, &given, &mut system.workspace());
        assert!(assembled.is_ok(), "{name}: {assembled:?}");
        // Slow enough that three samples make a parabola of the rates, even of the stiffest.
        let step = 1e-6;
        let mut motion = Motion::new(system.interface());
        let mut integrator = Dopri5::new(&system);
        (integrator.relative, integrator.absolute) = (1e-12, 1e-12);
        for sample in 0..3 {
            let t = 1e-3 + step * f64::from(sample);
            let run = integrator.run(&system, &mut state, t, |_| ());
            assert_eq!(run.and_then(|()| motion.record(&system, &state)), Ok(()), "{name}");
        }
        let [before, at, after] = motion.samples.as_slice() else { unreachable!() };
        let largest = largest(&at.acceleration);
        for (joint, a) in at.acceleration.iter().enumerate() {
            let slope = (after.u[joint] - before.u[joint]) / (after.t - before.t);
            assert!((slope - a).abs() < 1e-5 * largest, "{name}: {slope} is not {a}");
        }
        for (point, position) in mechanism.points.iter().zip(&at.points) {
            let pose = at.poses[point.body.index()];
            for ((row, p), x) in pose.rotation.iter().zip(pose.translation).zip(position) {
                let carried = row[0] * point.at.x + row[1] * point.at.y + row[2] * point.at.z + p;
                assert!(
                    (carried - x).abs() < 1e-14 * motion.size.max(1.0),
                    "{name}: {carried} {x}"
                );
            }
        }
        let fixed = mechanism.bodies.iter().position(|body| body.fixed);
        assert_eq!(fixed.is_none(), ROBOTS.contains(&name), "{name}");
        assert!(fixed.is_none_or(|fixed| at.poses[fixed].translation == [0.0; 3]), "{name}");
        assert!(at.closure < 1e-9 * motion.size && at.energy.kinetic > 0.0, "{name}");
    }
}
