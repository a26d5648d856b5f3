//! Switching surfaces: where formulas of the model jump, and the times at which they jump or bend.
//!
//! A step across a jump is of order 1, and a step over a short pulse does not see it at all. Steps therefore end at
//! each surface. Its sides are those of a switching function, the argument x of `step(x)` in a formula.
//!
//! - Where x depends on the time alone, as in `step(t - 1)`, the next change is looked for before the step.
//! - Where it depends on the state, as in `sign(q.hip)`, a step that crosses the surface is taken again, so that it ends
//!   a little before it. Then all stages lie on one side, and the continuous extension leads over the rest of the way.
//!
//! Both are as in E. Hairer, S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I", II.6 (1993).

use lamc::program::{
    Argument, Function, FunctionKind, Instruction, Op, Output, Phase, Slot, Value,
};
use lamc_runtime::{Error, Integrator as _, State};

use super::{Method, Simulation};
use crate::execution::Jit;

/// A step ends this share of its length before a surface.
const SHORT_OF: f64 = 0.02;
/// The continuous extension is followed beyond the end of such a step by this share of its length.
const AHEAD: f64 = 0.05;
/// A surface that is nearer than this share of the step before is not looked for ahead.
const NEAREST: f64 = 1e-6;
/// A step is taken again at most so often.
const REPEATS: usize = 40;
/// Bisections that tell about where a step crosses a surface; of a place to the last digit.
const ROUGHLY: usize = 10;
const EXACTLY: usize = 60;
/// A step to a time ends before it by this share of it.
const ROUNDING: f64 = 4.0 * f64::EPSILON;
/// A share of a step in which nothing moves.
const INSTANT: f64 = 1e-12;
/// Between two samples, functions of time that are not linear are looked at so often.
const LOOKS: usize = 256;

/// A state that a step passes.
type Passed = State<Vec<f64>, f64>;

/// The switching functions of a mechanism.
pub(super) struct Switches {
    /// Of the state.
    crossed: Slice,
    /// Of time alone.
    timed: Slice,
    /// Whether one of these is not linear.
    bends: bool,
    /// Where the step before began, s, and the values of `crossed` there.
    before: Option<(f64, Vec<f64>)>,
    /// The end of the last interval that was searched for changes in time, s, and the first one in it.
    searched: Option<(f64, Option<f64>)>,
}

impl Switches {
    /// `None` if no formula switches.
    pub(super) fn new(system: &Jit) -> Option<Self> {
        let kinds = [FunctionKind::Acceleration, FunctionKind::Equations];
        let kind = kinds.into_iter().find(|&kind| system.has(kind))?;
        let function = system.engine().function(kind);
        let formulas = function.instructions.iter().filter(|it| it.section.phase == Phase::Formula);
        let switches = |op: &Op| matches!(op, Op::Step(_) | Op::Abs(_) | Op::Min(..) | Op::Max(..));
        let switches: Vec<Op> = formulas.map(|formula| formula.op).filter(switches).collect();
        if switches.is_empty() {
            return None;
        }
        let depends = dependences(function);
        let (mut crossed, mut timed, mut bends) = (Vec::new(), Vec::new(), false);
        for op in switches {
            let argument = op.operands().map(|operand| depends[operand.index()]).max()?;
            match argument {
                Depends::OnState if matches!(op, Op::Step(_)) => crossed.push(op),
                Depends::Linearly | Depends::OnTime => {
                    timed.push(op);
                    bends |= argument == Depends::OnTime;
                }
                Depends::OnState | Depends::OnNothing => {}
            }
        }
        let is_needed = !(crossed.is_empty() && timed.is_empty());
        let [crossed, timed] = [crossed, timed].map(|ops| Slice::of(function, &ops));
        is_needed.then_some(Self { crossed, timed, bends, before: None, searched: None })
    }

    /// The values at a state of the functions of the state.
    fn at(&self, system: &Jit, state: &Passed) -> Vec<f64> {
        self.crossed.values(system, state.t, &state.q, &state.u)
    }

    /// Forgets what it knows of the motion so far. Call it after the inputs have changed.
    pub(super) fn forget(&mut self) {
        (self.before, self.searched) = (None, None);
    }

    /// The first time after `begin` at which a function of time is on another side, s, if it is not after `end`.
    fn next_time(&mut self, system: &Jit, begin: f64, end: f64) -> Option<f64> {
        match self.searched {
            Some((to, found)) if to == end && found.is_none_or(|found| found > begin) => found,
            _ if self.timed.values.is_empty() => None,
            _ => {
                let found = self.search(system, begin, end);
                self.searched = Some((end, found));
                found
            }
        }
    }

