//! The FMU backend: the C module and its model description as a source FMU of FMI 2.0 or 3.0, for
//! Model Exchange and Co-Simulation.
//!
//! All variables are scalars. The value reference of a variable is its index in the memory of an
//! instance; `Layout` assigns the indices.

use serde::Serialize;
use sha2::{Digest, Sha256};
use tera::{Context, Tera};

use super::c::{self, Real, STATUS};
use crate::program::{Interface, Program};

/// Default for the longest step of Co-Simulation, s.
const STEP: f64 = 1e-3;

/// Version of the FMI standard.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Version {
    /// FMI 2.0.
    #[default]
    Fmi2,
    /// FMI 3.0.
    Fmi3,
}

/// The index at which each block of values begins in the memory of an instance.
#[derive(Clone, Copy, Serialize)]
struct Layout {
    time: usize,
    parameters: usize,
    step: usize,
    inputs: usize,
    q: usize,
    u: usize,
    a: usize,
    points: usize,
    kinetic: usize,
    potential: usize,
    /// Motor torques: one value per joint, whether the joint is driven or not.
    motors: usize,
    count: usize,
}

impl Layout {
    fn of(interface: &Interface) -> Self {
        let n = interface.joints.len();
        let (time, parameters) = (0, 1);
        let step = parameters + interface.parameters.len();
        let inputs = step + 1;
        let q = inputs + interface.inputs.len();
        let (u, a, points) = (q + n, q + 2 * n, q + 3 * n);
        let kinetic = points + 3 * interface.points.len();
        let (potential, motors) = (kinetic + 1, kinetic + 2);
        let count = motors + n;
        Self { time, parameters, step, inputs, q, u, a, points, kinetic, potential, motors, count }
    }
}

/// The two ways in which FMI refers to a variable.
#[derive(Clone, Copy, Serialize)]
struct Key {
    /// Position among the variables, counted from 1 (FMI 2.0).
    index: usize,
    /// Value reference.
    reference: usize,
}

/// A scalar variable, with its attributes in the model description.
#[derive(Clone, Serialize)]
struct Variable {
    name: String,
    reference: usize,
    description: String,
    causality: &'static str,
    variability: &'static str,
    initial: Option<&'static str>,
    unit: Option<&'static str>,
    start: Option<String>,
    derivative_of: Option<Key>,
    is_state: bool,
}

impl Variable {
    fn new(name: impl Into<String>, reference: usize, description: impl Into<String>) -> Self {
        Self {
            name: name.into(),
            reference,
            // XML 1.0 cannot represent most control characters, not even as escapes.
            description: description.into().replace(char::is_control, " "),
            causality: "output",
            variability: "continuous",
            initial: Some("calculated"),
            unit: None,
            start: None,
            derivative_of: None,
            is_state: false,
        }
    }

    fn unit(mut self, unit: &'static str) -> Self {
        self.unit = Some(unit);
        self
    }

    fn parameter(mut self, value: f64) -> Self {
        self.causality = "parameter";
        self.variability = "tunable";
        self.initial = Some("exact");
        self.start = Some(format!("{value:?}"));
        self
    }

    /// Marks a state variable. If it has a guess, initialization solves for its value, starting from
    /// the guess; otherwise it is prescribed.
    fn state(mut self, guess: Option<f64>) -> Self {
        self.is_state = true;
        if let Some(guess) = guess {
            self.initial = Some("approx");
            self.start = Some(format!("{guess:?}"));
        }
        self
    }
}

/// Returns all variables, in the order of the model description.
fn variables(interface: &Interface, layout: &Layout) -> Vec<Variable> {
    let mut time = Variable::new("time", layout.time, "Time").unit("s");
    (time.causality, time.initial) = ("independent", None);
    let mut all = vec![time];
    for (i, parameter) in interface.parameters.iter().enumerate() {
        let name = format!("parameters.{}", parameter.name);
        let variable = Variable::new(name, layout.parameters + i, &parameter.doc);
        all.push(variable.parameter(parameter.value));
    }
    let step = Variable::new("solver.step", layout.step, "Longest internal step of Co-Simulation");
    all.push(step.unit("s").parameter(STEP));
    for (i, input) in interface.inputs.iter().enumerate() {
        let name = format!("inputs.{input}");
        let mut variable = Variable::new(name, layout.inputs + i, "Input, SI units");
        (variable.causality, variable.initial) = ("input", None);
        variable.start = Some("0.0".to_owned());
        all.push(variable);
    }
    for (j, joint) in interface.joints.iter().enumerate() {
        let variable = |letter: char, reference: usize, what: &str| {
            let description = format!("{what} of joint {}", joint.name);
            Variable::new(format!("joints.{}.{letter}", joint.name), reference, description)
        };
        let key =
            |reference: usize, after: usize| Some(Key { index: all.len() + 1 + after, reference });
        let guess = |value: f64| (!joint.driven).then_some(value);
        let q = variable('q', layout.q + j, "Angle").unit("rad").state(guess(joint.initial_q));
        let mut u =
            variable('u', layout.u + j, "Speed").unit("rad/s").state(guess(joint.initial_u));
        let mut a = variable('a', layout.a + j, "Acceleration").unit("rad/s2");
        u.derivative_of = key(q.reference, 0);
        a.derivative_of = key(u.reference, 1);
        all.extend([q, u, a]);
    }
    for (i, point) in interface.points.iter().enumerate() {
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let name = format!("points.{point}.{axis}");
            let description = format!("Position of point {point} in the base frame");
            all.push(Variable::new(name, layout.points + 3 * i + k, description).unit("m"));
        }
    }
    let energy = |kind: &str, reference, what: &str| {
        Variable::new(format!("energy.{kind}"), reference, what).unit("J")
    };
    all.push(energy("kinetic", layout.kinetic, "Kinetic energy"));
    all.push(energy("potential", layout.potential, "Energy of gravity and springs"));
    for joint in interface.driven() {
        let name = &interface.joints[joint.index()].name;
        let description = format!("Torque of the motor that drives joint {name}");
        let reference = layout.motors + joint.index();
        all.push(Variable::new(format!("motor.{name}"), reference, description).unit("N.m"));
    }
    all
}

