//! Motions on demand: each is a run of `lamc simulate`.

use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::thread;
use std::time::{Duration, Instant};

use super::super::Derivation;
use super::Arguments;
use super::board::{Board, Wish};

/// How long a run may take when something newer is wanted.
const PATIENCE: Duration = Duration::from_secs(1);

/// How often a run is looked at.
const LOOK: Duration = Duration::from_millis(2);

/// Makes the motions of a model.
pub struct Simulation {
    program: PathBuf,
    model: String,
    duration: f64,
    rate: f64,
    derivation: Derivation,
}

impl Simulation {
    /// Of the model the arguments name.
    pub fn new(arguments: &Arguments) -> io::Result<Self> {
        Ok(Self {
            program: std::env::current_exe()?,
            model: arguments.model.clone(),
            duration: arguments.duration,
            rate: arguments.rate,
            derivation: arguments.derivation,
        })
    }

    /// Processes requests without end.
    pub fn serve(&self, board: &Board) {
        loop {
            let wish = board.next_wish();
            match self.answer(&wish, board) {
                Ok(Some(answer)) => board.answer(wish.number, answer),
                // The run was stopped for a newer request.
                Ok(None) => {}
                Err(error) => {
                    let problem = format!("error: cannot run lamc simulate: {error}");
                    board.answer(wish.number, message(&wish, true, &problem, "null"));
                }
            }
        }
    }

    fn answer(&self, wish: &Wish, board: &Board) -> io::Result<Option<String>> {
        let mut command = Command::new(&self.program);
        command.args(["simulate", "--view", "-"]);
        command.arg(format!("--duration={}", self.duration));
        command.arg(format!("--rate={}", self.rate));
        command.arg(format!("--max-hinges={}", self.derivation.size.max_hinges));
        command.args(self.derivation.no_cache.then_some("--no-cache"));
        for settings in wish.settings.iter() {
            for (name, value) in &settings.parameters {
                command.arg(format!("--set={name}={value:?}"));
            }
            for (joint, angle) in &settings.initial {
                command.arg(format!("--initial={joint}={angle:?}rad"));
            }
        }
        command.arg("--").arg(&self.model);
        command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn()?;
        let (out, err) = (child.stdout.take(), child.stderr.take());
        thread::scope(|scope| {
            let shown = scope.spawn(|| text(out));
            let told = scope.spawn(|| text(err));
            let done = finish(&mut child, || board.is_outdated(wish.number))?;
            let [shown, told] = [shown, told].map(|reader| {
                reader.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
            });
            let (shown, told) = (shown?, told?);
            // A motion that ended early is shown as far as it was computed.
            let shown = if shown.is_empty() { "null" } else { &shown };
            Ok(done.map(|done| message(wish, !done, &told, shown)))
        })
    }
}

/// Everything that comes out of a pipe.
fn text(pipe: Option<impl Read>) -> io::Result<String> {
    let mut bytes = Vec::new();
    if let Some(mut pipe) = pipe {
        pipe.read_to_end(&mut bytes)?;
    }
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

/// Whether a run succeeded; nothing when it was ended because it is outdated.
fn finish(child: &mut Child, is_outdated: impl Fn() -> bool) -> io::Result<Option<bool>> {
    let begin = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(Some(status.success()));
        }
        if begin.elapsed() > PATIENCE && is_outdated() {
            child.kill()?;
            child.wait()?;
            return Ok(None);
        }
        thread::sleep(LOOK);
    }
}

/// What the page gets: whether the model is shown as written, what there is to say about it, and
/// the data of the motion.
fn message(wish: &Wish, failed: bool, told: &str, shown: &str) -> String {
    let (number, written) = (wish.number, wish.settings.is_none());
    let told = serde_json::Value::from(told.trim_end());
    format!(
        r#"{{"number":{number},"written":{written},"failed":{failed},"told":{told},"shown":{shown}}}"#
    )
}
