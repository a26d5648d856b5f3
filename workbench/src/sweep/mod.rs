//! Sweeps: many runs of one model with other parameters, initial angles and inputs, on all cores, into one Parquet file.
//!
//! ```text
//! plan + model -> Sweep -> parts (a few runs each, by any process, in any order) -> Store -> file
//! ```
//!
//! The values of a run depend on its number only ([`Design`]), and its results on its values only. Therefore the file has
//! the same bytes whatever computed it: one thread or many, a machine or a cluster, in one go or resumed.

mod design;
pub mod plan;
mod run;
mod store;
mod table;
#[cfg(test)]
mod tests;

pub use design::{Design, MOST_SOBOL};
pub use plan::{Plan, Quantities};
pub use store::{Opened, Store, StoreError};

use std::io;
use std::ops::Range;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc;
use std::thread;

use lamc::pipeline::Compiled;
use lamc::source::{AngleUnit, Diagnostic, Diagnostics, SourceFile, Span, codes};
use sha2::{Digest as _, Sha256};

use crate::execution::Jit;
use plan::Task;
use run::{Run, columns, run};
use store::Description;
use table::{Cell, Column, as_io, batch, schema, writer};

/// Runs whose rows make a row group of the file.
const RUNS_OF_A_GROUP: u64 = 4096;
/// Most parts of a row group; with whole motions, so many million numbers.
const MOST_PARTS: u64 = 128;
/// Runs of a part, which are lost when a process is killed: more in larger sweeps.
const PART: [u64; 2] = [32, 1024];
/// Parts of a sweep from which on they become larger.
const MANY_PARTS: u64 = 4096;
/// Numbers of a part with whole motions, about.
const PART_NUMBERS: f64 = 1e6;

/// What of a sweep to do: the one of so many equal pieces, counted from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shard {
    /// Which.
    pub index: u64,
    /// Of how many.
    pub of: u64,
}

impl Shard {
    /// All of it.
    pub const ALL: Self = Self { index: 1, of: 1 };

    /// Reads `3/100`.
    pub fn read(text: &str) -> Option<Self> {
        let (index, of) = text.split_once('/')?;
        let (index, of) = (index.trim().parse().ok()?, of.trim().parse().ok()?);
        (1..=of).contains(&index).then_some(Self { index, of })
    }

    /// Its runs of so many.
    fn runs(self, all: u64) -> Range<u64> {
        let bound = |index: u64| (u128::from(all) * u128::from(index) / u128::from(self.of)) as u64;
        bound(self.index - 1)..bound(self.index)
    }
}

/// A model, a plan, and which runs of it.
pub struct Sweep {
    compiled: Arc<Compiled>,
    guess: Vec<(usize, f64)>,
    plan: Plan,
    text: String,
    design: Design,
    columns: Vec<Column>,
    runs: Range<u64>,
    fingerprint: String,
}

/// The results of some runs.
pub struct Part {
    /// As a Parquet file.
    pub bytes: Vec<u8>,
    /// The number of runs.
    pub runs: usize,
    /// Why runs failed: the number of the run, and the reason.
    pub failures: Vec<(u64, String)>,
}

impl Sweep {
    /// Reads a plan for a model. `system` has the values that the plan does not change, `guess` the initial angles that
    /// are not the model's, rad. Initial angles without a unit are in `angle`.
    ///
    /// # Errors
    /// Returns the mistakes in the plan.
    pub fn new(
        compiled: Arc<Compiled>,
        system: &Jit,
        guess: Vec<(usize, f64)>,
        plan: &SourceFile,
        angle: AngleUnit,
        shard: Shard,
    ) -> Result<Self, Diagnostics> {
        let text = plan.text.clone();
        let plan = Plan::read(plan, &Quantities::of(&compiled, system, &guess), angle)?;
        if plan.task.rests() {
            let constant = compiled.program.interface.without_controllers("states of rest");
            constant.map_err(|why| Diagnostic::error(codes::BAD_PLAN, Span::default(), why))?;
        }
        let mut all = vec![Column::index("run")];
        all.extend(plan.quantities().map(|it| Column::number(it.name.clone(), plan::unit(it))));
        all.extend(columns(&plan.task, &compiled.program.interface));
        all.extend([Column::text("failure"), Column::text("warning")]);
        let runs = shard.runs(plan.runs());
        let mut digest = Sha256::new();
        digest.update(env!("CARGO_PKG_VERSION"));
        digest.update(compiled.to_bytes());
        digest.update(format!("{:?}{:?}{guess:?}", system.parameters(), system.inputs()));
        digest.update(format!("{plan:?}{runs:?}"));
        let fingerprint = digest.finalize().iter().map(|byte| format!("{byte:02x}")).collect();
        let design = Design::new(&plan);
        Ok(Self { compiled, guess, plan, text, design, columns: all, runs, fingerprint })
    }

