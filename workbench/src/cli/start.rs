//! Options of all commands that evaluate a model: its parameters and inputs, and the initial
//! configuration.

use std::borrow::Cow;
use std::collections::HashSet;

use clap::Args;
use lamc::laminate::{Mechanism, verdicts};
use lamc::pipeline::Compiled;
use lamc::program::Interface;
use lamc::source::{
    Controller, Diagnostics, EditError, Numbers, Severity, SourceModel, beyond_a_turn, has_no_unit,
    read_angle, read_as, read_quantity,
};
use lamc_runtime::State;
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::{self, Asked, allowed};

use super::progress::Busy;
use super::{Derivation, Failed, fail, load_edited, misused, read, report, warn};

/// The model and its initial configuration.
#[derive(Args)]
pub struct Start {
    /// The model
    pub model: String,
    /// Set a parameter; a number without a unit is in SI units and radians, a unit must fit the
    /// parameter: k=0.02, k=11.4mN*m/rad
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Set an input to a constant or an expression of t and the parameters; numbers without a unit
    /// are in SI units and radians: motor=2mN*m, "motor=0.002*sin(2*pi*t)"
    #[arg(long, value_name = "NAME=VALUE")]
    input: Vec<String>,
    /// Set the guess of an initial angle; a number without a unit is in the model's `units.angle`
    /// (radians by default): j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    initial: Vec<String>,
    /// Hold a joint at an angle; numbers without a unit as for --initial: j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    lock: Vec<String>,
    #[command(flatten)]
    derivation: Derivation,
}

impl Start {
    /// A model with these inputs and locks; everything else as it is in the file.
    pub fn of(
        model: String,
        input: Vec<String>,
        lock: Vec<String>,
        derivation: Derivation,
    ) -> Self {
        Self { model, set: Vec::new(), input, initial: Vec::new(), lock, derivation }
    }

    /// The model compiled, its joints locked as asked, without what is released.
    pub fn compile(&self, released: &[String]) -> Result<Compiled, Failed> {
        self.compile_changed(released, |_| ())
    }

    /// As [`compile`](Self::compile), after another change of the model.
    pub fn compile_changed(
        &self,
        released: &[String],
        change: impl FnOnce(&mut SourceModel),
    ) -> Result<Compiled, Failed> {
        for (option, settings) in [
            ("--set", &self.set),
            ("--input", &self.input),
            ("--initial", &self.initial),
            ("--lock", &self.lock),
        ] {
            are_distinct(option, settings)?;
        }
        let locks = self.locks(released)?;
        let prescribed = self.input.iter().map(|setting| named(setting, INPUT));
        let prescribed = prescribed.collect::<Result<Vec<_>, _>>()?;
        let compiled = load_edited(&self.model, self.derivation, |model| {
            change(model);
            let functions = prescribed.iter().filter(|(_, text)| read_quantity(text).is_none());
            functions.into_iter().try_for_each(|(name, text)| model.prescribe(name, text))?;
            released.iter().try_for_each(|name| model.release(name))?;
            for (joint, text) in &locks {
                // That it is an angle has been found.
                if let Some(angle) = model.angle.read(text) {
                    warn_of_turns("--lock", joint, text, model.angle.is_radian().then_some(angle));
                    model.lock(joint, angle)?;
                }
            }
            Ok(())
        })?;
        self.drawn(compiled)
    }

    /// The mechanism with the drawing that the parameters give.
    fn drawn(&self, mut compiled: Compiled) -> Result<Compiled, Failed> {
        if compiled.model.is_some() && !self.set.is_empty() {
            let known = &compiled.program.interface.parameters;
            let mut values: Vec<f64> = known.iter().map(|known| known.value).collect();
            for setting in &self.set {
                let (name, text) = named(setting, SET)?;
                // An unknown name is reported where the parameters are set.
                if let Some(index) = known.iter().position(|known| known.name == name) {
                    values[index] = quantity("--set", (name, text), &compiled.numbers)?;
                }
            }
            let topology = compiled.topology_at(&values).map(Cow::into_owned);
            compiled.topology = topology.map_err(|problems| refused(&self.model, &problems))?;
        }
        Ok(compiled)
    }

    /// The joints to hold, but for what is released.
    fn locks(&self, released: &[String]) -> Result<Vec<(&str, &str)>, Failed> {
        let mut locks = Vec::new();
        for lock in &self.lock {
            let (joint, text) = named(lock, LOCK)?;
            if read_angle(text).is_none() {
                return Err(unlike(lock, LOCK));
            }
            // A joint that is locked for the equilibrium may be released for the motion.
            if !released.iter().any(|name| name == joint) {
                locks.push((joint, text));
            }
        }
        Ok(locks)
    }

