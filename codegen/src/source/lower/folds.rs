//! `pattern.fold`: the angles of the finished fold of creases to which the drawing gives none.

use lamc_drawings::Role;

use crate::source::codes;
use crate::source::diagnostic::Diagnostic;
use crate::source::fields::Fields;
use crate::source::pattern::{FOLDED, Sheet};
use crate::source::schema::FOLD;

use super::Lowering;

impl Lowering<'_> {
    /// Reads the angles of the finished fold: of mountains, then of valleys.
    pub(super) fn folds(&mut self, pattern: &Fields) -> Option<[f64; 2]> {
        let Some(entry) = pattern.entry("fold") else { return Some(FOLDED) };
        let (at, found) = (entry.key.span, &mut self.diagnostics);
        let fields = Fields::new(&entry.value, at, "`fold`", &FOLD, found)?;
        let signed = [("mountain", -1.0, "-180 to 0"), ("valley", 1.0, "0 to 180")];
        let read = signed.map(|(key, sign, range)| {
            let Some(fold) = self.optional(&fields, key)? else { return Some(sign * FOLDED[1]) };
            if (0.0..=FOLDED[1]).contains(&(sign * fold.value)) {
                return Some(fold.value);
            }
            let message = format!("a {key} folds by {range} deg");
            self.note(Diagnostic::error(codes::FOLD_SIGN, fold.span, message));
            None
        });
        Some([read[0]?, read[1]?])
    }

    /// Warns of an angle of mountains or valleys that none of them takes, because the drawing gives them others.
    pub(super) fn unused_folds(&mut self, pattern: &Fields, sheet: &Sheet) {
        for (key, role, plural) in
            [("mountain", Role::Mountain, "mountains"), ("valley", Role::Valley, "valleys")]
        {
            let Some(node) = pattern.get("fold").and_then(|fold| fold.get(key)) else { continue };
            let mut lines = sheet.lines.iter().filter(|line| line.role == role).peekable();
            if lines.peek().is_none() || lines.any(|line| line.fold.is_none()) {
                continue;
            }
            let message =
                format!("the drawing gives angles to all {plural}, so this one is not used");
            let warning = Diagnostic::warning(codes::UNUSED_FOLD, node.span, message);
            self.note(warning.hint(
                "in SVG an opacity that is written is the angle over 180 deg, also an opacity of 1",
            ));
        }
    }
}
