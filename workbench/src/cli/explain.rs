//! `lamc explain CODE`: the entry of `docs/ERRORS.md`.

use lamc::source::{closest_name, codes};
use lamc_workbench::reference;

use super::{Outcome, misused, output};

/// Prints the explanation of a code, or all codes.
pub fn run(code: Option<&str>) -> Outcome {
    let names: Vec<&str> = codes::all().map(|code| code.name).collect();
    let Some(code) = code else {
        return output::print((names.join("\n") + "\n").as_bytes());
    };
    // The code may be copied from a report with its brackets.
    let code =
        code.trim_start_matches("error[").trim_start_matches("warning[").trim_end_matches(']');
    if let Some(entry) = reference::explain(code) {
        return output::print(format!("{code}\n\n{entry}\n").as_bytes());
    }
    Err(match closest_name(code, &names) {
        Some(meant) => misused(format_args!("there is no code `{code}`: did you mean `{meant}`?")),
        None => misused(format_args!("there is no code `{code}`; `lamc explain` lists all codes")),
    })
}
