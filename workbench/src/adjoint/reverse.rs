//! Functions of a program in reverse mode: the derivative of a weighted sum of the outputs by everything that is read.
//!
//! With v = f(x, y) and the adjoint v' of v, x' grows by f_x v' and y' by f_y v', from the last instruction to the first
//! (A. Griewank and A. Walther, "Evaluating Derivatives", 2008, section 3.2). This takes a few times as many operations as
//! the function itself, however many slots there are.

use std::collections::HashMap;

use lamc::program::{
    Function, FunctionKind, Instruction, Interface, Op, Output, Phase, Program, Section, Slot,
    Value,
};
use lamc::source::{CoordinateId, InputId, ParameterId, SpeedId};

/// What is differentiated: the functions of motions, and of what is measured of them.
const KINDS: [FunctionKind; 9] = [
    FunctionKind::Equations,
    FunctionKind::Closure,
    FunctionKind::Drives,
    FunctionKind::Points,
    FunctionKind::Energy,
    FunctionKind::Acceleration,
    FunctionKind::Projection,
    FunctionKind::Jacobian,
    FunctionKind::Drawing,
];

/// The name of the only output of a function in reverse mode.
const ADJOINTS: &str = "adjoints";

/// The name of an output that is not differentiated, which is the last one of the functions that have it.
const MARGIN: &str = "margin";

/// The slot of the weight of an output. The functions that are differentiated here read no multipliers, so that these
/// slots are free.
pub fn weight(entry: usize) -> Slot {
    Slot::Multiplier(entry)
}

/// The order of adjoints: those of the state are q and u, the others the parameters, the inputs, and the numbers of the
/// drawing.
#[derive(Clone, Copy, Debug)]
pub struct Layout {
    /// The length of q.
    pub coordinates: usize,
    /// The length of u.
    pub speeds: usize,
    /// How many parameters there are.
    pub parameters: usize,
    /// How many inputs there are.
    pub inputs: usize,
    /// How many numbers the drawing has.
    pub drawn: usize,
}

impl Layout {
    /// That of a mechanism.
    pub fn of(interface: &Interface) -> Self {
        Self {
            coordinates: interface.coordinates(),
            speeds: interface.speeds(),
            parameters: interface.parameters.len(),
            inputs: interface.inputs.len(),
            drawn: interface.drawn,
        }
    }

    /// The number of adjoints of the state.
    pub fn state(self) -> usize {
        self.coordinates + self.speeds
    }

    /// The number of the others.
    pub fn rest(self) -> usize {
        self.parameters + self.inputs + self.drawn
    }

    /// The place of a slot: `Ok` in the state, `Err` among the others. None of what is not differentiated by, such as the
    /// time.
    fn place(self, slot: Slot) -> Option<Result<usize, usize>> {
        Some(match slot {
            Slot::Position(CoordinateId(index)) => Ok(index),
            Slot::Rate(SpeedId(index)) => Ok(self.coordinates + index),
            Slot::Parameter(ParameterId(index)) => Err(index),
            Slot::Input(InputId(index)) => Err(self.parameters + index),
            Slot::Drawn(index) => Err(self.parameters + self.inputs + index),
            _ => return None,
        })
    }
}

/// Where what a function in reverse mode writes belongs.
#[derive(Clone, Debug, Default)]
pub struct Places {
    /// Places among the adjoints of the state; those are written first.
    pub state: Vec<usize>,
    /// Places among the others.
    pub rest: Vec<usize>,
}

/// The functions of a program in reverse mode.
#[derive(Clone, Debug)]
pub struct Reversed {
    /// Each function reads what the one of the same kind reads, and the weights of its outputs; it writes the adjoints that
    /// are not always zero.
    pub program: Program,
    /// Where these belong, by kind.
    pub places: Vec<Places>,
}

impl Reversed {
    /// Differentiates the functions of a program.
    pub fn of(program: &Program) -> Self {
        let layout = Layout::of(&program.interface);
        let reversed = program.functions.iter().map(|function| reverse(function, layout));
        let (functions, places) = reversed.unzip();
        let interface = program.interface.clone();
        Self { program: Program { interface, facts: Vec::new(), functions }, places }
    }
}

