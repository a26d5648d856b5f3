//! A compiled model with its source, and the states at which it is looked at.

use lamc::pipeline::{self, Compiled};
use lamc::source::{SourceFile, SourceModel, parse};
use lamc_runtime::State;
use lamc_workbench::execution::Jit;
use lamc_workbench::verify::{Remark, Settings, Solution, Values, closed_states};

use crate::largest;

use super::edits;

/// A state of all joints.
pub type Point = State<Vec<f64>, f64>;

/// Closed states for each model.
const STATES: usize = 4;

/// Slower joints rest, rad/s: those of random states have up to 3 rad/s.
const RESTS: f64 = 1e-6;

/// Why there is no motion to check.
pub const NOTHING_MOVES: &str = "nothing moves";

/// A compiled model.
#[derive(Clone)]
pub struct Subject {
    /// As it was read.
    pub model: SourceModel,
    pub compiled: Compiled,
    pub system: Jit,
}

impl Subject {
    /// Reads and compiles a text.
    pub fn new(text: &str) -> Result<Self, String> {
        Self::edited(text, |_| ())
    }

    /// As [`new`](Self::new), after a change.
    pub fn edited(text: &str, edit: impl FnOnce(&mut SourceModel)) -> Result<Self, String> {
        let file = SourceFile { path: "random.yaml".into(), text: text.to_owned() };
        let (mut model, _) = parse(&file).map_err(|problems| problems.to_string())?;
        edit(&mut model);
        let compiled = pipeline::compile_edited(&file, |read| {
            read.clone_from(&model);
            Ok(())
        });
        let compiled = compiled.map_err(|error| error.to_string())?;
        let system = Jit::new(&compiled.program);
        Ok(Self { model, compiled, system })
    }

    /// The values of everything at a state.
    pub fn values(&self, point: &Point) -> Values {
        let State { t, q, u } = point.clone();
        let parameters = self.compiled.topology.mechanism.parameters.iter();
        Values {
            parameters: parameters.map(|parameter| parameter.value).collect(),
            inputs: self.system.inputs().to_vec(),
            t,
            q,
            u,
        }
    }

    /// The system with these inputs.
    pub fn with_inputs(&self, values: &[f64]) -> Jit {
        let mut system = self.system.clone();
        for (name, &value) in self.system.interface().inputs.iter().zip(values) {
            // The names are the program's own.
            let _ = system.set_input(name, value);
        }
        system
    }
}

/// The model that moves, and the one that says what must hold.
pub struct Pair {
    texts: [String; 2],
    pub moves: Subject,
    pub says: Subject,
    /// Closed states of the first, each with inputs of its own; that with the best condition first. The systems
    /// have the inputs of the first that moves.
    pub states: Vec<(Values, Solution)>,
}

impl Pair {
    pub fn new(moves: &str, says: &str) -> Result<Self, String> {
        let same = |_: &mut SourceModel| ();
        Self::of([moves, says], [&same, &same])
    }

    /// Both after a change that depends on the compiled model, and after which no law depends on time.
    pub fn edited(&self, edit: fn(&mut SourceModel, &Compiled)) -> Result<Self, String> {
        let [moves, says] = [&self.moves, &self.says]
            .map(|subject| |model: &mut SourceModel| edit(model, &subject.compiled));
        let mut pair = Self::of(self.texts.each_ref().map(String::as_str), [&moves, &says])?;
        pair.states.iter_mut().for_each(|(values, _)| values.t = 0.0);
        Ok(pair)
    }

    /// Both as they are from the time on at which their motion starts, with this share of all damping, friction and
    /// air.
    pub fn begun(&self, damped: f64) -> Result<Self, String> {
        let begin = self.start()?.0.t;
        let [moves, says] = [&self.moves, &self.says].map(|subject| {
            move |model: &mut SourceModel| {
                if damped != 1.0 {
                    edits::damped(model, &subject.compiled, damped);
                }
                edits::from_time(model, begin);
            }
        });
        let [mut moves, mut says] =
            both(&self.texts.each_ref().map(String::as_str), [&moves, &says])?;
        let mut states = self.states.clone();
        states.iter_mut().for_each(|(values, _)| values.t -= begin);
        let inputs = &self.start()?.1;
        moves.system = moves.with_inputs(inputs);
        says.system = says.with_inputs(inputs);
        Ok(Self { texts: self.texts.clone(), moves, says, states })
    }

    fn of(texts: [&str; 2], edits: [&dyn Fn(&mut SourceModel); 2]) -> Result<Self, String> {
        let [moves, says] = both(&texts, edits)?;
        let settings = Settings { states: STATES, seed: 1, duration: 0.0 };
        let states = closed_states(&moves.compiled, &settings);
        let mut states = states.map_err(|remark| match remark {
            Remark::NotChecked(reason) | Remark::Failed(reason) => reason,
        })?;
        // In the flat state loops may have more freedom than anywhere else.
        let most = states.iter().map(|(_, solution)| solution.rank).max();
        states.retain(|(_, solution)| Some(solution.rank) == most);
        // Motions start from the state with the best condition.
        states.sort_by(|(_, a), (_, b)| a.condition().total_cmp(&b.condition()));
        let mut pair = Self { texts: texts.map(str::to_owned), moves, says, states };
        if let Ok((_, inputs)) = pair.start() {
            pair.moves.system = pair.moves.with_inputs(&inputs);
            pair.says.system = pair.says.with_inputs(&inputs);
        }
        Ok(pair)
    }

    /// The text of the model that says what must hold.
    pub fn saying(&self) -> &str {
        &self.texts[1]
    }

    /// The state from which motions start, and its inputs: the first that moves.
    pub fn start(&self) -> Result<(Point, Vec<f64>), String> {
        let moves = |(values, _): &&(Values, Solution)| largest(&values.u) > RESTS;
        let (values, _) = self.states.iter().find(moves).ok_or(NOTHING_MOVES)?;
        let Values { t, q, u, inputs, .. } = values.clone();
        Ok((State { t, q, u }, inputs))
    }
}

/// Both models after their changes; the same text is compiled once.
fn both(texts: &[&str; 2], edits: [&dyn Fn(&mut SourceModel); 2]) -> Result<[Subject; 2], String> {
    let moves = Subject::edited(texts[0], edits[0])?;
    let says = match texts[0] == texts[1] {
        true => moves.clone(),
        false => Subject::edited(texts[1], edits[1])?,
    };
    Ok([moves, says])
}
