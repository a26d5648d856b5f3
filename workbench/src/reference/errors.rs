//! `docs/ERRORS.md`: every code of diagnostics with its cause, an example and its cure; and single
//! entries for `lamc explain`.

use std::fmt::Write;

use lamc::source::Code;
use lamc::source::codes::GROUPS;

/// The page as it is in this program. It is a copy of `docs/ERRORS.md`, because the package of this crate has no
/// `docs/`, and some file systems do not support symbolic links.
const PAGE: &str = include_str!("ERRORS.md");

const BEGINNING: &str = "\
# Errors and warnings

lamc reports mistakes and unusual values in a file with their position in the file and a code. This
page explains the cause of each code, shows a short file with the report, and says how to correct it.
`lamc explain CODE` prints the entry of one code. Errors stop the compilation; warnings and notes do not.

This page is generated from the table of codes in the compiler and from the files in `tests/wrong`.
";

/// An example of a file with a mistake.
pub struct Example {
    /// The extension of its name: `yaml`, `csv` or `json`.
    pub language: String,
    /// Its text.
    pub text: String,
    /// The diagnostic of the file that has the code.
    pub report: String,
}

/// Writes the page, with the example that `of` returns for each code.
pub fn errors_page(of: impl Fn(Code) -> Option<Example>) -> String {
    let mut page = String::from(BEGINNING);
    for (title, codes) in GROUPS {
        // Writing to a string cannot fail.
        let _ = write!(page, "\n## {title}\n");
        for code in *codes {
            page.push_str(&entry(*code, of(*code).as_ref()));
        }
    }
    page
}

fn entry(code: Code, example: Option<&Example>) -> String {
    let mut entry = format!("\n### {}\n\n{}\n\n", code.name, code.cause);
    match (example, code.no_example) {
        (Some(Example { language, text, report }), _) => {
            let (text, report) = (text.trim_end(), report.trim_end());
            let _ = write!(entry, "```{language}\n{text}\n```\n\n```text\n{report}\n```\n\n");
        }
        (None, Some(reason)) => {
            let _ = write!(entry, "No example is shown: {reason}.\n\n");
        }
        (None, None) => {}
    }
    let _ = writeln!(entry, "**What to do:** {}", code.cure);
    entry
}

/// The entry of a code, if there is such a code.
pub fn explain(code: &str) -> Option<&'static str> {
    let heading = format!("\n### {code}\n");
    let (_, entry) = PAGE.split_once(&heading)?;
    let end = entry.find("\n### ").into_iter().chain(entry.find("\n## ")).min();
    Some(entry[..end.unwrap_or(entry.len())].trim())
}