/// A function in reverse mode, and the places of what it writes.
fn reverse(function: &Function, layout: Layout) -> (Function, Places) {
    let mut tape = Tape::new(function, layout);
    if KINDS.contains(&function.kind) {
        tape.seed(function);
        for index in (0..function.instructions.len()).rev() {
            if let Some(adjoint) = tape.adjoints[index] {
                tape.pull(Value(index), adjoint);
            }
        }
    }
    let mut places = Places::default();
    let (mut entries, mut others) = (Vec::new(), Vec::new());
    for (index, instruction) in function.instructions.iter().enumerate() {
        let Op::Load(slot) = instruction.op else { continue };
        let (Some(adjoint), Some(place)) = (tape.adjoints[index], layout.place(slot)) else {
            continue;
        };
        match place {
            Ok(place) => {
                places.state.push(place);
                entries.push(adjoint);
            }
            Err(place) => {
                places.rest.push(place);
                others.push(adjoint);
            }
        }
    }
    entries.append(&mut others);
    let output = Output { name: ADJOINTS, rows: entries.len(), columns: 1, entries };
    let mut reversed =
        Function { kind: function.kind, instructions: tape.instructions, outputs: vec![output] };
    reversed.forget_unused();
    (reversed, places)
}

/// The instructions of a function, and behind them those of its derivative.
struct Tape {
    instructions: Vec<Instruction>,
    /// Whether a value of the function depends on what is differentiated by.
    moves: Vec<bool>,
    /// The adjoint of each value of the function, as far as it is known.
    adjoints: Vec<Option<Value>>,
    /// Sines and cosines that the function has, by whether it is a sine, and by the angle.
    known: HashMap<(bool, Value), Value>,
    section: Section,
}

impl Tape {
    fn new(function: &Function, layout: Layout) -> Self {
        let mut moves = Vec::with_capacity(function.instructions.len());
        let mut known = HashMap::new();
        for (index, instruction) in function.instructions.iter().enumerate() {
            moves.push(match instruction.op {
                Op::Load(slot) => layout.place(slot).is_some(),
                // Flat but for the step itself.
                Op::Step(_) => false,
                op => op.operands().any(|operand| moves[operand.index()]),
            });
            match instruction.op {
                Op::Sin(angle) => known.insert((true, angle), Value(index)),
                Op::Cos(angle) => known.insert((false, angle), Value(index)),
                _ => None,
            };
        }
        Self {
            instructions: function.instructions.clone(),
            adjoints: vec![None; moves.len()],
            moves,
            known,
            section: Section::mechanism(Phase::Output),
        }
    }

    /// The weights of the outputs are their adjoints.
    fn seed(&mut self, function: &Function) {
        // The margin of a solution only says whether it holds.
        let outputs = function.outputs.iter().filter(|output| output.name != MARGIN);
        for (index, entry) in outputs.flat_map(|output| &output.entries).enumerate() {
            if self.moves[entry.index()] {
                let weight = self.push(Op::Load(weight(index)));
                self.add(*entry, weight);
            }
        }
    }

    fn push(&mut self, op: Op) -> Value {
        self.instructions.push(Instruction { op, section: self.section, name: None });
        Value(self.instructions.len() - 1)
    }

    fn constant(&mut self, number: f64) -> Value {
        self.push(Op::Const(number))
    }

    /// Adds a share to the adjoint of a value.
    fn add(&mut self, value: Value, share: Value) {
        if !self.moves[value.index()] {
            return;
        }
        let sum = match self.adjoints[value.index()] {
            Some(sum) => self.push(Op::Add(sum, share)),
            None => share,
        };
        self.adjoints[value.index()] = Some(sum);
    }

    /// Takes a share from the adjoint of a value.
    fn subtract(&mut self, value: Value, share: Value) {
        if !self.moves[value.index()] {
            return;
        }
        let sum = match self.adjoints[value.index()] {
            Some(sum) => self.push(Op::Sub(sum, share)),
            None => self.push(Op::Neg(share)),
        };
        self.adjoints[value.index()] = Some(sum);
    }

    /// Adds a product to the adjoint of a value.
    fn add_product(&mut self, value: Value, factors: [Value; 2]) {
        if self.moves[value.index()] {
            let share = self.push(Op::Mul(factors[0], factors[1]));
            self.add(value, share);
        }
    }

    /// The sine or the cosine of an angle.
    fn turn(&mut self, is_sine: bool, angle: Value) -> Value {
        if let Some(known) = self.known.get(&(is_sine, angle)) {
            return *known;
        }
        let value = self.push(if is_sine { Op::Sin(angle) } else { Op::Cos(angle) });
        self.known.insert((is_sine, angle), value);
        value
    }

