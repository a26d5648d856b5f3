//! `lamc sweep MODEL PLAN -o FILE`: many runs of a model, on all cores, into a Parquet file.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::io::IsTerminal as _;
use std::path::Path;
use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use clap::Args;
use lamc_workbench::sweep::{Opened, Part, Shard, Sweep};

use super::interrupt::{self, EXIT_INTERRUPTED};
use super::paths::Paths;
use super::start::Start;
use super::{Failed, Outcome, fail, misused, output, progress, read, report};

/// How often a line says how far it is where there is no terminal.
const TOLD: Duration = Duration::from_secs(30);
/// Reasons of failures that are listed.
const MOST_REASONS: usize = 5;

/// Simulate a model many times: with a grid or samples of parameters, initial angles and inputs.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// The plan: what varies, and what is recorded
    plan: String,
    /// Where to write the results, as Parquet: a row for each run
    #[arg(short, long, value_name = "FILE")]
    output: String,
    /// Continue a sweep that was interrupted
    #[arg(long)]
    resume: bool,
    /// Do one of several equal parts: 3/100 is the third of a hundred
    #[arg(long, value_name = "INDEX/COUNT")]
    shard: Option<String>,
    /// Threads; as many as cores, unless given
    #[arg(long, value_name = "NUMBER")]
    threads: Option<usize>,
}

impl Arguments {
    /// The shard, and the number of threads.
    fn check(&self) -> Result<(Shard, usize), Failed> {
        let Self { start, plan, output: path, shard, threads, .. } = self;
        Paths::default()
            .input("the model", [&start.model])
            .input("the plan", [plan])
            .output("--output", [path])
            .check()?;
        if path == "-" {
            return Err(misused(
                "a sweep needs a file, beside which its parts are kept: --output sweep.parquet",
            ));
        }
        output::has_extension(Some(path), "parquet")?;
        let shard = match shard {
            None => Shard::ALL,
            Some(text) => Shard::read(text).ok_or_else(|| {
                misused(format_args!(
                    "`--shard {text}` is not of the form `3/100`: the third of a hundred parts"
                ))
            })?,
        };
        let threads = match threads {
            Some(0) => return Err(misused("--threads must be at least 1")),
            Some(threads) => *threads,
            None => thread::available_parallelism().map_or(1, usize::from),
        };
        Ok((shard, threads))
    }
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { start, plan, output: path, resume, .. } = arguments;
    let (shard, threads) = arguments.check()?;
    output::probe(path)?;
    let plan = read(plan)?;
    let compiled = Arc::new(start.compile(&[])?);
    let system = start.system(&compiled)?;
    let guess = start.guess(&compiled, system.interface())?;
    let angle = compiled.numbers.angle;
    let sweep = Sweep::new(compiled, &system, guess, &plan, angle, shard).map_err(|problems| {
        report(&problems, &plan);
        Failed(1)
    })?;
    let store = match sweep.open(Path::new(path), *resume).map_err(fail)? {
        Opened::Complete => return output::print(&format!("{path} is complete\n")),
        Opened::Begun(store) => store,
    };
    interrupt::listen()?;
    let parts = store.missing();
    let mut tally = Tally::new(sweep.parts() - parts.len(), &parts);
    let is_asked = interrupt::is_asked_for;
    let outcome = sweep.execute(&parts, threads, &system, &store, is_asked, |part| tally.add(part));
    tally.bar.finish_and_clear();
    outcome.map_err(fail)?;
    if interrupt::take() {
        let (done, all) = (tally.kept + tally.done, sweep.parts());
        let _ = fail(format_args!(
            "interrupted: {done} of {all} parts are kept beside {path}; --resume continues"
        ));
        return Err(Failed(EXIT_INTERRUPTED));
    }
    store.join().map_err(fail)?;
    output::print(&tally.summary(sweep.runs(), path))?;
    match tally.runs > 0 && tally.failed == tally.runs {
        true => Err(fail("every run failed")),
        false => Ok(()),
    }
}

/// What has been done so far.
struct Tally {
    bar: indicatif::ProgressBar,
    begin: Instant,
    told: Instant,
    /// Parts of earlier calls.
    kept: usize,
    /// Parts to do, and done.
    parts: usize,
    done: usize,
    runs: usize,
    failed: usize,
    reasons: BTreeMap<String, (usize, u64)>,
}

impl Tally {
    fn new(kept: usize, parts: &[usize]) -> Self {
        let now = Instant::now();
        let parts = parts.len();
        let (bar, reasons) = (progress::bar(parts), BTreeMap::new());
        Self { bar, begin: now, told: now, kept, parts, done: 0, runs: 0, failed: 0, reasons }
    }

    fn add(&mut self, part: &Part) {
        self.done += 1;
        self.runs += part.runs;
        self.failed += part.failures.len();
        for (run, reason) in &part.failures {
            let (count, _) = self.reasons.entry(kind(reason)).or_insert((0, *run));
            *count += 1;
        }
        self.bar.set_position(self.done as u64);
        if !std::io::stderr().is_terminal() && self.told.elapsed() > TOLD {
            self.told = Instant::now();
            let left = self.begin.elapsed().as_secs_f64() / self.done as f64
                * (self.parts - self.done) as f64;
            let Self { done, parts, runs, failed, .. } = self;
            eprintln!("{runs} runs, {failed} failed; {done} of {parts} parts, {left:.0} s left");
        }
    }

    fn summary(&self, runs: u64, path: &str) -> String {
        let mut text = String::new();
        let seconds = self.begin.elapsed().as_secs_f64();
        let _ = write!(text, "{path}: {runs} runs");
        if self.kept > 0 {
            let _ = write!(text, ", {} of them now", self.runs);
        }
        let _ = writeln!(text, ", {} failed, in {seconds:.2} s", self.failed);
        let mut reasons: Vec<_> = self.reasons.iter().collect();
        reasons.sort_by_key(|(_, (count, _))| std::cmp::Reverse(*count));
        for (reason, (count, run)) in reasons.iter().take(MOST_REASONS) {
            let _ = writeln!(text, "  {count} failed as run {run} did: {reason}");
        }
        if let Some(rest @ 1..) = reasons.len().checked_sub(MOST_REASONS) {
            let _ = writeln!(text, "  and for {rest} other reasons: see the column `failure`");
        }
        text
    }
}

/// A reason without its numbers, by which failures are counted together.
fn kind(reason: &str) -> String {
    let mut kind = String::new();
    for word in reason.split(' ') {
        let is_number = word.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        kind.push_str(if is_number { ".." } else { word });
        kind.push(' ');
    }
    kind.trim_end().to_owned()
}
