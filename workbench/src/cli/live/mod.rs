//! `lamc live MODEL`: the viewer in a browser, updated whenever the model or its drawing is saved or a
//! slider moves.
//!
//! Every motion is simulated by a separate process (`lamc simulate`), so errors and long
//! computations do not affect the server. One thread watches the files, one runs simulations, and one
//! answers all requests; they share a [`Board`].

mod board;
mod server;
mod simulation;

use std::fs;
use std::net::TcpListener;
use std::path::PathBuf;
use std::sync::Arc;
use std::thread;
use std::time::Duration;

use clap::Args;
use lamc::source::SourceFile;

use self::board::Board;
use super::{Derivation, Outcome, fail, misused, output, read};

/// Interval at which the file is checked.
const LOOK: Duration = Duration::from_millis(30);

/// Show a model's motion in the browser and update it whenever the file is saved.
#[derive(Args)]
pub struct Arguments {
    /// The model
    model: String,
    /// Port on this machine; 0 selects a free port
    #[arg(long, default_value_t = 7878)]
    port: u16,
    /// Seconds to simulate
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    duration: f64,
    /// Samples per second
    #[arg(long, default_value_t = 100.0, value_name = "HERTZ")]
    rate: f64,
    #[command(flatten)]
    derivation: Derivation,
}

pub fn run(arguments: &Arguments) -> Outcome {
    if arguments.model == "-" {
        return Err(misused(
            "the model must be a file, not standard input, because lamc watches \
                            it",
        ));
    }
    // A mistyped file name is reported at once; mistakes in the model are reported in the page.
    let file = read(&arguments.model)?;
    let here = ("127.0.0.1", arguments.port);
    let bound = TcpListener::bind(here).and_then(|listener| Ok((listener.local_addr()?, listener)));
    let (address, listener) = bound.map_err(|error| {
        fail(format_args!("cannot listen on 127.0.0.1:{}: {error}", arguments.port))
    })?;
    let port = address.port();
    let board = Arc::new(Board::default());
    let simulation = simulation::Simulation::new(arguments).map_err(fail)?;
    output::print(&format!(
        "http://127.0.0.1:{port}/ shows {}; Ctrl-C ends it\n",
        arguments.model
    ))?;
    let (watched, shared) = (arguments.model.clone(), board.clone());
    thread::spawn(move || watch(&watched, &shared));
    let shared = board.clone();
    thread::spawn(move || simulation.serve(&shared));
    server::serve(listener, port, file.stem(), board).map_err(fail)
}

/// Requests a new motion whenever the model or its drawing changes. Polling is cheap, and it notices every
/// way in which editors replace a file on any file system.
fn watch(path: &str, board: &Board) {
    let look = |path: &PathBuf| {
        fs::metadata(path).and_then(|found| Ok((found.modified()?, found.len()))).ok()
    };
    let all = || {
        let others = SourceFile::read(path).map_or(Vec::new(), |file| file.others());
        std::iter::once(path.into()).chain(others).collect::<Vec<PathBuf>>()
    };
    let mut files = all();
    let mut before: Vec<_> = files.iter().map(look).collect();
    loop {
        thread::sleep(LOOK);
        let now: Vec<_> = files.iter().map(look).collect();
        // A file is missing for a moment while it is being replaced.
        if now.iter().zip(&before).any(|(now, before)| now.is_some() && now != before) {
            // The model may name another drawing now.
            files = all();
            before = files.iter().map(look).collect();
            board.saved();
        }
    }
}
