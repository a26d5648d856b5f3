//! The text of functions in numbered statements, shortened.

use std::collections::{HashMap, HashSet};

/// Shortens the lines of a function: a third is blanks and repeated names, and many values are only handed to other parts.
pub fn shorten(lines: Vec<String>) -> Vec<String> {
    let names = [("mul_add(", "f("), ("kept[", "k["), (", ", ",")];
    let operators = [(" = ", "="), (" + ", "+"), (" - ", "-"), (" * ", "*"), (" / ", "/")];
    let short = |line: String| {
        let replaced = |text: String, (long, short): (&str, &str)| text.replace(long, short);
        names.into_iter().chain(operators).fold(line.trim_start().to_owned(), replaced)
    };
    let mut lines = stored_at_once(lines.into_iter().map(short).collect());
    for (declaration, use_of) in [("let k = kept;", "k["), ("let f = mul_add;", "f(")] {
        if lines.iter().any(|line| line.contains(use_of)) {
            lines.insert(0, declaration.to_owned());
        }
    }
    lines
}

/// Stores values that only other parts use where they are computed: `let a1=x;` .. `k[7]=a1;` becomes `k[7]=x;`. A cell that
/// is read later, with a value from before, stays as it is until then.
fn stored_at_once(lines: Vec<String>) -> Vec<String> {
    let (mut uses, mut last_reads, mut cells) = (HashMap::new(), HashMap::new(), HashMap::new());
    for (index, line) in lines.iter().enumerate() {
        words(line).for_each(|word| *uses.entry(word).or_insert(0) += 1);
        if let Some((cell, name)) = store(line) {
            cells.insert(name, cell);
        } else {
            let reads = line.split("k[").skip(1).filter_map(|read| read.split(']').next());
            last_reads.extend(reads.map(|cell| (cell, index)));
        }
    }
    let (mut stored, mut written) = (HashSet::new(), Vec::new());
    for (index, line) in lines.iter().enumerate() {
        if store(line).is_some_and(|(_, name)| stored.contains(name)) {
            continue;
        }
        let is_whole = line.ends_with(';');
        let defined = line.strip_prefix("let ").and_then(|line| line.split_once('='));
        let moved = defined.filter(|(name, _)| is_whole && uses.get(name) == Some(&2));
        let moved = moved.and_then(|(name, value)| Some((name, cells.get(name)?, value)));
        match moved {
            Some((name, cell, value)) if last_reads.get(cell).is_none_or(|&last| last <= index) => {
                stored.insert(name);
                written.push(format!("k[{cell}]={value}"));
            }
            _ => written.push(line.clone()),
        }
    }
    written
}

/// The cell and the name, if a line stores a named value for other parts.
fn store(line: &str) -> Option<(&str, &str)> {
    let (cell, name) = line.strip_prefix("k[")?.strip_suffix(';')?.split_once("]=")?;
    words(name).eq([name]).then_some((cell, name))
}

fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !c.is_ascii_alphanumeric() && c != '_')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_for_other_parts_are_stored_at_once() {
        let lines = [
            "    let a1 = q[0] - kept[5];",
            "    let b1 = mul_add(a1, kept[3], u[0]);",
            "    let c1 = a1 / b1;",
            "    let d1 = kept[4] * c(-N1);",
            "    kept[4] = c1;",
            "    kept[5] = b1;",
            "    kept[6] = d1;",
        ];
        let expected = [
            "let f = mul_add;",
            "let k = kept;",
            "let a1=q[0]-k[5];",
            "let b1=f(a1,k[3],u[0]);",
            // Cell 4 is read in the next line.
            "let c1=a1/b1;",
            "k[6]=k[4]*c(-N1);",
            "k[4]=c1;",
            // b1 is used here too.
            "k[5]=b1;",
        ];
        assert_eq!(shorten(lines.map(str::to_owned).into()), expected);
    }
}
