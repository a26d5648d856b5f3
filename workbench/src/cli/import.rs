//! `lamc import DESIGN -o FILE`.

use lamc::source;

use super::paths::Paths;
use super::{Failed, Outcome, output, read, report};

pub fn run(design: &String, path: &String) -> Outcome {
    Paths::default().input("the design", [design]).output("--output", [path]).check()?;
    let file = read(design)?;
    match source::parse(&file) {
        Ok((model, warnings)) => {
            report(&warnings, &file);
            output::write(path, &source::to_yaml(&model))
        }
        Err(problems) => {
            report(&problems, &file);
            Err(Failed(1))
        }
    }
}
