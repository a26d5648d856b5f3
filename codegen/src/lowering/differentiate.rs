//! Differentiation of a function: forward, instruction by instruction.
//!
//! Each value v gets a companion dv, the derivative along a direction, by the rules of the
//! calculus; where every dv of an operand is zero, so is its own and nothing is written. The
//! outputs become the companions of the old ones. Unneeded companions go with dead code.
//!
//! After A. Griewank and A. Walther, "Evaluating Derivatives", 2008, section 3.1.
//!
//! Where a function has a corner (`abs`, `min`, `max`) its derivative is that of the side of the
//! larger argument; at a pole (`sqrt` of 0) it is infinite. That of a step is 0, also at the step.

use crate::program::{Function, Instruction, Interface, Moving, Op, Phase, Section, Slot, Value};
use crate::source::free::{COORDINATES, SPEEDS};
use crate::source::{CoordinateId, SpeedId};

/// Coordinates of the position and speeds of the velocity of a free body, before those of its orientation.
const LINEAR: usize = 3;

/// Prefix of the name of a derivative: `d_omega_left_x`.
pub const CHANGE_OF: &str = "d_";

/// The derivative along the direction that the [`Slot::Change`]s give, du/dt and lambda constant.
pub fn along_changes(function: Function, directions: &Directions) -> Function {
    differentiate(function, |forward, slot, section| {
        let moving = match slot {
            Slot::Time => Moving::Time,
            Slot::Position(id) => return Some(directions.change(forward, id, section)),
            Slot::Rate(id) => Moving::Rate(id),
            Slot::Parameter(id) => Moving::Parameter(id),
            Slot::Input(id) => Moving::Input(id),
            // What follows from the parameters is differentiated before it moves out of the function.
            Slot::Drawn(_)
            | Slot::Acceleration(_)
            | Slot::Multiplier(_)
            | Slot::Memory(_)
            | Slot::Change(_) => {
                return None;
            }
        };
        Some(forward.push(Op::Load(Slot::Change(moving)), section))
    })
}

/// The derivative by t, all else constant.
pub fn by_time(function: Function) -> Function {
    differentiate(function, |forward, slot, section| {
        (slot == Slot::Time).then(|| forward.push(Op::Const(1.0), section))
    })
}

/// The derivative by a speed, all else constant.
pub fn by_speed(function: Function, speed: SpeedId) -> Function {
    differentiate(function, |forward, slot, section| {
        (slot == Slot::Rate(speed)).then(|| forward.push(Op::Const(1.0), section))
    })
}

/// How coordinates change along directions of u.
pub struct Directions {
    joints: usize,
}

impl Directions {
    /// Those of a mechanism.
    pub fn of(interface: &Interface) -> Self {
        Self { joints: interface.joints.len() }
    }

    /// The change of a coordinate: that of its speed, for a quaternion p that of p (0, w) / 2.
    fn change(&self, forward: &mut Forward, id: CoordinateId, section: Section) -> Value {
        let mut load = |slot| forward.push(Op::Load(slot), section);
        let mut along = |speed| load(Slot::Change(Moving::Position(SpeedId(speed))));
        let Some(beyond) = id.index().checked_sub(self.joints) else { return along(id.index()) };
        let (body, part) = (beyond / COORDINATES, beyond % COORDINATES);
        let [q, u] = [COORDINATES, SPEEDS].map(|count| self.joints + count * body);
        let Some(component) = part.checked_sub(LINEAR) else { return along(u + part) };
        // Factors of w: which component of p, and its sign.
        const TERMS: [[(usize, bool); 3]; 4] = [
            [(1, true), (2, true), (3, true)],
            [(0, false), (3, true), (2, false)],
            [(3, false), (0, false), (1, true)],
            [(2, true), (1, false), (0, false)],
        ];
        let turns: [Value; 3] = std::array::from_fn(|k| along(u + LINEAR + k));
        let mut sum = None;
        for (turn, (factor, negative)) in turns.into_iter().zip(TERMS[component]) {
            let slot = Slot::Position(CoordinateId(q + LINEAR + factor));
            let factor = forward.push(Op::Load(slot), section);
            let term = forward.push(Op::Mul(factor, turn), section);
            sum = Some(match (sum, negative) {
                (None, false) => term,
                (None, true) => forward.push(Op::Neg(term), section),
                (Some(sum), false) => forward.push(Op::Add(sum, term), section),
                (Some(sum), true) => forward.push(Op::Sub(sum, term), section),
            });
        }
        let half = forward.push(Op::Const(0.5), section);
        match sum {
            Some(sum) => forward.push(Op::Mul(half, sum), section),
            None => half,
        }
    }
}

