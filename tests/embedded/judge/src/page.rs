//! The table of `docs/EMBEDDED.md` against the rows that are printed.

const PAGE: &str = include_str!("../../../../docs/EMBEDDED.md");

/// Relative: a new compiler changes the numbers by a few percent.
const TOLERANCE: f64 = 0.1;

/// What is wrong with the page's row of the same name. The difference, in the first column of numbers, is rounding
/// and is checked by itself.
pub fn complaint(row: &str) -> Option<String> {
    let cells = |row: &str| row.split('|').map(|cell| cell.trim().to_owned()).collect::<Vec<_>>();
    let found = cells(row);
    let Some(written) = PAGE.lines().map(cells).find(|written| written.get(1) == found.get(1))
    else {
        return Some("docs/EMBEDDED.md has no such row".into());
    };
    let agree = |(found, written): (&String, &String)| match (found.parse(), written.parse()) {
        (Ok(found), Ok(written)) => {
            let (found, written): (f64, f64) = (found, written);
            (found - written).abs() <= TOLERANCE * written
        }
        _ => found == written,
    };
    let agrees = found.len() == written.len() && found.iter().zip(&written).skip(3).all(agree);
    (!agrees).then(|| format!("docs/EMBEDDED.md says {}", written.join(" | ")))
}
