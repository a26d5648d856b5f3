//! Mechanisms with values that were computed independently of lamc.
//!
//! `data/published` holds the four mechanisms of the paper DETC2018-86359 as masses, centres, inertias
//! and hinge lines, with states and motions from three other implementations (Newton-Euler in NumPy,
//! Pinocchio, CasADi). `data/drawings` holds drawings in popupCAD's format with closed-form mass
//! properties ([`solve`] gives the accelerations of their states); `draw.py` there made them.

use std::fs;
use std::path::{Path, PathBuf};

use lamc::laminate::{Body, Joint, MassProperties, Mechanism};
use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc::source::{BodyId, Expression, Span};
use nalgebra::{Matrix3, Vector3};
use serde::Deserialize;

use crate::compare::largest;
use crate::random::{Random, closed_state};
use crate::{compile, workspace};
use lamc_workbench::verify::{Values, solve, tree_mass_matrix};

const PUBLISHED: [&str; 4] =
    ["paper_pendulum", "paper_triple_pendulum", "paper_fourbar", "paper_sixbar"];
const DRAWINGS: [&str; 4] = ["drawn_pendulum", "drawn_fourbar", "drawn_sixbar", "drawn_sarrus"];
/// The number of states of each drawing.
const STATES: usize = 12;

/// A mechanism with its reference values.
#[derive(Debug)]
pub struct Design {
    /// The file's name without its extension.
    pub name: &'static str,
    /// The model or drawing.
    pub path: PathBuf,
    /// The result of lamc.
    pub compiled: Compiled,
    /// The results of other programs.
    pub reference: Reference,
}

/// The published mechanisms, in the order of [`crate::EXAMPLES`].
pub fn published() -> impl Iterator<Item = Design> {
    PUBLISHED.into_iter().map(|name| Design::read("published", name, "yaml"))
}

/// A published mechanism.
///
/// # Panics
/// If there is none with this name.
pub fn published_design(name: &str) -> Design {
    published().find(|design| design.name == name).expect("a published mechanism's name")
}

/// The drawings in popupCAD's format.
pub fn drawings() -> impl Iterator<Item = Design> {
    DRAWINGS.into_iter().map(|name| {
        let mut design = Design::read("drawings", name, "cad.joints");
        design.reference.states = design.solved_states();
        design
    })
}

/// All published mechanisms and drawings.
pub fn designs() -> impl Iterator<Item = Design> {
    published().chain(drawings())
}

impl Design {
    fn read(folder: &str, name: &'static str, extension: &str) -> Self {
        let folder = workspace().join("tests/data").join(folder);
        let path = folder.join(format!("{name}.{extension}"));
        let reference = Reference::read(&folder.join(format!("{name}.json")));
        Self { name, compiled: compile(&path), path, reference }
    }

    /// Random closed states of a drawing, solved by Newton's and Euler's equations.
    fn solved_states(&self) -> Vec<ReferenceState> {
        let mechanism = self.reference.mechanism();
        let system = Interpreter::new(&self.compiled.program);
        let mut random = Random::new(2026);
        let state = |_| {
            let state = closed_state(&system, &mut random);
            let values = Values { q: state.q, u: state.u, ..Values::default() };
            let solution = solve(&mechanism, &values).expect("bodies have inertia");
            // lamc closed the state; the independent formulation checks that it is closed.
            assert!(solution.open_by < 1e-10, "{}: open by {:e}", self.name, solution.open_by);
            let slip = solution.speed_mismatch;
            assert!(slip < 1e-9, "{}: speeds differ by {slip:e}", self.name);
            let is_tree = self.reference.rank == 0;
            ReferenceState {
                mass_matrix: is_tree.then(|| tree_mass_matrix(&mechanism, &values)),
                forcing: None,
                acceleration: solution.acceleration,
                kinetic_energy: solution.kinetic_energy,
                potential_energy: solution.potential_energy,
                q: values.q,
                u: values.u,
            }
        };
        (0..STATES).map(state).collect()
    }
}