/// Differentiates; `seed` writes the derivative of a slot, if it has one.
fn differentiate(
    function: Function,
    seed: impl Fn(&mut Forward, Slot, Section) -> Option<Value>,
) -> Function {
    let mut forward = Forward { instructions: Vec::with_capacity(3 * function.instructions.len()) };
    let mut primal: Vec<Value> = Vec::with_capacity(function.instructions.len());
    let mut tangent: Vec<Option<Value>> = Vec::with_capacity(function.instructions.len());
    for instruction in function.instructions {
        let Instruction { op, section, name } = instruction;
        let change = name.as_ref().map(|name| format!("{CHANGE_OF}{name}"));
        let value = forward.push(op.map(|x| primal[x.index()]), section);
        forward.instructions[value.index()].name = name;
        let derivative = match op {
            Op::Load(slot) => seed(&mut forward, slot, section),
            op => {
                let of = |x: Value| (primal[x.index()], tangent[x.index()]);
                Rule { forward: &mut forward, section }.derivative(op, value, of)
            }
        };
        if let Some(derivative) = derivative {
            let named = &mut forward.instructions[derivative.index()];
            if !matches!(named.op, Op::Load(_) | Op::Const(_)) && named.name.is_none() {
                named.name = change;
            }
        }
        primal.push(value);
        tangent.push(derivative);
    }
    let mut outputs = function.outputs;
    for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
        *entry = match tangent[entry.index()] {
            Some(value) => value,
            None => forward.push(Op::Const(0.0), Section::mechanism(Phase::Output)),
        };
    }
    Function { kind: function.kind, instructions: forward.instructions, outputs }
}

struct Forward {
    instructions: Vec<Instruction>,
}

impl Forward {
    fn push(&mut self, op: Op, section: Section) -> Value {
        self.instructions.push(Instruction { op, section, name: None });
        Value(self.instructions.len() - 1)
    }
}

/// Writes the derivative of one operation.
struct Rule<'a> {
    forward: &'a mut Forward,
    section: Section,
}

