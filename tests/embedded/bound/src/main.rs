//! Bounds of the instructions and of the stack of functions in firmware, from its code.
//!
//! ```text
//! lamc-embedded-bound IMAGE LIMITS FUNCTION[,FUNCTION..] SOURCE.c.. -- FLAG..
//! ```
//!
//! The bound of a function is the longest way through its instructions. Each loop is taken as often as it turns at
//! most, by the source line in which it begins and the limits of the variables in it, and each call with the bound of
//! the function that is called. Both branches of every decision are taken to be possible. Functions that call
//! themselves, and jumps to computed addresses, are refused. The flags are those with which the C compiler of this
//! machine reads the sources.

mod graph;
mod image;
mod loops;
mod source;

use std::collections::BTreeMap;
use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};

use graph::{Blocks, Call, blocks, longest};
use image::Image;
use loops::Loops;

/// What a call takes at most.
#[derive(Clone, Copy, Debug, Default)]
struct Bound {
    instructions: u64,
    /// Bytes.
    stack: i64,
}

/// A function, and its name in the limits where calls of it from one function have limits of their own.
type Called = (u32, Option<String>);

struct Bounds<'a> {
    image: &'a Image,
    loops: Loops<'a>,
    known: BTreeMap<Called, Bound>,
    /// The functions whose bounds are being sought.
    open: Vec<u32>,
}

impl Bounds<'_> {
    fn of(&mut self, called: &Called) -> Result<Bound, Box<dyn Error>> {
        if let Some(bound) = self.known.get(called) {
            return Ok(*bound);
        }
        let name = self.name(called.0);
        if self.open.contains(&called.0) {
            return Err(format!("{name} calls itself").into());
        }
        self.open.push(called.0);
        let blocks = blocks(self.image, called.0)?;
        let mut stack = 0;
        let mut costs = BTreeMap::new();
        for (&at, block) in &blocks {
            stack = stack.max(block.stack);
            let mut instructions = block.addresses.len() as u64;
            for call in &block.calls {
                let bound = self.of(&self.called(call))?;
                stack = stack.max(call.depth + bound.stack);
                instructions += bound.instructions;
            }
            costs.insert(at, instructions);
        }
        let instructions =
            self.longest(called, &blocks, &costs).map_err(|error| format!("{name}: {error}"))?;
        let bound = Bound { instructions, stack };
        self.open.pop();
        self.known.insert(called.clone(), bound);
        Ok(bound)
    }

    fn called(&self, call: &Call) -> Called {
        (call.function, self.loops.of_call(&self.name(call.function), call.address))
    }

    fn longest(
        &mut self,
        (function, from): &Called,
        blocks: &Blocks,
        costs: &BTreeMap<u32, u64>,
    ) -> Result<u64, Box<dyn Error>> {
        let name = self.name(*function);
        let all = blocks.keys().copied().collect();
        // Such a loop would have no way in of its own, and would count as one turn.
        if blocks.values().any(|block| block.next.contains(function)) {
            return Err("a loop begins with the first instruction".into());
        }
        let mut returns =
            |found: &graph::Loop<'_>| self.loops.returns(&name, from.as_deref(), blocks, found);
        let ways = longest(blocks, &all, *function, &|at| costs[&at], &mut returns)?;
        Ok(ways.into_values().max().unwrap_or(0))
    }

    fn name(&self, function: u32) -> String {
        self.image
            .functions
            .get(&function)
            .map_or(format!("{function:#x}"), |(name, _)| name.clone())
    }
}

fn run() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let mut halves = arguments.splitn(2, |argument| argument == "--");
    let (Some([image, limits, functions, sources @ ..]), flags) = (halves.next(), halves.next())
    else {
        return Err("IMAGE LIMITS FUNCTION[,FUNCTION..] SOURCE.c.. -- FLAG..".into());
    };
    let bytes = fs::read(image)?;
    let sources: Vec<PathBuf> = sources.iter().map(PathBuf::from).collect();
    let sources = source::Sources::read(&sources, Path::new(limits), flags.unwrap_or_default())?;
    let elf = Image::read(&bytes)?;
    let mut loops = Loops::new(Path::new(image), &sources)?;
    // The first time finds the loops, the second one knows how often they turn.
    let mut known = BTreeMap::new();
    for _ in 0..2 {
        let mut bounds = Bounds { image: &elf, loops, known: BTreeMap::new(), open: Vec::new() };
        for name in functions.split(',') {
            let begin = elf.function(name).ok_or_else(|| format!("there is no function {name}"))?;
            bounds.of(&(begin, None))?;
        }
        (known, loops) = (bounds.known, bounds.loops);
        loops.count()?;
    }
    for name in functions.split(',') {
        let Some(begin) = elf.function(name) else { continue };
        let bound = known[&(begin, None)];
        println!("{name} {} {}", bound.instructions, bound.stack);
    }
    Ok(())
}

fn main() -> ExitCode {
    match run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::FAILURE
        }
    }
}
