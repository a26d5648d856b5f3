//! The program as machine code in this process, by Cranelift.
//!
//! A [`Jit`] computes what the [`Interpreter`](lamc::program::Interpreter) computes, bit for bit:
//! the same operations in the same order, none fused, and the same functions of the host for sines
//! and the like. A function is interpreted until it has been called so often that compiling it
//! pays; on a host that Cranelift does not know, every call is interpreted.

#[cfg(test)]
mod tests;
mod translate;

use std::cell::RefCell;
use std::fmt;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use cranelift_codegen::settings::{self, Configurable, Flags};
use cranelift_jit::{JITBuilder, JITModule};
use cranelift_module::{ModuleError, default_libcall_names};

use lamc::program::{Engine, Executable, Function, FunctionKind, Interpretation, Program, Slot};

/// A program that is executed as machine code.
pub type Jit = Executable<MachineCode>;

/// Calls after which a function is compiled: by then interpreting it has taken as long as compiling
/// it takes, so that neither choice can cost more than twice the better one.
const WORTH: u32 = 600;

/// Executes functions as machine code, and interprets those that are rarely called. Clones share
/// the code, also between threads.
#[derive(Clone)]
pub struct MachineCode {
    interpretation: Interpretation,
    shared: Arc<Shared>,
    /// The cells of each function: values that were read, constants, results of one part for another, outputs.
    cells: RefCell<Vec<Vec<f64>>>,
}

/// What all clones use.
struct Shared {
    functions: Vec<Function>,
    entries: Vec<Entry>,
    memory: Mutex<Option<Memory>>,
}

/// Where a function is called from.
#[derive(Default)]
struct Entry {
    calls: AtomicU32,
    /// `None` if the function cannot be compiled.
    code: OnceLock<Option<Code>>,
}

/// A compiled function.
struct Code {
    /// The slots that it reads, in the order of its first cells.
    loads: Vec<Slot>,
    /// The parts of the function, executed one after the other on the same cells.
    parts: Vec<unsafe extern "C" fn(*mut f64)>,
    /// The cells before the first call: constants in their places, zeros elsewhere.
    initial: Vec<f64>,
    /// The cells of each output.
    outputs: Vec<Vec<usize>>,
}

/// The memory of machine code. It lives until nothing can call the code any more.
struct Memory(Option<JITModule>);

impl MachineCode {
    /// The function of this kind that it executes.
    pub fn function(&self, kind: FunctionKind) -> &Function {
        &self.shared.functions[kind as usize]
    }

    /// Compiles these functions now. Returns false if there is no machine code for the host.
    pub fn compile(&self, kinds: &[FunctionKind]) -> bool {
        kinds.iter().all(|&kind| self.compiled(kind).is_some())
    }

    /// An engine whose code goes to this memory; without memory it interprets everything.
    fn within(program: &Program, memory: Option<Memory>) -> Self {
        Self {
            interpretation: Interpretation::new(program),
            shared: Arc::new(Shared {
                functions: program.functions.clone(),
                entries: program.functions.iter().map(|_| Entry::default()).collect(),
                memory: Mutex::new(memory),
            }),
            cells: RefCell::new(vec![Vec::new(); program.functions.len()]),
        }
    }

    /// Returns the machine code of a function, and compiles it if necessary.
    fn compiled(&self, kind: FunctionKind) -> Option<&Code> {
        let Shared { functions, entries, memory } = &*self.shared;
        let compile = || {
            // A thread that panicked has not finished its function, and no other uses what it left.
            let mut memory = memory.lock().unwrap_or_else(PoisonError::into_inner);
            let module = memory.as_mut()?.0.as_mut()?;
            translate::function(module, &functions[kind as usize]).ok()
        };
        entries[kind as usize].code.get_or_init(compile).as_ref()
    }
}

impl Engine for MachineCode {
    /// Creates an engine that has compiled nothing yet.
    fn new(program: &Program) -> Self {
        Self::within(program, host().ok().map(|module| Memory(Some(module))))
    }

    fn run(&self, kind: FunctionKind, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]) {
        let Entry { calls, code } = &self.shared.entries[kind as usize];
        let code = match code.get() {
            Some(code) => code.as_ref(),
            None if calls.fetch_add(1, Ordering::Relaxed) >= WORTH => self.compiled(kind),
            None => None,
        };
        match code {
            Some(code) => code.run(&mut self.cells.borrow_mut()[kind as usize], load, out),
            None => self.interpretation.run(kind, load, out),
        }
    }
}

impl Code {
    /// Runs the code on the cells of one thread, which are empty before the first call.
    fn run(&self, cells: &mut Vec<f64>, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]) {
        if cells.is_empty() {
            cells.clone_from(&self.initial);
        }
        for (cell, slot) in cells.iter_mut().zip(&self.loads) {
            *cell = load(*slot);
        }
        for part in &self.parts {
            // SAFETY: `translate::function` made this code and these cells together: it takes one
            // pointer and touches no memory but as many cells as there are, which nobody else has
            // borrowed. The code is alive: `Shared` holds its memory beside it.
            #[allow(unsafe_code)]
            unsafe {
                part(cells.as_mut_ptr());
            }
        }
        for (output, target) in self.outputs.iter().zip(out) {
            for (&cell, slot) in output.iter().zip(target.iter_mut()) {
                *slot = cells[cell];
            }
        }
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        if let Some(module) = self.0.take() {
            // SAFETY: pointers into this memory are kept only in the `entries` of a `Shared`, which is
            // private, runs them only while it is borrowed, and goes with the memory.
            #[allow(unsafe_code)]
            unsafe {
                module.free_memory();
            }
        }
    }
}

impl fmt::Debug for MachineCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let compiled = |kind: &FunctionKind| {
            matches!(self.shared.entries[*kind as usize].code.get(), Some(Some(_)))
        };
        let names = FunctionKind::ALL.into_iter().filter(compiled);
        f.debug_tuple("MachineCode").field(&names.collect::<Vec<_>>()).finish()
    }
}

/// An empty module for this machine.
fn host() -> translate::Translated<JITModule> {
    let mut flags = settings::builder();
    // The program has been optimised already; code is called by address from anywhere.
    for (name, value) in [
        ("opt_level", "none"),
        ("is_pic", "false"),
        ("use_colocated_libcalls", "false"),
        ("enable_verifier", if cfg!(test) { "true" } else { "false" }),
    ] {
        flags.set(name, value).map_err(ModuleError::from)?;
    }
    let unknown = |reason: &str| ModuleError::Backend(std::io::Error::other(reason).into());
    let isa = cranelift_native::builder().map_err(unknown)?.finish(Flags::new(flags));
    let isa = isa.map_err(ModuleError::from)?;
    let mut builder = JITBuilder::with_isa(isa, default_libcall_names());
    builder.symbols(translate::HOST_FUNCTIONS.iter().map(|(name, address)| (*name, address())));
    Ok(JITModule::new(builder))
}