    /// The number of runs.
    pub fn runs(&self) -> u64 {
        self.runs.end - self.runs.start
    }

    /// The number of parts.
    pub fn parts(&self) -> usize {
        self.runs().div_ceil(self.runs_of_a_part()) as usize
    }

    /// Runs of every part but the last. They depend on the plan only.
    fn runs_of_a_part(&self) -> u64 {
        let numbers = match &self.plan.task {
            Task::Simulate(task) if task.motion => {
                let joints = self.compiled.program.interface.joints.len() as f64;
                task.settings.duration * task.rate * (1.0 + 2.0 * joints)
            }
            _ => 0.0,
        };
        let most = (self.plan.runs() / MANY_PARTS).clamp(PART[0], PART[1]);
        (PART_NUMBERS / numbers).clamp(1.0, most as f64) as u64
    }

    /// Begins to keep its results for a file, or goes on.
    ///
    /// # Errors
    /// As [`Store::open`].
    pub fn open(&self, file: &std::path::Path, resumes: bool) -> Result<Opened, StoreError> {
        let about = Description {
            schema: schema(&self.columns),
            fingerprint: &self.fingerprint,
            plan: &self.text,
            parts: self.parts(),
            parts_of_a_group: (RUNS_OF_A_GROUP / self.runs_of_a_part()).clamp(1, MOST_PARTS)
                as usize,
        };
        Store::open(file, &about, resumes)
    }

    /// Computes a part. `None`: interrupted.
    ///
    /// # Errors
    /// Returns an error if the results cannot be encoded.
    pub fn part(
        &self,
        part: usize,
        system: &Jit,
        is_interrupted: &dyn Fn() -> bool,
    ) -> io::Result<Option<Part>> {
        let step = self.runs_of_a_part();
        let first = self.runs.start + part as u64 * step;
        let last = (first + step).min(self.runs.end);
        let (mut rows, mut failures) = (Vec::new(), Vec::new());
        for number in first..last {
            let values = self.design.values(number);
            let named = self.plan.quantities().zip(values.iter().copied());
            let (compiled, task) = (&self.compiled, &self.plan.task);
            let run = run(compiled, system.clone(), &self.guess, task, named, is_interrupted);
            let Some(run) = run else { return Ok(None) };
            if let Err(reason) = &run.outcome {
                failures.push((number, reason.clone()));
            }
            rows.push(self.row(number, &values, run));
        }
        let rows = batch(&self.columns, &rows).map_err(as_io)?;
        let mut writer = writer(Vec::new(), schema(&self.columns), &[]).map_err(as_io)?;
        writer.write(&rows).map_err(as_io)?;
        let bytes = writer.into_inner().map_err(as_io)?;
        Ok(Some(Part { bytes, runs: (last - first) as usize, failures }))
    }

    fn row(&self, number: u64, values: &[f64], run: Run) -> Vec<Cell> {
        let mut row = vec![Cell::Index(number)];
        row.extend(values.iter().copied().map(Cell::number));
        let failure = match run.outcome {
            Ok(cells) => {
                row.extend(cells);
                None
            }
            Err(reason) => {
                let texts = self.columns.len() - 2;
                row.extend(self.columns[row.len()..texts].iter().map(Column::empty));
                Some(reason)
            }
        };
        let warning = (!run.warnings.is_empty()).then(|| run.warnings.join("; "));
        row.extend([failure, warning].map(Cell::Text));
        row
    }

    /// Computes these parts on so many threads, each with a copy of the system, and keeps them; `finished` is told of each.
    /// Ends early, with what is finished, when interrupted.
    ///
    /// # Errors
    /// Returns the first failure to keep a part.
    pub fn execute(
        &self,
        parts: &[usize],
        threads: usize,
        system: &Jit,
        store: &Store,
        is_interrupted: impl Fn() -> bool + Sync,
        mut finished: impl FnMut(&Part),
    ) -> Result<(), StoreError> {
        let next = AtomicUsize::new(0);
        let failed = |error| StoreError::Failed("a part".to_owned(), error);
        thread::scope(|scope| {
            let (tell, told) = mpsc::channel();
            for _ in 0..threads.clamp(1, parts.len().max(1)) {
                let (tell, system) = (tell.clone(), system.clone());
                let (next, is_interrupted) = (&next, &is_interrupted);
                scope.spawn(move || {
                    let take = || parts.get(next.fetch_add(1, Ordering::Relaxed));
                    while let Some(&part) = take() {
                        let done = match self.part(part, &system, is_interrupted) {
                            Ok(None) => break,
                            Ok(Some(done)) => store.keep(part, &done.bytes).map(|()| done),
                            Err(error) => Err(failed(error)),
                        };
                        // Nobody listens any more after a failure.
                        if tell.send(done).is_err() {
                            break;
                        }
                    }
                });
            }
            drop(tell);
            told.iter().try_for_each(|done| done.map(|part| finished(&part)))
        })
    }
}
