//! Controllers.

use std::collections::HashMap;

use crate::source::codes;
use crate::source::controllers::{Command, Controller, Memory, Pwm};
use crate::source::diagnostic::{Diagnostic, Span, Spanned};
use crate::source::fields::{Fields, entries};
use crate::source::ids::{InputId, MemoryId};
use crate::source::names::{self, Kind, hint};
use crate::source::schema::{CONTROLLER, MEMORY, ONE_SAMPLE, PWM, Value};
use crate::source::yaml::{Content, Entry, Node, shorten};

use super::Lowering;
use super::formulas::Own;

/// How far the ratio of two times may be from a whole number: decimals of a file are rounded.
const WHOLE: f64 = 1e-9;

/// The name of the time between samples in formulas of controllers.
pub(super) const SAMPLE: &str = "Ts";

impl Lowering<'_> {
    /// Reads the controllers.
    pub(super) fn controllers(&mut self, declared: &[Entry]) -> Option<Vec<Controller>> {
        self.refuse_sample_as_name(declared);
        let driven = self.driven(declared);
        let mut first = 0;
        self.each(declared, |this, entry| {
            let controller = this.controller(entry, first, &driven);
            first += entry.value.get("memory").map_or(0, |node| match &node.content {
                Content::Mapping(entries) => entries.len(),
                _ => 0,
            });
            controller
        })
    }

    /// Reports parameters and inputs that are called as the time between samples is.
    fn refuse_sample_as_name(&mut self, declared: &[Entry]) {
        let names = [&self.names.parameters, &self.names.inputs];
        let is_taken = names.iter().any(|names| names.position(SAMPLE).is_some());
        if let Some(entry) = declared.first().filter(|_| is_taken) {
            let message =
                format!("`{SAMPLE}` is the time between samples in formulas of controllers");
            let error = Diagnostic::error(codes::DUPLICATE_NAME, entry.key.span, message);
            self.note(
                error
                    .label("a controller")
                    .hint(format!("give the parameter or the input `{SAMPLE}` another name")),
            );
        }
    }

    /// Finds which controller drives which input, and reports inputs that two of them drive.
    fn driven(&mut self, declared: &[Entry]) -> HashMap<String, String> {
        let mut driven: HashMap<String, (String, Span)> = HashMap::new();
        for entry in declared {
            let Some(Content::Mapping(inputs)) =
                entry.value.get("inputs").map(|node| &node.content)
            else {
                continue;
            };
            for Entry { key, .. } in inputs {
                if let Some((_, first)) = driven.get(&key.value) {
                    let message =
                        format!("two controllers drive the input `{}`", shorten(&key.value));
                    let error = Diagnostic::error(codes::SECOND_CONTROLLER, key.span, message);
                    self.note(
                        error
                            .label("driven again")
                            .also(*first, "driven here first")
                            .hint("let one controller drive the input"),
                    );
                } else {
                    let by = (entry.key.value.clone(), key.span);
                    driven.insert(key.value.clone(), by);
                }
            }
        }
        driven.into_iter().map(|(input, (by, _))| (input, by)).collect()
    }

    /// Reads a controller. Its memory begins at `first` in that of all controllers.
    fn controller(
        &mut self,
        entry: &Entry,
        first: usize,
        driven: &HashMap<String, String>,
    ) -> Option<Controller> {
        let owner = format!("controller `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &CONTROLLER, found)?;
        let sample = self.sample(&fields);
        let delay = self.delay(&fields, sample.as_ref());
        let memory = entries(fields.get("memory"), "memory", &mut self.diagnostics);
        self.memory_names(memory);
        let own = Own {
            memory: memory.iter().map(|entry| entry.key.value.clone()).collect(),
            first: MemoryId(first),
            sample: sample.as_ref().map_or(1.0, |sample| sample.value),
            driven,
        };
        let memory = self.each(memory, |this, entry| this.memory(entry, &own));
        let commands = self.commands(&fields, &own);
        let pwm = match fields.get("pwm") {
            None => Some(None),
            Some(node) => self.pwm(node, &fields, sample.as_ref()).map(Some),
        };
        Some(Controller {
            name: entry.key.value.clone(),
            span: entry.key.span,
            sample: sample?.value,
            delay: delay?,
            memory: memory?,
            commands: commands?,
            pwm: pwm?,
        })
    }

    fn sample(&mut self, fields: &Fields) -> Option<Spanned<f64>> {
        let sample = self.required(fields, "sample")?;
        if sample.value > 0.0 {
            return Some(sample);
        }
        let message = format!("the time between samples is {} s", sample.value);
        let error = Diagnostic::error(codes::BAD_SAMPLE, sample.span, message);
        self.note(error.label("not positive").hint("give a positive time, as in `sample: 5 ms`"));
        None
    }

    fn delay(&mut self, fields: &Fields, sample: Option<&Spanned<f64>>) -> Option<f64> {
        let Some(node) = fields.get("delay") else { return Some(0.0) };
        if node.scalar().is_some_and(|scalar| scalar.text.trim() == ONE_SAMPLE) {
            return Some(sample?.value);
        }
        let Value::Either(number, _) = fields.expected("delay") else { return None };
        let delay = self.number(node, number.measured().0)?;
        let sample = sample?;
        if (0.0..=sample.value).contains(&delay.value) {
            return Some(delay.value);
        }
        let message =
            format!("the delay is {} s, the time between samples {} s", delay.value, sample.value);
        let error = Diagnostic::error(codes::BAD_DELAY, delay.span, message);
        self.note(
            error
                .label(if delay.value < 0.0 { "negative" } else { "longer than a sample" })
                .also(sample.span, "the time between samples")
                .hint("a delay is from 0 to `1 sample`; remember older values in the `memory`"),
        );
        None
    }

    /// Checks the names of a controller's memory.
    fn memory_names(&mut self, memory: &[Entry]) {
        for Entry { key, .. } in memory {
            names::check(key, Kind::Symbol("a memory"), &mut self.diagnostics);
            let names = [&self.names.parameters, &self.names.inputs];
            let is_taken = names.iter().any(|names| names.position(&key.value).is_some());
            if is_taken || key.value == SAMPLE {
                let message = format!("`{}` has another meaning already", key.value);
                let error = Diagnostic::error(codes::DUPLICATE_NAME, key.span, message);
                let label = if is_taken {
                    "the name of a parameter or an input"
                } else {
                    "the time between samples"
                };
                self.note(error.label(label).hint("give the memory another name"));
            }
        }
    }

    fn memory(&mut self, entry: &Entry, own: &Own) -> Option<Memory> {
        let owner = format!("memory `{}`", shorten(&entry.key.value));
        let found = &mut self.diagnostics;
        let fields = Fields::new(&entry.value, entry.key.span, owner, &MEMORY, found)?;
        let initial = self.optional(&fields, "initial");
        let next = fields.read("next", &mut self.diagnostics);
        let next = next.and_then(|node| self.law_of_controller(node, own));
        let initial = initial?.map_or(0.0, |initial| initial.value);
        let Spanned { value: next, span } = next?;
        Some(Memory { name: entry.key.value.clone(), initial, next, span })
    }

    fn commands(&mut self, fields: &Fields, own: &Own) -> Option<Vec<Command>> {
        let node = fields.read("inputs", &mut self.diagnostics)?;
        let laws = entries(Some(node), "formulas", &mut self.diagnostics);
        if laws.is_empty() {
            if matches!(node.content, Content::Mapping(_)) {
                let message = "the controller drives no input";
                let error = Diagnostic::error(codes::IDLE_CONTROLLER, node.span, message);
                self.note(error.hint("name an input and its formula: `inputs: { motor: .. }`"));
            }
            return None;
        }
        self.each(laws, |this, entry| this.command(entry, own))
    }

    fn command(&mut self, entry: &Entry, own: &Own) -> Option<Command> {
        let input = self.names.inputs.position(&entry.key.value).map(InputId);
        if input.is_none() {
            let message = format!("there is no input `{}`", shorten(&entry.key.value));
            let known = || self.names.inputs.names().collect();
            let hint = hint(self.diagnostics.0.len(), &entry.key.value, known, "inputs");
            let error = Diagnostic::error(codes::UNKNOWN_INPUT, entry.key.span, message);
            self.note(Diagnostic { hint, ..error.label("unknown input") });
        }
        let Spanned { value, span } = self.law_of_controller(&entry.value, own)?;
        Some(Command { input: input?, value, span })
    }

    fn pwm(
        &mut self,
        node: &Node,
        controller: &Fields,
        sample: Option<&Spanned<f64>>,
    ) -> Option<Pwm> {
        let found = &mut self.diagnostics;
        let fields = Fields::new(node, controller.at(), "the modulation", &PWM, found)?;
        let period = self.required(&fields, "period");
        let levels = self.required_numbers::<2>(&fields, "levels");
        let duty = match fields.get("duty") {
            None => Some(Spanned { value: [0.0, 1.0], span: node.span }),
            Some(node) => {
                let duty = self.numbers::<2>(node, fields.expected("duty"));
                duty.map(|value| Spanned { value, span: node.span })
            }
        };
        let (period, levels, duty) = (period?, levels?, duty?);
        let errors = contradictions(&period, &levels, &duty, sample);
        let is_sound = errors.is_empty();
        for (span, message, hint) in errors {
            self.note(Diagnostic::error(codes::BAD_PWM, span, message).hint(hint));
        }
        let pwm = Pwm { period: period.value, levels: levels.value, duty: duty.value };
        is_sound.then_some(pwm)
    }
}

