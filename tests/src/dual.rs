//! Dual numbers, and any program as a mechanism over them: forward derivatives through the runtime itself.
//!
//! With e^2 = 0, f(x + x' e) = f(x) + f'(x) x' e, for everything that is computed from arithmetic (W. K. Clifford, 1873;
//! A. Griewank and A. Walther, "Evaluating Derivatives", 2008, section 3.1). What is computed is the derivative of the numbers of the
//! computation, with the decisions that it took.

use std::cell::RefCell;
use std::cmp::Ordering;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use lamc::program::{FunctionKind, Interface, Op, Program, Slot, Value};
use lamc_runtime::plumbing::{
    Dimensions, Drive, EquationsMut, Margin, ProjectionMut, ReductionSizes, workspace_len,
};
use lamc_runtime::{Arithmetic, Error, JacobianMut, Mechanism, Scalar, State, StateOf, free_body};

/// A number and its derivative: x + x' e with e^2 = 0.
#[derive(Clone, Copy, Debug, Default)]
pub struct Dual(pub f64, pub f64);

impl PartialEq for Dual {
    fn eq(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

impl PartialOrd for Dual {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        self.0.partial_cmp(&other.0)
    }
}

impl Add for Dual {
    type Output = Self;
    fn add(self, b: Self) -> Self {
        Self(self.0 + b.0, self.1 + b.1)
    }
}

impl Sub for Dual {
    type Output = Self;
    fn sub(self, b: Self) -> Self {
        Self(self.0 - b.0, self.1 - b.1)
    }
}

impl Mul for Dual {
    type Output = Self;
    fn mul(self, b: Self) -> Self {
        Self(self.0 * b.0, self.1 * b.0 + self.0 * b.1)
    }
}

impl Div for Dual {
    type Output = Self;
    fn div(self, b: Self) -> Self {
        Self(self.0 / b.0, (self.1 - self.0 / b.0 * b.1) / b.0)
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        Self(-self.0, -self.1)
    }
}

impl AddAssign for Dual {
    fn add_assign(&mut self, b: Self) {
        *self = *self + b;
    }
}

impl SubAssign for Dual {
    fn sub_assign(&mut self, b: Self) {
        *self = *self - b;
    }
}

impl MulAssign for Dual {
    fn mul_assign(&mut self, b: Self) {
        *self = *self * b;
    }
}

impl Arithmetic for Dual {
    const ZERO: Self = Self(0.0, 0.0);
    const ONE: Self = Self(1.0, 0.0);
    const EPSILON: Self = Self(f64::EPSILON, 0.0);
    fn from_f64(value: f64) -> Self {
        Self(value, 0.0)
    }
    fn sqrt(self) -> Self {
        let root = self.0.sqrt();
        Self(root, self.1 / (2.0 * root))
    }
    fn sin_cos(self) -> (Self, Self) {
        let (s, c) = self.0.sin_cos();
        (Self(s, c * self.1), Self(c, -s * self.1))
    }
    fn tan(self) -> Self {
        Self(self.0.tan(), self.1 / self.0.cos().powi(2))
    }
    fn exp(self) -> Self {
        Self(self.0.exp(), self.0.exp() * self.1)
    }
    fn tanh(self) -> Self {
        Self(self.0.tanh(), self.1 / self.0.cosh().powi(2))
    }
    fn ln(self) -> Self {
        Self(self.0.ln(), self.1 / self.0)
    }
    fn pow(self, exponent: Self) -> Self {
        let power = self.0.powf(exponent.0);
        let by_base = exponent.0 * self.0.powf(exponent.0 - 1.0) * self.1;
        let by_exponent = if exponent.1 == 0.0 { 0.0 } else { power * self.0.ln() * exponent.1 };
        Self(power, by_base + by_exponent)
    }
    fn atan2(self, x: Self) -> Self {
        let square = self.0 * self.0 + x.0 * x.0;
        Self(self.0.atan2(x.0), (x.0 * self.1 - self.0 * x.1) / square)
    }
    fn step(self) -> Self {
        Self(f64::from(u8::from(self.0 >= 0.0)), 0.0)
    }
    fn abs(self) -> Self {
        if self.0 < 0.0 { -self } else { self }
    }
    fn min(self, other: Self) -> Self {
        if self.0 <= other.0 { self } else { other }
    }
    fn max(self, other: Self) -> Self {
        if self.0 >= other.0 { self } else { other }
    }
}

impl Scalar for Dual {
    fn to_f64(self) -> f64 {
        self.0
    }
    fn to_f32(self) -> f32 {
        self.0 as f32
    }
    fn is_finite(self) -> bool {
        self.0.is_finite() && self.1.is_finite()
    }
}

/// A program that is interpreted in dual numbers.
pub struct DualSystem<'p> {
    program: &'p Program,
    /// The parameters.
    parameters: Vec<Dual>,
    /// The inputs.
    inputs: Vec<Dual>,
    drawing: Vec<Dual>,
    values: RefCell<Vec<Dual>>,
}

