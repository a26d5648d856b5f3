//! Compares random mechanisms with Newton's and Euler's equations in maximal coordinates, through machine
//! code and interpreter, in `f64` and `f32`: what `lamc verify` does, on models that nobody wrote.
//!
//! ```text
//! cargo run -q -p lamc-tests --bin differential -- --count 150 [--seed 1] [--keep FOLDER]
//! ```
//!
//! A failure prints the seed, what failed, and the shortest model found that still fails; with `--keep` it is
//! written to a folder. The exit code is 1 if anything failed.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;
use std::time::Instant;
use std::{env, fs};

use lamc::pipeline::compile;
use lamc::source::SourceFile;
use lamc_tests::random::{Lines, Random, Recipe, driven, model};
use lamc_tests::shrink::shrunk;
use lamc_workbench::verify::{Remark, Settings, at_states};

/// States compared for each mechanism.
const STATES: usize = 4;

struct Arguments {
    count: u64,
    seed: u64,
    keep: Option<String>,
}

fn main() -> ExitCode {
    let Some(arguments) = arguments() else {
        eprintln!("usage: differential [--count NUMBER] [--seed NUMBER] [--keep FOLDER]");
        return ExitCode::from(2);
    };
    let begin = Instant::now();
    let mut tally = Tally::default();
    for seed in arguments.seed..arguments.seed + arguments.count {
        let text = mechanism(seed);
        match outcome(&text) {
            Outcome::Agrees(states) => tally.agree(states),
            Outcome::NotCompared(reason) => *tally.skipped.entry(reason).or_default() += 1,
            Outcome::Fails(failure) => {
                tally.failures += 1;
                report(seed, &text, &failure, arguments.keep.as_deref());
            }
        }
    }
    println!(
        "{} mechanisms agree at {} states, {} fail; {:.0} s",
        tally.mechanisms,
        tally.states,
        tally.failures,
        begin.elapsed().as_secs_f64()
    );
    for (reason, count) in &tally.skipped {
        println!("{count} not compared: {reason}");
    }
    // Hardly any model may escape the comparison.
    let skipped: u64 = tally.skipped.values().sum();
    match tally.failures == 0 && skipped * 5 <= arguments.count {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

#[derive(Default)]
struct Tally {
    mechanisms: u64,
    states: usize,
    failures: u64,
    skipped: BTreeMap<String, u64>,
}

impl Tally {
    fn agree(&mut self, states: usize) {
        self.mechanisms += 1;
        self.states += states;
    }
}

fn arguments() -> Option<Arguments> {
    let mut arguments = Arguments { count: 150, seed: 1, keep: None };
    let mut words = env::args().skip(1);
    while let Some(word) = words.next() {
        let value = words.next()?;
        match word.as_str() {
            "--count" => arguments.count = value.parse().ok()?,
            "--seed" => arguments.seed = value.parse().ok()?,
            "--keep" => arguments.keep = Some(value),
            _ => return None,
        }
    }
    Some(arguments)
}

/// A random mechanism: a tree or loops of any class, driven or not, from micrometres to hundreds of metres,
/// turned in its plane.
fn mechanism(seed: u64) -> String {
    let mut random = Random::new(seed ^ 0x5eed);
    let recipe = match random.below(5) {
        0 | 1 => Recipe { branches: 1 + random.below(12), loops: 0, lines: Lines::Any },
        2 => {
            Recipe { branches: random.below(4), loops: 1 + random.below(3), lines: Lines::Parallel }
        }
        3 => Recipe {
            branches: random.below(4),
            loops: 1 + random.below(3),
            lines: Lines::Concurrent,
        },
        _ => Recipe { branches: random.below(3), loops: 1 + random.below(2), lines: Lines::Any },
    };
    let mut text = model(seed, recipe);
    // A loop may have no freedom left for a driven joint.
    if recipe.loops == 0 && random.chance(0.3) {
        text = driven(&text);
    }
    if random.chance(0.3) {
        text = text.replacen("gravity:", "air: { density: 1.2, drag: 1.1 }\ngravity:", 1);
    }
    if random.chance(0.3) {
        let law = "friction: { torque: 1e-4, speed: 0.1 }, cubic_stiffness: 0.01, torque:";
        text = text.replacen("torque:", law, 1);
    }
    match random.below(6) {
        // A thousandth, and a thousand times the size.
        0 => text.replace("length: mm", "length: um"),
        1 => text.replace("length: mm", "length: m"),
        _ => text,
    }
}

/// What a comparison found.
enum Outcome {
    /// At so many states.
    Agrees(usize),
    /// The model, or none of its states, could be compared.
    NotCompared(String),
    Fails(String),
}

fn outcome(text: &str) -> Outcome {
    let file = SourceFile { path: "random.yaml".into(), text: text.to_owned() };
    let settings = Settings { states: STATES, seed: 1, duration: 0.1 };
    let hook = take_hook();
    set_hook(Box::new(|_| ()));
    let found = catch_unwind(AssertUnwindSafe(|| {
        let compiled = compile(&file).map_err(|error| error.to_string())?;
        Ok::<_, String>(at_states(&compiled, &settings))
    }));
    set_hook(hook);
    let checks = match found {
        Ok(Ok(checks)) => checks,
        Ok(Err(refusal)) => {
            return Outcome::NotCompared(refusal.lines().next().unwrap_or_default().to_owned());
        }
        Err(_) => return Outcome::Fails("panic".to_owned()),
    };
    let failed: Vec<_> = checks.iter().filter(|check| check.failed()).collect();
    if let [first, ..] = failed.as_slice() {
        return Outcome::Fails(format!("{} is off by {:e}", first.name, first.error));
    }
    match &checks[0].remark {
        Some(Remark::NotChecked(reason) | Remark::Failed(reason)) => {
            Outcome::NotCompared(reason.clone())
        }
        None => Outcome::Agrees(checks[0].cases),
    }
}

/// Prints a failure with the shortest model that fails in the same check.
fn report(seed: u64, text: &str, failure: &str, keep: Option<&str>) {
    let check = |failure: &str| failure.split(" is off").next().map(str::to_owned);
    let same = |text: &str| match outcome(text) {
        Outcome::Fails(other) => check(&other) == check(failure),
        _ => false,
    };
    let shortest = shrunk(text, &same);
    println!("seed {seed}: {failure}\n{shortest}");
    let Some(folder) = keep else { return };
    let path = format!("{folder}/{seed}.yaml");
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(&path, &shortest));
    if let Err(error) = written {
        eprintln!("{path}: {error}");
    }
}
