//! `lamc yield MODEL GOALS`: which share of built robots meets the goals.

use std::fmt::Write;
use std::thread;

use clap::Args;
use lamc_workbench::optimise::{Goals, Judged, Problem, Yield};
use serde::Serialize;

use super::interrupt::{self, EXIT_INTERRUPTED};
use super::optimise::shown_goal;
use super::paths::Paths;
use super::start::Start;
use super::{Failed, Outcome, fail, misused, output, progress, read, report};

/// Judge robots that are built with tolerances: which share meets the goals, and which tolerance matters
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// The goals, with `tolerances`
    goals: String,
    /// How many robots are built; a power of two is best
    #[arg(long, value_name = "NUMBER", default_value_t = 1024)]
    robots: u64,
    /// Print JSON in SI units and radians
    #[arg(long)]
    json: bool,
    /// Threads; as many as cores, unless given
    #[arg(long, value_name = "NUMBER")]
    threads: Option<usize>,
}

/// Most robots: what the record of all of them may take.
const MOST_ROBOTS: u64 = 1_000_000;

#[derive(Serialize)]
struct Report<'a> {
    model: &'a str,
    robots: u64,
    good: u64,
    share: f64,
    interval: [f64; 2],
    failures: &'a [(String, u64)],
    goals: Vec<GoalReport<'a>>,
    tolerances: Vec<ToleranceReport<'a>>,
    seed: u64,
}

#[derive(Serialize)]
struct GoalReport<'a> {
    name: &'a str,
    nominal: f64,
    mean: f64,
    standard_deviation: f64,
    good: Option<u64>,
    variance_by_tolerance: &'a [f64],
}

#[derive(Serialize)]
struct ToleranceReport<'a> {
    parameter: &'a str,
    standard_deviation: f64,
    good_without: u64,
    standard_error: f64,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { start, goals: path, robots, .. } = arguments;
    Paths::default().input("the model", [&start.model]).input("the goals", [path]).check()?;
    let threads = match arguments.threads {
        Some(0) => return Err(misused("--threads must be at least 1")),
        Some(threads) => threads,
        None => thread::available_parallelism().map_or(1, usize::from),
    };
    if !(2..=MOST_ROBOTS).contains(robots) {
        return Err(misused(format_args!("--robots must be 2 to {MOST_ROBOTS}")));
    }
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
    if goals.tolerances.is_empty() {
        return Err(fail(format_args!(
            "{path} has no `tolerances`: say by how much built robots differ from the design, as in \
             `tolerances: {{ crank: {{ normal: 0.05 mm }} }}`"
        )));
    }
    interrupt::listen()?;
    let builds = robots * (1 + goals.tolerances.len() as u64);
    let bar = progress::bar(builds as usize);
    let problem = Problem::new(&compiled, system, goals);
    let found = problem
        .built_robots(*robots, threads, &interrupt::is_asked_for, &|| bar.inc(1))
        .map_err(fail);
    bar.finish_and_clear();
    let Some(found) = found? else {
        interrupt::take();
        let _ = fail("interrupted");
        return Err(Failed(EXIT_INTERRUPTED));
    };
    let text = match arguments.json {
        true => json(&problem, &found)?,
        false => text(&problem, &found),
    };
    output::print(&text)
}

fn json(problem: &Problem<'_>, found: &Yield) -> Result<String, Failed> {
    let goals = found.judged.iter().map(|judged| GoalReport {
        name: &judged.name,
        nominal: judged.nominal,
        mean: judged.mean,
        standard_deviation: judged.deviation,
        good: judged.good,
        variance_by_tolerance: &judged.shares,
    });
    let tolerances = found.tolerances.iter().map(|influence| ToleranceReport {
        parameter: &influence.name,
        standard_deviation: influence.deviation,
        good_without: influence.good_without,
        standard_error: influence.error,
    });
    let report = Report {
        model: &problem.system.interface().name,
        robots: found.robots,
        good: found.good,
        share: found.good as f64 / found.robots as f64,
        interval: found.interval(),
        failures: &found.failures,
        goals: goals.collect(),
        tolerances: tolerances.collect(),
        seed: problem.goals.seed,
    };
    Ok(serde_json::to_string_pretty(&report).map_err(fail)? + "\n")
}

fn text(problem: &Problem<'_>, found: &Yield) -> String {
    let percent = |count: u64| 100.0 * count as f64 / found.robots as f64;
    let [low, high] = found.interval().map(|share| 100.0 * share);
    // Writing to a string cannot fail.
    let mut text = String::new();
    let _ = writeln!(
        text,
        "{:.1} % of {} robots meet all goals ({low:.1} to {high:.1} % with a probability of 95 %)",
        percent(found.good),
        found.robots
    );
    for (reason, times) in &found.failures {
        let _ = writeln!(text, "not possible, {times} robots: {reason}");
    }
    for (index, judged) in found.judged.iter().enumerate() {
        let Judged { name, nominal, mean, deviation, good, shares } = judged;
        let (factor, unit) = shown_goal(problem, index, found.judged.len());
        let verdict = good
            .map_or("does not judge".to_owned(), |good| format!("{:.1} % meet it", percent(good)));
        let _ = writeln!(
            text,
            "{name}: {:.6} {unit} as designed, built {:.6} +- {:.6} {unit}; {verdict}",
            factor * nominal,
            factor * mean,
            factor * deviation
        );
        let mut causes: Vec<(&str, f64)> = found
            .tolerances
            .iter()
            .map(|it| it.name.as_str())
            .zip(shares.iter().copied())
            .collect();
        causes.sort_by(|a, b| b.1.total_cmp(&a.1));
        let causes: Vec<String> = causes
            .iter()
            .filter(|(_, share)| *share >= 0.005)
            .map(|(name, share)| format!("`{name}` {:.0} %", 100.0 * share))
            .collect();
        if !causes.is_empty() {
            let _ = writeln!(text, "  its variance, to first order: {}", causes.join(", "));
        }
    }
    for influence in &found.tolerances {
        let _ = writeln!(
            text,
            "without the tolerance of `{}`: {:.1} % (+- {:.1})",
            influence.name,
            percent(influence.good_without),
            100.0 * influence.error / found.robots as f64
        );
    }
    text
}