/// Time and state.
type At<'a> = (Dual, &'a [Dual], &'a [Dual]);

impl<'p> DualSystem<'p> {
    /// At values of the parameters and inputs.
    pub fn new(program: &'p Program, parameters: Vec<Dual>, inputs: Vec<Dual>) -> Self {
        let drawn = program.interface.drawn;
        let mut system = Self {
            program,
            parameters,
            inputs,
            drawing: vec![Dual::ZERO; drawn],
            values: RefCell::default(),
        };
        if drawn > 0 {
            let mut drawing = vec![Dual::ZERO; drawn];
            system.run(FunctionKind::Drawing, (Dual::ZERO, &[], &[]), &mut [&mut drawing]);
            system.drawing = drawing;
        }
        system
    }

    fn run(&self, kind: FunctionKind, (t, q, u): At<'_>, out: &mut [&mut [Dual]]) {
        let function = self.program.function_of(kind);
        let mut values = self.values.borrow_mut();
        values.clear();
        for instruction in &function.instructions {
            let of = |x: Value| values[x.index()];
            let value = match instruction.op {
                Op::Load(slot) => match slot {
                    Slot::Time => t,
                    Slot::Position(id) => q[id.index()],
                    Slot::Rate(id) => u[id.index()],
                    Slot::Parameter(id) => self.parameters[id.index()],
                    Slot::Input(id) => self.inputs[id.index()],
                    Slot::Drawn(place) => self.drawing[place],
                    _ => panic!("{slot:?} is not needed"),
                },
                Op::Const(number) => Dual::from_f64(number),
                Op::Neg(x) => -of(x),
                Op::Add(x, y) => of(x) + of(y),
                Op::Sub(x, y) => of(x) - of(y),
                Op::Mul(x, y) => of(x) * of(y),
                Op::Div(x, y) => of(x) / of(y),
                Op::Sqrt(x) => of(x).sqrt(),
                Op::Sin(x) => of(x).sin_cos().0,
                Op::Cos(x) => of(x).sin_cos().1,
                Op::Tan(x) => of(x).tan(),
                Op::Exp(x) => of(x).exp(),
                Op::Abs(x) => of(x).abs(),
                Op::Tanh(x) => of(x).tanh(),
                Op::Ln(x) => of(x).ln(),
                Op::Step(x) => of(x).step(),
                Op::Min(x, y) => of(x).min(of(y)),
                Op::Max(x, y) => of(x).max(of(y)),
                Op::Pow(x, y) => of(x).pow(of(y)),
                Op::Atan2(y, x) => of(y).atan2(of(x)),
            };
            values.push(value);
        }
        for (output, target) in function.outputs.iter().zip(out) {
            for (entry, place) in output.entries.iter().zip(target.iter_mut()) {
                *place = values[entry.index()];
            }
        }
    }

    fn solve(
        &self,
        kind: FunctionKind,
        at: At<'_>,
        out: &mut [&mut [Dual]],
    ) -> Result<Option<Margin<Dual>>, Error> {
        if self.program.function_of(kind).outputs.is_empty() {
            return Ok(None);
        }
        let mut margin = [Dual::ZERO; 3];
        let mut out: Vec<&mut [Dual]> = out.iter_mut().map(|out| &mut **out).collect();
        out.push(&mut margin);
        self.run(kind, at, &mut out);
        let [inverse_pivot, conditioning, pivot] = margin;
        Ok(Some(Margin { inverse_pivot, conditioning, pivot }))
    }

    fn interface(&self) -> &Interface {
        &self.program.interface
    }
}