impl Rule<'_> {
    fn push(&mut self, op: Op) -> Value {
        self.forward.push(op, self.section)
    }

    fn constant(&mut self, number: f64) -> Value {
        self.push(Op::Const(number))
    }

    /// The derivative of `op`, whose value is `value`; `of` gives an operand and its derivative.
    fn derivative(
        &mut self,
        op: Op,
        value: Value,
        of: impl Fn(Value) -> (Value, Option<Value>),
    ) -> Option<Value> {
        match op {
            Op::Const(_) | Op::Load(_) | Op::Step(_) => None,
            Op::Neg(x) => of(x).1.map(|dx| self.push(Op::Neg(dx))),
            Op::Add(x, y) => match (of(x).1, of(y).1) {
                (Some(dx), Some(dy)) => Some(self.push(Op::Add(dx, dy))),
                (dx, dy) => dx.or(dy),
            },
            Op::Sub(x, y) => match (of(x).1, of(y).1) {
                (Some(dx), Some(dy)) => Some(self.push(Op::Sub(dx, dy))),
                (None, Some(dy)) => Some(self.push(Op::Neg(dy))),
                (dx, None) => dx,
            },
            Op::Mul(x, y) => {
                let ((x, dx), (y, dy)) = (of(x), of(y));
                let left = dx.map(|dx| self.push(Op::Mul(dx, y)));
                let right = dy.map(|dy| self.push(Op::Mul(x, dy)));
                self.sum(left, right)
            }
            // d(x / y) = (dx - (x / y) dy) / y
            Op::Div(x, y) => {
                let ((_, dx), (y, dy)) = (of(x), of(y));
                let carried = dy.map(|dy| self.push(Op::Mul(value, dy)));
                let above = match (dx, carried) {
                    (Some(dx), Some(carried)) => Some(self.push(Op::Sub(dx, carried))),
                    (None, Some(carried)) => Some(self.push(Op::Neg(carried))),
                    (dx, None) => dx,
                };
                above.map(|above| self.push(Op::Div(above, y)))
            }
            Op::Max(x, y) => self.blend((of(x).0, of(y).0), of(x).1, of(y).1),
            Op::Min(x, y) => self.blend((of(y).0, of(x).0), of(x).1, of(y).1),
            Op::Pow(x, y) => self.power(value, of(x), of(y)),
            Op::Atan2(y, x) => self.angle(of(y), of(x)),
            Op::Sqrt(x)
            | Op::Sin(x)
            | Op::Cos(x)
            | Op::Tan(x)
            | Op::Exp(x)
            | Op::Tanh(x)
            | Op::Ln(x)
            | Op::Abs(x) => self.function(op, value, of(x)),
        }
    }

    /// The derivative of a function of one value.
    fn function(&mut self, op: Op, value: Value, (x, dx): (Value, Option<Value>)) -> Option<Value> {
        let dx = dx?;
        let factor = match op {
            // 1 / (2 sqrt(x)), 1 / x
            Op::Sqrt(_) => {
                let twice = self.push(Op::Add(value, value));
                return Some(self.push(Op::Div(dx, twice)));
            }
            Op::Ln(_) => return Some(self.push(Op::Div(dx, x))),
            Op::Sin(_) => self.push(Op::Cos(x)),
            Op::Cos(_) => {
                let sine = self.push(Op::Sin(x));
                self.push(Op::Neg(sine))
            }
            // 1 + tan^2, 1 - tanh^2
            Op::Tan(_) | Op::Tanh(_) => {
                let one = self.constant(1.0);
                let square = self.push(Op::Mul(value, value));
                let is_tangent = matches!(op, Op::Tan(_));
                self.push(if is_tangent { Op::Add(one, square) } else { Op::Sub(one, square) })
            }
            Op::Exp(_) => value,
            // 2 step(x) - 1
            Op::Abs(_) => {
                let (one, step) = (self.constant(1.0), self.push(Op::Step(x)));
                let twice = self.push(Op::Add(step, step));
                self.push(Op::Sub(twice, one))
            }
            _ => unreachable!("{op:?} is not a function of one value"),
        };
        Some(self.push(Op::Mul(factor, dx)))
    }

    fn sum(&mut self, x: Option<Value>, y: Option<Value>) -> Option<Value> {
        match (x, y) {
            (Some(x), Some(y)) => Some(self.push(Op::Add(x, y))),
            (x, y) => x.or(y),
        }
    }

    /// dx where `larger` is not less than `smaller`, else dy.
    fn blend(
        &mut self,
        (larger, smaller): (Value, Value),
        dx: Option<Value>,
        dy: Option<Value>,
    ) -> Option<Value> {
        if dx.is_none() && dy.is_none() {
            return None;
        }
        let difference = self.push(Op::Sub(larger, smaller));
        let step = self.push(Op::Step(difference));
        let left = dx.map(|dx| self.push(Op::Mul(step, dx)));
        let right = dy.map(|dy| {
            let one = self.constant(1.0);
            let rest = self.push(Op::Sub(one, step));
            self.push(Op::Mul(rest, dy))
        });
        self.sum(left, right)
    }

    /// d(atan2(y, x)) = (x dy - y dx) / (x^2 + y^2)
    fn angle(
        &mut self,
        (y, dy): (Value, Option<Value>),
        (x, dx): (Value, Option<Value>),
    ) -> Option<Value> {
        let ahead = dy.map(|dy| self.push(Op::Mul(x, dy)));
        let back = dx.map(|dx| self.push(Op::Mul(y, dx)));
        let above = match (ahead, back) {
            (Some(ahead), Some(back)) => Some(self.push(Op::Sub(ahead, back))),
            (None, Some(back)) => Some(self.push(Op::Neg(back))),
            (ahead, None) => ahead,
        };
        above.map(|above| {
            let [x, y] = [x, y].map(|x| self.push(Op::Mul(x, x)));
            let square = self.push(Op::Add(x, y));
            self.push(Op::Div(above, square))
        })
    }

    /// d(x^y) = y x^(y - 1) dx + x^y ln x dy
    fn power(
        &mut self,
        value: Value,
        (x, dx): (Value, Option<Value>),
        (y, dy): (Value, Option<Value>),
    ) -> Option<Value> {
        let base = dx.map(|dx| {
            let one = self.constant(1.0);
            let less = self.push(Op::Sub(y, one));
            let power = self.push(Op::Pow(x, less));
            let derivative = self.push(Op::Mul(y, power));
            self.push(Op::Mul(derivative, dx))
        });
        let exponent = dy.map(|dy| {
            let logarithm = self.push(Op::Ln(x));
            let derivative = self.push(Op::Mul(value, logarithm));
            self.push(Op::Mul(derivative, dy))
        });
        self.sum(base, exponent)
    }
}
