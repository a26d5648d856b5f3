//! The derivation in progress: symbols, bindings, and the names the generated code will carry.

use std::collections::HashMap;

use super::equations::{Binding, BindingId, Elimination, Equations, Leaf};
use super::frame::{Frame, frames};
use super::motion::{Motion, Placement};
use super::section::{Phase, Section};
use super::vector::Vector;
use super::{articulated, closure, dynamics, inverse};
use crate::laminate::Mechanism;
use crate::source::codes::{self, Code};
use crate::source::{Diagnostic, Diagnostics, InputId, JointId, ParameterId, Span};
use crate::symbolic::{self, Algebra, Expr, SessionError, Tree};
use crate::topology::{NodeId, Topology};

/// Why no equations could be derived.
#[derive(Debug, thiserror::Error)]
pub enum DeriveError {
    /// The symbolic engine is not to be had.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The model asks for something undefined.
    #[error("{0}")]
    Model(Diagnostics),
}

/// Derives the equations of motion.
///
/// # Errors
/// When the symbolic engine cannot be started, or an expression divides by zero wherever it is
/// evaluated.
pub fn derive(topology: &Topology) -> Result<Equations, DeriveError> {
    symbolic::session(|algebra| Derivation::new(topology, algebra).finish())?
        .map_err(DeriveError::Model)
}

/// What a binding is called and where it belongs.
#[derive(Clone, Debug)]
pub struct Label {
    name: String,
    section: Section,
}

/// One derivation.
pub struct Derivation<'a> {
    pub topology: &'a Topology,
    pub frames: Vec<Frame>,
    /// q, by joint.
    pub q: Vec<Expr>,
    /// u, by joint.
    pub u: Vec<Expr>,
    pub t: Expr,
    pub parameters: Vec<Expr>,
    pub inputs: Vec<Expr>,
    /// Given du/dt, by joint, and lambda, by closure row: symbols of the inverse dynamics only.
    pub accelerations: Vec<Expr>,
    pub multipliers: Vec<Expr>,
    /// sin q and cos q, by joint.
    pub sin_cos: Vec<[Expr; 2]>,
    /// Relative to an ancestor (`None`: the ground), by ancestor and node.
    pub motions: HashMap<(Option<NodeId>, NodeId), Motion>,
    pub placements: HashMap<(Option<NodeId>, NodeId), Placement>,
    /// As `motions`, at the given du/dt.
    pub accelerated: HashMap<(Option<NodeId>, NodeId), Motion>,
    pub problems: Diagnostics,
    algebra: &'a mut Algebra<Leaf, Label>,
    /// Symbols of constants, by the bits of their magnitudes.
    constants: HashMap<u64, Expr>,
    /// What those symbols, and their negatives, are.
    numbers: HashMap<Expr, f64>,
    names: Vec<String>,
}

impl<'a> Derivation<'a> {
    fn new(topology: &'a Topology, algebra: &'a mut Algebra<Leaf, Label>) -> Self {
        let mechanism = &topology.mechanism;
        let joints = || (0..mechanism.joints.len()).map(JointId);
        let t = algebra.leaf(Leaf::Time);
        let q = joints().map(|id| algebra.leaf(Leaf::Position(id))).collect();
        let u = joints().map(|id| algebra.leaf(Leaf::Rate(id))).collect();
        let parameters = (0..mechanism.parameters.len())
            .map(|index| algebra.leaf(Leaf::Parameter(ParameterId(index))))
            .collect();
        let inputs = (0..mechanism.inputs.len())
            .map(|index| algebra.leaf(Leaf::Input(InputId(index))))
            .collect();
        let mut derivation = Self {
            topology,
            frames: frames(topology),
            q,
            u,
            t,
            parameters,
            inputs,
            accelerations: Vec::new(),
            multipliers: Vec::new(),
            sin_cos: Vec::new(),
            motions: HashMap::new(),
            placements: HashMap::new(),
            accelerated: HashMap::new(),
            problems: Diagnostics::default(),
            algebra,
            constants: HashMap::new(),
            numbers: HashMap::new(),
            names: topology.node_names(),
        };
        derivation.bind_angles();
        derivation
    }

