//! What the commands that evaluate have in common: a model, its parameters and inputs, and the
//! configuration to start from.

use clap::Args;
use lamc::pipeline::Compiled;
use lamc::program::{Interface, Interpreter};
use lamc::source::{SourceModel, read_angle, read_quantity};
use lamc_runtime::{Error, State, System, assemble, project};

use super::{Failed, fail, load_edited, misused};

/// Which model, and where it starts.
#[derive(Args)]
pub struct Start {
    /// The model
    pub model: String,
    /// Set a parameter: k=0.02, k=11.4mN*m/rad
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Set an input, constant: motor=2mN*m
    #[arg(long, value_name = "NAME=VALUE")]
    input: Vec<String>,
    /// Start from another angle, a rough guess: j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    initial: Vec<String>,
    /// Hold a joint at an angle: j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    lock: Vec<String>,
}

impl Start {
    /// The model compiled, its joints locked as asked, without what is released.
    pub fn compile(&self, released: &[String]) -> Result<Compiled, Failed> {
        let locks = self.locks(released)?;
        load_edited(&self.model, |model| {
            released.iter().try_for_each(|name| model.release(name))?;
            locks.iter().try_for_each(|(joint, angle)| model.lock(joint, *angle))
        })
    }

    /// As [`compile`](Self::compile), after another change of the model.
    pub fn compile_tuned(&self, tune: impl FnOnce(&mut SourceModel)) -> Result<Compiled, Failed> {
        let locks = self.locks(&[])?;
        load_edited(&self.model, |model| {
            tune(model);
            locks.iter().try_for_each(|(joint, angle)| model.lock(joint, *angle))
        })
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
    pub fn system(&self, compiled: &Compiled) -> Result<Interpreter, Failed> {
        let mut system = Interpreter::new(&compiled.program);
        for setting in &self.set {
            let (name, value) = pair(setting, "--set k=0.02", read_quantity)?;
            system.set_parameter(name, value).map_err(fail)?;
        }
        for setting in &self.input {
            let (name, value) = pair(setting, "--input motor=0.02", read_quantity)?;
            system.set_input(name, value).map_err(fail)?;
        }
        Ok(system)
    }

    /// The closed configuration nearest to the guess, at consistent rates.
    pub fn assembled(&self, system: &Interpreter) -> Result<State<Vec<f64>, f64>, Failed> {
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

/// Splits `name=value`.
pub fn pair<'a>(
    text: &'a str,
    example: &str,
    read: impl Fn(&str) -> Option<f64>,
) -> Result<(&'a str, f64), Failed> {
    let parts = text.split_once('=').and_then(|(name, value)| Some((name.trim(), read(value)?)));
    parts.ok_or_else(|| misused(format_args!("`{text}` is not of the form `{example}`")))
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
