//! `lamc completions SHELL` and `lamc man FOLDER`: what shells and manuals need of the commands.

use std::path::Path;

use clap::CommandFactory;
use clap_complete::Shell;
use clap_mangen::Man;

use super::paths::Paths;
use super::{Cli, Failed, Outcome, fail, output};

/// Prints the script by which a shell completes `lamc`.
pub fn completions(shell: Shell) -> Outcome {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "lamc", &mut script);
    output::print(&script)
}

/// Writes a page for `lamc` and one for each command.
pub fn man(folder: &str) -> Outcome {
    let mut command = Cli::command().disable_help_subcommand(true);
    command.build();
    let commands = command.get_subcommands().cloned();
    let pages = commands.map(|sub| {
        let name = format!("lamc-{}", sub.get_name());
        sub.display_name(name)
    });
    let pages = pages.chain([command.clone()]).map(|page| {
        let name = page.get_display_name().unwrap_or("lamc").to_owned();
        let mut text = Vec::new();
        Man::new(page).render(&mut text).map_err(fail)?;
        Ok((Path::new(folder).join(name + ".1").display().to_string(), text))
    });
    let pages: Vec<(String, Vec<u8>)> = pages.collect::<Result<_, Failed>>()?;
    let paths = pages.iter().map(|(path, _)| path);
    paths.fold(Paths::default(), |paths, path| paths.output("the page", [path])).check()?;
    pages.iter().try_for_each(|(path, text)| output::write(path, text))
}