    /// Binds sin q and cos q of every joint, in the order of the tree.
    fn bind_angles(&mut self) {
        self.sin_cos = vec![[Expr::zero(), Expr::zero()]; self.q.len()];
        for (index, node) in self.topology.nodes.iter().enumerate() {
            let joint = node.joint.index();
            let q = [self.q[joint].clone()];
            let name = &self.mechanism().joints[joint].name;
            let names = [format!("sin_{name}"), format!("cos_{name}")];
            let functions = [symbolic::Function::Sin, symbolic::Function::Cos];
            for (k, (name, function)) in names.into_iter().zip(functions).enumerate() {
                let section = Section::body(NodeId(index), Phase::HingeAngle);
                self.sin_cos[joint][k] = self.bind(section, name, Expr::apply(function, &q));
            }
        }
    }

    fn finish(mut self) -> Result<Equations, Diagnostics> {
        let dynamics = dynamics::dynamics(&mut self);
        let closure = closure::closure(&mut self);
        let poses = self.poses();
        let points = self.points();
        let drives = self.drives();
        self.give_accelerations();
        let inverse = inverse::inverse(&mut self, &dynamics);
        let elimination = articulated::articulated(&mut self, &dynamics);
        if self.problems.has_errors() {
            return Err(self.problems);
        }
        Ok(Equations {
            topology: self.topology.clone(),
            mass: self.trees(&dynamics.mass),
            forcing: self.trees(&dynamics.forcing),
            jacobian: self.trees(&closure.jacobian),
            gamma: self.trees(&closure.gamma),
            elimination: Elimination {
                inverse_pivots: self.trees(&elimination.inverse_pivots),
                reduced: self.trees(&elimination.reduced),
                reduced_rows: self.trees(&elimination.reduced_rows),
                accelerations: self.trees(&elimination.accelerations),
            },
            row_residual: self.trees(&closure.row_residual),
            row_velocity: self.trees(&closure.row_velocity),
            residual: self.trees(&closure.residual),
            residual_jacobian: self.trees(&closure.residual_jacobian),
            poses: self.trees(&poses),
            points: self.trees(&points),
            drives: self.trees(&drives),
            imbalance: self.trees(&inverse.imbalance),
            opening: self.trees(&inverse.opening),
            reactions: self.trees(&inverse.reactions),
            kinetic_energy: self.tree(&dynamics.kinetic_energy),
            potential_energy: self.tree(&dynamics.potential_energy),
            bindings: self.bindings(),
        })
    }

    /// Makes the symbols of the inverse dynamics, last: terms are ordered by the age of their
    /// symbols, and the rest should not depend on these.
    fn give_accelerations(&mut self) {
        let joints = (0..self.q.len()).map(JointId).map(Leaf::Acceleration);
        self.accelerations = joints.map(|leaf| self.algebra.leaf(leaf)).collect();
        let rows: usize = self.topology.loops.iter().map(|closed| closed.rows.len()).sum();
        self.multipliers = (0..rows).map(|row| self.algebra.leaf(Leaf::Multiplier(row))).collect();
    }

    /// Prescribed angles of the driven joints, in their order.
    fn drives(&mut self) -> Vec<Expr> {
        let mechanism = self.mechanism();
        let driven =
            mechanism.joints.iter().filter_map(|joint| Some((joint, joint.drive.as_ref()?)));
        driven
            .map(|(joint, drive)| {
                self.scalar(drive, &format!("drive_{}", joint.name), Some(joint.span))
            })
            .collect()
    }

