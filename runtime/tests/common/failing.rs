//! A mechanism that fails where a test wants it to, and counts its evaluations.

use std::cell::Cell;

use lamc_runtime::plumbing::{Dimensions, EquationsMut, workspace_len};
use lamc_runtime::{Error, Mechanism, State};

/// m d2q/dt2 = 1 - q - dq/dt, and not a number after the time `from`.
#[derive(Clone, Debug)]
pub struct Failing {
    pub mass: f64,
    /// s.
    pub from: f64,
    /// Evaluations that lie further apart than this have no value either, s.
    pub longest: f64,
    pub last: Cell<f64>,
    pub evaluations: Cell<u64>,
}

const DIMENSIONS: Dimensions = Dimensions::of_joints(1);

impl Failing {
    /// A force that is not a number after this time (s).
    pub fn without_force_from(from: f64) -> Self {
        Self {
            mass: 1.0,
            from,
            longest: f64::INFINITY,
            last: Cell::new(0.0),
            evaluations: Cell::new(0),
        }
    }
}

impl Mechanism for Failing {
    type Scalar = f64;
    type Coordinates = [f64; 1];
    type Speeds = [f64; 1];
    type Matrix = [f64; 1];
    type Workspace = [f64; workspace_len(DIMENSIONS)];
    type Poses = [[f64; 12]; 0];
    type Points = [[f64; 3]; 0];

    fn dimensions(&self) -> Dimensions {
        DIMENSIONS
    }
    fn speeds(&self) -> [f64; 1] {
        [0.0]
    }
    fn matrix(&self) -> [f64; 1] {
        [0.0]
    }
    fn workspace(&self) -> Self::Workspace {
        [0.0; workspace_len(DIMENSIONS)]
    }
    fn size(&self) -> f64 {
        1.0
    }
    fn limits(&self, _: usize) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }
    fn initial(&self) -> State<[f64; 1], f64> {
        State { t: 0.0, q: [0.5], u: [0.0] }
    }
    fn is_pinned(&self, _: usize) -> bool {
        true
    }
    fn write_equations(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: EquationsMut<'_, f64>,
    ) -> Result<(), Error> {
        self.evaluations.set(self.evaluations.get() + 1);
        let apart = t - self.last.replace(t);
        out.mass[0] = self.mass;
        let fails = t > self.from || apart > self.longest;
        out.forcing[0] = if fails { f64::NAN } else { 1.0 - q[0] - u[0] };
        Ok(())
    }
    fn write_closure(&self, _: &[f64], _: &mut [f64], _: &mut [f64]) -> Result<(), Error> {
        Ok(())
    }
}
