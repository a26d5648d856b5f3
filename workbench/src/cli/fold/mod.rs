//! `lamc fold MODEL --to 80%`: fold a sheet from the flat state, write the requested files, and say
//! how far it comes and what ends it.

mod summary;

use std::fmt::Write;

use clap::Args;
use lamc::pipeline;
use lamc::source::read_in;
use lamc_workbench::folding::{End, Fold, Path};
use lamc_workbench::motion::Motion;
use serde_json::json;

use super::interrupt::{self, EXIT_INTERRUPTED};
use super::paths::Paths;
use super::pictures::Pictures;
use super::plot::{self, Panel};
use super::progress::{self, Busy};
use super::shapes::Shapes;
use summary::{LISTED, broken, ended, summary};

use super::{Failed, Outcome, Size, fail, misused, output, read, report, warn};

/// Most states of a path.
const MOST_STEPS: usize = 10_000;
/// Most numbers a path may have: a gigabyte.
const MOST_NUMBERS: usize = 125_000_000;
/// Share of the finished fold from which the topology takes its guess of a folded state, if the model has none.
const GUESS: f64 = 0.3;

/// Fold a sheet from the flat state towards the angles of the finished fold.
#[derive(Args)]
pub struct Arguments {
    /// The model, whose joints have a `fold`
    model: String,
    /// How far to fold: a share of the `fold` of the joints, such as 80%
    #[arg(long, value_name = "SHARE", default_value = "100%")]
    to: String,
    /// States from flat to there in the output
    #[arg(long, value_name = "NUMBER", default_value_t = 50)]
    steps: usize,
    #[command(flatten)]
    size: Size,
    #[command(flatten)]
    files: Files,
}

/// What to write.
#[derive(Args)]
#[command(next_help_heading = "Files")]
struct Files {
    /// Write the angles by progress as CSV; `-` writes standard output
    #[arg(long, value_name = "FILE")]
    csv: Option<String>,
    /// Write the last state as JSON, as `lamc eval` reads it
    #[arg(long, value_name = "FILE")]
    state: Option<String>,
    /// Draw the angles by progress: FILE.svg or FILE.png; `-` writes SVG to standard output
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
    #[command(flatten)]
    shapes: Shapes,
    #[command(flatten)]
    pictures: Pictures,
}

impl Files {
    fn check(&self) -> Outcome {
        if let Some(path) = &self.plot {
            plot::format(path).map_err(misused)?;
        }
        self.shapes.check()?;
        self.pictures.check()
    }

    fn paths(&self) -> Paths<'_> {
        let paths = Paths::default()
            .output("--csv", &self.csv)
            .output("--state", &self.state)
            .output("--plot", &self.plot);
        self.pictures.paths(self.shapes.paths(paths))
    }

    fn write(&self, fold: &Fold, path: &Path, motion: &Motion) -> Outcome {
        if let Some(file) = &self.csv {
            output::write(file, &csv(motion, path))?;
        }
        if let (Some(file), Some(last)) = (&self.state, path.samples.last()) {
            output::write(file, &format!("{}\n", json!({ "states": [{ "q": last.q }] })))?;
        }
        if let Some(file) = &self.plot {
            let picture = plot::draw(motion, &[Panel::Angles], false, file);
            output::write(file, &picture.map_err(fail)?)?;
        }
        self.shapes.write(&fold.topology().mechanism, motion)?;
        self.pictures.write(&fold.topology().mechanism, motion)
    }
}

pub fn run(arguments: &Arguments) -> Outcome {
    let to = arguments.progress()?;
    arguments.files.check()?;
    arguments.files.paths().input("the model", [&arguments.model]).check()?;
    let mut fold = arguments.fold()?;
    let numbers = fold.targets().len() + 12 * fold.topology().mechanism.bodies.len();
    if arguments.steps.saturating_mul(numbers) > MOST_NUMBERS {
        return Err(misused(format_args!(
            "{} steps are too many for this model: lower --steps to at most {}",
            arguments.steps,
            MOST_NUMBERS / numbers
        )));
    }
    for (vertex, violation) in fold.not_flat_foldable().into_iter().take(LISTED) {
        warn(format_args!("{} cannot fold flat: {}", fold.loop_name(vertex), broken(&violation)));
    }
    interrupt::listen()?;
    let bar = progress::bar(arguments.steps);
    let path = fold.follow(to, arguments.steps, |step| {
        bar.set_position(step as u64 - 1);
        !interrupt::is_asked_for()
    });
    bar.finish_and_clear();
    interrupt::take();
    let motion = fold.motion(&path);
    arguments.files.write(&fold, &path, &motion)?;
    if !arguments.files.paths().is_printed() {
        output::print(&summary(&fold, &path, &motion))?;
    }
    match &path.end {
        End::Reached => Ok(()),
        End::Interrupted => Err(Failed(EXIT_INTERRUPTED)),
        end => Err(fail(ended(&fold, &path, end))),
    }
}

impl Arguments {
    /// The progress that is asked for.
    fn progress(&self) -> Result<f64, Failed> {
        if !(1..=MOST_STEPS).contains(&self.steps) {
            return Err(misused(format_args!("--steps must be from 1 to {MOST_STEPS}")));
        }
        let to = read_in(&self.to, "%").ok().filter(|to| *to > 0.0 && *to <= 1.0);
        to.ok_or_else(|| {
            misused(format_args!(
                "`--to {}`: expected a share of the finished fold of more than 0 and at most 100 %, as \
                 in `--to 80%`",
                self.to
            ))
        })
    }

    /// Reads the model and finds its loops.
    fn fold(&self) -> Result<Fold, Failed> {
        let file = read(&self.model)?;
        let busy = Busy::new(format!("finding the loops of {}", self.model));
        let analysed = pipeline::analyse_edited(&file, |model| {
            model.max_hinges = self.size.max_hinges;
            let folds = model.joints.iter().find_map(|joint| joint.fold.clone());
            if let Some(fold) =
                folds.filter(|_| model.initial_q.is_empty() && model.initial_fold.is_none())
            {
                model.initial_fold = Some(lamc::source::Spanned { value: GUESS, span: fold.span });
            }
        });
        drop(busy);
        let (model, topology, warnings) = analysed.map_err(|problems| {
            report(&problems, &file);
            Failed(1)
        })?;
        report(&warnings, &file);
        Fold::new(&model, topology).ok_or_else(|| {
            fail(
                "no joint has a `fold`: give the joints that fold their angle, as in `fold: -180 deg` \
                 for a mountain",
            )
        })
    }
}

/// The angles by progress, rad. Numbers are written so that they read back as they are.
fn csv(motion: &Motion, path: &Path) -> String {
    let mut text = "progress [%],reached [%],closure [m]".to_owned();
    for joint in &motion.joints {
        let _ = write!(text, ",q.{joint} [rad]");
    }
    text.push('\n');
    for (sample, at) in motion.samples.iter().zip(&path.samples) {
        let _ = write!(text, "{:?},{:?},{:?}", sample.t, 100.0 * at.reached, sample.closure);
        for q in &sample.q {
            let _ = write!(text, ",{q:?}");
        }
        text.push('\n');
    }
    text
}