    /// The mechanism.
    pub fn mechanism(&self) -> &'a Mechanism {
        &self.topology.mechanism
    }

    /// The number `value`, exactly; -1, 0 and 1 as such, others as symbols.
    pub fn constant(&mut self, value: f64) -> Expr {
        if value == 0.0 || value.abs() == 1.0 {
            return Expr::integer(value as i64);
        }
        let magnitude = value.abs();
        let (algebra, numbers) = (&mut *self.algebra, &mut self.numbers);
        let symbol = self.constants.entry(magnitude.to_bits()).or_insert_with(|| {
            let symbol = algebra.leaf(Leaf::Constant(magnitude));
            numbers.insert(symbol.clone(), magnitude);
            numbers.insert(-&symbol, -magnitude);
            symbol
        });
        if value < 0.0 { -&*symbol } else { symbol.clone() }
    }

    /// Constants, componentwise.
    pub fn constants<const K: usize>(&mut self, values: [f64; K]) -> [Expr; K] {
        values.map(|value| self.constant(value))
    }

    /// Names an expression.
    pub fn bind(&mut self, section: Section, name: String, value: Expr) -> Expr {
        self.algebra.bind(value, Label { name, section })
    }

    /// Names the components of a vector of a node: `omega_left_x`.
    pub fn bind_vector(&mut self, node: NodeId, phase: Phase, name: &str, value: Vector) -> Vector {
        let body = self.names[node.index()].clone();
        let mut axes = ["x", "y", "z"].into_iter();
        value.map(|component| {
            let axis = axes.next().unwrap_or_default();
            self.bind(Section::body(node, phase), format!("{name}_{body}_{axis}"), component)
        })
    }

    /// Names an unbound intermediate of a node.
    pub fn bind_scalar(&mut self, node: NodeId, phase: Phase, name: &str, value: Expr) -> Expr {
        let name = format!("{name}_{}", self.names[node.index()]);
        self.bind(Section::body(node, phase), name, value)
    }

    /// The partial derivative of an expression by a speed, through every binding.
    pub fn by_speed(&mut self, phase: Phase, value: &Expr, joint: JointId) -> Expr {
        let suffix = &self.mechanism().joints[joint.index()].name;
        let label = |label: &Label| Label {
            name: format!("{}_by_{suffix}", label.name),
            section: Section { phase, ..label.section },
        };
        let u = self.u[joint.index()].clone();
        self.algebra.derivative(value, &u, &label)
    }

    /// The number that an expression is, if it is one: -1, 0, 1 or a constant's symbol.
    pub fn value(&self, value: &Expr) -> Option<f64> {
        match value.as_integer() {
            Some(number) => Some(number as f64),
            None => self.numbers.get(value).copied(),
        }
    }

    /// Reports that the entry at `span` divides by zero.
    pub fn division_by_zero(&mut self, span: Option<Span>, what: &str) {
        let hint = "the divisor is zero whatever t, q, u, parameters and inputs are";
        self.undefined(codes::DIVISION_BY_ZERO, format!("{what} divides by zero"), hint, span);
    }

    /// Reports that a part of the entry at `span` is infinite or not a number.
    pub fn not_finite(&mut self, value: f64, span: Option<Span>, what: &str) {
        let hint = "it is so whatever t, q, u, parameters and inputs are";
        self.undefined(codes::NOT_FINITE, format!("a part of {what} is {value}"), hint, span);
    }

    fn undefined(&mut self, code: Code, what: String, hint: &str, span: Option<Span>) {
        let mut problem = Diagnostic::error(code, span.unwrap_or_default(), what).hint(hint);
        problem.span = span;
        // The law of a joint is read for the motion and for the balance.
        if !self.problems.0.contains(&problem) {
            self.problems.push(problem);
        }
    }

    fn bindings(&self) -> Vec<Binding> {
        self.algebra
            .definitions(&bound)
            .into_iter()
            .map(|(label, tree)| Binding { name: label.name, section: label.section, tree })
            .collect()
    }

    fn tree(&self, value: &Expr) -> Tree<Leaf> {
        self.algebra.tree(value, &bound)
    }

    fn trees(&self, values: &[Expr]) -> Vec<Tree<Leaf>> {
        values.iter().map(|value| self.tree(value)).collect()
    }
}

fn bound(index: usize) -> Leaf {
    Leaf::Bound(BindingId(index))
}
