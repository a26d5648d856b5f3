//! Configurations to compare with, as CSV: the first column holds names, the others angles of joints.

use lamc::source::Diagnostics;

use super::table::Table;

/// The angles of all joints under a name.
#[derive(Clone, Debug, PartialEq)]
pub struct Configuration {
    /// What the first column calls it.
    pub name: String,
    /// By joint, rad.
    pub q: Vec<f64>,
}

/// Reads the angles of these joints: radians in a column `joint`, degrees in `joint [deg]`.
///
/// # Errors
/// Returns an error for each joint without a column and each field that is not a number.
pub fn configurations(text: &str, joints: &[&str]) -> Result<Vec<Configuration>, Diagnostics> {
    let table = Table::read(text)?;
    let mut columns = Vec::new();
    let mut missing = Diagnostics::default();
    for joint in joints {
        let degrees = table.column(&format!("{joint} [deg]"));
        let column = degrees.map(|column| (column, 1_f64.to_radians()));
        match column.or_else(|| table.column(joint).map(|column| (column, 1.0))) {
            Some(column) => columns.push(column),
            None => missing.push(table.missing(format!("no column for joint `{joint}`"))),
        }
    }
    if missing.has_errors() {
        return Err(missing);
    }
    let mut all = Vec::new();
    table.rows(|row| {
        let angle = |&(column, unit): &(usize, f64)| -> Result<f64, Diagnostics> {
            let number = row.number(column)?.map(|number| unit * number);
            number.ok_or_else(|| row.wrong(column, "a number").into())
        };
        let q = columns.iter().map(angle).collect::<Result<_, _>>()?;
        all.push(Configuration { name: row.field(0).to_owned(), q });
        Ok(())
    })?;
    Ok(all)
}
