//! `lamc optimise MODEL GOALS -o BEST.yaml`: values of parameters that meet goals.

use std::fmt::Write;
use std::thread;
use std::time::Instant;

use clap::Args;
use lamc::source::schema::{ANGLE, LENGTH};
use lamc::source::{self, SourceFile, SourceModel, to_yaml, with_parameters};
use lamc_workbench::optimise::goals::{Aim, Measure, Moved, Moving, OfState, Stroke, Wanted};
use lamc_workbench::optimise::{
    Failure, Goals, KEPT, Kept, Outcome as Optimum, Problem, Reached, remarks,
};
use serde::Serialize;

use super::designs::side_by_side;
use super::interrupt::{self, EXIT_INTERRUPTED};
use super::paths::Paths;
use super::start::Start;
use super::{Failed, Outcome, fail, misused, output, progress, read, report};

/// Find the values of parameters that meet goals: paths of points, angles at rest, frequencies, masses.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// The goals: what varies, what is aimed at, what has to be kept
    goals: String,
    /// Where to write the best model
    #[arg(short, long, value_name = "FILE")]
    output: String,
    /// Draw the mechanism before and after, side by side, as PNG
    #[arg(long, value_name = "FILE")]
    png: Option<String>,
    /// Print JSON in SI units and radians
    #[arg(long)]
    json: bool,
    /// Threads; as many as cores, unless given
    #[arg(long, value_name = "NUMBER")]
    threads: Option<usize>,
}

#[derive(Serialize)]
struct Report<'a> {
    model: &'a str,
    parameters: serde_json::Map<String, serde_json::Value>,
    objective: f64,
    goals: Vec<GoalReport<'a>>,
    constraints: Vec<ConstraintReport<'a>>,
    searches: usize,
    reached: usize,
    designs_drawn: usize,
    evaluations: usize,
    seed: u64,
    remarks: &'a [String],
    history: &'a [(usize, f64)],
    objectives: Vec<f64>,
}

#[derive(Serialize)]
struct GoalReport<'a> {
    name: &'a str,
    /// Of a path, the root mean square of its distances, m.
    value: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    largest: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    wanted: Option<f64>,
    before: Option<f64>,
}

#[derive(Serialize)]
struct ConstraintReport<'a> {
    name: &'a str,
    value: f64,
    limit: f64,
    kept: bool,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { start, goals: path, output: best, .. } = arguments;
    Paths::default()
        .input("the model", [&start.model])
        .input("the goals", [path])
        .output("--output", [best])
        .output("--png", &arguments.png)
        .check()?;
    output::has_extension(arguments.png.as_ref(), "png")?;
    let threads = match arguments.threads {
        Some(0) => return Err(misused("--threads must be at least 1")),
        Some(threads) => threads,
        None => thread::available_parallelism().map_or(1, usize::from),
    };
    if best == "-" && arguments.json {
        return Err(misused("the best model and --json cannot both go to standard output"));
    }
    output::probe(best)?;
    let file = read(path)?;
    let compiled = start.compile(&[])?;
    let mut system = start.system(&compiled)?;
    system.interface().without_controllers("goals").map_err(fail)?;
    for (joint, angle) in start.guess(&compiled, system.interface())? {
        system.set_initial(joint, angle);
    }
    let goals = Goals::read(&file, &compiled).map_err(|problems| {
        report(&problems, &file);
        Failed(1)
    })?;
    let model = declared(&start.model, &goals)?;
    interrupt::listen()?;
    let bar = progress::bar(goals.starts as usize);
    let problem = Problem::new(&compiled, system, goals);
    let begun = Instant::now();
    let found = problem.optimise(threads, &interrupt::is_asked_for, &|| bar.inc(1));
    bar.finish_and_clear();
    let is_interrupted = interrupt::take();
    let found = found.map_err(|failure| {
        let is_interrupted = matches!(failure, Failure::Interrupted);
        let failed = fail(failure);
        if is_interrupted { Failed(EXIT_INTERRUPTED) } else { failed }
    })?;
    let values = problem.parameters(&found.found[found.best].x);
    write(arguments, &problem, &model, &values)?;
    let remarks = remarks(&problem, &found);
    if best == "-" {
        return Ok(());
    }
    let text = match arguments.json {
        true => json(&problem, &found, &remarks)?,
        false => text(&problem, &found, &remarks, best, begun.elapsed().as_secs_f64()),
    };
    output::print(&text)?;
    if is_interrupted {
        let _ = fail(format_args!("interrupted: {best} is the best until then"));
        return Err(Failed(EXIT_INTERRUPTED));
    }
    Ok(())
}

