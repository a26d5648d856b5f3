//! Aliases as keys, as PyYAML wrote them before version 6: `*id003: 600.0`.
//!
//! YAML 1.2 lets the name of an anchor contain a colon (production 102, `ns-anchor-char`), so that the
//! alias of such a line is called `id003:` and the line has no colon that separates a key from its
//! value. A space before the colon would do, but every later position in the text would then be off by
//! one. Therefore the names are shortened by the letter `i`, with a space behind: `*d003 : 600.0`.

use std::borrow::Cow;

/// How PyYAML names its anchors: this prefix and at least three digits.
const PREFIX: &str = "id";
const FEWEST_DIGITS: usize = 3;

/// Returns a text of the same length in which aliases that are keys are followed by a space. Texts
/// without Python objects, and texts without such keys, stay as they are.
pub(super) fn spaced(text: &str) -> Cow<'_, str> {
    if !text.contains("!!python/") || !text.lines().any(begins_with_alias_key) {
        return Cow::Borrowed(text);
    }
    let mut spaced = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find(['&', '*']) {
        let (before, marked) = rest.split_at(at);
        let follows =
            before.chars().next_back().is_none_or(|c| c.is_whitespace() || "[,{".contains(c));
        let name = follows.then(|| name(&marked[1..])).flatten();
        spaced.push_str(before);
        spaced.push_str(&marked[..1]);
        rest = &marked[1..];
        if let Some(length) = name {
            spaced.push_str(&rest[1..length]);
            spaced.push(' ');
            rest = &rest[length..];
        }
    }
    spaced.push_str(rest);
    Cow::Owned(spaced)
}

/// Returns the length of the name at the beginning of a text if PyYAML gave it.
fn name(text: &str) -> Option<usize> {
    let digits = text.strip_prefix(PREFIX)?;
    let count = digits.bytes().take_while(u8::is_ascii_digit).count();
    let ends =
        digits[count..].chars().next().is_none_or(|c| c.is_whitespace() || ":],}".contains(c));
    (count >= FEWEST_DIGITS && ends).then_some(PREFIX.len() + count)
}

/// Whether a line has the form `*id003: value`, perhaps in a list.
fn begins_with_alias_key(line: &str) -> bool {
    let line = line.trim_start_matches([' ', '-', '?']);
    let Some(alias) = line.strip_prefix('*') else { return false };
    name(alias).is_some_and(|length| {
        let rest = &alias[length..];
        rest.starts_with(": ") || rest.trim_end() == ":"
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_get_a_space_and_nothing_moves() {
        for (text, expected) in [
            (
                "!!python/tuple\n- &id003 x\n- *id003: 600.0\n- {a: *id003, b: [*id003]}\n- *id003:\n",
                "!!python/tuple\n- &d003  x\n- *d003 : 600.0\n- {a: *d003 , b: [*d003 ]}\n- *d003 :\n",
            ),
            // No key of this kind, no name of PyYAML, no file of Python.
            ("!!python/tuple\n- &id003 x\n- *id003\n", "!!python/tuple\n- &id003 x\n- *id003\n"),
            ("!!python/tuple\n- &id03 x\n- *id03: 1\n", "!!python/tuple\n- &id03 x\n- *id03: 1\n"),
            ("- &id003 x\n- *id003: 1\n", "- &id003 x\n- *id003: 1\n"),
        ] {
            assert_eq!(spaced(text), expected);
            assert_eq!(spaced(text).len(), text.len());
        }
    }
}