    /// The model ready to be evaluated, with parameters and inputs set.
    pub fn system(&self, compiled: &Compiled) -> Result<Jit, Failed> {
        let mut system = Jit::new(&compiled.program);
        for setting in &self.set {
            let (name, text) = named(setting, SET)?;
            let value = quantity("--set", (name, text), &compiled.numbers)?;
            system.set_parameter(name, value).map_err(fail)?;
        }
        let mechanism = &compiled.topology.mechanism;
        let defaults: Vec<f64> = mechanism.parameters.iter().map(|known| known.value).collect();
        let known = verdicts(mechanism, &defaults);
        for verdict in verdicts(mechanism, system.parameters()) {
            match verdict.severity {
                Severity::Error => return Err(fail(verdict)),
                Severity::Warning if !known.contains(&verdict) => warn(verdict),
                Severity::Warning | Severity::Note => {}
            }
        }
        for setting in &self.input {
            let (name, text) = named(setting, INPUT)?;
            if read_quantity(text).is_some() {
                undriven(mechanism, name)?;
                let value = quantity("--input", (name, text), &compiled.numbers)?;
                system.set_input(name, value).map_err(fail)?;
            }
        }
        Ok(system)
    }

    /// The joints whose guess is given, rad.
    pub fn guess(
        &self,
        compiled: &Compiled,
        interface: &Interface,
    ) -> Result<Vec<(usize, f64)>, Failed> {
        let joints = &interface.joints;
        let mut guess = Vec::new();
        for setting in &self.initial {
            let (name, text) = named(setting, INITIAL)?;
            let unit = compiled.numbers.angle;
            let angle = unit.read(text).ok_or_else(|| unlike(setting, INITIAL))?;
            warn_of_turns("--initial", name, text, unit.is_radian().then_some(angle));
            let Some(joint) = joints.iter().position(|joint| joint.name == name) else {
                let names: Vec<_> = joints.iter().map(|joint| joint.name.as_str()).collect();
                return Err(fail(format_args!(
                    "there is no joint `{name}`; there are {}",
                    names.join(", ")
                )));
            };
            allowed(&joints[joint], angle).map_err(fail)?;
            guess.push((joint, angle));
        }
        Ok(guess)
    }

    /// The closed configuration nearest to the guess, at consistent rates.
    pub fn assembled(
        &self,
        compiled: &Compiled,
        system: &Jit,
    ) -> Result<State<Vec<f64>, f64>, Failed> {
        let guess = self.guess(compiled, system.interface())?;
        let _busy = Busy::new("closing the loops");
        simulation::start(&compiled.topology, system, &Asked::of(system, &guess), warn)
            .map_err(fail)
    }
}

/// How options are written.
const SET: &str = "--set k=0.02";
const INPUT: &str = "--input motor=0.02";
const INITIAL: &str = "--initial j0=30deg";
const LOCK: &str = "--lock j0=30deg";

/// Reports what is wrong with a model that was read before.
fn refused(path: &str, problems: &Diagnostics) -> Failed {
    match read(path) {
        Ok(file) => {
            report(problems, &file);
            Failed(1)
        }
        Err(failed) => failed,
    }
}

/// Refuses a name that is given twice.
fn are_distinct(option: &str, settings: &[String]) -> Result<(), Failed> {
    let mut seen = HashSet::new();
    let mut names = settings.iter().filter_map(|setting| setting.split_once('='));
    match names.find(|(name, _)| !seen.insert(name.trim())) {
        Some((twice, _)) => {
            Err(misused(format_args!("`{option}` gives `{}` twice: keep one", twice.trim())))
        }
        None => Ok(()),
    }
}

/// The value of a parameter or an input, SI, whose unit measures what it does.
fn quantity(option: &str, (name, text): (&str, &str), numbers: &Numbers) -> Result<f64, Failed> {
    let dimension = numbers.dimensions.get(name).copied();
    let value = read_as(text, dimension)
        .map_err(|reason| misused(format_args!("`{option} {name}={text}`: {reason}")))?;
    let is_angle = dimension.is_some_and(|dimension| dimension.is_angle());
    warn_of_turns(option, name, text, is_angle.then_some(value));
    Ok(value)
}

/// Warns of a number without a unit that is read as radians and was perhaps meant in degrees.
fn warn_of_turns(option: &str, name: &str, text: &str, radians: Option<f64>) {
    if let Some(turns) = radians.filter(|_| has_no_unit(text)).and_then(beyond_a_turn) {
        warn(format_args!(
            "`{option} {name}={text}`: {turns}; for degrees write `{name}={text}deg`"
        ));
    }
}

/// Refuses an input that a controller drives.
fn undriven(mechanism: &Mechanism, input: &str) -> Result<(), Failed> {
    let drives = |controller: &&Controller| {
        let mut commands = controller.commands.iter();
        commands.any(|command| mechanism.inputs[command.input.index()] == input)
    };
    match mechanism.controllers.iter().find(drives) {
        None => Ok(()),
        Some(controller) => {
            let (input, controller) = (input.to_owned(), controller.name.clone());
            Err(fail(EditError::Controlled { input, controller }))
        }
    }
}

/// Splits `name=text`.
fn named<'a>(text: &'a str, example: &str) -> Result<(&'a str, &'a str), Failed> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    parts.ok_or_else(|| unlike(text, example))
}

fn unlike(text: &str, example: &str) -> Failed {
    misused(format_args!("`{text}` is not of the form `{example}`"))
}
