//! A mechanism before and after an optimisation, as one picture.

use lamc_workbench::motion::Motion;
use lamc_workbench::optimise::Problem;
use lamc_workbench::optimise::goals::{Aim, Clearance, Measure};
use lamc_workbench::picture::{Picture, Renderer, View};
use lamc_workbench::rest::settle;
use lamc_workbench::scene::{Moment, Scene};
use lamc_workbench::simulation::{Asked, Settings, Simulation, start};

/// Width and height of one of both, pixels.
const SIZE: [usize; 2] = [640, 560];

/// Draws these designs, given by all parameters in SI, side by side and on one scale: in the state of rest if a goal is
/// about it, else in the initial one. Those that have no such state are left out; `None` if all are.
pub fn side_by_side(problem: &Problem<'_>, designs: &[&[f64]]) -> Option<Picture> {
    let shown: Vec<(Scene, Motion)> =
        designs.iter().filter_map(|values| shown(problem, values)).collect();
    let points: Vec<_> = shown.iter().flat_map(|(scene, motion)| scene.swept(motion)).collect();
    let pictures = shown.iter().map(|(scene, motion)| {
        let moment = motion.samples.last().map_or_else(Moment::default, Moment::from);
        Renderer::around(scene, motion, points.clone(), View::default(), SIZE).draw(&moment)
    });
    pictures.reduce(Picture::beside)
}

/// One design as a motion of one sample.
fn shown(problem: &Problem<'_>, values: &[f64]) -> Option<(Scene, Motion)> {
    let mut system = problem.system.clone();
    let names: Vec<_> = system.interface().parameters.iter().map(|it| it.name.clone()).collect();
    for (name, value) in names.iter().zip(values) {
        system.set_parameter(name, *value).ok()?;
    }
    let topology = problem.compiled.topology_at(values).ok()?;
    let mut state = start(&topology, &system, &Asked::of(&system, &[]), |_| ()).ok()?;
    if is_about_rest(problem) {
        settle(&system, &mut state).ok()?;
    }
    state.u.fill(0.0);
    let mut still = Simulation::new(system, state, None, &Settings::default()).ok()?;
    still.run([0.0], || false, |_| ()).ok()?;
    Some((Scene::new(&topology.mechanism), still.motion().clone()))
}

fn is_about_rest(problem: &Problem<'_>) -> bool {
    let goals = problem.goals.goals.iter().filter_map(|goal| match goal.aim {
        Aim::Number(measure, _) => Some(measure),
        Aim::Path(_) => None,
    });
    let measures = goals.chain(problem.goals.constraints.iter().map(|it| it.measure));
    let of_rest = |measure: Measure| {
        matches!(
            measure,
            Measure::Angle(_)
                | Measure::Position { .. }
                | Measure::Energy
                | Measure::Stiffness { .. }
                | Measure::Frequency(_)
                | Measure::Torque(_)
                | Measure::Force(_)
                | Measure::Settle(_)
                | Measure::Clearance(Clearance { turned: None, .. })
        )
    };
    measures.into_iter().any(of_rest)
}
