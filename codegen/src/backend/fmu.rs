//! The FMU backend: the C module and its model description as a source FMU of FMI 2.0 or 3.0, for
//! Model Exchange and Co-Simulation.
//!
//! All variables are scalars. The value reference of a variable is its index in the memory of an
//! instance; `Layout` assigns the indices.

mod variables;

use serde::Serialize;
use sha2::{Digest, Sha256};
use tera::{Context, Tera};

use self::variables::{Variable, variables};
use super::c::{self, Real, STATUS};
use crate::program::{Interface, Program, Selection};

/// Default for the longest step of Co-Simulation, s.
const STEP: f64 = 1e-3;

/// Numbers of a quaternion: the last coordinates of a free body.
const QUATERNION: usize = 4;

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
    /// The rates of the quaternions of free bodies. Those of other coordinates are speeds.
    rates: usize,
    points: usize,
    kinetic: usize,
    potential: usize,
    contacts: usize,
    /// Nine numbers if there are free bodies.
    momentum: usize,
    /// Motor torques: one value per joint, whether the joint is driven or not.
    motors: usize,
    count: usize,
}

impl Layout {
    fn of(interface: &Interface) -> Self {
        let (nq, nu) = (interface.coordinates(), interface.speeds());
        let (time, parameters) = (0, 1);
        let step = parameters + interface.parameters.len();
        let inputs = step + 1;
        let q = inputs + interface.inputs.len();
        let (u, a, rates) = (q + nq, q + nq + nu, q + nq + 2 * nu);
        let points = rates + QUATERNION * interface.free.len();
        let kinetic = points + 3 * interface.points.len();
        let (potential, contacts) = (kinetic + 1, kinetic + 2);
        let momentum = contacts + 6 * interface.contacts.len();
        let motors = momentum + if interface.free.is_empty() { 0 } else { 9 };
        let count = motors + interface.joints.len();
        Self {
            time,
            parameters,
            step,
            inputs,
            q,
            u,
            a,
            rates,
            points,
            kinetic,
            potential,
            contacts,
            momentum,
            motors,
            count,
        }
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

/// Returns the files of the FMU with their paths in the archive. The same program always gives the same
/// files.
pub fn files(program: &Program, version: Version) -> Vec<(String, String)> {
    let interface = &program.interface;
    let name = &interface.name;
    let header_name = format!("{name}.h");
    // A master calls no derivatives.
    let called = program.only(Selection::default());
    let (source, header) =
        (c::source(&called, Real::Double, &header_name), c::header(&called, Real::Double));
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
    let derivative = |(v, key): (&Variable, Key)| Some((key, v.derivative_of?.reference));
    let mut derivatives: Vec<_> = keys.filter_map(derivative).collect();
    // Derivatives have the order of the states: all q, then all u.
    derivatives.sort_by_key(|(_, state)| *state);
    let derivatives: Vec<Key> = derivatives.into_iter().map(|(key, _)| key).collect();
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
    context.insert("drawn", &interface.drawn);
    context.insert("parameters", &names);
    let values: Vec<String> =
        interface.parameters.iter().map(|p| c::constant(Real::Double, p.value)).collect();
    context.insert("parameter_values", &values);
    context.insert("inputs", &c::fields(&interface.inputs));
    let (joints, free) = (interface.joints.iter(), interface.free.iter());
    let q = joints.clone().map(|joint| joint.initial_q).chain(free.clone().flat_map(|body| body.q));
    let u = joints.map(|joint| joint.initial_u).chain(free.flat_map(|body| body.u));
    let guess = q.chain(u).map(|x| c::constant(Real::Double, x));
    context.insert("guess", &guess.collect::<Vec<_>>());
    let given = interface.joints.iter().map(|joint| usize::from(joint.initial_given));
    context.insert("given", &given.collect::<Vec<_>>());
    context.insert("joints", &interface.joints.len());
    context.insert("free_bodies", &interface.free.len());
    // The numbers of joints, of coordinates and of continuous states, as C knows them.
    let [pins, nq, states] = match interface.free.is_empty() {
        true => ["N", "N", "2 * N"],
        false => ["JOINTS", "NQ", "STATES"],
    };
    context.insert("pins", pins);
    context.insert("nq", nq);
    context.insert("states", states);
    context.insert("has_points", &!interface.points.is_empty());
    context.insert("has_contacts", &!interface.contacts.is_empty());
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