/// Writes the model with the best values of all parameters, SI, and the picture that was asked for.
fn write(
    arguments: &Arguments,
    problem: &Problem<'_>,
    (file, model): &(SourceFile, SourceModel),
    values: &[f64],
) -> Outcome {
    let best = &arguments.output;
    let rewritten = with_parameters(file, model, values, best);
    output::write(best, &rewritten.unwrap_or_else(|| to_yaml(&model.at(values))))?;
    let Some(path) = &arguments.png else { return Ok(()) };
    match side_by_side(problem, &[problem.system.parameters(), values]) {
        Some(picture) => output::write(path, &picture.png().map_err(fail)?),
        None => Ok(()),
    }
}

/// The file, and the model as it is in it, in which all variables are declared.
fn declared(path: &str, goals: &Goals) -> Result<(SourceFile, SourceModel), Failed> {
    let file = read(path)?;
    let (model, _) = source::parse(&file).map_err(|problems| {
        report(&problems, &file);
        Failed(1)
    })?;
    let made = goals.variables.iter().find(|it| it.parameter >= model.parameters.len());
    match made {
        Some(variable) => Err(fail(format_args!(
            "`{}` comes from `tunable` and has no value in the model: declare a parameter, and use it in its place",
            variable.name
        ))),
        None => Ok((file, model)),
    }
}

fn json(problem: &Problem<'_>, found: &Optimum, remarks: &[String]) -> Result<String, Failed> {
    let best = &found.found[found.best];
    let values = problem.parameters(&best.x);
    let varied = problem.goals.variables.iter();
    let parameters = varied.map(|it| (it.name.clone(), values[it.parameter].into())).collect();
    let before = |index: usize| found.before.as_ref().map(|before| before.goals[index].value);
    let goals = problem.goals.goals.iter().zip(&best.evaluation.goals).enumerate();
    let goals = goals.map(|(index, (goal, Reached { value, largest, .. }))| GoalReport {
        name: &goal.name,
        value: *value,
        largest: *largest,
        wanted: match &goal.aim {
            Aim::Path(_) => None,
            Aim::Number(_, wanted) => Some(wanted.value()),
        },
        before: before(index),
    });
    let constraints = best.evaluation.constraints.iter().map(|kept| ConstraintReport {
        name: &kept.name,
        value: kept.value,
        limit: kept.wanted.value(),
        kept: kept.excess.value <= KEPT,
    });
    let report = Report {
        model: &problem.system.interface().name,
        parameters,
        objective: best.objective,
        goals: goals.collect(),
        constraints: constraints.collect(),
        searches: found.found.len(),
        reached: found.reached,
        designs_drawn: found.drawn,
        evaluations: found.found.iter().map(|found| found.evaluations).sum(),
        seed: problem.goals.seed,
        remarks,
        history: &best.history,
        objectives: found.found.iter().map(|found| found.objective).collect(),
    };
    Ok(serde_json::to_string_pretty(&report).map_err(fail)? + "\n")
}

fn text(
    problem: &Problem<'_>,
    found: &Optimum,
    remarks: &[String],
    path: &str,
    seconds: f64,
) -> String {
    let best = &found.found[found.best];
    let searches = found.found.len();
    let evaluations: usize = found.found.iter().map(|found| found.evaluations).sum();
    // Writing to a string cannot fail.
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{path}: the best of {searches} searches, {} of which reached it; {evaluations} evaluations in {seconds:.2} s",
        found.reached
    );
    if found.drawn > searches {
        let _ = writeln!(
            text,
            "{} designs were drawn for them; the others cannot be evaluated",
            found.drawn
        );
    }
    let values = problem.parameters(&best.x);
    for variable in &problem.goals.variables {
        let dimension = problem.compiled.numbers.dimensions.get(&variable.name).copied();
        let (factor, unit) = match dimension {
            Some(dimension) if dimension == LENGTH.dimension => (1e3, "mm".to_owned()),
            Some(dimension) if dimension == ANGLE.dimension => {
                (1_f64.to_degrees(), "deg".to_owned())
            }
            Some(dimension) => (1.0, dimension.si_unit()),
            None => (1.0, String::new()),
        };
        let [value, low, high] =
            [values[variable.parameter], variable.bounds[0], variable.bounds[1]]
                .map(|it| factor * it);
        let name = &variable.name;
        let _ = writeln!(text, "  {name:<20} {value:>14.6} {unit:<8} within {low:.6} .. {high:.6}");
    }
    for (index, (goal, reached)) in
        problem.goals.goals.iter().zip(&best.evaluation.goals).enumerate()
    {
        let before = found.before.as_ref().map(|before| &before.goals[index]);
        let _ = writeln!(text, "goal {}", goal_line(&goal.name, &goal.aim, reached, before));
    }
    for kept in &best.evaluation.constraints {
        let _ = writeln!(text, "constraint {}", constraint_line(problem, kept));
    }
    remarks.iter().for_each(|remark| text.push_str(&format!("{remark}\n")));
    text
}

