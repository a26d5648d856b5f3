//! The command `lamc`.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
