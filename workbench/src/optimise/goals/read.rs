//! Text -> goals, with diagnostics.

use lamc::pipeline::Compiled;
use lamc::program::Interface;
use lamc::source::fields::{Fields, array, entries};
use lamc::source::yaml::{self, Entry, Node};
use lamc::source::{
    Code, Diagnostic, Diagnostics, Expression, ParameterId, SourceFile, Span, codes, read_as,
};

use super::keys::{CONSTRAINT, GOAL, GOALS, NORMS, VARIABLE};
use super::measures::MEASURES;
use super::{Aim, Constraint, Goal, Goals, MOST_ROBOTS, MOST_STARTS, Norm, Variable, Wanted};
use crate::execution::Jit;
use crate::reading::Terms;
use crate::sweep::plan::{Quantities, Target, Varied, distributions};

/// What a file of goals needs.
const NEEDED: &str = "a file of goals needs `parameters` and `goals`";

pub fn goals(file: &SourceFile, compiled: &Compiled) -> Result<Goals, Diagnostics> {
    let (root, found) = yaml::parse(&file.text).map_err(|mut found| {
        let empty = found.0.iter_mut().filter(|found| found.code == codes::EMPTY_FILE);
        empty.for_each(|found| found.hint = Some(NEEDED.to_owned()));
        found
    })?;
    let interface = &compiled.program.interface;
    let mut reader = Reader { file, compiled, interface, found };
    let goals = reader.goals(&root);
    match goals {
        Some(goals) if !reader.found.has_errors() => Ok(goals),
        _ => Err(reader.found),
    }
}

pub(super) struct Reader<'c> {
    pub(super) file: &'c SourceFile,
    pub(super) compiled: &'c Compiled,
    pub(super) interface: &'c Interface,
    pub(super) found: Diagnostics,
}

impl Terms for Reader<'_> {
    fn found(&mut self) -> &mut Diagnostics {
        &mut self.found
    }

    fn code(&self) -> Code {
        codes::BAD_GOALS
    }
}

