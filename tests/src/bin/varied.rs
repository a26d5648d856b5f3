//! Prints the random mechanism of a seed: `cargo run -q -p lamc-tests --bin varied -- 7 > varied7.yaml`.

use std::env;
use std::process::ExitCode;

use lamc_tests::varied::mechanism;

fn main() -> ExitCode {
    match env::args().nth(1).and_then(|word| word.parse().ok()) {
        Some(seed) => {
            print!("{}", mechanism(seed));
            ExitCode::SUCCESS
        }
        None => {
            eprintln!("usage: varied SEED");
            ExitCode::from(2)
        }
    }
}
