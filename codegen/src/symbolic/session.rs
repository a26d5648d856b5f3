//! Sessions of the engine, bindings, and derivatives through bindings.
//!
//! Without a licence key, each user may run the engine in only one thread of one process at a time, and
//! the engine ends the process that requests a second one. Therefore only one session runs at a time.
//! It has its own thread, which lives as long as the session. A lock within the process and a locked
//! file between processes make other sessions wait.
//!
//! Without a key the engine writes a banner to standard output, unless the environment has `SYMBOLICA_HIDE_BANNER`: the
//! command sets it for the process that derives, and `.cargo/config.toml` for those that cargo runs here.
//!
//! The engine orders the terms of a sum by the age of their symbols in the process. Each session
//! therefore takes its symbols from one pool (`v0`, `v1`, ...), in the order in which it needs them, after those of
//! all functions. So the order of terms depends only on the session, and not on what the process derived before.

use std::fs::{self, File, TryLockError};
use std::io::{Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};
use std::{env, io, process, thread};

use rustc_hash::FxHashMap;
use symbolica::atom::{Atom, AtomCore, AtomView, Symbol};
use symbolica::coefficient::CoefficientView;
use symbolica::symbol;

use super::expr::{Expr, create_opaque, opaque_function};
use super::tree::{Function, Tree};

/// The reason why no session could be started.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// The lock file, which lets only one process at a time hold a session, cannot be opened or locked.
    #[error(
        "cannot lock {path}: {error}; lamc needs a folder that it may write: set HOME or TMPDIR"
    )]
    Lock {
        /// Path of the lock file.
        path: PathBuf,
        /// Error from the operating system.
        error: io::Error,
    },
    /// Another process has held its session for as long as we wait.
    #[error(
        "another lamc{holder} has derived equations for {seconds} s: end it, or let lamc wait longer with LAMC_WAIT=SECONDS"
    )]
    Busy {
        /// Its id as ` (pid 123)`, or nothing.
        holder: String,
        /// How long this process has waited, s.
        seconds: u64,
    },
    /// No thread could be started.
    #[error("cannot start the thread of the symbolic engine: {0}")]
    Thread(io::Error),
}

/// Stack size of the session's thread. A derivative recurses once per binding on the path to a leaf.
const STACK_BYTES: usize = 256 << 20;

/// Starts a session and runs `work` with an empty [`Algebra`], after all other sessions of this user
/// have ended.
///
/// # Errors
/// Returns an error if the lock file cannot be locked within [`patience`], or if the thread cannot be started. A panic
/// in `work` is propagated.
pub fn session<L, B, R>(
    work: impl FnOnce(&mut Algebra<L, B>) -> R + Send,
) -> Result<R, SessionError>
where
    R: Send,
{
    static TURN: Mutex<()> = Mutex::new(());
    let _turn = TURN.lock().unwrap_or_else(PoisonError::into_inner);
    let _file = lock_file()?;
    thread::scope(|scope| {
        thread::Builder::new()
            .name("symbolic".to_owned())
            .stack_size(STACK_BYTES)
            .spawn_scoped(scope, || work(&mut Algebra::new()))
            .map_err(SessionError::Thread)?
            .join()
            .map_err(|panic| std::panic::resume_unwind(panic))
    })
}

/// Time after which we print that we wait for another process to release the lock file.
const SILENCE: Duration = Duration::from_secs(1);

/// How often a locked file is tried again.
const LOOK: Duration = Duration::from_millis(10);

/// How long a process waits for another one that uses the engine: ten minutes, or `LAMC_WAIT` seconds if this variable
/// of the environment is a whole number.
pub fn patience() -> Duration {
    let asked = env::var("LAMC_WAIT").ok().and_then(|text| text.trim().parse().ok());
    Duration::from_secs(asked.unwrap_or(600))
}

/// Waits for the lock on the file that serialises the processes of one user. The file is unlocked when
/// it is dropped. It contains the id of the process that holds the lock, so that waiting processes can
/// print it.
fn lock_file() -> Result<File, SessionError> {
    let folder = env::home_dir().map(|home| home.join(".cache").join("lamc"));
    let folder = folder.filter(|folder| fs::create_dir_all(folder).is_ok());
    let at_home = folder.map(|folder| folder.join("symbolic.lock"));
    let path = at_home.unwrap_or_else(|| env::temp_dir().join("lamc-symbolic.lock"));
    let failed = |error| SessionError::Lock { path: path.clone(), error };
    let mut file = open(&path).map_err(failed)?;
    wait_for(&file, failed)?;
    // Other processes read this id. If it cannot be written, only their message is less precise.
    let cleared = file.set_len(0).and_then(|()| file.rewind());
    let _ = cleared.and_then(|()| write!(file, "{}", process::id()));
    Ok(file)
}

/// Opens the lock file. One that can only be read, such as another user's or that of a read-only file system, can be
/// locked as well.
fn open(path: &Path) -> io::Result<File> {
    let own = File::options().create(true).truncate(false).read(true).write(true).open(path);
    own.or_else(|error| File::open(path).map_err(|_| error))
}

