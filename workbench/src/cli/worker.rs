//! Equations are derived in a process of their own.
//!
//! The symbolic engine ends the process that uses it where another program of the same user does, where it finds no
//! folder for its permit, and on its own mistakes. Here it ends a worker, and the command says what happened. The
//! worker is `lamc worker`: it reads the model from its standard input, and writes the stages that it begins and the
//! result to its standard output, in frames of a number, a length and bytes. The engine writes its last words
//! there, too. It ends when its standard input does, so
//! that it does not outlive the command.

use std::env;
use std::fmt::Write as _;
use std::io::{self, BufRead, BufReader, ErrorKind, Read, Write};
use std::panic;
use std::process::{self, Command, ExitStatus, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use lamc::pipeline::{self, CompileError, Derived, Stage};
use lamc::source::Diagnostics;
use lamc::symbolic::patience;

use super::{Outcome, fail};

/// The kinds of frames: the model, the stages, and the three kinds of results. No text begins with these.
const MODEL: u8 = 1;
const TOPOLOGY: u8 = 2;
const EQUATIONS: u8 = 3;
const PROGRAM: u8 = 4;
const DERIVED: u8 = 5;
const PROBLEMS: u8 = 6;
const FAILURE: u8 = 7;

/// How messages begin that are shown while the worker runs. All others explain why it has ended.
const WAITING: &str = "waiting for ";

/// A part of what the engine says where another program of this user runs it.
const OCCUPIED: &str = "restricted Symbolica thread";

/// A part of what it says, besides, where it cannot write the file by which it knows.
const NO_PERMIT: &str = "Symbolica thread permit";

/// How often an engine that is in use is tried again.
const AGAIN: Duration = Duration::from_millis(250);

/// What became of a worker.
enum Answer {
    Derived(Box<Derived>),
    Failed(CompileError),
    /// It has ended without a result. The text is what it or the engine said.
    Ended(ExitStatus, String),
}

/// What comes out of a worker.
enum Output {
    Frame(u8, Vec<u8>),
    /// Anything else, up to its end.
    Words(String),
}

/// As [`pipeline::Read::derive`], in another process.
pub fn derive(
    read: &pipeline::Read<'_>,
    mut enter: impl FnMut(Stage, usize),
) -> Result<Derived, CompileError> {
    let (begin, patience) = (Instant::now(), patience());
    let model = read.to_bytes();
    let mut is_silent = true;
    loop {
        let (status, said) = match ask(&model, &mut enter) {
            Ok(Answer::Derived(derived)) => return Ok(*derived),
            Ok(Answer::Failed(error)) => return Err(error),
            Ok(Answer::Ended(status, said)) => (status, said),
            Err(error) => {
                let text = format!("cannot run the process that derives equations: {error}");
                return Err(CompileError::Ended(text));
            }
        };
        let is_over = begin.elapsed() >= patience;
        if is_over || !is_occupied(&said) {
            return Err(CompileError::Ended(ended(status, &said, patience)));
        }
        if is_silent {
            is_silent = false;
            let most = patience.as_secs();
            // If standard error is closed, the message is lost.
            let _ = writeln!(
                io::stderr(),
                "{WAITING}another program that runs Symbolica, for at most {most} s"
            );
        }
        thread::sleep(AGAIN);
    }
}

fn is_occupied(said: &str) -> bool {
    said.contains(OCCUPIED) && !said.contains(NO_PERMIT)
}

/// Why there are no equations, and what to do.
fn ended(status: ExitStatus, said: &str, patience: Duration) -> String {
    if is_occupied(said) {
        return format!(
            "another program of this user has run Symbolica for {} s; without a key it runs in one thread of one \
             process at a time: end that program, let lamc wait longer with LAMC_WAIT=SECONDS, or give a key in \
             SYMBOLICA_LICENSE",
            patience.as_secs()
        );
    }
    let mut text = format!("the process that derived the equations has ended ({status})");
    // The engine frames some of its words.
    let is_frame = |c: char| c.is_whitespace() || ('\u{2500}'..='\u{257f}').contains(&c);
    let lines = said.lines().map(|line| line.trim_matches(is_frame));
    let said = lines.filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n");
    match said.as_str() {
        "" => text.push_str(" and said nothing: was its memory too small?"),
        said => drop(write!(text, ":\n{said}")),
    }
    if said.contains(NO_PERMIT) {
        text.push_str("\nSymbolica needs a folder that it may write: set HOME or XDG_CACHE_HOME");
    }
    text
}

/// Runs a worker for this model.
fn ask(model: &[u8], enter: &mut impl FnMut(Stage, usize)) -> io::Result<Answer> {
    let mut command = Command::new(env::current_exe()?);
    // Otherwise it writes a banner among the frames.
    command.env("SYMBOLICA_HIDE_BANNER", "1");
    command.arg("worker").stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut worker = command.spawn()?;
    let (Some(mut to), Some(from), Some(says)) =
        (worker.stdin.take(), worker.stdout.take(), worker.stderr.take())
    else {
        unreachable!("all three are pipes");
    };
    thread::scope(|scope| {
        let said = scope.spawn(|| said(BufReader::new(says)));
        // What a worker says that ends before it has read the model is more than that it has ended.
        let sent = send(&mut to, MODEL, model);
        let answer = answer(&mut BufReader::new(from), enter);
        drop(to);
        let status = worker.wait()?;
        let said = said.join().unwrap_or_else(|panic| panic::resume_unwind(panic));
        match answer? {
            Ok(answer) => Ok(answer),
            Err(_) if status.success() => sent.and(Err(ErrorKind::UnexpectedEof.into())),
            Err(words) => Ok(Answer::Ended(status, said + words.as_str())),
        }
    })
}

/// Reads the worker's frames up to a result, or the last words of one that has ended without.
fn answer(
    from: &mut impl Read,
    enter: &mut impl FnMut(Stage, usize),
) -> io::Result<Result<Answer, String>> {
    let wrong =
        |error: &dyn std::error::Error| io::Error::new(ErrorKind::InvalidData, error.to_string());
    loop {
        let (kind, bytes) = match receive(from)? {
            Output::Frame(kind, bytes) => (kind, bytes),
            Output::Words(words) => return Ok(Err(words)),
        };
        let stage = match kind {
            TOPOLOGY => Stage::Topology,
            EQUATIONS => Stage::Equations,
            PROGRAM => Stage::Program,
            DERIVED => {
                let derived = Derived::from_bytes(&bytes, b"").map_err(|error| wrong(&error))?;
                return Ok(Ok(Answer::Derived(Box::new(derived))));
            }
            PROBLEMS => {
                let problems: Diagnostics =
                    serde_json::from_slice(&bytes).map_err(|error| wrong(&error))?;
                return Ok(Ok(Answer::Failed(problems.into())));
            }
            _ => {
                let text = String::from_utf8_lossy(&bytes).into_owned();
                return Ok(Ok(Answer::Failed(CompileError::Ended(text))));
            }
        };
        let joints = <[u8; 8]>::try_from(&bytes[..]).map_err(|error| wrong(&error))?;
        enter(stage, u64::from_le_bytes(joints) as usize);
    }
}

/// Passes on what a worker waits for; returns what else it says.
fn said(says: impl BufRead) -> String {
    let mut kept = String::new();
    for line in says.split(b'\n').map_while(Result::ok) {
        let line = String::from_utf8_lossy(&line);
        // If standard error is closed, the message is lost; a text in memory takes everything.
        let _ = match line.starts_with(WAITING) {
            true => writeln!(io::stderr(), "{line}").map_err(|_| std::fmt::Error),
            false => writeln!(kept, "{line}"),
        };
    }
    kept
}

/// Derives equations for another process.
pub fn run() -> Outcome {
    let model = match receive(&mut io::stdin()) {
        Ok(Output::Frame(MODEL, bytes)) => pipeline::Read::from_bytes(&bytes).map_err(fail)?,
        _ => return Err(fail("`lamc worker` is run by other commands, which send it a model")),
    };
    // Nothing follows: standard input ends when the other process does.
    thread::spawn(|| {
        let _ = io::stdin().read(&mut [0]);
        process::exit(1);
    });
    let mut out = io::stdout();
    let derived = model.derive(|stage, joints| {
        let kind = match stage {
            Stage::Topology => TOPOLOGY,
            Stage::Equations => EQUATIONS,
            Stage::Program => PROGRAM,
        };
        // Without a reader, this process ends soon.
        let _ = send(&mut io::stdout(), kind, &(joints as u64).to_le_bytes());
    });
    match derived {
        Ok(derived) => send(&mut out, DERIVED, &derived.to_bytes(b"")),
        Err(CompileError::Model(problems)) => serde_json::to_vec(&problems)
            .map_err(io::Error::from)
            .and_then(|problems| send(&mut out, PROBLEMS, &problems)),
        Err(error) => send(&mut out, FAILURE, error.to_string().as_bytes()),
    }
    .map_err(fail)
}

fn send(to: &mut impl Write, kind: u8, bytes: &[u8]) -> io::Result<()> {
    to.write_all(&[kind])?;
    to.write_all(&(bytes.len() as u64).to_le_bytes())?;
    to.write_all(bytes)?;
    to.flush()
}

fn receive(from: &mut impl Read) -> io::Result<Output> {
    let mut head = Vec::new();
    from.take(9).read_to_end(&mut head)?;
    if let [kind @ MODEL..=FAILURE, length @ ..] = &head[..]
        && let Ok(length) = <[u8; 8]>::try_from(length)
    {
        let mut bytes = Vec::new();
        let length = u64::from_le_bytes(length);
        from.take(length).read_to_end(&mut bytes)?;
        // One that ends in the middle of a frame has given no result.
        let is_whole = bytes.len() as u64 == length;
        return Ok(if is_whole {
            Output::Frame(*kind, bytes)
        } else {
            Output::Words(String::new())
        });
    }
    from.read_to_end(&mut head)?;
    Ok(Output::Words(String::from_utf8_lossy(&head).into_owned()))
}
