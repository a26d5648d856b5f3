//! The published designs against reference values from three independent implementations.

use lamc::program::Interpreter;
use lamc_runtime::{EquationsMut, Integrator, State, System, acceleration, assemble};
use lamc_tests::{DESIGNS, Reference, compile, dopri5, relative_error, shared};
use nalgebra::{Matrix3, Vector3};

/// Runs `check` on every published design.
fn each(check: impl Fn(&str, &lamc::pipeline::Compiled, &Interpreter, &Reference)) {
    let Some(shared) = shared() else { return };
    for name in DESIGNS {
        let compiled = compile(&shared.join("designs").join(format!("{name}.cad.joints")));
        let interpreter = Interpreter::new(&compiled.program);
        check(name, &compiled, &interpreter, &Reference::read(&shared, name));
    }
}

#[test]
fn masses_centres_and_inertias() {
    each(|name, compiled, _, reference| {
        for (body, expected) in compiled.topology.mechanism.bodies.iter().zip(&reference.bodies) {
            let properties = &body.mass_properties;
            let mass = (properties.mass - expected.mass).abs() / expected.mass;
            assert!(mass <= 1e-12, "{name} {}: mass {mass:e}", body.name);
            let com = Vector3::from(expected.com);
            let error = (properties.com - com).amax() / com.amax();
            assert!(error <= 1e-12, "{name} {}: centre {error:e}", body.name);
            let inertia = Matrix3::from(expected.inertia);
            let error = (properties.inertia - inertia).amax() / inertia.amax();
            assert!(error <= 1e-12, "{name} {}: inertia {error:e}", body.name);
        }
    });
}

#[test]
fn accelerations_ranks_and_energies() {
    each(|name, _, system, reference| {
        let mut workspace = system.workspace();
        for (index, state) in reference.states.iter().enumerate() {
            let at = format!("{name} state {index}");
            let mut rates = system.vector();
            let rank = acceleration(system, 0.0, &state.q, &state.u, &mut workspace, &mut rates)
                .map(|constraint| constraint.rank);
            assert_eq!(rank, Ok(state.constraint_rank), "{at}");
            assert_eq!(state.q.len() - state.constraint_rank, state.dof, "{at}");
            let error = relative_error(&rates, &state.acceleration);
            assert!(error <= 1e-9, "{at}: acceleration {error:e}");
            let energy = system.energy(0.0, &state.q, &state.u);
            let energies = [energy.kinetic, energy.potential];
            for (value, expected) in
                energies.into_iter().zip([state.kinetic_energy, state.potential_energy])
            {
                let error = (value - expected).abs() / expected.abs();
                assert!(error <= 1e-9, "{at}: energy {error:e}");
            }
        }
    });
}

#[test]
fn mass_matrix_and_forcing_of_trees() {
    each(|name, _, system, reference| {
        let n = system.dimensions().coordinates;
        for state in &reference.states {
            let (Some(expected), Some(expected_forcing)) = (&state.mass_matrix, &state.forcing)
            else {
                continue;
            };
            let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
            let out = EquationsMut {
                mass: &mut mass,
                forcing: &mut forcing,
                jacobian: &mut [],
                gamma: &mut [],
            };
            system.write_equations(0.0, &state.q, &state.u, out);
            let error = relative_error(&mass, &expected.concat());
            assert!(error <= 1e-9, "{name}: mass matrix {error:e}");
            let error = relative_error(&forcing, expected_forcing);
            assert!(error <= 1e-9, "{name}: forcing {error:e}");
        }
    });
}

#[test]
fn trajectories() {
    each(|name, _, system, reference| {
        let trajectory = &reference.trajectory;
        let mut state = State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() };
        let mut integrator = dopri5(system, 1e-10);
        let loops = system.dimensions().loops;
        let mut residual = vec![0.0; 9 * loops];
        let mut jacobian = vec![0.0; 9 * loops * state.q.len()];
        for (&t, expected) in trajectory.t.iter().zip(&trajectory.q) {
            if let Err(error) = integrator.run(system, &mut state, t, |_| ()) {
                panic!("{name} at t = {t}: {error}");
            }
            let error =
                state.q.iter().zip(expected).fold(0.0_f64, |most, (x, y)| most.max((x - y).abs()));
            assert!(error <= 1e-6, "{name} at t = {t}: off by {error:e}");
            system.write_closure(&state.q, &mut residual, &mut jacobian);
            let open = residual.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            assert!(open <= 1e-9 * system.size(), "{name} at t = {t}: open by {open:e} m");
        }
    });
}

#[test]
fn assembly_from_rough_guesses() {
    each(|name, _, system, reference| {
        let mut workspace = system.workspace();
        for state in &reference.states {
            let mut guess: Vec<f64> = state.q.iter().map(|q| (q * 10.0).round() / 10.0).collect();
            let assembly =
                assemble(system, 0.0, &mut guess, &vec![false; state.q.len()], &mut workspace);
            let residual = assembly.map(|assembly| assembly.residual);
            assert!(
                residual.is_ok_and(|residual| residual <= 1e-12 * system.size()),
                "{name}: {residual:?}"
            );
        }
    });
}
