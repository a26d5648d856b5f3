//! The command line: arguments in, one library call, exit code out.
//!
//! Exit codes: 0 done, 1 any failure (reported on standard error), 2 usage (clap's own).

mod check;
mod compile;
mod curves;
mod cut;
mod derive;
mod designs;
mod equilibrium;
mod eval;
mod explain;
mod fit;
mod fold;
mod hinge;
mod import;
mod input;
mod interrupt;
mod live;
mod load;
mod mocap;
mod modes;
mod notes;
mod optimise;
mod output;
mod paths;
mod pictures;
mod plot;
mod progress;
mod schema;
mod shapes;
mod shell;
mod simulate;
mod start;
mod sweep;
mod verify;
mod worker;
mod yields;

use std::ffi::OsString;
use std::fmt::Display;
use std::io::{self, IsTerminal, Write};
use std::path::Path;
use std::process::ExitCode;

use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use lamc::backend::rust::ScalarChoice;
use lamc::source::{Diagnostics, MAX_HINGES, SourceFile, closest_name};

use input::{read, read_numbers};
use load::{compiled, load, load_edited};

const TERMS: &str = concat!(
    env!("CARGO_PKG_VERSION"),
    "\n\nlamc derives equations with Symbolica, which has a licence of its own: personal use is free, \
     professional\nuse, also at a university, needs a licence from symbolica.io, whose key is read from the \
     environment\nvariable SYMBOLICA_LICENSE. Generated code and lamc-runtime do not contain it (MIT OR Apache-2.0). \
     NOTICE in\nthe sources says more."
);

/// Compiler for the motion of laminate robots: writes Rust, C, Python or an FMU from a mechanism's YAML.
#[derive(Parser)]
#[command(name = "lamc", version, long_version = TERMS, args_conflicts_with_subcommands = true)]
#[command(
    subcommand_negates_reqs = true,
    after_help = "If a model has the name of a command, write its path with a folder: ./check."
)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    compile: Option<Compile>,
}

/// Compile a model to Rust, C, Python around C, or an FMU.
#[derive(Args)]
struct Compile {
    /// The model: lamc's YAML or a popupCAD DynamicsInfo file; `-` reads standard input
    model: String,
    /// Where to write the Rust module; `-` writes standard output
    #[arg(short, long, value_name = "FILE", required_unless_present_any = ["c", "header", "fmu"])]
    output: Option<String>,
    /// Where to write the module in freestanding C99
    #[arg(long, value_name = "FILE", requires = "header")]
    c: Option<String>,
    /// Where to write the header of the C source, or of a Rust module with --extern-c
    #[arg(long, value_name = "FILE")]
    header: Option<String>,
    /// Where to write Python (NumPy) around the C source: in the same folder
    #[arg(long, value_name = "FILE", requires = "c")]
    python: Option<String>,
    /// Where to write a source FMU for Model Exchange and Co-Simulation, in f64
    #[arg(long, value_name = "FILE")]
    fmu: Option<String>,
    /// The version of FMI
    #[arg(long, value_enum, default_value_t, requires = "fmu")]
    fmi: Fmi,
    /// Export the functions of the header from the Rust module
    #[arg(long, requires = "output")]
    extern_c: bool,
    /// Functions of the Rust or C module besides those that every motion needs: poses, points,
    /// energy, contacts, gaps, reactions, momentum, control, tangent, acceleration, projection, jacobian, jacobian_params; all;
    /// none. Default: all but the last two
    #[arg(long, value_name = "NAME,..", value_delimiter = ',', conflicts_with = "python")]
    functions: Vec<String>,
    /// The number type; C takes `generic` for f64
    #[arg(long, value_enum, default_value_t)]
    scalar: Scalar,
    /// Cut a loop at this joint: this changes the number of operations, not the motion
    #[arg(long, value_name = "JOINT")]
    cut: Vec<String>,
    /// Write nothing; fail if a file differs from what would be written
    #[arg(long)]
    check: bool,
    // Not flattened, because clap would regard the whole group as absent.
    /// Compile a model with up to this many hinges: memory and time grow as the square of their
    /// number
    #[arg(long, value_name = "NUMBER", default_value_t = MAX_HINGES)]
    max_hinges: usize,
    /// Derive the equations anew, and keep them in no cache
    #[arg(long)]
    no_cache: bool,
}

