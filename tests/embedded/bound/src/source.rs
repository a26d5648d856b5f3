//! Loops of the source, and how often each turns at most.
//!
//! The C compiler of this machine counts: it runs each `for` with the worst values of the variables in it, which
//! `limits` states, and without the conditions behind a first `&&`.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Where a loop begins: name of the file, line.
pub type Place = (String, u32);

/// A loop, and the name of its function in the limits.
pub type Known = (String, Place);

/// The sources and what is known of their variables.
pub struct Sources {
    /// The lines of each file, by its name.
    files: BTreeMap<String, Vec<String>>,
    paths: Vec<PathBuf>,
    /// Of a function (`*`: of all others too), least and largest values of variables.
    limits: BTreeMap<String, Vec<(String, [String; 2])>>,
    /// Flags of the compiler.
    flags: Vec<String>,
}

impl Sources {
    /// Reads sources in C, and the limits: lines of `FUNCTION VARIABLE = EXPRESSION`.
    ///
    /// # Errors
    /// A file cannot be read, or a limit is none.
    pub fn read(
        paths: &[PathBuf],
        limits: &Path,
        flags: &[String],
    ) -> Result<Self, Box<dyn Error>> {
        let mut files = BTreeMap::new();
        for path in paths {
            let lines = fs::read_to_string(path)?.lines().map(str::to_owned).collect();
            files.insert(name_of(path), lines);
        }
        let text = fs::read_to_string(limits)?;
        let mut limits: BTreeMap<String, Vec<_>> = BTreeMap::new();
        let lines = text.lines().map(str::trim);
        for line in lines.filter(|line| !line.is_empty() && !line.starts_with('#')) {
            let (left, range) = line.split_once('=').ok_or_else(|| format!("no limit: {line}"))?;
            let (function, name) =
                left.trim().split_once(' ').ok_or_else(|| format!("no limit: {line}"))?;
            let (least, most) = range.split_once("..").unwrap_or((range, range));
            let limit = (name.trim().to_owned(), [least, most].map(|side| side.trim().to_owned()));
            limits.entry(function.to_owned()).or_default().push(limit);
        }
        Ok(Self { files, paths: paths.to_vec(), limits, flags: flags.to_vec() })
    }

    /// Whether something is known of this function.
    pub fn knows(&self, function: &str) -> bool {
        self.limits.contains_key(function)
    }

    /// Whether a loop begins in this line.
    pub fn is_loop(&self, (file, line): &Place) -> bool {
        self.line(file, *line).is_some_and(|text| text.starts_with("for ("))
    }

    /// The function whose body contains this line: the last one that begins before it.
    pub fn function(&self, (file, line): &Place) -> Option<&str> {
        let lines = self.files.get(file)?.get(..*line as usize)?;
        let is_letter = |letter: char| letter.is_alphanumeric() || letter == '_';
        let begins = |line: &&String| line.starts_with(is_letter) && line.contains('(');
        let (head, _) = lines.iter().rev().find(begins)?.split_once('(')?;
        head.rsplit(|letter| !is_letter(letter)).next()
    }

    fn line(&self, file: &str, line: u32) -> Option<&str> {
        let lines = self.files.get(file)?;
        Some(lines.get(line.checked_sub(1)? as usize)?.trim())
    }

    /// How often every loop of a function turns at most, where its source is not known.
    pub fn loops(&self, function: &str) -> Option<u64> {
        let limits = self.limits.get(function)?;
        limits.iter().find(|(known, _)| known == "loops")?.1[1].parse().ok()
    }

    /// How often each of these loops, with the name of its function in the limits, turns at most.
    ///
    /// # Errors
    /// The compiler does not know a variable of a loop, which is then to be added to the limits.
    pub fn turns(&self, loops: &BTreeSet<Known>) -> Result<BTreeMap<Known, u64>, Box<dyn Error>> {
        let mut text = String::new();
        for path in &self.paths {
            writeln!(text, "#include \"{}\"", path.canonicalize()?.display())?;
        }
        // Without free bodies, there are as many speeds as coordinates.
        text += "#ifndef SPEEDS\n#define SPEEDS COORDINATES\n#endif\n#include <stdio.h>\nint main(void)\n{\n";
        for (function, place) in loops {
            let head = self.head(function, place).ok_or_else(|| format!("{place:?}: no loop"))?;
            writeln!(
                text,
                "{{ long turns = 0; for ({head}) turns++; printf(\"%ld\\n\", turns); }} /* {function} */"
            )?;
        }
        text += "return 0;\n}\n";
        let folder = tempfile::tempdir()?;
        let [source, program] = ["loops.c", "loops"].map(|name| folder.path().join(name));
        fs::write(&source, &text)?;
        let mut compiler = Command::new("cc");
        compiler.args(&self.flags).arg("-w").arg(&source).arg("-o").arg(&program).arg("-lm");
        let built = compiler.output()?;
        if !built.status.success() {
            return Err(String::from_utf8_lossy(&built.stderr).into());
        }
        let counted = String::from_utf8(Command::new(&program).output()?.stdout)?;
        let turns: Result<Vec<u64>, _> = counted.lines().map(str::parse).collect();
        Ok(loops.iter().cloned().zip(turns?).collect())
    }

    /// What stands in the parentheses of a `for`, with least values in place of variables where it begins, and the
    /// largest where it ends.
    fn head(&self, function: &str, (file, line): &Place) -> Option<String> {
        let text = self.line(file, *line)?.strip_prefix("for (")?;
        let mut depth = 1;
        let end = text.char_indices().find_map(|(at, letter)| {
            depth += i32::from(letter == '(') - i32::from(letter == ')');
            (depth == 0).then_some(at)
        })?;
        let mut parts = text[..end].splitn(3, ';').map(str::trim);
        let (first, condition, next) = (parts.next()?, parts.next()?, parts.next()?);
        let condition = condition.split("&&").next()?.trim();
        // What counts down begins with its largest value.
        let begins = usize::from(next.ends_with("--"));
        // What the loop itself counts has no limit.
        let own = first.split_whitespace().nth(1)?;
        let stated = self.limits.get(function).into_iter().chain(self.limits.get("*")).flatten();
        let [mut begin, mut end] = [first, condition].map(str::to_owned);
        for (name, sides) in stated.filter(|(name, _)| name != own) {
            begin = replace(&begin, name, &sides[begins]);
            end = replace(&end, name, &sides[1 - begins]);
        }
        Some(format!("{begin}; {end}; {next}"))
    }
}

/// The name of a file without its folders.
pub fn name_of(path: &Path) -> String {
    path.file_name().unwrap_or_default().to_string_lossy().into_owned()
}

/// A text with a name replaced by a value, but not within longer names.
fn replace(text: &str, name: &str, value: &str) -> String {
    let is_letter = |letter: char| letter.is_alphanumeric() || letter == '_';
    let mut parts = text.split(name);
    let mut result = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        let is_whole = !result.ends_with(is_letter) && !part.starts_with(is_letter);
        if is_whole {
            let _ = write!(result, "({value})");
        } else {
            result += name;
        }
        result += part;
    }
    result
}
