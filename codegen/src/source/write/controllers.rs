//! Controllers in our schema.

use super::{expression, line, list, number};
use crate::source::controllers::Controller;
use crate::source::model::SourceModel;

/// Writes the controllers of a model.
pub fn write(out: &mut String, model: &SourceModel) {
    super::section(out, "controllers", &model.controllers, |out, controller| {
        one(out, controller, model);
    });
}

fn one(out: &mut String, controller: &Controller, model: &SourceModel) {
    line(out, 1, &format!("{}:", controller.name));
    line(out, 2, &format!("sample: {}", number(controller.sample)));
    if controller.delay.to_bits() != 0 {
        line(out, 2, &format!("delay: {}", number(controller.delay)));
    }
    if !controller.memory.is_empty() {
        line(out, 2, "memory:");
        for memory in &controller.memory {
            let (initial, next) = (number(memory.initial), expression(&memory.next, model));
            let fields = format!("{{ initial: {initial}, next: {next} }}");
            line(out, 3, &format!("{}: {fields}", memory.name));
        }
    }
    line(out, 2, "inputs:");
    for command in &controller.commands {
        let input = &model.inputs[command.input.index()].value;
        line(out, 3, &format!("{input}: {}", expression(&command.value, model)));
    }
    if let Some(pwm) = &controller.pwm {
        let (period, levels, duty) = (number(pwm.period), list(&pwm.levels), list(&pwm.duty));
        line(out, 2, &format!("pwm: {{ period: {period}, levels: {levels}, duty: {duty} }}"));
    }
}