impl Mechanism for DualSystem<'_> {
    type Scalar = Dual;
    type Coordinates = Vec<Dual>;
    type Speeds = Vec<Dual>;
    type Matrix = Vec<Dual>;
    type Workspace = Vec<Dual>;
    type Poses = Vec<[Dual; 12]>;
    type Points = Vec<[Dual; 3]>;

    fn dimensions(&self) -> Dimensions {
        let interface = self.interface();
        Dimensions {
            rows: interface.rows,
            rank: interface.rank,
            loops: interface.loops.len(),
            bodies: interface.bodies.len(),
            points: interface.points.len(),
            contacts: interface.contacts.len(),
            drives: interface.driven().len(),
            parameters: interface.parameters.len(),
            inputs: interface.inputs.len(),
            coordinates: interface.coordinates(),
            speeds: interface.speeds(),
            joints: interface.joints.len(),
            reduction: ReductionSizes::NONE,
        }
    }

    fn speeds(&self) -> Vec<Dual> {
        vec![Dual::ZERO; self.interface().speeds()]
    }

    fn matrix(&self) -> Vec<Dual> {
        vec![Dual::ZERO; self.interface().speeds() * self.interface().speeds()]
    }

    fn workspace(&self) -> Vec<Dual> {
        vec![Dual::ZERO; workspace_len(self.dimensions())]
    }

    fn size(&self) -> Dual {
        Dual(self.interface().size, 0.0)
    }

    fn limits(&self, _: usize) -> [Dual; 2] {
        [Dual(f64::NEG_INFINITY, 0.0), Dual(f64::INFINITY, 0.0)]
    }

    fn initial(&self) -> StateOf<Self> {
        State {
            t: Dual::ZERO,
            q: vec![Dual::ZERO; self.interface().coordinates()],
            u: self.speeds(),
        }
    }

    fn is_pinned(&self, _: usize) -> bool {
        false
    }

    fn advance(&self, q: &mut [Dual], step: &[Dual]) {
        free_body::advance(q, step, self.interface().joints.len());
    }

    fn write_rates(&self, q: &[Dual], u: &[Dual], out: &mut [Dual]) {
        free_body::write_rates(q, u, out, self.interface().joints.len());
    }

    fn normalise(&self, q: &mut [Dual]) {
        free_body::normalise(q, self.interface().joints.len());
    }

    fn write_equations(
        &self,
        t: Dual,
        q: &[Dual],
        u: &[Dual],
        out: EquationsMut<'_, Dual>,
    ) -> Result<(), Error> {
        let out = &mut [out.mass, out.forcing, out.jacobian, out.gamma];
        self.run(FunctionKind::Equations, (t, q, u), out);
        Ok(())
    }

    fn write_closure(
        &self,
        q: &[Dual],
        residual: &mut [Dual],
        jacobian: &mut [Dual],
    ) -> Result<(), Error> {
        self.run(FunctionKind::Closure, (Dual::ZERO, q, &[]), &mut [residual, jacobian]);
        Ok(())
    }

    fn drives(&self, t: Dual, mut visit: impl FnMut(Drive<Dual>)) {
        let driven = self.interface().driven();
        let mut values = vec![Dual::ZERO; 4 * driven.len()];
        self.run(FunctionKind::Drives, (t, &[], &[]), &mut [&mut values]);
        for (joint, row) in driven.iter().zip(values.as_chunks::<4>().0) {
            let [position, speed, acceleration, jerk] = *row;
            visit(Drive { joint: joint.index(), position, speed, acceleration, jerk });
        }
    }

    fn write_acceleration(
        &self,
        t: Dual,
        q: &[Dual],
        u: &[Dual],
        out: &mut [Dual],
    ) -> Result<Option<Margin<Dual>>, Error> {
        self.solve(FunctionKind::Acceleration, (t, q, u), &mut [out])
    }

    fn write_projection(
        &self,
        q: &[Dual],
        u: &[Dual],
        out: ProjectionMut<'_, Dual>,
    ) -> Result<Option<Margin<Dual>>, Error> {
        let out = &mut [out.residual, out.positions, out.speeds];
        self.solve(FunctionKind::Projection, (Dual::ZERO, q, u), out)
    }

    fn write_jacobian(
        &self,
        t: Dual,
        q: &[Dual],
        u: &[Dual],
        out: JacobianMut<'_, Dual>,
    ) -> Result<Option<Margin<Dual>>, Error> {
        let out = &mut [out.acceleration, out.dq, out.du, out.dt];
        self.solve(FunctionKind::Jacobian, (t, q, u), out)
    }
}
