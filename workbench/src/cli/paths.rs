//! The files of a command line: no output may overwrite an input or another output.
//!
//! Files are compared by identity, not by the spelling of their paths: `m.yaml`, `./m.yaml`, a link
//! to it and, where standard input comes from it, `-` are one file. A file that does not exist yet
//! is identified by the path at which it would be created. Devices and pipes cannot be overwritten
//! and are ignored.

use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

use lamc::files;

use super::pictures::is_numbered;
use super::{Outcome, misused, output};

/// The files of a command line, with the arguments that name them.
#[derive(Default)]
pub struct Paths<'a> {
    inputs: Vec<Named<'a>>,
    outputs: Vec<Named<'a>>,
}

/// A path as it was given, and what for.
struct Named<'a> {
    argument: &'a str,
    path: &'a str,
}

/// What makes two paths one file.
#[derive(PartialEq, Eq)]
enum Identity {
    /// Device and inode.
    #[cfg(unix)]
    Node(u64, u64),
    /// For what is not there yet, and where the system has no such numbers.
    Place(PathBuf),
}

impl<'a> Paths<'a> {
    /// Adds a file that is read, if it is given; `-` is standard input.
    pub fn input(mut self, argument: &'a str, path: impl IntoIterator<Item = &'a String>) -> Self {
        self.inputs.extend(path.into_iter().map(|path| Named { argument, path }));
        self
    }

    /// Adds a file that is written, if it is given; `-` is standard output, and `#` in its name
    /// stands for many files.
    pub fn output(mut self, argument: &'a str, path: impl IntoIterator<Item = &'a String>) -> Self {
        self.outputs.extend(path.into_iter().map(|path| Named { argument, path }));
        self
    }

    /// Whether an output goes to standard output.
    pub fn is_printed(&self) -> bool {
        self.outputs.iter().any(|output| output.path == "-")
    }

    /// Refuses, before any work, what would lose a file, and what cannot be written.
    pub fn check(&self) -> Outcome {
        self.are_apart()?;
        self.outputs.iter().try_for_each(|output| output::probe(output.path))
    }

    /// Refuses one file for an output and something else, and one standard input for two inputs.
    fn are_apart(&self) -> Outcome {
        let mut piped = self.inputs.iter().filter(|input| input.path == "-");
        if let (Some(one), Some(other)) = (piped.next(), piped.next()) {
            let [one, other] = [one.argument, other.argument];
            return Err(misused(format_args!("{one} and {other} both read standard input")));
        }
        for (number, output) in self.outputs.iter().enumerate() {
            let read = self.inputs.iter().find(|input| output.overwrites(input, io::stdin()));
            let earlier = &self.outputs[..number];
            let written = earlier.iter().find(|other| {
                other.path == output.path
                    || output.overwrites(other, io::stdout())
                    || other.overwrites(output, io::stdout())
            });
            let (other, why) = match (read, written) {
                (Some(input), _) => (input, "the input would be overwritten"),
                (None, Some(other)) => (other, "each output needs a separate file"),
                (None, None) => continue,
            };
            return Err(misused(format_args!(
                "{} {} and {} {} are the same file: {why}",
                output.argument, output.path, other.argument, other.path
            )));
        }
        Ok(())
    }
}

impl Named<'_> {
    /// Whether writing this takes the place of another file, whose `-` is `stream`.
    fn overwrites(&self, other: &Named<'_>, stream: impl Stream) -> bool {
        let path = Path::new(self.path);
        let Some(taken) = identity(Path::new(other.path), stream) else { return false };
        let series = path.file_name().and_then(|name| name.to_str()).filter(|n| n.contains('#'));
        let Some(series) = series else {
            return identity(path, io::stdout()) == Some(taken);
        };
        let stands_for = |found: &Path| {
            let name = found.file_name().and_then(|name| name.to_str());
            name.is_some_and(|name| is_numbered(series, name))
        };
        // Of those that are there, each may be a link to the other file.
        let folder = files::folder(path);
        let there = fs::read_dir(folder).into_iter().flatten().flatten();
        let mut there = there.map(|entry| entry.path()).filter(|found| stands_for(found));
        let place = files::place(Path::new(other.path));
        there.any(|found| identity(&found, io::stdout()).as_ref() == Some(&taken))
            || (stands_for(&place) && files::place(folder) == files::folder(&place))
    }
}

/// What a path means where it can be overwritten: a file, or nothing yet.
fn identity(path: &Path, stream: impl Stream) -> Option<Identity> {
    if path == Path::new("-") {
        return stream.metadata().filter(Metadata::is_file).and_then(|found| node(&found));
    }
    match fs::metadata(path) {
        Ok(found) if !found.is_file() => None,
        Ok(found) => Some(node(&found).unwrap_or_else(|| Identity::Place(files::place(path)))),
        Err(_) => Some(Identity::Place(files::place(path))),
    }
}

#[cfg(unix)]
fn node(found: &Metadata) -> Option<Identity> {
    use std::os::unix::fs::MetadataExt;

    Some(Identity::Node(found.dev(), found.ino()))
}

#[cfg(not(unix))]
fn node(_: &Metadata) -> Option<Identity> {
    None
}

/// Standard input or output, which may have been redirected to a file.
trait Stream {
    fn metadata(&self) -> Option<Metadata>;
}

#[cfg(unix)]
impl<S: std::os::fd::AsFd> Stream for S {
    fn metadata(&self) -> Option<Metadata> {
        let copy = self.as_fd().try_clone_to_owned().ok()?;
        fs::File::from(copy).metadata().ok()
    }
}

#[cfg(not(unix))]
impl<S> Stream for S {
    fn metadata(&self) -> Option<Metadata> {
        None
    }
}
