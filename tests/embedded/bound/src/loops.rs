//! Which loop of the source a loop of the image is.

use std::collections::{BTreeMap, BTreeSet};
use std::error::Error;
use std::path::Path;

use addr2line::Loader;

use crate::graph::{Blocks, Loop};
use crate::source::{Known, Place, Sources, name_of};

/// A call that was put in place, or the function that contains the instruction: its name, and the line.
type Frame = (String, Place);

/// The loops of an image.
pub struct Loops<'a> {
    lines: Loader,
    sources: &'a Sources,
    /// Those that were met.
    met: BTreeSet<Known>,
    turns: BTreeMap<Known, u64>,
    /// The head of each, and the frames of the source.
    seen: Vec<(u32, Vec<Frame>)>,
}

impl<'a> Loops<'a> {
    /// # Errors
    /// The image cannot be read.
    pub fn new(image: &Path, sources: &'a Sources) -> Result<Self, Box<dyn Error>> {
        let lines = Loader::new(image).map_err(|error| error.to_string())?;
        Ok(Self { lines, sources, met: BTreeSet::new(), turns: BTreeMap::new(), seen: Vec::new() })
    }

    /// Counts how often the loops that were met turn at most.
    ///
    /// # Errors
    /// A variable of a loop is not known.
    pub fn count(&mut self) -> Result<(), Box<dyn Error>> {
        self.turns = self.sources.turns(&self.met)?;
        self.seen.clear();
        Ok(())
    }

    /// How often at most a loop leads back to its head. Loops within it were asked for before it.
    ///
    /// Limits may be stated for calls from one function of the source, `from`.
    ///
    /// # Errors
    /// It is not known which loop of the source it is.
    pub fn returns(
        &mut self,
        function: &str,
        from: Option<&str>,
        blocks: &Blocks,
        found: &Loop<'_>,
    ) -> Result<u64, Box<dyn Error>> {
        if let Some(limit) = self.sources.loops(function) {
            return Ok(limit);
        }
        let mut frames = self.find(blocks, found).ok_or_else(|| {
            format!("no loop of the source is known for that at {:#x}", found.head)
        })?;
        self.seen.push((found.head, frames.clone()));
        let is_own = frames.len() == 1;
        let (_, place) = frames.pop().unwrap_or_default();
        let name = from.filter(|_| is_own).or_else(|| self.sources.function(&place));
        let known = (name.unwrap_or_default().to_owned(), place);
        // The first time, how often is not known.
        let turns = self.turns.get(&known).copied().unwrap_or(1);
        self.met.insert(known);
        Ok(if found.is_tested_at_end(blocks) { turns.saturating_sub(1) } else { turns })
    }

    /// The loop of the source that a loop is: the outermost in the lines of the instructions that lead back, or else of
    /// the head, or else of all. Loops within it are others.
    fn find(&self, blocks: &Blocks, found: &Loop<'_>) -> Option<Vec<Frame>> {
        let within = self.seen.iter().filter(|(head, _)| *head != found.head);
        let within: BTreeSet<&Vec<Frame>> = within
            .filter(|(head, _)| found.blocks.contains(head))
            .map(|(_, frames)| frames)
            .collect();
        let among = |parts: &mut dyn Iterator<Item = u32>| {
            let frames = parts.flat_map(|at| &blocks[&at].addresses).map(|&at| self.frames(at));
            let loops = frames.filter(|frames| {
                let is_loop = frames.last().is_some_and(|(_, place)| self.sources.is_loop(place));
                is_loop && !within.contains(frames)
            });
            loops.min_by_key(|frames| (frames.len(), frames.clone()))
        };
        among(&mut found.back.iter().copied())
            .or_else(|| among(&mut std::iter::once(found.head)))
            .or_else(|| among(&mut found.blocks.iter().copied()))
    }

    /// The name in the limits of a function for the call at this address, if that is another one than of other calls.
    pub fn of_call(&self, function: &str, address: u32) -> Option<String> {
        let (_, place) = self.frames(address).pop()?;
        let caller = self.sources.function(&place)?;
        let name = format!("{}@{caller}", function.split('.').next()?);
        self.sources.knows(&name).then_some(name)
    }

    /// From the function itself to the innermost call that was put in place.
    fn frames(&self, address: u32) -> Vec<Frame> {
        let Ok(mut found) = self.lines.find_frames(u64::from(address)) else { return Vec::new() };
        let mut frames = Vec::new();
        while let Ok(Some(frame)) = found.next() {
            let Some((name, location)) = frame.function.zip(frame.location) else { continue };
            let Some((file, line)) = location.file.zip(location.line) else { continue };
            let Ok(name) = name.raw_name() else { continue };
            frames.push((name.into_owned(), (name_of(Path::new(file)), line)));
        }
        frames.reverse();
        frames
    }
}