/// How large a model may be.
#[derive(Args, Clone, Copy)]
struct Size {
    /// Compile a model with up to this many hinges: memory and time grow as the square of their
    /// number
    #[arg(long, value_name = "NUMBER", default_value_t = MAX_HINGES)]
    max_hinges: usize,
}

/// How the equations of a model are derived.
#[derive(Args, Clone, Copy)]
struct Derivation {
    #[command(flatten)]
    size: Size,
    /// Derive the equations anew, and keep them in no cache
    #[arg(long)]
    no_cache: bool,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum Scalar {
    /// f64 throughout
    F64,
    /// f32 throughout
    F32,
    /// Generic over lamc_runtime::Scalar
    #[default]
    Generic,
}

#[derive(Clone, Copy, Default, ValueEnum)]
enum Fmi {
    /// FMI 2.0
    #[default]
    #[value(name = "2")]
    Two,
    /// FMI 3.0
    #[value(name = "3")]
    Three,
}

impl From<Scalar> for ScalarChoice {
    fn from(scalar: Scalar) -> Self {
        match scalar {
            Scalar::F64 => Self::F64,
            Scalar::F32 => Self::F32,
            Scalar::Generic => Self::Generic,
        }
    }
}

#[derive(Subcommand)]
enum Command {
    /// Report on a model: warnings, mobility, masses, operation counts
    Check {
        /// The model
        model: String,
        #[command(flatten)]
        derivation: Derivation,
    },
    /// Derive a model's equations and write them as bytes: what the Python package `lamc` loads
    Derive(derive::Arguments),
    /// Compare a model's equations with an independent formulation, and check energy and closure
    Verify(verify::Arguments),
    /// Evaluate a model at given states (JSON in, JSON out), or at its initial configuration
    Eval(eval::Arguments),
    /// Simulate a model from its initial configuration
    Simulate(Box<simulate::Arguments>),
    /// Simulate a model many times: a grid, or samples, of parameters, initial angles and inputs
    Sweep(Box<sweep::Arguments>),
    /// Find the values of parameters that meet goals: paths, angles at rest, frequencies, masses
    Optimise(Box<optimise::Arguments>),
    /// Build robots with tolerances: the share that meets the goals, and which tolerance matters
    Yield(Box<yields::Arguments>),
    /// Show a model's motion in the browser and update it whenever the file is saved
    Live(live::Arguments),
    /// Find an equilibrium of a model
    Equilibrium(equilibrium::Arguments),
    /// Natural frequencies, damping and mode shapes about an equilibrium
    Modes(modes::Arguments),
    /// Identify parameters from a measured motion
    Fit(fit::Arguments),
    /// Fold a sheet: from the flat state towards the angles of the finished fold
    Fold(Box<fold::Arguments>),
    /// Stiffness, damping and linear range of a hinge
    #[command(subcommand)]
    Hinge(hinge::Command),
    /// Joint angles from motion capture: unit quaternions of the bodies over time
    Mocap(mocap::Arguments),
    /// Write a crease pattern (SVG, FOLD, DXF) or a model (popupCAD files too) in lamc's schema
    Import(import::Arguments),
    /// Write outlines and holes of each layer for a laser cutter, as SVG and DXF
    Cut(cut::Arguments),
    /// Explain the code of an error or warning with cause, example and cure
    Explain {
        /// The code, as in `error[unknown-key]`; without one, all codes are listed
        code: Option<String>,
    },
    /// Print the JSON Schema of the model file, for editors
    Schema,
    /// Print a completion script for a shell
    Completions {
        /// The shell
        #[arg(value_enum)]
        shell: clap_complete::Shell,
    },
    /// Derive equations for another lamc, which reads and writes the pipes of this process
    #[command(hide = true)]
    Worker,
    /// Write the manual: a page for lamc and one for each command
    Man {
        /// Folder for the pages, such as ~/.local/share/man/man1
        folder: String,
    },
}

/// Already reported on standard error; the exit code.
struct Failed(u8);

type Outcome = Result<(), Failed>;

/// Runs the command line.
pub fn run() -> ExitCode {
    if let Err(Failed(code)) = refuse_unknown_command() {
        return ExitCode::from(code);
    }
    let cli = Cli::parse_from(with_negative_values(std::env::args_os()));
    let outcome = match (cli.command, cli.compile) {
        (Some(Command::Check { model, derivation }), _) => check::run(&model, derivation),
        (Some(Command::Derive(arguments)), _) => derive::run(arguments),
        (Some(Command::Verify(arguments)), _) => verify::run(&arguments),
        (Some(Command::Eval(arguments)), _) => eval::run(&arguments),
        (Some(Command::Simulate(arguments)), _) => simulate::run(&arguments),
        (Some(Command::Sweep(arguments)), _) => sweep::run(&arguments),
        (Some(Command::Optimise(arguments)), _) => optimise::run(&arguments),
        (Some(Command::Yield(arguments)), _) => yields::run(&arguments),
        (Some(Command::Live(arguments)), _) => live::run(&arguments),
        (Some(Command::Equilibrium(arguments)), _) => equilibrium::run(&arguments),
        (Some(Command::Modes(arguments)), _) => modes::run(&arguments),
        (Some(Command::Fit(arguments)), _) => fit::run(&arguments),
        (Some(Command::Fold(arguments)), _) => fold::run(&arguments),
        (Some(Command::Hinge(command)), _) => hinge::run(&command),
        (Some(Command::Mocap(arguments)), _) => mocap::run(&arguments),
        (Some(Command::Import(arguments)), _) => import::run(&arguments),
        (Some(Command::Cut(arguments)), _) => cut::run(&arguments),
        (Some(Command::Explain { code }), _) => explain::run(code.as_deref()),
        (Some(Command::Schema), _) => schema::run(),
        (Some(Command::Completions { shell }), _) => shell::completions(shell),
        (Some(Command::Worker), _) => worker::run(),
        (Some(Command::Man { folder }), _) => shell::man(&folder),
        (None, Some(arguments)) => compile::run(&arguments),
        (None, None) => unreachable!("clap asks for a model or a command"),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(Failed(code)) => ExitCode::from(code),
    }
}

/// Joins an option with a negative number after it, as in `--kerf=-1mm`. Otherwise clap takes the number for an
/// option, and says nothing of the range.
fn with_negative_values(arguments: impl Iterator<Item = OsString>) -> Vec<OsString> {
    let mut joined: Vec<OsString> = Vec::new();
    for argument in arguments {
        let negative = argument.to_str().and_then(|text| text.strip_prefix('-'));
        let is_negative =
            negative.is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit() || c == '.'));
        let is_option = |option: &&mut OsString| {
            option
                .to_str()
                .is_some_and(|it| it.starts_with("--") && it.len() > 2 && !it.contains('='))
        };
        match joined.last_mut().filter(is_option) {
            Some(option) if is_negative => {
                option.push("=");
                option.push(argument);
            }
            _ => joined.push(argument),
        }
    }
    joined
}