/// Locks the file, and prints a message if another process makes us wait. A process that was suspended
/// holds the lock until it is resumed.
fn wait_for(file: &File, failed: impl Fn(io::Error) -> SessionError) -> Result<(), SessionError> {
    let (begin, patience) = (Instant::now(), patience());
    let mut silent = true;
    loop {
        match file.try_lock() {
            Ok(()) => return Ok(()),
            Err(TryLockError::WouldBlock) => {}
            Err(TryLockError::Error(error)) => return Err(failed(error)),
        }
        if begin.elapsed() >= patience {
            return Err(SessionError::Busy { holder: holder(file), seconds: patience.as_secs() });
        }
        if silent && begin.elapsed() >= SILENCE {
            silent = false;
            let (holder, most) = (holder(file), patience.as_secs());
            // If standard error is closed, the message is lost.
            let _ =
                writeln!(io::stderr(), "waiting for another lamc{holder}, for at most {most} s");
        }
        thread::sleep(LOOK);
    }
}

/// Returns the process that holds the lock as ` (pid 123)`, or nothing if its id cannot be read.
fn holder(mut file: &File) -> String {
    let mut text = String::new();
    match file.rewind().and_then(|()| file.take(20).read_to_string(&mut text)) {
        Ok(_) if text.parse::<u32>().is_ok() => format!(" (pid {text})"),
        _ => String::new(),
    }
}

/// The meaning of a symbol.
enum Meaning<L> {
    Leaf(L),
    /// A number greater than 0.
    Number(f64),
    Bound(usize),
}

/// A bound intermediate.
struct Definition<B> {
    label: B,
    value: Expr,
}

/// How many symbols are created together: that takes two thirds of the time that they would take between other work.
const SYMBOLS_AT_ONCE: usize = 256;

/// The expressions of one session, with leaves `L` and intermediates that have labels `B`.
pub struct Algebra<L, B> {
    /// The first symbols of the pool.
    symbols: Vec<Symbol>,
    /// What those stand for that have been used.
    meanings: Vec<Meaning<L>>,
    index: FxHashMap<Symbol, usize>,
    definitions: Vec<Definition<B>>,
    bound: FxHashMap<Expr, Expr>,
    derivatives: FxHashMap<(usize, Symbol), Expr>,
    /// Symbols of numbers, by the bits of their magnitudes.
    numbers: FxHashMap<u64, Expr>,
    /// The numbers that those symbols and their negatives stand for.
    values: FxHashMap<Expr, f64>,
}

impl<L, B> Algebra<L, B> {
    fn new() -> Self {
        create_opaque();
        Self {
            symbols: Vec::new(),
            meanings: Vec::new(),
            index: FxHashMap::default(),
            definitions: Vec::new(),
            bound: FxHashMap::default(),
            derivatives: FxHashMap::default(),
            numbers: FxHashMap::default(),
            values: FxHashMap::default(),
        }
    }

    fn symbol(&mut self, meaning: Meaning<L>) -> Expr {
        let index = self.meanings.len();
        if index == self.symbols.len() {
            let more = index..index + SYMBOLS_AT_ONCE;
            self.symbols.extend(more.map(|index| symbol!(format!("lamc::v{index}"))));
        }
        let symbol = self.symbols[index];
        self.meanings.push(meaning);
        self.index.insert(symbol, index);
        Expr(symbol.to_atom())
    }

    /// Creates a symbol that stands for `leaf`.
    pub fn leaf(&mut self, leaf: L) -> Expr {
        self.symbol(Meaning::Leaf(leaf))
    }

    /// Returns the number `value`, exactly: -1, 0 and 1 as numbers, all others as symbols.
    pub fn number(&mut self, value: f64) -> Expr {
        if value == 0.0 || value.abs() == 1.0 {
            return Expr::integer(value as i64);
        }
        let magnitude = value.abs();
        let symbol = match self.numbers.get(&magnitude.to_bits()) {
            Some(known) => known.clone(),
            None => {
                let symbol = self.symbol(Meaning::Number(magnitude));
                self.numbers.insert(magnitude.to_bits(), symbol.clone());
                self.values.insert(symbol.clone(), magnitude);
                self.values.insert(-&symbol, -magnitude);
                symbol
            }
        };
        if value < 0.0 { -&symbol } else { symbol }
    }

    /// Returns the value of an expression that is a number: a whole number, or an expression that
    /// [`Self::number`] returned.
    pub fn value(&self, expr: &Expr) -> Option<f64> {
        match expr.as_integer() {
            Some(number) => Some(number as f64),
            None => self.values.get(expr).copied(),
        }
    }