    /// Hands the adjoint of a value on to its operands.
    fn pull(&mut self, value: Value, adjoint: Value) {
        self.section = self.instructions[value.index()].section;
        match self.instructions[value.index()].op {
            Op::Const(_) | Op::Load(_) | Op::Step(_) => {}
            Op::Neg(x) => self.subtract(x, adjoint),
            Op::Add(x, y) => {
                self.add(x, adjoint);
                self.add(y, adjoint);
            }
            Op::Sub(x, y) => {
                self.add(x, adjoint);
                self.subtract(y, adjoint);
            }
            Op::Mul(x, y) => {
                self.add_product(x, [adjoint, y]);
                self.add_product(y, [adjoint, x]);
            }
            // d(x / y) = (dx - (x / y) dy) / y
            Op::Div(x, y) => {
                let share = self.push(Op::Div(adjoint, y));
                self.add(x, share);
                if self.moves[y.index()] {
                    let carried = self.push(Op::Mul(share, value));
                    self.subtract(y, carried);
                }
            }
            Op::Max(x, y) => self.choose([x, y], [x, y], adjoint),
            Op::Min(x, y) => self.choose([y, x], [x, y], adjoint),
            Op::Pow(x, y) => self.power(value, [x, y], adjoint),
            Op::Atan2(y, x) => self.angle([y, x], adjoint),
            Op::Sqrt(x)
            | Op::Sin(x)
            | Op::Cos(x)
            | Op::Tan(x)
            | Op::Exp(x)
            | Op::Tanh(x)
            | Op::Ln(x)
            | Op::Abs(x) => self.function(value, x, adjoint),
        }
    }

    /// The share of a function of one value.
    fn function(&mut self, value: Value, x: Value, adjoint: Value) {
        let factor = match self.instructions[value.index()].op {
            // 1 / (2 sqrt(x)), 1 / x
            Op::Sqrt(_) => {
                let twice = self.push(Op::Add(value, value));
                let share = self.push(Op::Div(adjoint, twice));
                return self.add(x, share);
            }
            Op::Ln(_) => {
                let share = self.push(Op::Div(adjoint, x));
                return self.add(x, share);
            }
            Op::Cos(_) => {
                let sine = self.turn(true, x);
                let share = self.push(Op::Mul(adjoint, sine));
                return self.subtract(x, share);
            }
            Op::Sin(_) => self.turn(false, x),
            // 1 + tan^2, 1 - tanh^2
            op @ (Op::Tan(_) | Op::Tanh(_)) => {
                let one = self.constant(1.0);
                let square = self.push(Op::Mul(value, value));
                let is_tangent = matches!(op, Op::Tan(_));
                self.push(if is_tangent { Op::Add(one, square) } else { Op::Sub(one, square) })
            }
            // 2 step(x) - 1
            Op::Abs(_) => {
                let (one, step) = (self.constant(1.0), self.push(Op::Step(x)));
                let twice = self.push(Op::Add(step, step));
                self.push(Op::Sub(twice, one))
            }
            // exp(x)
            _ => value,
        };
        self.add_product(x, [adjoint, factor]);
    }

    /// The adjoint goes to the first of two values where the first number is not less than the second, else to the other.
    fn choose(&mut self, [larger, smaller]: [Value; 2], [x, y]: [Value; 2], adjoint: Value) {
        let difference = self.push(Op::Sub(larger, smaller));
        let step = self.push(Op::Step(difference));
        let share = self.push(Op::Mul(step, adjoint));
        self.add(x, share);
        if self.moves[y.index()] {
            let rest = self.push(Op::Sub(adjoint, share));
            self.add(y, rest);
        }
    }

    /// d(x^y) = y x^(y - 1) dx + x^y ln x dy
    fn power(&mut self, value: Value, [x, y]: [Value; 2], adjoint: Value) {
        if self.moves[x.index()] {
            let one = self.constant(1.0);
            let less = self.push(Op::Sub(y, one));
            let power = self.push(Op::Pow(x, less));
            let slope = self.push(Op::Mul(y, power));
            self.add_product(x, [adjoint, slope]);
        }
        if self.moves[y.index()] {
            let logarithm = self.push(Op::Ln(x));
            let slope = self.push(Op::Mul(value, logarithm));
            self.add_product(y, [adjoint, slope]);
        }
    }

    /// d(atan2(y, x)) = (x dy - y dx) / (x^2 + y^2)
    fn angle(&mut self, [y, x]: [Value; 2], adjoint: Value) {
        let [xx, yy] = [x, y].map(|it| self.push(Op::Mul(it, it)));
        let square = self.push(Op::Add(xx, yy));
        let share = self.push(Op::Div(adjoint, square));
        self.add_product(y, [share, x]);
        if self.moves[x.index()] {
            let back = self.push(Op::Mul(share, y));
            self.subtract(x, back);
        }
    }
}
