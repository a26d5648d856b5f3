//! The binder names intermediates, so that no expression is ever expanded.
//!
//! If the velocity of the n-th body of a chain were expanded, it would have some 3^n terms. Every phase
//! therefore binds what it computes: the algebra continues with a symbol, and the generated code gets a
//! statement with the name and the [`Section`] of the intermediate.

use std::collections::HashMap;
use std::sync::Arc;

use super::equations::{Binding, BindingId, Leaf};
use super::vector::{Tensor, Vector};
use super::wrench::Wrench;
use crate::laminate::{Formula, Geometry, Mechanism};
use crate::program::{Fact, Phase, Section};
use crate::source::codes::{self, Code};
use crate::source::{
    CoordinateId, Diagnostic, Diagnostics, InputId, JointId, MemoryId, ParameterId, PointId, Span,
    SpeedId,
};
use crate::symbolic::{Algebra, Expr, Tree};
use crate::topology::{NodeId, Topology};

/// The name and the section of an intermediate.
#[derive(Clone, Debug)]
pub struct Label {
    name: String,
    section: Section,
}

/// Binds intermediates, and collects the errors in the formulas of the model.
pub struct Binder<'a> {
    topology: &'a Topology,
    geometry: &'a Geometry,
    algebra: &'a mut Algebra<Leaf, Label>,
    symbols: Symbols,
    /// Names of the nodes, by node.
    names: Vec<String>,
    /// Names of the speeds.
    speeds: Vec<String>,
    facts: Vec<Fact>,
    /// Numbers of the drawing that depend on parameters, by the address of their formulas, which are kept alive.
    drawn: HashMap<*const Formula, (Arc<Formula>, Expr)>,
    problems: Diagnostics,
}

/// Symbols of the variables in the model's formulas.
struct Symbols {
    time: Expr,
    /// q.
    coordinates: Vec<Expr>,
    /// u.
    speeds: Vec<Expr>,
    parameters: Vec<Expr>,
    inputs: Vec<Expr>,
    /// What controllers remember.
    memory: Vec<Expr>,
    /// Positions of the output points, three numbers each, from when they are known.
    points: Vec<Expr>,
}

impl<'a> Binder<'a> {
    /// Creates a binder without any bindings.
    pub fn new(
        topology: &'a Topology,
        geometry: &'a Geometry,
        algebra: &'a mut Algebra<Leaf, Label>,
    ) -> Self {
        let mechanism = &topology.mechanism;
        let symbols = Symbols {
            time: algebra.leaf(Leaf::Time),
            coordinates: (0..mechanism.coordinates())
                .map(|index| algebra.leaf(Leaf::Position(CoordinateId(index))))
                .collect(),
            speeds: (0..mechanism.speeds())
                .map(|index| algebra.leaf(Leaf::Rate(SpeedId(index))))
                .collect(),
            parameters: (0..mechanism.parameters.len())
                .map(|index| algebra.leaf(Leaf::Parameter(ParameterId(index))))
                .collect(),
            inputs: (0..mechanism.inputs.len())
                .map(|index| algebra.leaf(Leaf::Input(InputId(index))))
                .collect(),
            memory: (0..mechanism.controllers.iter().map(|it| it.memory.len()).sum())
                .map(|index| algebra.leaf(Leaf::Memory(MemoryId(index))))
                .collect(),
            points: Vec::new(),
        };
        Self {
            topology,
            geometry,
            algebra,
            symbols,
            names: topology.node_names(),
            speeds: mechanism.speed_labels(),
            facts: Vec::new(),
            drawn: HashMap::new(),
            problems: Diagnostics::default(),
        }
    }

