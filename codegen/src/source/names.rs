//! Names: which names are valid, and suggestions for unknown names.
//!
//! Names end up in Rust, in a C99 header that C++ may include, and in Python scripts around both.

use super::codes;
use super::diagnostic::{Diagnostic, Diagnostics, Spanned};
use super::formula;
use super::render::MOST_SHOWN;
use super::yaml::shorten;

#[rustfmt::skip]
const RUST_KEYWORDS: &[&str] = &[
    "Self", "abstract", "as", "async", "await", "become", "box", "break", "const", "continue",
    "crate", "do", "dyn", "else", "enum", "extern", "false", "final", "fn", "for", "gen", "if",
    "impl", "in", "let", "loop", "macro", "match", "mod", "move", "mut", "override", "priv", "pub",
    "ref", "return", "self", "static", "struct", "super", "trait", "true", "try", "type", "typeof",
    "unsafe", "unsized", "use", "virtual", "where", "while", "yield",
];
#[rustfmt::skip]
const C_KEYWORDS: &[&str] = &[
    "_Bool", "_Complex", "_Imaginary", "auto", "bool", "break", "case", "char", "const", "continue",
    "default", "do", "double", "else", "enum", "extern", "float", "for", "goto", "if", "inline",
    "int", "long", "register", "restrict", "return", "short", "signed", "sizeof", "static",
    "struct", "switch", "typedef", "union", "unsigned", "void", "volatile", "while",
];
#[rustfmt::skip]
const CPP_KEYWORDS: &[&str] = &[
    "alignas", "alignof", "and", "and_eq", "asm", "bitand", "bitor", "catch", "class", "compl",
    "concept", "consteval", "constexpr", "constinit", "const_cast", "co_await", "co_return",
    "co_yield", "decltype", "delete", "dynamic_cast", "explicit", "export", "friend", "mutable",
    "namespace", "new", "noexcept", "not", "not_eq", "nullptr", "operator", "or", "or_eq",
    "private", "protected", "public", "reinterpret_cast", "requires", "static_assert",
    "static_cast", "template", "this", "thread_local", "throw", "typeid", "typename", "using",
    "wchar_t", "xor", "xor_eq",
];
#[rustfmt::skip]
const PYTHON_KEYWORDS: &[&str] = &[
    "False", "None", "True", "and", "as", "assert", "async", "await", "break", "class", "continue",
    "def", "del", "elif", "else", "except", "finally", "for", "from", "global", "if", "import",
    "in", "is", "lambda", "nonlocal", "not", "or", "pass", "raise", "return", "try", "while",
    "with", "yield",
];
/// Names with a fixed meaning in expressions: time, coordinates, speeds and pi.
const EXPRESSION_NAMES: &[&str] = &["pi", "q", "t", "u"];

/// Identifiers that cannot be used, with the reason.
const RESERVED: [(&[&str], &str); 7] = [
    (RUST_KEYWORDS, "a keyword of Rust"),
    (C_KEYWORDS, "a keyword of C"),
    (CPP_KEYWORDS, "a keyword of C++, which may include the C header"),
    (PYTHON_KEYWORDS, "a keyword of Python"),
    (EXPRESSION_NAMES, "a name with a fixed meaning in expressions"),
    (&["null", "NULL"], "the null value of YAML and C"),
    (&["_"], "not an identifier in Rust"),
];

/// Returns why an identifier cannot be used; `None` if it can.
fn reserved(name: &str) -> Option<&'static str> {
    RESERVED.iter().find(|(list, _)| list.contains(&name)).map(|(_, reason)| *reason)
}

/// Returns the identifiers that cannot be names of this kind.
pub fn reserved_names(kind: Kind) -> Vec<&'static str> {
    let mut names: Vec<&str> = RESERVED.iter().flat_map(|(list, _)| list.iter().copied()).collect();
    if matches!(kind, Kind::Symbol(_)) {
        names.extend(formula::functions());
    }
    names.sort_unstable();
    names.dedup();
    names
}

/// Returns whether the word is reserved in Rust, C, C++ or Python.
pub fn is_keyword(name: &str) -> bool {
    [RUST_KEYWORDS, C_KEYWORDS, CPP_KEYWORDS, PYTHON_KEYWORDS]
        .iter()
        .any(|list| list.contains(&name))
}

/// Returns whether the name has only letters, digits and `_` and does not start with a digit.
pub fn is_identifier(name: &str) -> bool {
    !name.starts_with(|c: char| c.is_ascii_digit())
        && !name.is_empty()
        && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
}

