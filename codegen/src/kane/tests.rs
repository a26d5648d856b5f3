//! Compares Kane's equations of small mechanisms with closed forms.

use nalgebra::{Matrix3, Vector3};

use super::{Equations, Leaf, derive};
use crate::laminate::{Body, Geometry, Joint, MassProperties, Mechanism};
use crate::program::{Phase, Section, Subject};
use crate::source::{BodyId, Expression, JointId, Span};
use crate::symbolic::{Function, Tree};
use crate::topology::{Connection, Node, NodeId, Topology};

/// Evaluates trees directly, as the reference for all later stages.
struct Evaluator<'a> {
    equations: &'a Equations,
    bound: Vec<f64>,
    q: &'a [f64],
    u: &'a [f64],
}

impl<'a> Evaluator<'a> {
    fn new(equations: &'a Equations, q: &'a [f64], u: &'a [f64]) -> Self {
        let mut evaluator = Self { equations, bound: Vec::new(), q, u };
        for binding in &equations.bindings {
            let value = evaluator.value(&binding.tree);
            evaluator.bound.push(value);
        }
        evaluator
    }

    fn value(&self, tree: &Tree<Leaf>) -> f64 {
        match tree {
            Tree::Rational(a, b) => *a as f64 / *b as f64,
            Tree::Number(number) => *number,
            Tree::Leaf(Leaf::Position(j)) => self.q[j.index()],
            Tree::Leaf(Leaf::Rate(j)) => self.u[j.index()],
            Tree::Leaf(Leaf::Bound(b)) => self.bound[b.index()],
            Tree::Leaf(Leaf::Parameter(p)) => {
                self.equations.mechanism().parameters[p.index()].value
            }
            Tree::Leaf(Leaf::Time | Leaf::Input(_)) => 0.0,
            Tree::Leaf(Leaf::Acceleration(_) | Leaf::Multiplier(_) | Leaf::Memory(_)) => f64::NAN,
            Tree::Sum(terms) => terms.iter().map(|x| self.value(x)).sum(),
            Tree::Product(factors) => factors.iter().map(|x| self.value(x)).product(),
            Tree::Power(base, n) => self.value(base).powi(*n as i32),
            Tree::Apply(Function::Sin, x) => self.value(&x[0]).sin(),
            Tree::Apply(Function::Cos, x) => self.value(&x[0]).cos(),
            Tree::Apply(..) => f64::NAN,
        }
    }

    fn values(&self, trees: &[Tree<Leaf>]) -> Vec<f64> {
        trees.iter().map(|tree| self.value(tree)).collect()
    }
}

/// Returns a chain of equal rods along x, hinged along y at x = 0, 1, 2, ..., with gravity along -z.
fn chain(n: usize, mass: f64, inertia: f64) -> Topology {
    let number = Expression::Number;
    let body = |k: usize| Body {
        name: if k == 0 { "ground".into() } else { format!("rod{k}") },
        fixed: k == 0,
        mass_properties: MassProperties {
            mass,
            com: Vector3::new(k as f64 - 0.5, 0.0, 0.0),
            inertia: Matrix3::from_diagonal(&Vector3::new(inertia / 9.0, inertia, inertia)),
        },
        mass_parameter: None,
        sheets: Vec::new(),
        point_masses: Vec::new(),
        surface: Vec::new(),
        span: Span::default(),
    };
    let joint = |k: usize| Joint {
        name: format!("j{k}"),
        bodies: [BodyId(k), BodyId(k + 1)],
        point: Vector3::new(k as f64, 0.0, 0.0),
        direction: Vector3::y(),
        length: 1.0,
        stiffness: number(3.0),
        damping: number(0.2),
        rest: number(0.1),
        cubic_stiffness: number(0.0),
        friction: None,
        linear_range: f64::INFINITY,
        torque: number(0.0),
        drive: None,
        limits: [f64::NEG_INFINITY, f64::INFINITY],
        fold: None,
        span: Span::default(),
    };
    let node = |k: usize| Node {
        connection: Connection::Hinge(JointId(k)),
        body: BodyId(k + 1),
        ghost: None,
        parent: k.checked_sub(1).map(NodeId),
        sense: 1.0,
        share: 1.0,
    };
    let mechanism = Mechanism {
        tolerance: 0.0,
        cuts: Vec::new(),
        name: "chain".into(),
        gravity: [number(0.0), number(0.0), number(-9.81)],
        bodies: (0..=n).map(body).collect(),
        joints: (0..n).map(joint).collect(),
        parameters: Vec::new(),
        inputs: Vec::new(),
        points: Vec::new(),
        forces: Vec::new(),
        elements: Default::default(),
        contacts: Vec::new(),
        controllers: Vec::new(),
        initial_q: vec![0.0; n],
        initial_given: Vec::new(),
        initial_u: vec![0.0; n],
        free: Vec::new(),
        air: None,
        size: n as f64,
    };
    Topology {
        copies: Vec::new(),
        reduction: None,
        mechanism,
        nodes: (0..n).map(node).collect(),
        loops: Vec::new(),
        rank: 0,
        mobility: n,
        assembled: None,
        infinitesimal: Vec::new(),
        is_shaky: false,
        warnings: Default::default(),
        comparison: None,
    }
}

