//! The part of the report on controllers: when they act, and on what.

use std::fmt::{self, Write};

use lamc::laminate::Mechanism;
use lamc::source::Controller;

/// Writes each controller, if there are any.
pub fn write(text: &mut String, mechanism: &Mechanism) -> fmt::Result {
    if mechanism.controllers.is_empty() {
        return Ok(());
    }
    writeln!(text, "\ncontrollers")?;
    mechanism.controllers.iter().try_for_each(|controller| write_one(text, mechanism, controller))
}

fn write_one(text: &mut String, mechanism: &Mechanism, controller: &Controller) -> fmt::Result {
    let Controller { name, sample, delay, memory, commands, pwm, .. } = controller;
    let quoted = |names: Vec<&String>| {
        names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
    };
    let driven = commands.iter().map(|command| &mechanism.inputs[command.input.index()]);
    let driven = quoted(driven.collect());
    write!(text, "  {name}: samples every {:.4} ms, ", 1e3 * sample)?;
    writeln!(text, "and sets {driven} {:.4} ms later", 1e3 * delay)?;
    if !memory.is_empty() {
        let names = memory.iter().map(|memory| &memory.name);
        writeln!(text, "    remembers {}", quoted(names.collect()))?;
    }
    if let Some(pwm) = pwm {
        let [lower, upper] = pwm.levels;
        writeln!(text, "    by pulses of {:.4} ms between {lower} and {upper}", 1e3 * pwm.period)?;
    }
    Ok(())
}
