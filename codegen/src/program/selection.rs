//! Which functions of a mechanism a backend writes.

use std::borrow::Cow;

use super::ir::{Function, Instruction, Interface, Op, Output, Program, Slot, Value};
use super::signature::{FunctionKind, Role};

/// Every function at once, among the names of functions.
const EVERYTHING: &str = "all";

/// No function, among the names of functions.
const NOTHING: &str = "none";

/// A set of functions. Those that every motion needs are in every set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection(u32);

impl Default for Selection {
    /// Everything but the unrolled derivatives, which are longer than all other functions together: the
    /// runtime differentiates through the tangent function instead.
    fn default() -> Self {
        let is_asked_for =
            |kind| matches!(kind, FunctionKind::Jacobian | FunctionKind::JacobianParams);
        Self::of(optional().filter(|&kind| !is_asked_for(kind)))
    }
}

/// A name that no function has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no function that can be chosen is called `{name}`; there are {}, `all` and `none`",
    optional().map(FunctionKind::name).collect::<Vec<_>>().join(", ")
)]
pub struct UnknownFunction {
    name: String,
}

/// The functions that a module may do without. What the runtime makes accelerations and projections of is chosen as
/// the acceleration.
fn optional() -> impl Iterator<Item = FunctionKind> {
    FunctionKind::ALL.into_iter().filter(|&kind| !is_needed(kind) && named(kind) == kind)
}

/// The function that a user asks for to get this one.
fn named(kind: FunctionKind) -> FunctionKind {
    match kind {
        FunctionKind::Reduction | FunctionKind::ProjectionReduction => FunctionKind::Acceleration,
        kind => kind,
    }
}

/// Returns whether all modules that have the function need it.
fn is_needed(kind: FunctionKind) -> bool {
    // The other functions read what it computes.
    kind.signature().role == Role::Required || kind == FunctionKind::Drawing
}

impl Selection {
    fn of(kinds: impl IntoIterator<Item = FunctionKind>) -> Self {
        let required = FunctionKind::ALL.into_iter().filter(|&kind| is_needed(kind));
        Self(kinds.into_iter().chain(required).fold(0, |set, kind| set | 1 << kind as u16))
    }

    /// The functions of these names, and those that every set has; `all` stands for every function
    /// and `none` for no other.
    ///
    /// # Errors
    /// The first name that no function has.
    pub fn named<N: AsRef<str>>(
        names: impl IntoIterator<Item = N>,
    ) -> Result<Self, UnknownFunction> {
        let mut kinds = Vec::new();
        for name in names {
            let name = name.as_ref().trim();
            let known = optional().find(|kind| kind.name() == name);
            match known {
                Some(kind) => kinds.push(kind),
                None if name == EVERYTHING => kinds.extend(optional()),
                None if name == NOTHING => {}
                None => return Err(UnknownFunction { name: name.to_owned() }),
            }
        }
        Ok(Self::of(kinds))
    }

    /// Whether a function is in the set.
    pub fn contains(self, kind: FunctionKind) -> bool {
        self.0 & 1 << named(kind) as u16 != 0
    }

    /// The functions that are in this set and in another.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }

    /// The option of the command that chooses this set, with a space in front; empty for the default.
    pub fn option(self) -> String {
        let names: Vec<_> =
            optional().filter(|&kind| self.contains(kind)).map(FunctionKind::name).collect();
        match names.is_empty() {
            _ if self == Self::default() => String::new(),
            true => format!(" --functions {NOTHING}"),
            false => format!(" --functions {}", names.join(",")),
        }
    }
}

impl Program {
    /// The functions that the program has.
    pub fn selection(&self) -> Selection {
        let written = self.functions.iter().filter(|function| !function.outputs.is_empty());
        Selection::of(written.map(|function| named(function.kind)))
    }

    /// The option of the command that chooses the functions that the program has, as [`Selection::option`]. What the
    /// mechanism has nothing for does not count as left out: momenta without a free body, gaps without contacts,
    /// control without controllers, a projection without loops.
    pub fn option(&self) -> String {
        let Interface { free, controllers, contacts, loops, reduction, .. } = &self.interface;
        let absent = [
            (FunctionKind::Momentum, free.is_empty()),
            (FunctionKind::Control, controllers.is_empty()),
            (FunctionKind::Gaps, contacts.is_empty()),
            (FunctionKind::Projection, loops.is_empty() || reduction.is_some() && !self.solves()),
        ];
        let absent = absent.into_iter().filter(|(_, is_absent)| *is_absent);
        let absent = absent.fold(0, |set, (kind, _)| set | 1 << kind as u16);
        Selection(self.selection().and(Selection::default()).0 | absent).option()
    }