    /// As [`next_time`](Self::next_time), which remembers it.
    fn search(&self, system: &Jit, begin: f64, end: f64) -> Option<f64> {
        let at = |t: f64| self.timed.values(system, t, &[], &[]);
        let first = at(begin);
        let looks = if self.bends { LOOKS } else { 1 };
        let place = |look: usize| match look == looks {
            true => end,
            false => begin + (end - begin) * (look as f64 / looks as f64),
        };
        let changes = |t: f64| are_apart(&first, &at(t));
        let look = (1..=looks).find(|&look| changes(place(look)))?;
        let (mut low, mut high) = (place(look - 1), place(look));
        while let Some(between) = Some(0.5 * (low + high)).filter(|&t| low < t && t < high) {
            *(if changes(between) { &mut high } else { &mut low }) = between;
        }
        Some(high)
    }

    /// The time before `end`, s, up to which a step comes not too near to a surface, if the functions go on changing as
    /// they did in the step before.
    fn safe(&self, t: f64, values: &[f64], end: f64) -> f64 {
        let Some((earlier, before)) = self.before.as_ref().filter(|(earlier, _)| *earlier < t)
        else {
            return end;
        };
        let last = t - earlier;
        let left = values.iter().zip(before).map(|(now, before)| now * last / (before - now));
        let near = left.filter(|left| *left > NEAREST * last).fold(f64::INFINITY, f64::min);
        end.min(t + (1.0 - SHORT_OF) * near)
    }
}

/// Whether a time is so little after `begin` that nothing moves until then; s.
fn is_at_once(begin: f64, at: f64, end: f64) -> bool {
    at - begin <= INSTANT * (end - begin) || at - ROUNDING * at.abs() <= begin
}

/// Whether a function is on another side of zero. Zero itself belongs to the positive side, as `step` has it.
fn are_apart(a: &[f64], b: &[f64]) -> bool {
    a.iter().zip(b).any(|(a, b)| (*a >= 0.0) != (*b >= 0.0))
}

/// Whether a function is on another side than at the begin of a step. Where that was on the surface, the step leaves it.
fn are_crossed(from: &[f64], to: &[f64]) -> bool {
    from.iter().zip(to).any(|(from, to)| *from != 0.0 && are_apart(&[*from], &[*to]))
}

impl Simulation {
    /// One step to `t` at most, s, that ends at the first surface on its way. The state just beyond it is then in
    /// `beyond`.
    pub(super) fn step_to_surface(&mut self, t: f64) -> Result<(), Error> {
        let Some(mut switches) = self.switches.take() else { return self.step_before_plates(t) };
        let outcome = self.step_with(&mut switches, t);
        self.switches = Some(switches);
        outcome
    }

    /// Goes to the other side of the surface at which the last step ended.
    pub(super) fn cross(&mut self) {
        if let Some(beyond) = self.beyond.take() {
            self.state = beyond;
            self.restart();
        }
    }

    /// Goes to the other side of surfaces that are reached at once, on the way to `t`, s.
    pub(super) fn switch_at_once(&mut self, t: f64) {
        let Some(switches) = &mut self.switches else { return };
        let mut next = |begin: f64| {
            let next = switches.next_time(&self.system.system, begin, t);
            next.filter(|&at| is_at_once(begin, at, t))
        };
        let Some(mut reached) = next(self.state.t) else { return };
        while let Some(at) = next(reached) {
            reached = at;
        }
        self.state.t = reached;
        self.restart();
    }

    fn step_with(&mut self, switches: &mut Switches, t: f64) -> Result<(), Error> {
        let switched = switches.next_time(&self.system.system, self.state.t, t);
        // No stage may lie on the other side by rounding.
        let end = switched.map_or(t, |at| at - ROUNDING * at.abs());
        self.step_before_surfaces(switches, end)?;
        if let Some(at) = switched.filter(|_| self.beyond.is_none() && self.state.t >= end) {
            self.beyond = Some(State { t: at, ..self.state.clone() });
        }
        Ok(())
    }

    /// One step to `end` at most, s, that ends at the first surface of the state.
    fn step_before_surfaces(&mut self, switches: &mut Switches, end: f64) -> Result<(), Error> {
        if switches.crossed.values.is_empty() {
            return self.step_before_plates(end);
        }
        let before = self.state.clone();
        let from = switches.at(&self.system.system, &before);
        let mut until = switches.safe(before.t, &from, end);
        for _ in 0..REPEATS {
            let kept = (self.system.clone(), self.explicit.clone(), self.implicit.clone());
            self.step_before_plates(until)?;
            let to = switches.at(&self.system.system, &self.state);
            let way = [before.t, self.state.t];
            let crossing = match are_crossed(&from, &to) {
                true => self.crossing(switches, way, &from, ROUGHLY)?,
                false => None,
            };
            let Some([_, after]) = crossing else { break };
            let length = after.t - before.t;
            if is_at_once(before.t, after.t, end) {
                break;
            }
            until = before.t + (1.0 - SHORT_OF) * length;
            self.state = before.clone();
            (self.system, self.explicit, self.implicit) = kept;
        }
        if until < end && self.state.t == until {
            let ahead = (until + AHEAD * (until - before.t)).min(end);
            if let Some([low, high]) = self.crossing(switches, [until, ahead], &from, EXACTLY)? {
                (self.state, self.beyond) = (low, Some(high));
            }
        }
        switches.before = Some((before.t, from));
        Ok(())
    }