impl Reader<'_> {
    fn goals(&mut self, root: &Node) -> Option<Goals> {
        let fields = Fields::new(root, root.span, "a file of goals", &GOALS, &mut self.found)?;
        if let Err(reason) = self.interface.without_free("optimisations") {
            self.wrong(root.span, reason);
            return None;
        }
        let named = |key, found: &mut Diagnostics| fields.read(key, found);
        let varied = named("parameters", &mut self.found);
        let variables = entries(varied, "ranges", &mut self.found);
        let variables: Vec<_> = variables.iter().filter_map(|entry| self.variable(entry)).collect();
        let aims = named("goals", &mut self.found);
        let goals = entries(aims, "goals", &mut self.found);
        let goals: Vec<_> = goals.iter().filter_map(|entry| self.goal(entry)).collect();
        for (node, what) in [(varied, "parameter"), (aims, "goal")] {
            let is_empty = node.is_some_and(|node| matches!(&node.content, yaml::Content::Mapping(entries) if entries.is_empty()));
            if let Some(node) = node.filter(|_| is_empty) {
                self.wrong(node.span, format!("at least one {what} is needed"));
            }
        }
        let constraints = self.all_constraints(fields.get("constraints"));
        let norm = self.word(&fields, "norm", NORMS).map(|word| match word {
            "max" => Norm::Max,
            _ => Norm::Squares,
        });
        let (starts, seed) = (self.whole(&fields, "starts"), self.whole(&fields, "seed"));
        if let Some(node) = fields.get("starts")
            && starts.is_some_and(|starts| !(1..=MOST_STARTS).contains(&starts))
        {
            self.wrong(node.span, format!("`starts` must be 1 to {MOST_STARTS}"));
        }
        let tolerances = self.tolerances(fields.get("tolerances"));
        let robust = self.robust(&fields, tolerances.is_empty());
        let robots = self.whole(&fields, "robots");
        if let Some(node) = fields.get("robots")
            && robots.is_some_and(|robots| !(2..=MOST_ROBOTS).contains(&robots))
        {
            self.wrong(node.span, format!("`robots` must be 2 to {MOST_ROBOTS}"));
        }
        // What the ends of a range make of the drawing is reported where everything else is right.
        if !self.found.has_errors() {
            variables.iter().for_each(|variable| self.is_possible(variable));
        }
        Some(Goals {
            variables,
            goals,
            constraints,
            norm: norm?,
            starts: starts?,
            seed: seed?,
            tolerances,
            robust,
            robots: robots?,
        })
    }

    /// The constraints, which can be kept together as far as they are about the same number.
    fn all_constraints(&mut self, node: Option<&Node>) -> Vec<Constraint> {
        let mut constraints = Vec::new();
        for entry in entries(node, "constraints", &mut self.found) {
            for constraint in self.constraints(entry) {
                self.agree(&constraints, &constraint, entry.key.span);
                constraints.push((constraint, entry.key.span));
            }
        }
        constraints.into_iter().map(|(constraint, _)| constraint).collect()
    }

    /// The tolerances of parameters.
    fn tolerances(&mut self, node: Option<&Node>) -> Vec<Varied> {
        let system = Jit::new(&self.compiled.program);
        let mut quantities = Quantities::of(self.compiled, &system, &[]);
        quantities.0.retain(|it| matches!(it.target, Target::Parameter(_)));
        let terms = (self.compiled.numbers.angle, codes::BAD_GOALS);
        distributions(node, &quantities, terms, &mut self.found)
    }

    /// How many standard deviations are added.
    fn robust(&mut self, fields: &Fields, is_exact: bool) -> Option<f64> {
        let entry = fields.entry("robust")?;
        let deviations = self.number(fields, "robust", "%")?;
        if deviations < 0.0 {
            self.wrong(entry.value.span, "`robust` must not be negative");
        }
        if is_exact {
            let message = "`robust` needs `tolerances`";
            let error = Diagnostic::error(codes::BAD_GOALS, entry.key.span, message);
            let hint =
                "say by how much built robots differ: `tolerances: { crank: { normal: 0.05 mm } }`";
            self.found.push(error.hint(hint));
        }
        Some(deviations)
    }

    fn variable(&mut self, entry: &Entry) -> Option<Variable> {
        let (name, span) = (entry.key.value.clone(), entry.key.span);
        let interface = self.interface;
        let known: Vec<&str> = interface.parameters.iter().map(|it| it.name.as_str()).collect();
        let parameter = self.name(span, &name, &known, "parameter");
        let owner = format!("the parameter `{name}`");
        let fields = Fields::new(&entry.value, span, owner, &VARIABLE, &mut self.found)?;
        let own = self.compiled.numbers.ranges.get(&name).copied();
        let varied = Expression::Parameter(ParameterId(parameter?));
        let joints = &self.compiled.topology.mechanism.joints;
        let mut drives = joints.iter().filter_map(|joint| joint.drive.as_ref());
        if drives.any(|drive| drive.contains(&varied)) {
            self.wrong(span, format!("a prescribed angle depends on `{name}`: it cannot vary"));
        }
        let (bounds, span) = match fields.get("range") {
            Some(node) => {
                let [low, high] = array(node, "`[lowest, highest]`", &mut self.found)?;
                let ends = [low, high].map(|node| self.value(node, &name));
                let [Some(low), Some(high)] = ends else { return None };
                ([low, high], node.span)
            }
            None => match own {
                Some(range) => (range, span),
                None => {
                    let message = format!("`{name}` has no range, neither here nor in the model");
                    let error = Diagnostic::error(codes::BAD_GOALS, span, message);
                    let hint = format!("write `{name}: {{ range: [lowest, highest] }}`");
                    self.found.push(error.hint(hint));
                    return None;
                }
            },
        };
        let [low, high] = bounds;
        if low >= high {
            let error = Diagnostic::error(
                codes::BAD_GOALS,
                span,
                format!("the range of `{name}` is empty"),
            );
            self.found.push(error.hint("write the lower value first, and two different values"));
        }
        if let Some([least, most]) = own.filter(|[least, most]| low < *least || high > *most) {
            let message = format!(
                "the range of `{name}` goes beyond that of the model, {least} to {most} in SI units"
            );
            let error = Diagnostic::error(codes::BAD_GOALS, span, message);
            self.found.push(error.hint("narrow this range, or widen that of the model"));
        }
        Some(Variable { name, parameter: parameter?, bounds, span })
    }

    /// A value of a parameter, SI.
    fn value(&mut self, node: &Node, name: &str) -> Option<f64> {
        let dimension = self.compiled.numbers.dimensions.get(name).copied();
        let read = match node.scalar().filter(|_| !node.is_null()) {
            Some(scalar) => read_as(scalar.text.trim(), dimension),
            None => Err("expected a number".to_owned()),
        };
        read.map_err(|reason| self.not_a_number(node, reason)).ok()
    }

    /// Reports an end of a range at which the drawing is impossible or another mechanism.
    fn is_possible(&mut self, variable: &Variable) {
        let parameters = &self.interface.parameters;
        for end in variable.bounds {
            let mut values: Vec<f64> = parameters.iter().map(|known| known.value).collect();
            values[variable.parameter] = end;
            if let Err(problems) = self.compiled.topology_at(&values) {
                let why = problems.0.first().map_or("", |problem| problem.message.as_str());
                let dimension = self.compiled.numbers.dimensions.get(&variable.name);
                let unit = dimension.map_or(String::new(), |dimension| dimension.si_unit());
                let message = format!("`{}` = {end} {unit} is not possible: {why}", variable.name);
                let error = Diagnostic::error(codes::BAD_GOALS, variable.span, message);
                self.found.push(error.hint("narrow the range"));
                return;
            }
        }
    }

    fn goal(&mut self, entry: &Entry) -> Option<Goal> {
        let (name, span) = (entry.key.value.clone(), entry.key.span);
        let owner = format!("the goal `{name}`");
        let known = self.found.0.len();
        let fields = Fields::new(&entry.value, span, owner, &GOAL, &mut self.found)?;
        let weight = self.number(&fields, "weight", "%");
        let aim = match fields.entry("path") {
            Some(path) => {
                for key in MEASURES.iter().chain(&["target", "at_most", "at_least"]) {
                    if let Some(other) = fields.entry(key) {
                        self.wrong(other.key.span, format!("a path has no `{key}`"));
                    }
                }
                Aim::Path(self.path(path)?)
            }
            None => {
                let measure = self.measure(&fields, span, known)?;
                let wanted = self.wanted(&fields, measure);
                let [wanted] = wanted.as_slice() else {
                    let hint = "give one of `target`, `at_most` and `at_least`";
                    self.unless_told(span, known, hint);
                    return None;
                };
                Aim::Number(measure, *wanted)
            }
        };
        let within = self.within(&fields, &aim);
        Some(Goal { name, weight: weight?, aim, within })
    }

    /// Reports a limit that cannot be kept together with an earlier one of the same number.
    fn agree(&mut self, others: &[(Constraint, Span)], constraint: &Constraint, at: Span) {
        let contradicts = |other: &Constraint| match (other.wanted, constraint.wanted) {
            (Wanted::AtMost(most), Wanted::AtLeast(least))
            | (Wanted::AtLeast(least), Wanted::AtMost(most)) => least > most,
            _ => false,
        };
        let of_same = others.iter().filter(|(other, _)| other.measure == constraint.measure);
        if let Some((other, span)) = of_same.into_iter().find(|(other, _)| contradicts(other)) {
            let message = format!("no number keeps both limits of `{}`", constraint.name);
            let error = Diagnostic::error(codes::BAD_GOALS, at, message);
            let error = match other.name == constraint.name {
                true => error,
                false => error.also(*span, "the other limit"),
            };
            self.found.push(error.hint("`at_least` must not be more than `at_most`"));
        }
    }

    /// How far a built robot may be from what a goal aims at.
    fn within(&mut self, fields: &Fields, aim: &Aim) -> Option<f64> {
        let entry = fields.entry("within")?;
        let node = &entry.value;
        let read = match aim {
            Aim::Path(_) => self.read(node, "m"),
            Aim::Number(measure, Wanted::Target(_)) => self.number_of(*measure, node),
            Aim::Number(..) => {
                self.wrong(entry.key.span, "a limit needs no `within`: robots keep it or not");
                return None;
            }
        };
        if read.is_some_and(|within| within <= 0.0) {
            self.wrong(node.span, "`within` must be more than 0");
        }
        read
    }

    fn constraints(&mut self, entry: &Entry) -> Vec<Constraint> {
        let (name, span) = (&entry.key.value, entry.key.span);
        let owner = format!("the constraint `{name}`");
        let known = self.found.0.len();
        let fields = Fields::new(&entry.value, span, owner, &CONSTRAINT, &mut self.found);
        let Some(fields) = fields else { return Vec::new() };
        let Some(measure) = self.measure(&fields, span, known) else { return Vec::new() };
        let wanted = self.wanted(&fields, measure);
        if wanted.is_empty() {
            self.unless_told(span, known, "give `at_most` or `at_least`");
        }
        let named = wanted.into_iter();
        named.map(|wanted| Constraint { name: name.clone(), measure, wanted }).collect()
    }

    /// Reports what is missing, unless another mistake has been found since there were `known`.
    pub(super) fn unless_told(&mut self, at: Span, known: usize, message: impl Into<String>) {
        if self.found.0.len() == known {
            self.wrong(at, message);
        }
    }
}