/// Values computed independently of lamc; SI, base frame, joints in file order.
#[derive(Debug, Deserialize)]
pub struct Reference {
    /// Gravity, m/s^2.
    pub gravity: [f64; 3],
    /// Rank of the closure at each of the states.
    pub rank: usize,
    /// Bodies in file order.
    pub bodies: Vec<ReferenceBody>,
    /// Joints in file order.
    pub joints: Vec<ReferenceJoint>,
    /// Closed configurations with consistent rates.
    #[serde(default)]
    pub states: Vec<ReferenceState>,
    /// A motion from rest, of a published mechanism.
    trajectory: Option<Trajectory>,
}

/// A body with its mass properties; the inertia is about the centre of mass.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct ReferenceBody {
    pub name: String,
    pub fixed: bool,
    pub mass: f64,
    pub com: [f64; 3],
    pub inertia: [[f64; 3]; 3],
}

/// A hinge.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct ReferenceJoint {
    pub name: String,
    pub parent: String,
    pub child: String,
    pub axis: [f64; 3],
    pub point: [f64; 3],
    pub stiffness: f64,
    pub damping: f64,
    pub rest: f64,
    /// Of a drawing, rad.
    pub limits: Option<[f64; 2]>,
}

/// Values at one state.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct ReferenceState {
    pub q: Vec<f64>,
    pub u: Vec<f64>,
    pub acceleration: Vec<f64>,
    pub kinetic_energy: f64,
    pub potential_energy: f64,
    pub mass_matrix: Option<Vec<Vec<f64>>>,
    pub forcing: Option<Vec<f64>>,
}

/// A motion from rest.
#[derive(Debug, Deserialize)]
#[allow(missing_docs, reason = "named as in the file")]
pub struct Trajectory {
    pub q0: Vec<f64>,
    pub u0: Vec<f64>,
    pub t: Vec<f64>,
    pub q: Vec<Vec<f64>>,
}

impl Reference {
    fn read(path: &Path) -> Self {
        let text = fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// The motion of a published mechanism.
    ///
    /// # Panics
    /// If the mechanism is a drawing, which has no motion.
    pub fn trajectory(&self) -> &Trajectory {
        self.trajectory.as_ref().expect("published mechanisms have a trajectory")
    }

    /// The mechanism made directly of the bodies and joints of the reference, without the stages of lamc.
    pub fn mechanism(&self) -> Mechanism {
        let body = |name: &str| {
            BodyId(self.bodies.iter().position(|body| body.name == name).expect("a known body"))
        };
        let bodies = self.bodies.iter().map(|body| Body {
            name: body.name.clone(),
            fixed: body.fixed,
            mass_properties: MassProperties {
                mass: body.mass,
                com: body.com.into(),
                inertia: Matrix3::from_fn(|i, j| body.inertia[i][j]),
            },
            mass_parameter: None,
            sheets: Vec::new(),
            point_masses: Vec::new(),
            surface: Vec::new(),
            span: Span::default(),
        });
        let joints = self.joints.iter().map(|joint| Joint {
            name: joint.name.clone(),
            bodies: [body(&joint.parent), body(&joint.child)],
            point: joint.point.into(),
            direction: Vector3::from(joint.axis).normalize(),
            length: 1.0,
            stiffness: Expression::Number(joint.stiffness),
            damping: Expression::Number(joint.damping),
            rest: Expression::Number(joint.rest),
            cubic_stiffness: Expression::ZERO,
            friction: None,
            linear_range: f64::INFINITY,
            torque: Expression::ZERO,
            drive: None,
            limits: joint.limits.unwrap_or([f64::NEG_INFINITY, f64::INFINITY]),
            fold: None,
            span: Span::default(),
        });
        Mechanism {
            cuts: Vec::new(),
            name: "reference".into(),
            gravity: self.gravity.map(Expression::Number),
            bodies: bodies.collect(),
            joints: joints.collect(),
            parameters: Vec::new(),
            inputs: Vec::new(),
            points: Vec::new(),
            forces: Vec::new(),
            elements: Default::default(),
            contacts: Vec::new(),
            controllers: Vec::new(),
            initial_q: vec![0.0; self.joints.len()],
            initial_given: Vec::new(),
            initial_u: vec![0.0; self.joints.len()],
            free: Vec::new(),
            air: None,
            tolerance: 0.0,
            size: largest(self.joints.iter().flat_map(|joint| joint.point)),
        }
    }
}
