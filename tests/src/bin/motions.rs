//! Random mechanisms in motion, and described in another way.
//!
//! ```text
//! cargo run -q -p lamc-tests --bin motions -- --count 20 [--seed 1] [--keep FOLDER]
//! ```
//!
//! A failure prints the seed, what failed, and the shortest model found that still fails; with `--keep` it is
//! written to a folder. The exit code is 1 if anything failed, or if a check could not be made for more than
//! one in five of the models to which it applies.

use std::process::ExitCode;

use lamc_tests::campaign;
use lamc_tests::motions::checks;
use lamc_tests::varied::grounded;

fn main() -> ExitCode {
    campaign::run("motions", 20, &grounded, &checks)
}
