//! Makes a failing model shorter.
//!
//! Delta debugging on lines and on the entries of flow mappings and sequences (A. Zeller and R. Hildebrandt,
//! "Simplifying and isolating failure-inducing input", 2002): parts are left out as long as the text still
//! fails in the same way.

/// The shortest text found that still fails.
pub fn shrunk(text: &str, fails: &dyn Fn(&str) -> bool) -> String {
    let mut best = text.to_owned();
    loop {
        let before = best.len();
        best =
            without(&best, fails, |text| text.split_inclusive('\n').map(str::to_owned).collect());
        best = without(&best, fails, entries);
        if best.len() == before {
            return best;
        }
    }
}

/// Leaves out runs of parts, long runs first.
fn without(
    text: &str,
    fails: &dyn Fn(&str) -> bool,
    parts: impl Fn(&str) -> Vec<String>,
) -> String {
    let mut parts = parts(text);
    let mut length = parts.len().div_ceil(2).max(1);
    loop {
        let mut begin = 0;
        while begin < parts.len() {
            let end = (begin + length).min(parts.len());
            let rest: Vec<String> = [&parts[..begin], &parts[end..]].concat();
            if fails(&rest.concat()) {
                parts = rest;
            } else {
                begin = end;
            }
        }
        if length == 1 {
            return parts.concat();
        }
        length = length.div_ceil(2);
    }
}

/// The text cut behind each comma.
fn entries(text: &str) -> Vec<String> {
    text.split_inclusive(", ").map(str::to_owned).collect()
}
