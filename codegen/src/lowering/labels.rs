//! Names of the values of an elimination: by speeds and by rows of the closure.

use crate::kane::Equations;
use crate::program::Moving;

/// Names of speeds and rows.
pub struct Labels {
    /// By speed.
    pub speeds: Vec<String>,
    /// Of each closure row: its loop, and its number within the loop.
    rows: Vec<[usize; 2]>,
}

impl Labels {
    /// Those of a mechanism.
    pub fn of(equations: &Equations) -> Self {
        let topology = &equations.topology;
        let speeds = topology.mechanism.speed_labels();
        let loops = topology.loops.iter().enumerate();
        let rows = loops.flat_map(|(id, closed)| (0..closed.rows.len()).map(move |row| [id, row]));
        Self { speeds, rows: rows.collect() }
    }

    /// A row: `0_1` is the second of the first loop.
    pub fn row(&self, row: usize) -> String {
        let [id, number] = self.rows[row];
        format!("{id}_{number}")
    }

    /// A pair of rows: `loop0_1_2`, or `loop0_1_loop1_2` of two loops.
    pub fn pair(&self, i: usize, j: usize) -> String {
        let ([id, number], [other, second]) = (self.rows[i], self.rows[j]);
        if id == other {
            format!("loop{id}_{number}_{second}")
        } else {
            format!("loop{id}_{number}_loop{other}_{second}")
        }
    }
}

/// Name of a solution of the equations.
pub struct Called {
    /// By speed: `acceleration`.
    pub solution: &'static str,
    /// By closure row: `lambda`.
    pub multiplier: &'static str,
    /// Suffix of a derivative: `_by_q_east`; empty for other values.
    pub direction: String,
}

impl Called {
    /// Something that is no derivative.
    pub fn itself(solution: &'static str, multiplier: &'static str) -> Self {
        Self { solution, multiplier, direction: String::new() }
    }

    /// du/dt and lambda, or their derivatives.
    pub fn derivative(labels: &Labels, direction: Moving) -> Self {
        let direction = match direction {
            Moving::Time => "_by_t".to_owned(),
            Moving::Position(speed) => format!("_by_q_{}", labels.speeds[speed.index()]),
            Moving::Rate(speed) => format!("_by_u_{}", labels.speeds[speed.index()]),
            Moving::Parameter(id) => format!("_by_parameter_{}", id.index()),
            Moving::Input(id) => format!("_by_input_{}", id.index()),
        };
        Self { solution: "d_acceleration", multiplier: "d_lambda", direction }
    }

    /// The multiplier of a row: `lambda0_1`.
    pub fn multiplier(&self, labels: &Labels, row: usize) -> String {
        format!("{}{}{}", self.multiplier, labels.row(row), self.direction)
    }

    /// The solution of a speed: `acceleration_east`.
    pub fn solution(&self, labels: &Labels, speed: usize) -> String {
        format!("{}_{}{}", self.solution, labels.speeds[speed], self.direction)
    }
}
