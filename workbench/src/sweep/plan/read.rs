//! Text -> plan, with diagnostics.

use lamc::source::fields::{Fields, array, entries, items};
use lamc::source::yaml::{self, Content, Entry, Node, shorten};
use lamc::source::{AngleUnit, Code, Diagnostic, Diagnostics, SourceFile, Span, codes};

use super::keys::{AXIS, DISTRIBUTION, METHODS, PLAN, RECORDS, SAMPLERS, SAMPLES, SPACINGS, TASKS};
use super::{
    Axis, Distribution, MOST_RUNS, Plan, Quantities, Quantity, Sampler, Simulate, Task, Varied,
};
use crate::reading::Terms;
use crate::simulation::{Method, Settings};
use crate::sweep::MOST_SOBOL;

/// Most values of an axis.
const MOST_VALUES: u64 = 1_000_000;
/// What a plan needs.
const NEEDED: &str = "give a `grid`, or `vary` and `samples`";
/// The records of an equilibrium.
const AT_REST: &[&str] = &["end", "energy", "frequencies"];
/// What there is of motions only.
const OF_MOTIONS: &[&str] =
    &["duration", "rate", "tolerance", "method", "restitution", "settling_band"];

pub fn plan(
    file: &SourceFile,
    Quantities(quantities): &Quantities,
    angle: AngleUnit,
) -> Result<Plan, Diagnostics> {
    let (root, found) = yaml::parse(&file.text).map_err(|mut found| {
        let empty = found.0.iter_mut().filter(|found| found.code == codes::EMPTY_FILE);
        empty.for_each(|found| found.hint = Some(NEEDED.to_owned()));
        found
    })?;
    let mut reader = Reader { quantities, angle, found, code: codes::BAD_PLAN };
    let plan = reader.plan(&root);
    match plan {
        Some(plan) if !reader.found.has_errors() => Ok(plan),
        _ => Err(reader.found),
    }
}

/// Reads the distributions of some quantities, as `vary` of a plan has them; mistakes get a code of the file that they are in.
pub fn distributions(
    node: Option<&Node>,
    Quantities(quantities): &Quantities,
    (angle, code): (AngleUnit, Code),
    found: &mut Diagnostics,
) -> Vec<Varied> {
    let mut reader = Reader { quantities, angle, found: std::mem::take(found), code };
    let varied = reader.varied(node);
    *found = reader.found;
    varied
}

pub(super) struct Reader<'q> {
    pub(super) quantities: &'q [Quantity],
    pub(super) angle: AngleUnit,
    pub(super) found: Diagnostics,
    /// Of mistakes that only such a file can have.
    pub(super) code: Code,
}

/// A spread about the value of the model, or two numbers.
enum Spread {
    About(f64),
    Two([f64; 2]),
}

