//! Random models through checks, many at a time: what the commands `differential` and `motions` share.
//!
//! A failure prints the seed, what failed, and the shortest model found that still fails in the same check;
//! with `--keep` it is written to a folder.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::process::ExitCode;
use std::time::{Duration, Instant};
use std::{env, fs};

use lamc_workbench::verify::{Check, Remark};

use crate::compare::keep_largest;
use crate::shrink::shrunk;

/// The checks of a model, or why lamc refuses it.
pub type Checks<'a> = &'a dyn Fn(&str) -> Result<Vec<Check>, String>;

/// At most one model in so many may escape a check that applies to it.
const ESCAPES: u64 = 5;

/// How long a shorter model is looked for.
const PATIENCE: Duration = Duration::from_secs(60);

/// Runs the command `name` with the arguments of this process: `usual` models unless `--count` says
/// otherwise, each written by `model` from its seed.
pub fn run(name: &str, usual: u64, model: &dyn Fn(u64) -> String, checks: Checks<'_>) -> ExitCode {
    let Some(arguments) = arguments(usual, env::args().skip(1)) else {
        eprintln!("usage: {name} [--count NUMBER] [--seed NUMBER] [--keep FOLDER]");
        return ExitCode::from(2);
    };
    let begin = Instant::now();
    let mut tally = Tally::default();
    for seed in arguments.seed..arguments.seed + arguments.count {
        let text = model(seed);
        let outcome = outcome(&text, checks);
        tally.add(&outcome);
        if let Outcome::Fails { check, error } = outcome {
            let shortest = shortest(&text, check, checks);
            println!("seed {seed}: {check}: {error}\n{shortest}");
            keep(arguments.keep.as_deref(), seed, &shortest);
        }
    }
    tally.print(begin.elapsed().as_secs_f64());
    match tally.failures == 0 && !tally.escapes() {
        true => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    }
}

struct Arguments {
    count: u64,
    seed: u64,
    keep: Option<String>,
}

fn arguments(usual: u64, mut words: impl Iterator<Item = String>) -> Option<Arguments> {
    let mut arguments = Arguments { count: usual, seed: 1, keep: None };
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

/// What the checks of a model found.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// All checks that could be made pass.
    Passes(Vec<Check>),
    /// The model is refused, or no check could be made.
    NotCompared(String),
    /// The first check that failed, and its error.
    #[allow(missing_docs, reason = "the line above says what the fields are")]
    Fails { check: &'static str, error: String },
}

/// Runs the checks; a panic is a failure.
pub fn outcome(text: &str, checks: Checks<'_>) -> Outcome {
    let hook = take_hook();
    set_hook(Box::new(|_| ()));
    let found = catch_unwind(AssertUnwindSafe(|| checks(text)));
    set_hook(hook);
    let checks = match found {
        Ok(Ok(checks)) => checks,
        Ok(Err(refusal)) => {
            return Outcome::NotCompared(refusal.lines().next().unwrap_or_default().to_owned());
        }
        Err(panic) => {
            let message = panic.downcast_ref::<String>().cloned();
            let error = message.or_else(|| panic.downcast_ref::<&str>().map(|&text| text.into()));
            return Outcome::Fails { check: "panic", error: error.unwrap_or_default() };
        }
    };
    if let Some(failed) = checks.iter().find(|check| check.failed()) {
        let error = match &failed.remark {
            Some(Remark::NotChecked(reason) | Remark::Failed(reason)) => reason.clone(),
            None => format!("off by {:e}, allowed is {:e}", failed.error, failed.allowed),
        };
        return Outcome::Fails { check: failed.name, error };
    }
    match checks.iter().map(|check| check.remark.as_ref()).collect::<Option<Vec<_>>>().as_deref() {
        Some([Remark::NotChecked(reason) | Remark::Failed(reason), ..]) => {
            Outcome::NotCompared(reason.clone())
        }
        _ => Outcome::Passes(checks),
    }
}

/// The shortest model found that fails in the same check.
fn shortest(text: &str, failed: &'static str, checks: Checks<'_>) -> String {
    let begin = Instant::now();
    let same = |text: &str| {
        begin.elapsed() < PATIENCE
            && matches!(outcome(text, checks), Outcome::Fails { check, .. } if check == failed)
    };
    shrunk(text, &same)
}

fn keep(folder: Option<&str>, seed: u64, text: &str) {
    let Some(folder) = folder else { return };
    let path = format!("{folder}/{seed}.yaml");
    let written = fs::create_dir_all(folder).and_then(|()| fs::write(&path, text));
    if let Err(error) = written {
        eprintln!("{path}: {error}");
    }
}

/// What was found so far.
#[derive(Default)]
struct Tally {
    models: u64,
    failures: u64,
    /// How many models were not compared, by reason.
    skipped: BTreeMap<String, u64>,
    /// In the order of the checks.
    checks: Vec<Total>,
}

/// A check over all models.
struct Total {
    name: &'static str,
    cases: usize,
    models: u64,
    /// The largest error.
    error: f64,
    /// The largest error as a share of what is allowed.
    share: f64,
    /// How many models it could not be made for, by reason.
    escaped: BTreeMap<String, u64>,
}

impl Tally {
    fn add(&mut self, outcome: &Outcome) {
        match outcome {
            Outcome::Passes(checks) => {
                self.models += 1;
                checks.iter().for_each(|check| self.add_check(check));
            }
            Outcome::NotCompared(reason) => *self.skipped.entry(reason.clone()).or_default() += 1,
            Outcome::Fails { .. } => self.failures += 1,
        }
    }

    fn add_check(&mut self, check: &Check) {
        let place = self.checks.iter().position(|total| total.name == check.name);
        let place = place.unwrap_or_else(|| {
            let name = check.name;
            self.checks.push(Total {
                name,
                cases: 0,
                models: 0,
                error: 0.0,
                share: 0.0,
                escaped: BTreeMap::new(),
            });
            self.checks.len() - 1
        });
        let total = &mut self.checks[place];
        if let Some(Remark::NotChecked(reason) | Remark::Failed(reason)) = &check.remark {
            *total.escaped.entry(reason.clone()).or_default() += 1;
            return;
        }
        total.cases += check.cases;
        total.models += 1;
        total.error = keep_largest(total.error, check.error);
        let share = if check.error == 0.0 { 0.0 } else { check.error / check.allowed };
        total.share = keep_largest(total.share, share);
    }

    /// Whether too many models are not compared, or escape a check that applies to them.
    fn escapes(&self) -> bool {
        let is_too_much = |escaped: u64, made: u64| escaped * ESCAPES > escaped + made;
        let mut checks = self.checks.iter();
        is_too_much(self.skipped.values().sum(), self.models + self.failures)
            || checks.any(|total| is_too_much(total.escaped.values().sum(), total.models))
    }

    fn print(&self, seconds: f64) {
        println!("{} models pass, {} fail; {seconds:.0} s", self.models, self.failures);
        println!(
            "{:<18}{:>8}{:>13}{:>9}{:>10}{:>18}",
            "check", "models", "not checked", "cases", "error", "share of allowed"
        );
        for Total { name, models, cases, error, share, escaped } in &self.checks {
            let escaped: u64 = escaped.values().sum();
            println!("{name:<18}{models:>8}{escaped:>13}{cases:>9}{error:>10.1e}{share:>18.1e}");
        }
        for Total { name, escaped, .. } in &self.checks {
            for (reason, count) in escaped {
                println!("{count} without {name}: {reason}");
            }
        }
        for (reason, count) in &self.skipped {
            println!("{count} not compared: {reason}");
        }
    }
}