/// Returns what contradicts itself in a modulation: where, what and what would be right.
fn contradictions(
    period: &Spanned<f64>,
    levels: &Spanned<[f64; 2]>,
    duty: &Spanned<[f64; 2]>,
    sample: Option<&Spanned<f64>>,
) -> Vec<(Span, String, &'static str)> {
    let mut found = Vec::new();
    let times = sample.map_or(1.0, |sample| sample.value / period.value);
    if period.value <= 0.0 {
        let message = format!("the period is {} s", period.value);
        found.push((period.span, message, "give a positive time, as in `period: 1 ms`"));
    } else if times < 1.0 - WHOLE || (times - times.round()).abs() > WHOLE * times {
        let message = format!("the period fits {times} times into the time between samples");
        let hint = "give a period that fits a whole number of times, at least once";
        found.push((period.span, message, hint));
    }
    let [lower, upper] = levels.value;
    if upper <= lower {
        let message = format!("the lower level {lower} is not below the upper level {upper}");
        found.push((levels.span, message, "write `[lower, upper]`"));
    }
    let [least, greatest] = duty.value;
    if !(0.0 <= least && least < greatest && greatest <= 1.0) {
        let message = format!("a duty from {least} to {greatest} is not possible");
        found.push((duty.span, message, "write `[least, greatest]`, two shares from 0 to 1"));
    }
    found
}