impl Reader<'_> {
    fn plan(&mut self, root: &Node) -> Option<Plan> {
        let fields = Fields::new(root, root.span, "a plan", &PLAN, &mut self.found)?;
        let axes = self.axes(fields.get("grid"));
        let varied = self.varied(fields.get("vary"));
        self.are_apart(&fields);
        let (samples, sampler) = self.samples(&fields, !varied.is_empty());
        let seed = self.whole(&fields, "seed");
        let task = self.task(&fields);
        let plan =
            Plan { task: task?, axes, varied, sampler: sampler?, samples: samples?, seed: seed? };
        if plan.quantities().next().is_none() && !self.found.has_errors() {
            let error = Diagnostic::error(codes::BAD_PLAN, root.span, "the plan varies nothing");
            self.found.push(error.hint(NEEDED));
        }
        let points = plan.axes.iter().map(|axis| axis.values.len() as u64);
        let is_sobol = plan.sampler == Sampler::Sobol;
        if is_sobol && plan.varied.len() > MOST_SOBOL {
            let message = format!("Sobol's sequence has at most {MOST_SOBOL} quantities here");
            self.wrong(fields.get("vary")?.span, message);
        }
        let runs = points.chain([plan.samples]).try_fold(1, u64::checked_mul);
        if runs.is_none_or(|runs| runs > MOST_RUNS) {
            let message = format!("the plan has more than {MOST_RUNS} runs");
            let error = Diagnostic::error(codes::BAD_PLAN, root.span, message);
            self.found
                .push(error.hint("a grid of many quantities grows fast: sample them instead"));
        }
        Some(plan)
    }

    /// Refuses a quantity that is on the grid and drawn as well.
    fn are_apart(&mut self, fields: &Fields) {
        let keys = |key| match fields.get(key).map(|node| &node.content) {
            Some(Content::Mapping(entries)) => entries.as_slice(),
            _ => &[],
        };
        for entry in keys("vary") {
            let twice = keys("grid").iter().find(|other| other.key.value == entry.key.value);
            if let Some(twice) = twice {
                let message = format!("`{}` is on the grid and varied", shorten(&entry.key.value));
                let error = Diagnostic::error(codes::BAD_PLAN, entry.key.span, message);
                self.found.push(error.also(twice.key.span, "its axis").hint("keep one of them"));
            }
        }
    }

    fn axes(&mut self, node: Option<&Node>) -> Vec<Axis> {
        let entries = entries(node, "values", &mut self.found);
        entries.iter().filter_map(|entry| self.axis(entry)).collect()
    }

    fn axis(&mut self, entry: &Entry) -> Option<Axis> {
        let quantity = self.quantity(entry);
        let values = match &entry.value.content {
            Content::Mapping(_) => self.spaced(entry, quantity.as_ref()?),
            _ => {
                let list = items(&entry.value, "a list of values", &mut self.found)?;
                if list.is_empty() {
                    self.wrong(entry.value.span, "an axis needs at least one value");
                }
                let quantity = quantity.as_ref()?;
                list.iter().map(|node| self.value(node, quantity)).collect()
            }
        };
        Some(Axis { quantity: quantity?, values: values? })
    }

    /// The values of `from`, `to` and `count`.
    fn spaced(&mut self, entry: &Entry, quantity: &Quantity) -> Option<Vec<f64>> {
        let owner = format!("the axis of `{}`", quantity.name);
        let fields = Fields::new(&entry.value, entry.key.span, owner, &AXIS, &mut self.found)?;
        let ends = ["from", "to"].map(|key| {
            let node = fields.require(key, &mut self.found)?;
            self.value(node, quantity)
        });
        let count = self.whole(&fields, "count");
        let spacing = self.word(&fields, "spacing", SPACINGS);
        let ([Some(from), Some(to)], count) = (ends, count?) else { return None };
        if !(2..=MOST_VALUES).contains(&count) {
            let at = fields.get("count")?.span;
            self.wrong(at, format!("an axis has 2 to {MOST_VALUES} values"));
            return None;
        }
        let last = (count - 1) as f64;
        let share = |index: u64| index as f64 / last;
        let between = |share: f64| (1.0 - share) * from + share * to;
        if spacing? == "linear" {
            return Some((0..count).map(|index| between(share(index))).collect());
        }
        let distribution = self.logarithmic(entry.value.span, [from, to])?;
        let inner = (1..count - 1).map(|index| distribution.at(share(index)));
        Some([from].into_iter().chain(inner).chain([to]).collect())
    }

    fn varied(&mut self, node: Option<&Node>) -> Vec<Varied> {
        let entries = entries(node, "distributions", &mut self.found);
        entries.iter().filter_map(|entry| self.draw(entry)).collect()
    }

    fn draw(&mut self, entry: &Entry) -> Option<Varied> {
        let quantity = self.quantity(entry)?;
        let owner = format!("the distribution of `{}`", quantity.name);
        let fields =
            Fields::new(&entry.value, entry.key.span, owner, &DISTRIBUTION, &mut self.found)?;
        let given: Vec<_> = DISTRIBUTIONS.iter().filter_map(|key| fields.entry(key)).collect();
        let [Entry { key, value, .. }] = given.as_slice() else {
            // An unknown key has been reported.
            if !given.is_empty() || !self.found.has_errors() {
                self.wrong(entry.value.span, "give one of `uniform`, `log_uniform` and `normal`");
            }
            return None;
        };
        let spread = self.spread(value, &quantity)?;
        let distribution = match (key.value.as_str(), spread) {
            ("log_uniform", Spread::Two(ends)) => self.logarithmic(value.span, ends)?,
            ("log_uniform", Spread::About(_)) => {
                self.wrong(value.span, "`log_uniform` lies between two numbers: `[a, b]`");
                return None;
            }
            ("uniform", Spread::About(by)) => {
                Distribution::Uniform([quantity.value - by, quantity.value + by])
            }
            ("uniform", Spread::Two([low, high])) if low < high => {
                Distribution::Uniform([low, high])
            }
            ("uniform", Spread::Two(_)) => {
                self.wrong(value.span, "the first number must be less than the second");
                return None;
            }
            (_, Spread::About(deviation)) => Distribution::Normal([quantity.value, deviation]),
            (_, Spread::Two([mean, deviation])) if deviation > 0.0 => {
                Distribution::Normal([mean, deviation])
            }
            (_, Spread::Two(_)) => {
                self.wrong(value.span, "the standard deviation must be more than 0");
                return None;
            }
        };
        Some(Varied { quantity, distribution })
    }

    fn spread(&mut self, node: &Node, quantity: &Quantity) -> Option<Spread> {
        if let Content::Sequence(_) = node.content {
            let [a, b] = array(node, "`[a, b]`", &mut self.found)?;
            let (a, b) = (self.value(a, quantity), self.value(b, quantity));
            return Some(Spread::Two([a?, b?]));
        }
        let share = node.scalar().and_then(|scalar| scalar.text.trim().strip_suffix('%'));
        let by = match share.map(|share| share.trim().parse::<f64>()) {
            Some(Ok(percent)) => 0.01 * percent * quantity.value.abs(),
            _ => self.value(node, quantity)?,
        };
        if by > 0.0 && by.is_finite() {
            return Some(Spread::About(by));
        }
        let (name, value) = (&quantity.name, quantity.value);
        let message = match share {
            Some(_) if value == 0.0 => {
                format!("a percentage of `{name}` is 0, because the model's value is 0")
            }
            _ => "a tolerance must be more than 0".to_owned(),
        };
        self.wrong(node.span, message);
        None
    }

    /// Logarithms need numbers of one sign.
    fn logarithmic(&mut self, at: Span, ends: [f64; 2]) -> Option<Distribution> {
        if ends[0] * ends[1] > 0.0 {
            return Some(Distribution::LogUniform(ends));
        }
        self.wrong(at, "both ends must be positive, or both negative");
        None
    }

    fn samples(&mut self, fields: &Fields, is_varied: bool) -> (Option<u64>, Option<Sampler>) {
        let Some(entry) = fields.entry("samples") else {
            if let Some(vary) = fields.entry("vary").filter(|_| is_varied) {
                let error =
                    Diagnostic::error(codes::BAD_PLAN, vary.key.span, "`vary` needs `samples`");
                self.found.push(error.hint("add `samples: { count: 1000 }`"));
            }
            return (Some(1), Some(Sampler::Random));
        };
        if fields.entry("vary").is_none() {
            let error = Diagnostic::error(codes::BAD_PLAN, entry.key.span, "`samples` of nothing");
            self.found.push(error.hint("name the quantities to draw under `vary`"));
        }
        let Some(samples) =
            Fields::new(&entry.value, entry.key.span, "`samples`", &SAMPLES, &mut self.found)
        else {
            return (None, None);
        };
        let count = self.whole(&samples, "count");
        if count == Some(0) {
            self.wrong(samples.at(), "`samples` needs a `count` of at least 1");
        }
        let sampler = self.word(&samples, "method", SAMPLERS).map(|word| match word {
            "sobol" => Sampler::Sobol,
            "latin_hypercube" => Sampler::LatinHypercube,
            _ => Sampler::Random,
        });
        (count, sampler)
    }

    fn task(&mut self, fields: &Fields) -> Option<Task> {
        let task = self.word(fields, "task", TASKS)?;
        let at_rest = task == "equilibrium";
        let records = self.records(fields, at_rest)?;
        let has = |word| records.contains(&word);
        if at_rest {
            for entry in OF_MOTIONS.iter().filter_map(|key| fields.entry(key)) {
                let message = format!("an equilibrium has no `{}`", entry.key.value);
                let error = Diagnostic::error(codes::BAD_PLAN, entry.key.span, message);
                self.found.push(error.hint("remove the key, or choose `task: simulate`"));
            }
            let [end, energy, frequencies] = AT_REST else { return None };
            return Some(Task::Equilibrium {
                end: has(end),
                energy: has(energy),
                frequencies: has(frequencies),
            });
        }
        let duration = self.number(fields, "duration", "s");
        let rate = self.number(fields, "rate", "Hz");
        let tolerance = self.number(fields, "tolerance", "%");
        let restitution = self.number(fields, "restitution", "%");
        if let Some(node) = fields.get("restitution")
            && restitution.is_some_and(|share| !(0.0..=1.0).contains(&share))
        {
            self.wrong(node.span, "`restitution` must lie between 0 and 1");
        }
        let settling_band = self.number(fields, "settling_band", "%");
        let method = Method::named(self.word(fields, "method", METHODS)?);
        let settings = Settings {
            method,
            duration: duration?,
            tolerance: tolerance?,
            restitution: restitution?,
        };
        Some(Task::Simulate(Simulate {
            settings,
            rate: rate?,
            settling_band: settling_band?,
            end: has("end"),
            extremes: has("extremes"),
            settling: has("settling"),
            energy: has("energy"),
            motion: has("motion"),
        }))
    }

    fn records(&mut self, fields: &Fields, at_rest: bool) -> Option<Vec<&'static str>> {
        let Some(node) = fields.get("record") else { return Some(vec!["end", "energy"]) };
        let mut records = Vec::new();
        for node in items(node, "a list of records", &mut self.found)? {
            let word = self.one_of(node, RECORDS)?;
            let is_other = match at_rest {
                true => !AT_REST.contains(&word),
                false => word == "frequencies",
            };
            if is_other {
                let task = if at_rest { "an equilibrium" } else { "a motion" };
                self.wrong(node.span, format!("{task} has no `{word}`"));
            }
            records.push(word);
        }
        Some(records)
    }
}

/// The distributions, of which one is given.
const DISTRIBUTIONS: [&str; 3] = ["uniform", "log_uniform", "normal"];
