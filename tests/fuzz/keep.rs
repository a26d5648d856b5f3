//! Packs the inputs of a folder into a file of the repository, and unpacks them:
//!
//! ```text
//! rustc -o target/fuzz/keep tests/fuzz/keep.rs
//! target/fuzz/keep pack FOLDER FILE
//! target/fuzz/keep unpack FILE FOLDER
//! ```

use std::{env, fs, io};

#[path = "src/corpus.rs"]
mod corpus;

/// Longest line, bytes.
const LONGEST: usize = 2000;
/// Largest file, bytes. The shortest inputs are kept.
const LARGEST: usize = 80_000;

fn main() -> io::Result<()> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        ["pack", folder, file] => pack(folder, file),
        ["unpack", file, folder] => unpack(file, folder),
        _ => Err(io::Error::other("pack FOLDER FILE, or unpack FILE FOLDER")),
    }
}

fn pack(folder: &str, file: &str) -> io::Result<()> {
    let mut lines = Vec::new();
    for entry in fs::read_dir(folder)? {
        lines.push(corpus::line(&fs::read(entry?.path())?));
    }
    lines.sort_by_key(|line| (line.len(), line.clone()));
    lines.dedup();
    let mut text = String::new();
    for line in lines.iter().filter(|line| !line.is_empty() && line.len() <= LONGEST) {
        if text.len() + line.len() < LARGEST {
            text += line;
            text.push('\n');
        }
    }
    fs::write(file, text)
}

fn unpack(file: &str, folder: &str) -> io::Result<()> {
    fs::create_dir_all(folder)?;
    for (number, line) in fs::read_to_string(file)?.lines().enumerate() {
        let input = corpus::input(line).ok_or_else(|| io::Error::other(line.to_owned()))?;
        fs::write(format!("{folder}/kept-{number}"), input)?;
    }
    Ok(())
}