    /// The program with the functions of a set; the others have neither instructions nor outputs.
    #[must_use]
    pub fn only(&self, selection: Selection) -> Self {
        let functions = self.functions.iter().map(|function| {
            if selection.contains(function.kind) {
                return function.clone();
            }
            Function::none(function.kind)
        });
        let mut program = Self {
            interface: self.interface.clone(),
            facts: self.facts.clone(),
            functions: functions.collect(),
        };
        program.forget_unread_numbers();
        program
    }

    /// The program without the parts of a reduction beside a solution in straight-line code. Next to singular states, and with joints at
    /// stops, decompositions take their place.
    #[must_use]
    pub fn without_reduction(&self) -> Cow<'_, Self> {
        if !self.solves() || self.reduction().is_none() {
            return Cow::Borrowed(self);
        }
        let mut program = self.clone();
        for kind in [FunctionKind::Reduction, FunctionKind::ProjectionReduction] {
            program.functions[kind as usize] = Function::none(kind);
        }
        program.forget_unread_numbers();
        Cow::Owned(program)
    }

    /// Leaves out the numbers of the drawing that no function reads, with what computes them.
    fn forget_unread_numbers(&mut self) {
        let mut places = vec![None; self.interface.drawn];
        let ops = self.functions.iter().flat_map(|function| &function.instructions);
        for instruction in ops {
            if let Op::Load(Slot::Drawn(place)) = instruction.op {
                places[place] = Some(0);
            }
        }
        for (index, place) in places.iter_mut().flatten().enumerate() {
            *place = index;
        }
        let read = places.iter().flatten().count();
        if read == self.interface.drawn {
            return;
        }
        self.interface.drawn = read;
        for instruction in self.functions.iter_mut().flat_map(|it| &mut it.instructions) {
            if let Op::Load(Slot::Drawn(place)) = &mut instruction.op {
                *place = places[*place].unwrap_or(*place);
            }
        }
        let drawing = &mut self.functions[FunctionKind::Drawing as usize];
        for output in &mut drawing.outputs {
            let kept = output.entries.iter().zip(&places).filter(|(_, place)| place.is_some());
            output.entries = kept.map(|(entry, _)| *entry).collect();
            output.rows = read;
        }
        drawing.forget_unused();
    }
}

impl Function {
    /// A function that the program does not have: without outputs.
    pub fn none(kind: FunctionKind) -> Self {
        Self { kind, instructions: Vec::new(), outputs: Vec::new() }
    }

    /// A function whose values have new places among these instructions, by their places among the old.
    pub fn renumbered(
        kind: FunctionKind,
        instructions: Vec<Instruction>,
        mut outputs: Vec<Output>,
        places: &[Value],
    ) -> Self {
        for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
            *entry = places[entry.index()];
        }
        Self { kind, instructions, outputs }
    }

    /// Leaves out instructions on which no output depends.
    pub fn forget_unused(&mut self) {
        let mut is_used = vec![false; self.instructions.len()];
        let entries = || self.outputs.iter().flat_map(|output| &output.entries);
        entries().for_each(|entry| is_used[entry.index()] = true);
        for (index, instruction) in self.instructions.iter().enumerate().rev() {
            if is_used[index] {
                instruction.op.operands().for_each(|operand| is_used[operand.index()] = true);
            }
        }
        let mut places = vec![Value(usize::MAX); self.instructions.len()];
        let mut kept = Vec::new();
        for (index, mut instruction) in
            std::mem::take(&mut self.instructions).into_iter().enumerate()
        {
            if is_used[index] {
                places[index] = Value(kept.len());
                instruction.op = instruction.op.map(|operand| places[operand.index()]);
                kept.push(instruction);
            }
        }
        *self = Self::renumbered(self.kind, kept, std::mem::take(&mut self.outputs), &places);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_choose_functions_beside_those_that_every_module_has() {
        let selection = Selection::named(["acceleration"]).unwrap();
        assert!(selection.contains(FunctionKind::Acceleration));
        assert!(selection.contains(FunctionKind::Equations));
        assert!(!selection.contains(FunctionKind::Projection));
        assert!(!selection.contains(FunctionKind::Energy));
        assert_eq!(selection.option(), " --functions acceleration");
        let all = Selection::named(["all"]).unwrap();
        assert!(FunctionKind::ALL.into_iter().all(|kind| all.contains(kind)));
        assert_eq!(all.and(Selection::default()), Selection::default());
        assert!(!Selection::default().contains(FunctionKind::Jacobian));
        assert_eq!(Selection::default().option(), "");
        assert_eq!(Selection::named(["none"]).unwrap().option(), " --functions none");
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_right_ones() {
        let error = Selection::named(["acceleration", "projecton"]).unwrap_err().to_string();
        let expected = "`projecton`; there are poses, points, energy, contacts, gaps, reactions, momentum, control, \
                        tangent, acceleration, projection, jacobian, jacobian_params, `all`";
        assert!(error.contains(expected), "{error}");
    }
}
