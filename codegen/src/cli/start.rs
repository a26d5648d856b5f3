//! What the commands that evaluate have in common: a model, its parameters and inputs, and the
//! configuration to start from.

use clap::Args;
use lamc::backend::jit::Jit;
use lamc::pipeline::Compiled;
use lamc::program::Interface;
use lamc::source::{SourceModel, read_angle, read_quantity};
use lamc_runtime::{Error, State, System, assemble, project};

use super::progress::Busy;
use super::{Failed, Size, fail, load_edited, misused};

/// Which model, and where it starts.
#[derive(Args)]
pub struct Start {
    /// The model
    pub model: String,
    /// Set a parameter: k=0.02, k=11.4mN*m/rad
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Set an input, constant or an expression of t and the parameters:
    /// motor=2mN*m, "motor=0.002*sin(2*pi*t)"
    #[arg(long, value_name = "NAME=VALUE")]
    input: Vec<String>,
    /// Start from another angle, a rough guess: j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    initial: Vec<String>,
    /// Hold a joint at an angle: j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    lock: Vec<String>,
    #[command(flatten)]
    size: Size,
}

impl Start {
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
        let locks = self.locks(released)?;
        let prescribed = self.input.iter().map(|setting| named(setting, INPUT));
        let prescribed = prescribed.collect::<Result<Vec<_>, _>>()?;
        load_edited(&self.model, self.size, |model| {
            change(model);
            let functions = prescribed.iter().filter(|(_, text)| read_quantity(text).is_none());
            functions.into_iter().try_for_each(|(name, text)| model.prescribe(name, text))?;
            released.iter().try_for_each(|name| model.release(name))?;
            locks.iter().try_for_each(|(joint, angle)| model.lock(joint, *angle))
        })
    }

    /// Refuses `--initial` where it has no say.
    pub fn refuse_initial(&self, why: &str) -> Result<(), Failed> {
        match self.initial.is_empty() {
            true => Ok(()),
            false => Err(misused(format_args!("--initial has no say: {why}"))),
        }
    }

    /// The joints to hold, but for what is released.
    fn locks(&self, released: &[String]) -> Result<Vec<(&str, f64)>, Failed> {
        let mut locks = Vec::new();
        for lock in &self.lock {
            let (joint, angle) = pair(lock, "--lock j0=30deg", read_angle)?;
            // What is locked to settle may be let go to move.
            if !released.iter().any(|name| name == joint) {
                locks.push((joint, angle));
            }
        }
        Ok(locks)
    }

    /// The model ready to be evaluated, with parameters and inputs set.
    pub fn system(&self, compiled: &Compiled) -> Result<Jit, Failed> {
        let mut system = Jit::new(&compiled.program);
        for setting in &self.set {
            let (name, value) = pair(setting, "--set k=0.02", read_quantity)?;
            system.set_parameter(name, value).map_err(fail)?;
        }
        for setting in &self.input {
            let (name, text) = named(setting, INPUT)?;
            if let Some(value) = read_quantity(text) {
                system.set_input(name, value).map_err(fail)?;
            }
        }
        Ok(system)
    }

    /// The closed configuration nearest to the guess, at consistent rates.
    pub fn assembled(&self, system: &Jit) -> Result<State<Vec<f64>, f64>, Failed> {
        let mut state = State::initial(system);
        let n = state.q.len();
        let mut pinned: Vec<bool> = (0..n).map(|joint| system.is_given(joint)).collect();
        let joints = &system.interface().joints;
        if !self.initial.is_empty() {
            pinned.fill(false);
        }
        for setting in &self.initial {
            let (name, angle) = pair(setting, "--initial j0=30deg", read_angle)?;
            let Some(joint) = joints.iter().position(|joint| joint.name == name) else {
                let names: Vec<_> = joints.iter().map(|joint| joint.name.as_str()).collect();
                return Err(fail(format_args!(
                    "no joint `{name}`; there are {}",
                    names.join(", ")
                )));
            };
            if joints[joint].driven {
                return Err(fail(format_args!("`{name}` is driven: its angle is prescribed")));
            }
            let [least, greatest] = joints[joint].limits;
            if angle < least || angle > greatest {
                return Err(fail(format_args!("`{setting}` is outside the limits of `{name}`")));
            }
            state.q[joint] = angle;
            pinned[joint] = true;
        }
        let _busy = Busy::new("closing the loops");
        let mut workspace = system.workspace();
        assemble(system, 0.0, &mut state.q, &pinned, &mut workspace).map_err(|error| {
            let reason = describe(&error, system.interface());
            fail(format_args!("no closed configuration near the initial one: {reason}"))
        })?;
        project(system, 0.0, &mut state.q, &mut state.u, &mut workspace)
            .map_err(|error| fail(describe(&error, system.interface())))?;
        Ok(state)
    }
}

/// How an input is set.
const INPUT: &str = "--input motor=0.02";

/// Splits `name=text`.
fn named<'a>(text: &'a str, example: &str) -> Result<(&'a str, &'a str), Failed> {
    let parts = text.split_once('=').map(|(name, value)| (name.trim(), value.trim()));
    parts.ok_or_else(|| misused(format_args!("`{text}` is not of the form `{example}`")))
}

/// Splits `name=value`.
pub fn pair<'a>(
    text: &'a str,
    example: &str,
    read: impl Fn(&str) -> Option<f64>,
) -> Result<(&'a str, f64), Failed> {
    let (name, value) = named(text, example)?;
    let value = read(value).map(|value| (name, value));
    value.ok_or_else(|| misused(format_args!("`{text}` is not of the form `{example}`")))
}

/// The runtime's error with the names of the joints it is about.
pub fn describe(error: &Error, interface: &Interface) -> String {
    let joint = match *error {
        Error::NotClosed { joint, .. } => joint,
        Error::NotDriven { joint } | Error::NotFinite { joint } | Error::MassMatrix { joint } => {
            Some(joint)
        }
        _ => None,
    };
    match joint.and_then(|joint| interface.joints.get(joint)) {
        Some(joint) => format!("{error} (`{}`)", joint.name),
        None => error.to_string(),
    }
}
