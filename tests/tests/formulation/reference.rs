//! Published mechanisms and drawings against values that were computed independently of lamc.

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Integrator, Mechanism, State, acceleration, assemble};
use lamc_tests::{
    Reference, designs, dopri5, largest, largest_difference, published, relative_error,
};
use nalgebra::{Matrix3, Vector3};

/// Runs `check` on every published mechanism and every drawing.
fn each(check: impl Fn(&str, &Compiled, &Interpreter, &Reference)) {
    for design in designs() {
        let interpreter = Interpreter::new(&design.compiled.program);
        check(design.name, &design.compiled, &interpreter, &design.reference);
    }
}

#[test]
fn masses_centres_and_inertias() {
    each(|name, compiled, _, reference| {
        let bodies = &compiled.topology.mechanism.bodies;
        assert_eq!(bodies.len(), reference.bodies.len(), "{name}");
        for (body, expected) in bodies.iter().zip(&reference.bodies) {
            assert_eq!((&body.name, body.fixed), (&expected.name, expected.fixed), "{name}");
            let properties = &body.mass_properties;
            let mass = (properties.mass - expected.mass).abs() / expected.mass;
            assert!(mass <= 1e-12, "{name} {}: mass {mass:e}", body.name);
            let com = Vector3::from(expected.com);
            let error = largest(&(properties.com - com)) / largest(&com);
            assert!(error <= 1e-12, "{name} {}: centre {error:e}", body.name);
            let inertia = Matrix3::from(expected.inertia);
            let error = largest(&(properties.inertia - inertia)) / largest(&inertia);
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
            let mut rates = system.speeds();
            let rank = acceleration(system, 0.0, &state.q, &state.u, &mut workspace, &mut rates)
                .map(|constraint| constraint.rank);
            assert_eq!(rank, Ok(reference.rank), "{at}");
            let error = relative_error(&rates, &state.acceleration);
            assert!(error <= 1e-9, "{at}: acceleration {error:e}");
            let energy = system.energy(0.0, &state.q, &state.u).unwrap();
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
            assert_eq!(state.mass_matrix.is_some(), reference.rank == 0, "{name}");
            let Some(expected) = &state.mass_matrix else { continue };
            let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
            let out = EquationsMut {
                mass: &mut mass,
                forcing: &mut forcing,
                jacobian: &mut [],
                gamma: &mut [],
            };
            system.write_equations(0.0, &state.q, &state.u, out).unwrap();
            let error = relative_error(&mass, &expected.concat());
            assert!(error <= 1e-9, "{name}: mass matrix {error:e}");
            if let Some(expected) = &state.forcing {
                let error = relative_error(&forcing, expected);
                assert!(error <= 1e-9, "{name}: forcing {error:e}");
            }
        }
    });
}

#[test]
fn trajectories() {
    for design in published() {
        let (name, system) = (design.name, &Interpreter::new(&design.compiled.program));
        let trajectory = design.reference.trajectory();
        let mut state = State { t: 0.0, q: trajectory.q0.clone(), u: trajectory.u0.clone() };
        let mut integrator = dopri5(system, 1e-10);
        let loops = system.dimensions().loops;
        let mut residual = vec![0.0; 9 * loops];
        let mut jacobian = vec![0.0; 9 * loops * state.q.len()];
        for (&t, expected) in trajectory.t.iter().zip(&trajectory.q) {
            if let Err(error) = integrator.run(system, &mut state, t, |_| ()) {
                panic!("{name} at t = {t}: {error}");
            }
            let error = largest_difference(&state.q, expected);
            assert!(error <= 1e-6, "{name} at t = {t}: off by {error:e}");
            system.write_closure(&state.q, &mut residual, &mut jacobian).unwrap();
            let open = largest(&residual);
            assert!(open <= 1e-9 * system.size(), "{name} at t = {t}: open by {open:e} m");
        }
    }
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
