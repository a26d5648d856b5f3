//! The variables of an FMU, with their attributes in the model description.

use serde::Serialize;

use super::{Key, Layout, QUATERNION, STEP};
use crate::program::Interface;
use crate::source::free::{COORDINATE_NAMES, COORDINATES, SPEED_NAMES, SPEEDS};

/// A scalar variable, with its attributes in the model description.
#[derive(Clone, Serialize)]
pub struct Variable {
    pub name: String,
    pub reference: usize,
    pub description: String,
    pub causality: &'static str,
    pub variability: &'static str,
    pub initial: Option<&'static str>,
    pub unit: Option<&'static str>,
    pub start: Option<String>,
    pub derivative_of: Option<Key>,
    pub is_state: bool,
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
pub fn variables(interface: &Interface, layout: &Layout) -> Vec<Variable> {
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
    for index in 0..interface.joints.len() {
        let variables = joint(interface, layout, index, all.len() + 1);
        all.extend(variables);
    }
    for index in 0..interface.free.len() {
        let variables = free_body(interface, layout, index, all.len() + 1);
        all.extend(variables);
    }
    all.extend(points(interface, layout));
    let energy = |kind: &str, reference, what: &str| {
        Variable::new(format!("energy.{kind}"), reference, what).unit("J")
    };
    all.push(energy("kinetic", layout.kinetic, "Kinetic energy"));
    all.push(energy("potential", layout.potential, "Energy of gravity and springs"));
    all.extend(contacts(interface, layout));
    if !interface.free.is_empty() {
        all.extend(momentum(layout));
    }
    for joint in interface.driven() {
        let name = &interface.joints[joint.index()].name;
        let description = format!("Torque of the motor that drives joint {name}");
        let reference = layout.motors + joint.index();
        all.push(Variable::new(format!("motor.{name}"), reference, description).unit("N.m"));
    }
    all
}

/// Returns the variables of a joint. `first` is the position of the first among all variables, counted from 1.
fn joint(interface: &Interface, layout: &Layout, index: usize, first: usize) -> [Variable; 3] {
    let joint = &interface.joints[index];
    let variable = |letter: char, reference: usize, what: &str| {
        let description = format!("{what} of joint {}", joint.name);
        Variable::new(format!("joints.{}.{letter}", joint.name), reference, description)
    };
    let key = |reference: usize, after: usize| Some(Key { index: first + after, reference });
    let guess = |value: f64| (!joint.driven).then_some(value);
    let q = variable('q', layout.q + index, "Angle").unit("rad").state(guess(joint.initial_q));
    let mut u =
        variable('u', layout.u + index, "Speed").unit("rad/s").state(guess(joint.initial_u));
    let mut a = variable('a', layout.a + index, "Acceleration").unit("rad/s2");
    u.derivative_of = key(q.reference, 0);
    a.derivative_of = key(u.reference, 1);
    [q, u, a]
}

/// Returns the variables of a free body. `first` is the position of the first among all variables, counted from 1.
fn free_body(interface: &Interface, layout: &Layout, index: usize, first: usize) -> Vec<Variable> {
    let (body, joints) = (&interface.free[index], interface.joints.len());
    let (q, u) = (layout.q + joints + COORDINATES * index, layout.u + joints + SPEEDS * index);
    let (a, rates) = (u - layout.u + layout.a, layout.rates + QUATERNION * index);
    let moves = COORDINATES - QUATERNION;
    let coordinate = |k: usize| Key { index: first + k, reference: q + k };
    let speed = |k: usize| Key { index: first + COORDINATES + k, reference: u + k };
    let variable = |part: &str, reference: usize, what: &str| {
        let description = format!("{what} of body {}", body.name);
        Variable::new(format!("bodies.{}.{part}", body.name), reference, description)
    };
    let mut all = Vec::new();
    for (k, part) in COORDINATE_NAMES.into_iter().enumerate() {
        let part = format!("q.{part}");
        let coordinate = match k < moves {
            true => variable(&part, q + k, "Displacement of the centre of mass").unit("m"),
            false => variable(&part, q + k, "Quaternion"),
        };
        all.push(coordinate.state(Some(body.q[k])));
    }
    for (k, part) in SPEED_NAMES.into_iter().enumerate() {
        let part = format!("u.{part}");
        let speed = match k < moves {
            true => variable(&part, u + k, "Velocity of the centre of mass").unit("m/s"),
            false => variable(&part, u + k, "Angular velocity in the frame").unit("rad/s"),
        };
        let mut speed = speed.state(Some(body.u[k]));
        speed.derivative_of = (k < moves).then(|| coordinate(k));
        all.push(speed);
    }
    for (k, part) in SPEED_NAMES.into_iter().enumerate() {
        let unit = if k < moves { "m/s2" } else { "rad/s2" };
        let mut acceleration = variable(&format!("a.{part}"), a + k, "Acceleration").unit(unit);
        acceleration.derivative_of = Some(speed(k));
        all.push(acceleration);
    }
    for (k, part) in COORDINATE_NAMES.into_iter().skip(moves).enumerate() {
        let mut rate = variable(part, rates + k, "Rate of the quaternion").unit("1/s");
        rate.name = format!("der(bodies.{}.q.{part})", body.name);
        rate.derivative_of = Some(coordinate(moves + k));
        all.push(rate);
    }
    all
}

/// Returns the variables of the output points.
fn points(interface: &Interface, layout: &Layout) -> Vec<Variable> {
    let mut all = Vec::new();
    for (i, point) in interface.points.iter().enumerate() {
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let name = format!("points.{point}.{axis}");
            let description = format!("Position of point {point} in the base frame");
            all.push(Variable::new(name, layout.points + 3 * i + k, description).unit("m"));
        }
    }
    all
}

/// Returns the variables of the contact points.
fn contacts(interface: &Interface, layout: &Layout) -> Vec<Variable> {
    let mut all = Vec::new();
    for (i, contact) in interface.contacts.iter().enumerate() {
        for (k, part) in ["x", "y", "z", "fx", "fy", "fz"].into_iter().enumerate() {
            let (what, unit) =
                if k < 3 { ("Position of", "m") } else { ("Force on the body at", "N") };
            let description = format!("{what} contact point {contact} in the base frame");
            let reference = layout.contacts + 6 * i + k;
            let name = format!("contacts.{contact}.{part}");
            all.push(Variable::new(name, reference, description).unit(unit));
        }
    }
    all
}

/// Returns the variables of the centre of mass and of the momenta.
fn momentum(layout: &Layout) -> Vec<Variable> {
    let groups = [
        ("centre", "Centre of mass of all moving bodies", "m"),
        ("linear", "Linear momentum", "kg.m/s"),
        ("angular", "Angular momentum about the centre of mass", "kg.m2/s"),
    ];
    let mut all = Vec::new();
    for (i, (group, what, unit)) in groups.into_iter().enumerate() {
        for (k, axis) in ["x", "y", "z"].into_iter().enumerate() {
            let description = format!("{what} in the base frame");
            let reference = layout.momentum + 3 * i + k;
            let name = format!("momentum.{group}.{axis}");
            all.push(Variable::new(name, reference, description).unit(unit));
        }
    }
    all
}