/// Reports a first word that is neither a file nor a command but similar to a command, because as a
/// model it would lead to a misleading message.
fn refuse_unknown_command() -> Outcome {
    let word = std::env::args_os().nth(1).and_then(|word| word.into_string().ok());
    let Some(word) = word else { return Ok(()) };
    let is_word = word.chars().all(|c| c.is_ascii_alphanumeric()) && !Path::new(&word).exists();
    let command = Cli::command();
    let names: Vec<&str> = command.get_subcommands().map(clap::Command::get_name).collect();
    if !is_word || word == "help" || names.contains(&word.as_str()) {
        return Ok(());
    }
    match closest_name(&word, &names) {
        Some(meant) => Err(misused(format_args!(
            "there is no command `{word}`, and no file of this name: did you mean `{meant}`?"
        ))),
        None => Ok(()),
    }
}

/// Reports a failure that has no position in the model's text.
fn fail(message: impl Display) -> Failed {
    // If standard error is closed, the message is lost.
    let _ = writeln!(io::stderr(), "error: {message}");
    Failed(1)
}

/// Reports warnings.
fn warn(message: impl Display) {
    let _ = writeln!(io::stderr(), "warning: {message}");
}

/// Reports an argument that cannot be read.
fn misused(message: impl Display) -> Failed {
    let Failed(_) = fail(message);
    Failed(2)
}

fn report(diagnostics: &Diagnostics, file: &SourceFile) {
    let color = io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    let _ = write!(io::stderr(), "{}", diagnostics.render(file, color));
}
