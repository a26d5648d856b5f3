//! States next to the flat one whose accelerations were computed with 60 digits (`tests/near_flat/`).

use serde::Deserialize;

use crate::workspace;

/// A model and states of it.
#[derive(Debug, Deserialize)]
pub struct NearFlat {
    /// Path of the model from the workspace's folder.
    pub model: String,
    /// Pairs of a state at rest and one that moves, from far to near.
    pub states: Vec<NearFlatState>,
}

/// A closed state, rounded to `f64`. SI and radians.
#[derive(Debug, Deserialize)]
pub struct NearFlatState {
    /// The largest angle, rad, to within a factor of two or so.
    pub distance: f64,
    /// q, N, rad.
    pub q: Vec<f64>,
    /// u, N, rad/s; zero or along the closure.
    pub u: Vec<f64>,
    /// du/dt, N, rad/s^2.
    pub acceleration: Vec<f64>,
    /// Independent closure equations.
    pub rank: usize,
}

impl NearFlat {
    /// Reads all of them.
    pub fn read() -> Vec<Self> {
        let path = workspace().join("tests/near_flat/states.json");
        let text = std::fs::read_to_string(&path)
            .unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
    }

    /// The file's name without its ending.
    pub fn name(&self) -> &str {
        let file = self.model.rsplit('/').next().unwrap_or_default();
        file.strip_suffix(".yaml").unwrap_or(file)
    }
}

impl NearFlatState {
    /// Whether all speeds are zero.
    pub fn is_at_rest(&self) -> bool {
        self.u.iter().all(|&u| u == 0.0)
    }
}