    /// Names `value`: returns a symbol bound to it, or `value` itself if a name has no benefit.
    ///
    /// A value that was bound before keeps its first name. Whole numbers become [`Self::number`]s, so
    /// that arithmetic with bound values cannot overflow.
    pub fn bind(&mut self, value: Expr, label: B) -> Expr {
        if let Some(number) = value.as_integer() {
            return self.number(number as f64);
        }
        if value.is_atomic() {
            return value;
        }
        if let Some(symbol) = self.bound.get(&value) {
            return symbol.clone();
        }
        let symbol = self.symbol(Meaning::Bound(self.definitions.len()));
        self.bound.insert(value.clone(), symbol.clone());
        self.definitions.push(Definition { label, value });
        symbol
    }

    /// Returns the total derivative of `expr` by the symbol `by`. It applies the chain rule through
    /// every binding, and binds the derivatives of bindings under `label(label of the binding)`.
    ///
    /// # Panics
    /// Panics if `by` is not a symbol.
    pub fn derivative(&mut self, expr: &Expr, by: &Expr, label: &impl Fn(&B) -> B) -> Expr {
        let AtomView::Var(by_symbol) = by.0.as_view() else {
            unreachable!("derivatives are taken by symbols");
        };
        let by_symbol = by_symbol.get_symbol();
        let mut total = Expr(expr.0.derivative(by_symbol));
        for (symbol, definition) in self.bindings_in(expr) {
            let inner = match self.derivatives.get(&(definition, by_symbol)) {
                Some(known) => known.clone(),
                None => {
                    let value = self.definitions[definition].value.clone();
                    let inner = self.derivative(&value, by, label);
                    let name = label(&self.definitions[definition].label);
                    let inner = self.bind(inner, name);
                    self.derivatives.insert((definition, by_symbol), inner.clone());
                    inner
                }
            };
            if !inner.is_zero() {
                total = &total + &(&Expr(expr.0.derivative(symbol)) * &inner);
            }
        }
        total
    }

    /// Returns the bound symbols in `expr`, in the order in which they were created.
    fn bindings_in(&self, expr: &Expr) -> Vec<(Symbol, usize)> {
        let symbols = expr.0.get_all_symbols(false);
        let mut found: Vec<_> = symbols
            .into_iter()
            .filter_map(|symbol| match self.meanings[*self.index.get(&symbol)?] {
                Meaning::Bound(definition) => Some((symbol, definition)),
                Meaning::Leaf(_) | Meaning::Number(_) => None,
            })
            .collect();
        found.sort_by_key(|&(_, definition)| definition);
        found
    }

    /// Returns every binding in the order in which it was created, with its value as plain data.
    pub fn definitions(&self, bound: &impl Fn(usize) -> L) -> Vec<(B, Tree<L>)>
    where
        L: Clone,
        B: Clone,
    {
        let tree = |d: &Definition<B>| (d.label.clone(), self.tree(&d.value, bound));
        self.definitions.iter().map(tree).collect()
    }

    /// Returns `expr` as plain data. `bound` creates the leaf that refers to a binding by its index.
    pub fn tree(&self, expr: &Expr, bound: &impl Fn(usize) -> L) -> Tree<L>
    where
        L: Clone,
    {
        self.tree_of(expr.0.as_view(), bound)
    }

    fn tree_of(&self, view: AtomView<'_>, bound: &impl Fn(usize) -> L) -> Tree<L>
    where
        L: Clone,
    {
        match view {
            AtomView::Num(number) => match number.get_coeff_view() {
                CoefficientView::Natural(numerator, denominator, 0, _) => {
                    Tree::Rational(numerator, denominator)
                }
                other => unreachable!("numbers enter as -1, 0, 1 and cannot become {other:?}"),
            },
            AtomView::Var(variable) => match &self.meanings[self.index[&variable.get_symbol()]] {
                Meaning::Leaf(leaf) => Tree::Leaf(leaf.clone()),
                Meaning::Number(number) => Tree::Number(*number),
                Meaning::Bound(definition) => Tree::Leaf(bound(*definition)),
            },
            AtomView::Fun(function) => {
                let symbol = function.get_symbol();
                let head = if symbol == Symbol::SIN {
                    Function::Sin
                } else if symbol == Symbol::COS {
                    Function::Cos
                } else if let Some(opaque) = opaque_function(symbol.get_stripped_name()) {
                    opaque
                } else {
                    unreachable!("no function {symbol} is ever applied")
                };
                let arguments = function.iter().map(|view| self.tree_of(view, bound)).collect();
                Tree::Apply(head, arguments)
            }
            AtomView::Pow(power) => {
                let (base, exponent) = power.get_base_exp();
                match i64::try_from(&Atom::from(exponent)) {
                    Ok(exponent) => Tree::Power(Box::new(self.tree_of(base, bound)), exponent),
                    Err(_) => unreachable!("powers are whole; others are functions"),
                }
            }
            AtomView::Mul(product) => {
                Tree::Product(product.iter().map(|view| self.tree_of(view, bound)).collect())
            }
            AtomView::Add(sum) => {
                Tree::Sum(sum.iter().map(|view| self.tree_of(view, bound)).collect())
            }
        }
    }
}