fn assert_close(left: f64, right: f64) {
    assert!((left - right).abs() <= 1e-12 * (1.0 + right.abs()), "{left} is not {right}");
}

#[test]
fn pendulum_is_the_textbook_one() {
    let equations = derive(&chain(1, 2.0, 0.3), &Geometry::default()).unwrap();
    let (q, u) = ([0.7], [1.3]);
    let at = Evaluator::new(&equations, &q, &u);
    let about_hinge = 0.3 + 2.0 * 0.25;
    assert_close(at.value(&equations.mass[0]), about_hinge);
    // A turn about +y lowers the rod's far end, so the moment of gravity is +m g l cos q.
    let gravity = 2.0 * 9.81 * 0.5 * 0.7_f64.cos();
    assert_close(at.value(&equations.forcing[0]), gravity - 3.0 * (0.7 - 0.1) - 0.2 * 1.3);
    assert_close(at.value(&equations.kinetic_energy), 0.5 * about_hinge * 1.69);
    let height = -0.5 * 0.7_f64.sin();
    let spring = 1.5 * 0.36;
    assert_close(at.value(&equations.potential_energy), 2.0 * 9.81 * height + spring);
}

#[test]
fn double_pendulum_is_the_textbook_one() {
    let (m, i) = (2.0, 0.3);
    let equations = derive(&chain(2, m, i), &Geometry::default()).unwrap();
    let (q, u) = ([0.4, -0.9], [1.1, 0.6]);
    let at = Evaluator::new(&equations, &q, &u);
    let c = q[1].cos();
    let far = i + m * 0.25;
    let coupling = far + 0.5 * m * c;
    let near = i + m * 0.25 + m + far + m * c;
    let mass = at.values(&equations.mass);
    for (left, right) in mass.iter().zip([near, coupling, coupling, far]) {
        assert_close(*left, right);
    }
    let h = 0.5 * m * q[1].sin();
    let [one, both] = [q[0].cos(), (q[0] + q[1]).cos()].map(|c| m * 9.81 * c);
    let spring = |j: usize| -3.0 * (q[j] - 0.1) - 0.2 * u[j];
    let expected = [
        h * (2.0 * u[0] * u[1] + u[1] * u[1]) + 1.5 * one + 0.5 * both + spring(0),
        -h * u[0] * u[0] + 0.5 * both + spring(1),
    ];
    for (left, right) in at.values(&equations.forcing).iter().zip(expected) {
        assert_close(*left, right);
    }
    assert_eq!(equations.poses.len(), 36);
}

#[test]
fn bindings_grow_no_faster_than_the_square_of_the_joints() {
    let count = |n| derive(&chain(n, 1.0, 0.1), &Geometry::default()).unwrap().bindings.len();
    let (small, large) = (count(8), count(16));
    assert!(large <= 4 * small, "{small} bindings for 8 joints, {large} for 16");
}

#[test]
fn bindings_say_which_body_and_which_phase_they_belong_to() {
    let equations = derive(&chain(3, 2.0, 0.3), &Geometry::default()).unwrap();
    let section = |name: &str| {
        let found = equations.bindings.iter().find(|binding| binding.name == name);
        found.unwrap_or_else(|| panic!("nothing is called {name}")).section
    };
    let second = Subject::Body(NodeId(1));
    for (name, phase) in [
        ("sin_j1", Phase::HingeAngle),
        ("axis_y_rod2_x", Phase::Placement),
        ("omega_rod2_x", Phase::AngularVelocity),
        ("velocity_rod2_z", Phase::Velocity),
        ("velocity_product_rod2_y", Phase::VelocityProduct),
        ("apparent_gravity_rod2_z", Phase::ApparentGravity),
        ("bias_force_rod2_y", Phase::BiasForce),
        ("generalized_force_j1", Phase::GeneralizedForce),
        ("composite_first_moment_rod2_y", Phase::CompositeInertia),
        ("mass_j1_j1", Phase::MassMatrix),
        ("kinetic_energy_rod2", Phase::KineticEnergy),
        ("acceleration_rod2_y", Phase::GivenAcceleration),
        ("balance_force_rod2_y", Phase::InverseDynamics),
        ("articulated_inertia_rod2_xx", Phase::ArticulatedInertia),
        ("articulated_bias_force_rod2_y", Phase::ArticulatedBiasForce),
    ] {
        assert_eq!(section(name), Section { subject: second, phase }, "{name}");
    }
}
