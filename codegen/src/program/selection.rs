//! Which functions of a mechanism a backend writes.

use super::ir::{Function, Program};
use super::signature::FunctionKind;

/// Every function at once, among the names of functions.
const EVERYTHING: &str = "all";

/// No function, among the names of functions.
const NOTHING: &str = "none";

/// A set of functions. Those that solve may be left out, because the runtime then solves by its own
/// algorithms; all others are in every set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Selection(u16);

impl Default for Selection {
    /// Everything but the unrolled Jacobian, which is longer than all the others together: the
    /// runtime differentiates through the tangent function instead.
    fn default() -> Self {
        Self::of(optional().filter(|&kind| kind != FunctionKind::Jacobian))
    }
}

/// A name that no function has.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "no function that can be left out is called `{name}`; there are {}, `all` and `none`",
    optional().map(FunctionKind::name).collect::<Vec<_>>().join(", ")
)]
pub struct UnknownFunction {
    name: String,
}

/// The functions that a module may do without.
fn optional() -> impl Iterator<Item = FunctionKind> {
    FunctionKind::ALL.into_iter().filter(|kind| kind.signature().is_optional)
}

impl Selection {
    fn of(kinds: impl IntoIterator<Item = FunctionKind>) -> Self {
        let needed = FunctionKind::ALL.into_iter().filter(|kind| !kind.signature().is_optional);
        Self(kinds.into_iter().chain(needed).fold(0, |set, kind| set | 1 << kind as u16))
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
        self.0 & 1 << kind as u16 != 0
    }

    /// The names by which the set is asked for, without those that every set has.
    pub fn names(self) -> impl Iterator<Item = &'static str> {
        optional().filter(move |&kind| self.contains(kind)).map(FunctionKind::name)
    }
}

impl Program {
    /// The program with the functions of a set; the others have neither instructions nor outputs.
    #[must_use]
    pub fn only(&self, selection: Selection) -> Self {
        let functions = self.functions.iter().map(|function| {
            if selection.contains(function.kind) {
                return function.clone();
            }
            Function { kind: function.kind, instructions: Vec::new(), outputs: Vec::new() }
        });
        Self { interface: self.interface.clone(), functions: functions.collect() }
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
        assert_eq!(selection.names().collect::<Vec<_>>(), ["acceleration"]);
        let all = Selection::named(["all"]).unwrap();
        assert!(FunctionKind::ALL.into_iter().all(|kind| all.contains(kind)));
        let default = Selection::default();
        assert_eq!(default.names().collect::<Vec<_>>(), ["acceleration", "projection"]);
    }

    #[test]
    fn a_wrong_name_is_answered_with_the_right_ones() {
        let error = Selection::named(["acceleration", "projecton"]).unwrap_err().to_string();
        assert!(
            error.contains("`projecton`; there are acceleration, projection, jacobian"),
            "{error}"
        );
    }
}