    /// Returns the tree and the loops.
    pub fn topology(&self) -> &'a Topology {
        self.topology
    }

    /// Returns what depends on parameters in the drawing.
    pub fn geometry(&self) -> &'a Geometry {
        self.geometry
    }

    /// Returns the expression of a number of the drawing.
    pub fn drawn(&self, formula: &Arc<Formula>) -> Option<Expr> {
        self.drawn.get(&Arc::as_ptr(formula)).map(|(_, known)| known.clone())
    }

    /// Notes the expression of a number of the drawing.
    pub fn note_drawn(&mut self, formula: &Arc<Formula>, expression: &Expr) {
        self.drawn.insert(Arc::as_ptr(formula), (formula.clone(), expression.clone()));
    }

    /// Returns the mechanism.
    pub fn mechanism(&self) -> &'a Mechanism {
        &self.topology.mechanism
    }

    /// Returns every node of the tree, parents before their children.
    pub fn nodes(&self) -> impl DoubleEndedIterator<Item = NodeId> + use<> {
        (0..self.topology.nodes.len()).map(NodeId)
    }

    /// Returns the name of a joint.
    pub fn joint_name(&self, joint: JointId) -> &'a str {
        &self.mechanism().joints[joint.index()].name
    }

    /// Returns a name of the speed at a place in u: `knee`, `hull_vx`.
    pub fn speed_name(&self, speed: usize) -> &str {
        &self.speeds[speed]
    }

    /// Returns the name of a node.
    pub fn node_name(&self, node: NodeId) -> &str {
        &self.names[node.index()]
    }

    /// Records a named number of the model.
    pub fn name(&mut self, fact: Fact) {
        self.facts.push(fact);
    }

    /// Takes the recorded numbers, in the order in which they were recorded.
    pub fn facts(&mut self) -> Vec<Fact> {
        std::mem::take(&mut self.facts)
    }

    /// Returns t, s.
    pub fn time(&self) -> Expr {
        self.symbols.time.clone()
    }

    /// Returns the coordinate at a place in q: that of a joint is the joint's.
    pub fn coordinate(&self, place: usize) -> Expr {
        self.symbols.coordinates[place].clone()
    }

    /// Returns the speed at a place in u: that of a joint is the joint's.
    pub fn speed(&self, place: usize) -> Expr {
        self.symbols.speeds[place].clone()
    }

    /// Returns a parameter of the model.
    pub fn parameter(&self, id: ParameterId) -> Expr {
        self.symbols.parameters[id.index()].clone()
    }

    /// Returns an input of the model.
    pub fn input(&self, id: InputId) -> Expr {
        self.symbols.inputs[id.index()].clone()
    }

    /// Returns what a controller remembers.
    pub fn memory(&self, id: MemoryId) -> Expr {
        self.symbols.memory[id.index()].clone()
    }

    /// Makes the positions of the output points known to formulas of controllers.
    pub fn know_points(&mut self, points: &[Expr]) {
        self.symbols.points = points.to_vec();
    }

    /// Returns a coordinate of an output point, m.
    pub fn place(&self, id: PointId, axis: usize) -> Expr {
        self.symbols.points[3 * id.index() + axis].clone()
    }

    /// Creates a symbol for a given quantity.
    pub fn given(&mut self, leaf: Leaf) -> Expr {
        self.algebra.leaf(leaf)
    }

    /// Returns a number, exactly.
    pub fn constant(&mut self, value: f64) -> Expr {
        self.algebra.number(value)
    }

    /// Returns the value of an expression that is a number, otherwise `None`.
    pub fn value(&self, value: &Expr) -> Option<f64> {
        self.algebra.value(value)
    }

    /// Binds an intermediate.
    pub fn bind(&mut self, section: Section, name: String, value: Expr) -> Expr {
        self.algebra.bind(value, Label { name, section })
    }

    /// Binds a scalar of a body: `kinetic_energy_left`.
    pub fn scalar(&mut self, node: NodeId, phase: Phase, name: &str, value: Expr) -> Expr {
        let name = format!("{name}_{}", self.names[node.index()]);
        self.bind(Section::body(node, phase), name, value)
    }

    /// Binds components of a quantity of a body: `omega_left_x`.
    pub fn components<const K: usize>(
        &mut self,
        node: NodeId,
        phase: Phase,
        name: &str,
        axes: [&str; K],
        value: [Expr; K],
    ) -> [Expr; K] {
        let mut axes = axes.into_iter();
        value.map(|component| {
            let axis = axes.next().unwrap_or_default();
            let name = format!("{name}_{}_{axis}", self.names[node.index()]);
            self.bind(Section::body(node, phase), name, component)
        })
    }

    /// Binds a vector of a body.
    pub fn vector(&mut self, node: NodeId, phase: Phase, name: &str, value: Vector) -> Vector {
        self.components(node, phase, name, ["x", "y", "z"], value)
    }

    /// Binds a symmetric tensor of a body.
    pub fn tensor(&mut self, node: NodeId, phase: Phase, name: &str, value: Tensor) -> Tensor {
        self.components(node, phase, name, ["xx", "xy", "xz", "yy", "yz", "zz"], value)
    }

    /// Binds a matrix of a body, row by row.
    pub fn matrix(
        &mut self,
        node: NodeId,
        phase: Phase,
        name: &str,
        [x, y, z]: [Vector; 3],
    ) -> [Vector; 3] {
        [
            self.components(node, phase, name, ["xx", "xy", "xz"], x),
            self.components(node, phase, name, ["yx", "yy", "yz"], y),
            self.components(node, phase, name, ["zx", "zy", "zz"], z),
        ]
    }

    /// Binds a wrench on a body: `bias_force_left_x`, `bias_moment_left_x`.
    pub fn wrench(&mut self, node: NodeId, phase: Phase, name: &str, value: Wrench) -> Wrench {
        Wrench {
            force: self.vector(node, phase, &format!("{name}_force"), value.force),
            moment: self.vector(node, phase, &format!("{name}_moment"), value.moment),
        }
    }

    /// Returns the partial derivative of a velocity by a speed, through all intermediates.
    pub fn by_speed(&mut self, value: &Expr, joint: JointId) -> Expr {
        let suffix = &self.mechanism().joints[joint.index()].name;
        let label = |label: &Label| Label {
            name: format!("{}_by_{suffix}", label.name),
            section: Section { phase: Phase::PartialVelocity, ..label.section },
        };
        let u = self.speed(joint.index());
        self.algebra.derivative(value, &u, &label)
    }

    /// Reports that the entry at `span` divides by zero.
    pub fn division_by_zero(&mut self, span: Option<Span>, what: &str) {
        let hint = "the divisor is zero for all values of t, q, u, parameters and inputs";
        self.undefined(codes::DIVISION_BY_ZERO, format!("{what} divides by zero"), hint, span);
    }

    /// Reports that a part of the entry at `span` is infinite or not a number.
    pub fn not_finite(&mut self, value: f64, span: Option<Span>, what: &str) {
        let hint = "it is so for all values of t, q, u, parameters and inputs";
        self.undefined(codes::NOT_FINITE, format!("a part of {what} is {value}"), hint, span);
    }

    fn undefined(&mut self, code: Code, what: String, hint: &str, span: Option<Span>) {
        let mut problem = Diagnostic::error(code, span.unwrap_or_default(), what).hint(hint);
        problem.span = span;
        self.problems.push(problem);
    }

    /// Takes the errors in the model's formulas.
    pub fn problems(&mut self) -> Diagnostics {
        std::mem::take(&mut self.problems)
    }

    /// Returns every intermediate, in the order in which they were bound.
    pub fn bindings(&self) -> Vec<Binding> {
        self.algebra
            .definitions(&bound)
            .into_iter()
            .map(|(label, tree)| Binding { name: label.name, section: label.section, tree })
            .collect()
    }

    /// Returns an expression as plain data.
    pub fn tree(&self, value: &Expr) -> Tree<Leaf> {
        self.algebra.tree(value, &bound)
    }

    /// Returns expressions as plain data.
    pub fn trees(&self, values: &[Expr]) -> Vec<Tree<Leaf>> {
        values.iter().map(|value| self.tree(value)).collect()
    }
}

fn bound(index: usize) -> Leaf {
    Leaf::Bound(BindingId(index))
}