/// Purpose of a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// A parameter or input (with its article): expressions can use the name.
    Symbol(&'static str),
    /// Anything else, with its article: `a body`.
    Other(&'static str),
}

/// Reports a name that cannot be an identifier of the generated code.
pub(super) fn check(name: &Spanned<String>, kind: Kind, diagnostics: &mut Diagnostics) {
    let text = name.value.as_str();
    let (Kind::Symbol(what) | Kind::Other(what)) = kind;
    if !is_identifier(text) {
        let message = format!("`{}` cannot be the name of {what}", shorten(text));
        diagnostics.push(
            Diagnostic::error(codes::BAD_NAME, name.span, message)
                .label("a name has letters, digits and `_`, and does not start with a digit")
                .hint(format!("write `{}`", identifier_from(text))),
        );
        return;
    }
    let reason = match kind {
        Kind::Symbol(_) if formula::is_function(text) => Some("a function of expressions"),
        _ => reserved(text),
    };
    if let Some(reason) = reason {
        let suffix = what.rsplit(' ').next().unwrap_or_default();
        diagnostics.push(
            Diagnostic::error(
                codes::RESERVED_NAME,
                name.span,
                format!("`{text}` cannot be the name of {what}"),
            )
            .label(format!("`{text}` is {reason}"))
            .hint(format!("use another name, such as `{text}_{suffix}`")),
        );
    }
}

/// Returns an identifier that is similar to `text`: `4th Design` -> `m4th_Design`.
pub(super) fn identifier_from(text: &str) -> String {
    let name: String =
        text.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let letters = name.trim_matches('_');
    match letters {
        "" => "model".into(),
        _ if is_identifier(letters) && reserved(letters).is_none() => letters.into(),
        _ => format!("m{letters}"),
    }
}

/// Returns the known name that is most similar to `name`.
pub fn closest<'k>(name: &str, known: &[&'k str]) -> Option<&'k str> {
    /// Least similarity: suggestions below it are not useful.
    const SIMILAR: f64 = 0.8;
    /// Longest name, in bytes, that is compared: the time grows as the product of the lengths.
    const LONGEST: usize = 100;
    /// Most names that are compared. The largest models have some thousand bodies.
    const MOST: usize = 5000;
    if name.len() > LONGEST {
        return None;
    }
    let known = known.iter().take(MOST).filter(|candidate| candidate.len() <= LONGEST);
    known
        .map(|candidate| {
            let similarity = strsim::jaro_winkler(&name.to_lowercase(), &candidate.to_lowercase());
            (similarity, *candidate)
        })
        .filter(|(similarity, candidate)| *similarity > SIMILAR || is_slip(name, candidate))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, candidate)| candidate)
}

/// Returns whether two names differ by one letter that is wrong, missing, added or swapped with its
/// neighbour.
fn is_slip(name: &str, candidate: &str) -> bool {
    const SHORTEST: usize = 3;
    name.chars().count() >= SHORTEST && strsim::damerau_levenshtein(name, candidate) == 1
}

/// Returns a hint for an unknown name, as [`alternatives`] does, if a report can still show it after `earlier`
/// mistakes. Otherwise thousands of mistakes would each be compared with thousands of names.
pub(super) fn hint<'k>(
    earlier: usize,
    name: &str,
    known: impl FnOnce() -> Vec<&'k str>,
    plural: &str,
) -> Option<String> {
    (earlier < MOST_SHOWN).then(|| alternatives(name, &known(), plural))
}

/// Returns a hint for an unknown name: a similar name, or all known names.
pub fn alternatives(name: &str, known: &[&str], plural: &str) -> String {
    match closest(name, known) {
        Some(meant) => format!("did you mean `{meant}`?"),
        None if known.is_empty() => format!("there are no {plural}"),
        None if known.len() == 1 => format!("there is only `{}`", shorten(known[0])),
        None => format!("the {plural} are {}", quote_list(known)),
    }
}

/// Returns a list such as `` `a`, `b` and `c` ``; long lists are cut.
pub(super) fn quote_list(names: &[&str]) -> String {
    const MOST: usize = 16;
    let quoted: Vec<_> =
        names.iter().take(MOST).map(|name| format!("`{}`", shorten(name))).collect();
    match quoted.as_slice() {
        _ if names.len() > MOST => format!("{} and {} more", quoted.join(", "), names.len() - MOST),
        [first @ .., last] if !first.is_empty() => format!("{} and {last}", first.join(", ")),
        _ => quoted.concat(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stems_become_identifiers() {
        for (stem, name) in [
            ("sixbar", "sixbar"),
            ("4th_Design", "m4th_Design"),
            ("W_3.5", "W_3_5"),
            ("fünf-gelenk", "f_nf_gelenk"),
            ("for", "mfor"),
            ("params", "params"),
            ("...", "model"),
        ] {
            assert_eq!(identifier_from(stem), name, "{stem}");
            let spanned = Spanned { value: name.to_owned(), span: Default::default() };
            let mut diagnostics = Diagnostics::default();
            check(&spanned, Kind::Other("a model"), &mut diagnostics);
            assert!(!diagnostics.has_errors(), "{diagnostics}");
        }
    }

    #[test]
    fn what_is_meant() {
        assert_eq!(closest("left_am", &["right_arm", "left_arm"]), Some("left_arm"));
        assert_eq!(closest("stifness", &["damping", "stiffness"]), Some("stiffness"));
        assert_eq!(closest("amr", &["base", "arm"]), Some("arm"));
        assert_eq!(closest("j7", &["j0", "j1"]), None);
    }
}