fn goal_line(name: &str, aim: &Aim, reached: &Reached, before: Option<&Reached>) -> String {
    let (factor, unit) = match aim {
        Aim::Path(_) => (1e3, "mm"),
        Aim::Number(measure, _) => shown(*measure),
    };
    let value = |reached: &Reached| format!("{:.6}", factor * reached.value);
    let before = before.map_or(String::new(), |before| format!("; before {}", value(before)));
    match (aim, reached.largest) {
        (Aim::Number(_, wanted), _) => {
            format!("{name}: {} {unit}, {}{before}", value(reached), limit(*wanted, factor))
        }
        (Aim::Path(_), largest) => format!(
            "{name}: {} {unit} root mean square, {:.6} {unit} at most{before}",
            value(reached),
            factor * largest.unwrap_or(f64::NAN)
        ),
    }
}

fn constraint_line(problem: &Problem<'_>, kept: &Kept) -> String {
    let own = problem.goals.constraints.iter().find(|own| own.name == kept.name);
    // Those of paths are about angles.
    let (factor, unit) = own.map_or((1_f64.to_degrees(), "deg"), |own| shown(own.measure));
    let verdict = if kept.excess.value <= KEPT { "kept" } else { "NOT kept" };
    let wanted = limit(kept.wanted, factor);
    format!("{}: {:.6} {unit}, {wanted}: {verdict}", kept.name, factor * kept.value)
}

/// A unit for people, and the factor to it: of one of `all` numbers, which are goals, limits of joints on paths, and constraints.
pub(super) fn shown_goal(problem: &Problem<'_>, index: usize, all: usize) -> (f64, &'static str) {
    let Goals { goals, constraints, .. } = &problem.goals;
    match goals.get(index).map(|goal| &goal.aim) {
        Some(Aim::Path(_)) => (1e3, "mm"),
        Some(Aim::Number(measure, _)) => shown(*measure),
        None => {
            let own = (index + constraints.len()).checked_sub(all).map(|own| &constraints[own]);
            own.map_or((1_f64.to_degrees(), "deg"), |own| shown(own.measure))
        }
    }
}

/// A unit for people, and the factor to it.
fn shown(measure: Measure) -> (f64, &'static str) {
    match measure {
        Measure::Angle(_) | Measure::Moving(Moving { of: OfState::Angle(_), .. }) => {
            (1_f64.to_degrees(), "deg")
        }
        Measure::Position { .. }
        | Measure::Extent(_)
        | Measure::Clearance(_)
        | Measure::Moving(Moving { of: OfState::Position { .. }, .. }) => (1e3, "mm"),
        Measure::Frequency(_) => (1.0, "Hz"),
        Measure::Stiffness { .. } => (1.0, "N/m"),
        Measure::Torque(_) => (1e3, "mN m"),
        Measure::Force(_) => (1.0, "N"),
        Measure::Settle(_) => (1.0, "s"),
        Measure::Mass(_) => (1e3, "g"),
        Measure::Energy | Measure::Moving(_) => (1e3, "mJ"),
        Measure::Stroke(Stroke { of: Moved::Joint(_), .. }) => (1_f64.to_degrees(), "deg"),
        Measure::Stroke(_) => (1e3, "mm"),
    }
}

fn limit(wanted: Wanted, factor: f64) -> String {
    match wanted {
        Wanted::Target(value) => format!("wanted {:.6}", factor * value),
        Wanted::AtMost(value) => format!("wanted at most {:.6}", factor * value),
        Wanted::AtLeast(value) => format!("wanted at least {:.6}", factor * value),
    }
}