    /// The states just before and after a change of side on the continuous extension between two times, s, if it is on
    /// another side than these values at the later one.
    fn crossing(
        &mut self,
        switches: &Switches,
        [mut low, mut high]: [f64; 2],
        from: &[f64],
        bisections: usize,
    ) -> Result<Option<[Passed; 2]>, Error> {
        let mut before = self.extension(low)?;
        let mut after = self.extension(high)?;
        if !are_crossed(from, &switches.at(&self.system.system, &after)) {
            return Ok(None);
        }
        for _ in 0..bisections {
            let middle = low + 0.5 * (high - low);
            if !(low < middle && middle < high) {
                break;
            }
            let state = self.extension(middle)?;
            if are_crossed(from, &switches.at(&self.system.system, &state)) {
                (high, after) = (middle, state);
            } else {
                (low, before) = (middle, state);
            }
        }
        Ok(Some([before, after]))
    }

    /// The state at a time within the last step, s, or a little after it.
    pub(super) fn extension(&mut self, t: f64) -> Result<Passed, Error> {
        match self.method {
            Method::Rodas => self.implicit.between(&self.system, t),
            Method::Rigid { .. } => self.rigid.between(&self.system, &self.state, t),
            Method::Auto | Method::Dopri5 => self.explicit.between(&self.system, t),
        }
    }
}

/// What an instruction depends on during a step.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Depends {
    OnNothing,
    /// On time alone, linearly.
    Linearly,
    OnTime,
    OnState,
}

/// What each instruction of a function depends on.
fn dependences(function: &Function) -> Vec<Depends> {
    let mut all: Vec<Depends> = Vec::with_capacity(function.instructions.len());
    for instruction in &function.instructions {
        let of = |operand: Value| all[operand.index()];
        let most = instruction.op.operands().map(of).max();
        all.push(match (instruction.op, most) {
            (Op::Load(Slot::Time), _) => Depends::Linearly,
            (Op::Load(Slot::Position(_) | Slot::Rate(_)), _) => Depends::OnState,
            (_, None) => Depends::OnNothing,
            (Op::Neg(_) | Op::Add(..) | Op::Sub(..), Some(Depends::Linearly)) => Depends::Linearly,
            (Op::Mul(x, y), Some(Depends::Linearly)) if of(x).min(of(y)) == Depends::OnNothing => {
                Depends::Linearly
            }
            (Op::Div(_, y), Some(Depends::Linearly)) if of(y) == Depends::OnNothing => {
                Depends::Linearly
            }
            (_, Some(Depends::Linearly)) => Depends::OnTime,
            (_, Some(most)) => most,
        });
    }
    all
}

/// The part of a function that some values need.
struct Slice {
    ops: Vec<Op>,
    values: Vec<Value>,
}

impl Slice {
    /// What changes its sign where these operations switch.
    fn of(function: &Function, switches: &[Op]) -> Self {
        let mut function = function.clone();
        let mut entries = Vec::new();
        for &switch in switches {
            let (Op::Step(x) | Op::Abs(x) | Op::Min(x, _) | Op::Max(x, _)) = switch else {
                continue;
            };
            let mut entry = x;
            if let Op::Min(_, y) | Op::Max(_, y) = switch {
                entry = Value(function.instructions.len());
                let section = function.instructions[x.index()].section;
                let op = Op::Sub(x, y);
                function.instructions.push(Instruction { op, section, name: None });
            }
            entries.push(entry);
        }
        function.outputs =
            vec![Output { name: "switches", rows: entries.len(), columns: 1, entries }];
        function.forget_unused();
        let ops = function.instructions.iter().map(|instruction| instruction.op).collect();
        Self { ops, values: function.outputs.swap_remove(0).entries }
    }

    fn values(&self, system: &Jit, t: f64, q: &[f64], u: &[f64]) -> Vec<f64> {
        let read = |slot: Slot| match slot.place() {
            (Argument::Time, _) => t,
            (Argument::Positions, place) => q[place],
            (Argument::Speeds, place) => u[place],
            (Argument::Parameters, place) => system.parameters()[place],
            (Argument::Inputs, place) => system.inputs()[place],
            (Argument::Drawing, place) => system.drawing()[place],
            _ => f64::NAN,
        };
        let mut all: Vec<f64> = Vec::with_capacity(self.ops.len());
        for op in &self.ops {
            all.push(match *op {
                Op::Load(slot) => read(slot),
                op => op.evaluate(|operand| all[operand.index()]),
            });
        }
        self.values.iter().map(|value| all[value.index()]).collect()
    }
}