/// Returns the files of the FMU with their paths in the archive. The same program always gives the same
/// files.
pub fn files(program: &Program, version: Version) -> Vec<(String, String)> {
    let interface = &program.interface;
    let name = &interface.name;
    let header_name = format!("{name}.h");
    let (source, header) =
        (c::source(program, Real::Double, &header_name), c::header(program, Real::Double));
    let (functions, adapter, description) = match version {
        Version::Fmi2 => (lamc_templates::FMI2, "fmi2", lamc_templates::FMI2_DESCRIPTION),
        Version::Fmi3 => (lamc_templates::FMI3, "fmi3", lamc_templates::FMI3_DESCRIPTION),
    };
    let (source_name, adapter_name) = (format!("{name}.c"), format!("{name}_{adapter}.c"));
    let mut context = context(interface, version, &token(&source, &header));
    context.insert("sources", &[&source_name, &adapter_name]);
    let text = |template: &str| render(template, &context);
    let mut files = vec![
        ("modelDescription.xml".to_owned(), text(description)),
        (format!("sources/{source_name}"), source),
        (format!("sources/{header_name}"), header),
        (format!("sources/{adapter_name}"), text(functions)),
    ];
    if version == Version::Fmi3 {
        files.push(("sources/buildDescription.xml".to_owned(), text(lamc_templates::FMI3_BUILD)));
    }
    files
}

fn context(interface: &Interface, version: Version, token: &str) -> Context {
    let layout = Layout::of(interface);
    let variables = variables(interface, &layout);
    let keys = variables.iter().enumerate();
    let keys = keys.map(|(i, v)| (v, Key { index: i + 1, reference: v.reference }));
    let outputs = keys.clone().filter(|(v, _)| v.causality == "output").map(|(_, key)| key);
    let mut derivatives: Vec<Key> =
        keys.filter(|(v, _)| v.derivative_of.is_some()).map(|(_, key)| key).collect();
    // Derivatives have the order of the states: all q, then all u.
    derivatives.sort_by_key(|key| key.reference);
    let mut context = Context::new();
    context.insert("version", env!("CARGO_PKG_VERSION"));
    context.insert("name", &interface.name);
    context.insert("upper", &interface.name.to_ascii_uppercase());
    let description = format!("Compiled from {}", interface.source_name);
    context.insert("description", &description.replace(char::is_control, " "));
    context.insert("token", token);
    context.insert("fmi", if version == Version::Fmi2 { "2.0" } else { "3.0" });
    context.insert("layout", &layout);
    context.insert("step", &STEP);
    context.insert("codes", &STATUS);
    let names = c::fields(interface.parameters.iter().map(|parameter| &parameter.name));
    context.insert("parameters", &names);
    let values: Vec<String> =
        interface.parameters.iter().map(|p| c::constant(Real::Double, p.value)).collect();
    context.insert("parameter_values", &values);
    context.insert("inputs", &c::fields(&interface.inputs));
    let (q, u) = (interface.joints.iter().map(|joint| joint.initial_q), interface.joints.iter());
    let guess = q.chain(u.map(|joint| joint.initial_u));
    context.insert("guess", &guess.map(|x| c::constant(Real::Double, x)).collect::<Vec<_>>());
    let given = interface.joints.iter().map(|joint| usize::from(joint.initial_given));
    context.insert("given", &given.collect::<Vec<_>>());
    context.insert("has_points", &!interface.points.is_empty());
    context.insert("has_drives", &!interface.driven().is_empty());
    context.insert("outputs", &outputs.collect::<Vec<_>>());
    context.insert("derivatives", &derivatives);
    context.insert("variables", &variables);
    context
}

/// Returns a token in the form of a GUID, by which an importer checks that the description and the code
/// belong together.
fn token(source: &str, header: &str) -> String {
    let digest = Sha256::new().chain_update(source).chain_update(header).finalize();
    let hex: Vec<String> = digest.iter().map(|byte| format!("{byte:02x}")).collect();
    let part = |from: usize, to: usize| hex[from..to].concat();
    format!("{{{}-{}-{}-{}-{}}}", part(0, 4), part(4, 6), part(6, 8), part(8, 10), part(10, 16))
}

/// Fills in a template. The output is escaped if the template begins with an XML declaration.
fn render(template: &str, context: &Context) -> String {
    let is_xml = template.starts_with("<?xml");
    let main = if is_xml { "main.xml" } else { "main" };
    let mut tera = Tera::default();
    let parts = [
        ("model", lamc_templates::FMU_MODEL),
        ("units", lamc_templates::FMU_UNITS),
        (main, template),
    ];
    match tera.add_raw_templates(parts).and_then(|()| tera.render(main, context)) {
        Ok(text) => text,
        Err(error) => unreachable!("the template is at fault: {error:?}"),
    }
}
