//! A program as a mechanism of the runtime.

use lamc_runtime::plumbing::{
    Balance, Dimensions, Drive, EquationsMut, GapsMut, Margin, ProjectionMut, Reduction,
    ReductionMut, ReductionParts, ReductionSizes, Rows, workspace_len,
};
use lamc_runtime::{Change, Energy, Error, JacobianMut, Mechanism, Momentum, StateOf, free_body};

use super::{Executable, State};
use crate::program::{Engine, FunctionKind, Interface, SparseRows};

impl<E: Engine> Mechanism for Executable<E> {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Speeds = Vec<f64>;
    type Matrix = Vec<f64>;
    type Workspace = Vec<f64>;
    type Poses = Vec<[f64; 12]>;
    type Points = Vec<[f64; 3]>;

    fn dimensions(&self) -> Dimensions {
        let interface = &self.interface;
        Dimensions {
            rows: interface.rows,
            rank: interface.rank,
            loops: interface.loops.len(),
            bodies: interface.bodies.len(),
            points: interface.points.len(),
            contacts: interface.contacts.len(),
            drives: interface.driven().len(),
            parameters: interface.parameters.len(),
            inputs: interface.inputs.len(),
            coordinates: interface.coordinates(),
            speeds: interface.speeds(),
            joints: interface.joints.len(),
            reduction: interface.reduction.as_ref().map_or(ReductionSizes::NONE, |reduction| {
                ReductionSizes {
                    branches: reduction.branches.len(),
                    depth: reduction.depth(),
                    independent: reduction.independent.len(),
                    closure: reduction.closure.columns.len(),
                    factors: reduction.factors(),
                }
            }),
        }
    }

    fn speeds(&self) -> Vec<f64> {
        vec![0.0; self.interface.speeds()]
    }
    fn matrix(&self) -> Vec<f64> {
        vec![0.0; self.interface.speeds() * self.interface.speeds()]
    }
    fn workspace(&self) -> Vec<f64> {
        vec![0.0; workspace_len(self.dimensions())]
    }
    fn size(&self) -> f64 {
        self.interface.size
    }

    fn limits(&self, joint: usize) -> [f64; 2] {
        let unlimited = [f64::NEG_INFINITY, f64::INFINITY];
        self.interface.joints.get(joint).map_or(unlimited, |joint| joint.limits)
    }

    fn initial(&self) -> StateOf<Self> {
        let Interface { joints, free, .. } = &self.interface;
        let q = joints.iter().map(|joint| joint.initial_q);
        let u = joints.iter().map(|joint| joint.initial_u);
        lamc_runtime::State {
            t: 0.0,
            q: q.chain(free.iter().flat_map(|body| body.q)).collect(),
            u: u.chain(free.iter().flat_map(|body| body.u)).collect(),
        }
    }

    fn is_pinned(&self, joint: usize) -> bool {
        self.interface.joints.get(joint).is_some_and(|joint| joint.initial_given)
    }

    fn advance(&self, q: &mut [f64], step: &[f64]) {
        free_body::advance(q, step, self.interface.joints.len());
    }

    fn write_rates(&self, q: &[f64], u: &[f64], out: &mut [f64]) {
        free_body::write_rates(q, u, out, self.interface.joints.len());
    }

    fn write_difference(&self, from: &[f64], to: &[f64], out: &mut [f64]) {
        free_body::write_difference(from, to, out, self.interface.joints.len());
    }

    fn normalise(&self, q: &mut [f64]) {
        free_body::normalise(q, self.interface.joints.len());
    }

    fn momentum(&self, q: &Vec<f64>, u: &Vec<f64>) -> Result<Momentum<f64>, Error> {
        let mut out = [[f64::NAN; 3]; 3];
        let at = State { q, u, ..State::default() };
        self.evaluate(FunctionKind::Momentum, at, &mut [out.as_flattened_mut()])?;
        let [centre, linear, angular] = out;
        Ok(Momentum { centre, linear, angular })
    }

    fn energy(&self, t: f64, q: &Vec<f64>, u: &Vec<f64>) -> Result<Energy<f64>, Error> {
        let (mut kinetic, mut potential) = ([f64::NAN], [f64::NAN]);
        let at = State { t, q, u, ..State::default() };
        self.evaluate(FunctionKind::Energy, at, &mut [&mut kinetic, &mut potential])?;
        Ok(Energy { kinetic: kinetic[0], potential: potential[0] })
    }

    fn poses(&self, q: &Vec<f64>) -> Result<Vec<[f64; 12]>, Error> {
        self.rows(FunctionKind::Poses, q, self.interface.bodies.len())
    }

    fn points(&self, q: &Vec<f64>) -> Result<Vec<[f64; 3]>, Error> {
        self.rows(FunctionKind::Points, q, self.interface.points.len())
    }

    fn write_equations(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: EquationsMut<'_, f64>,
    ) -> Result<(), Error> {
        let out = &mut [out.mass, out.forcing, out.jacobian, out.gamma];
        self.evaluate(FunctionKind::Equations, State { t, q, u, ..State::default() }, out)
    }

    fn write_closure(
        &self,
        q: &[f64],
        residual: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), Error> {
        let at = State { q, ..State::default() };
        self.evaluate(FunctionKind::Closure, at, &mut [residual, jacobian])
    }

    fn drives(&self, t: f64, mut visit: impl FnMut(Drive<f64>)) {
        let driven = self.interface.driven();
        let mut values = vec![[f64::NAN; 4]; driven.len()];
        let at = State { t, ..State::default() };
        let out = &mut [values.as_flattened_mut()];
        let outcome = self.evaluate(FunctionKind::Drives, at, out);
        debug_assert_eq!(outcome, Ok(()));
        for (joint, [position, speed, acceleration, jerk]) in driven.iter().zip(values) {
            visit(Drive { joint: joint.index(), position, speed, acceleration, jerk });
        }
    }

    fn write_contacts(&self, t: f64, q: &[f64], u: &[f64], out: &mut [f64]) -> Result<(), Error> {
        let at = State { t, q, u, ..State::default() };
        self.evaluate(FunctionKind::Contacts, at, &mut [out])
    }

    fn write_gaps(&self, t: f64, q: &[f64], out: GapsMut<'_, f64>) -> Result<(), Error> {
        if out.gap.is_empty() {
            return Ok(());
        }
        let GapsMut { gap, friction, normal, rows } = out;
        let at = State { t, q, ..State::default() };
        self.evaluate(FunctionKind::Gaps, at, &mut [gap, friction, normal, rows])
    }

    fn write_reactions(&self, at: Balance<'_, f64>, out: &mut [f64]) -> Result<(), Error> {
        let Balance { t, q, u, acceleration, multipliers } = at;
        let at = State { t, q, u, acceleration, multipliers, ..State::default() };
        self.evaluate(FunctionKind::Reactions, at, &mut [out])
    }

    fn write_tangent(
        &self,
        at: Balance<'_, f64>,
        change: Change<'_, f64>,
        forces: &mut [f64],
        closure: &mut [f64],
    ) -> Result<(), Error> {
        let Balance { t, q, u, acceleration, multipliers } = at;
        let at = State { t, q, u, acceleration, multipliers, change, ..State::default() };
        self.evaluate(FunctionKind::Tangent, at, &mut [forces, closure])
    }

    fn write_acceleration(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: &mut [f64],
    ) -> Result<Option<Margin<f64>>, Error> {
        let at = State { t, q, u, ..State::default() };
        self.solve(FunctionKind::Acceleration, at, &mut [out])
    }

    fn write_projection(
        &self,
        q: &[f64],
        u: &[f64],
        out: ProjectionMut<'_, f64>,
    ) -> Result<Option<Margin<f64>>, Error> {
        let ProjectionMut { residual, positions, speeds } = out;
        let at = State { q, u, ..State::default() };
        self.solve(FunctionKind::Projection, at, &mut [residual, positions, speeds])
    }

    fn reduction(&self) -> Option<Reduction<'_, f64>> {
        let reduction = self.interface.reduction.as_ref();
        let reduction = reduction.filter(|_| self.has(FunctionKind::Reduction))?;
        Some(Reduction {
            branches: &self.branches,
            independent: &reduction.independent,
            steps: &self.steps,
            rows: &reduction.rows,
            places: &self.places,
            closure: rows(&reduction.closure),
            lower: rows(&reduction.lower),
            upper: rows(&reduction.upper),
            is_beside_solution: self.has(FunctionKind::Acceleration),
            parts: self,
        })
    }

    fn write_jacobian(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: JacobianMut<'_, f64>,
    ) -> Result<Option<Margin<f64>>, Error> {
        let JacobianMut { acceleration, dq, du, dt } = out;
        let at = State { t, q, u, ..State::default() };
        self.solve(FunctionKind::Jacobian, at, &mut [acceleration, dq, du, dt])
    }

    fn write_jacobian_params(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        acceleration: &mut [f64],
        dp: &mut [f64],
    ) -> Result<Option<Margin<f64>>, Error> {
        let at = State { t, q, u, ..State::default() };
        self.solve(FunctionKind::JacobianParams, at, &mut [acceleration, dp])
    }
}

impl<E: Engine> ReductionParts<f64> for Executable<E> {
    fn write_acceleration(
        &self,
        (t, q, u): (f64, &[f64], &[f64]),
        out: ReductionMut<'_, f64>,
        opening: &mut [f64],
        forces: &mut [f64],
    ) -> Result<(), Error> {
        let ReductionMut { axes, momenta, rotors, closure } = out;
        let at = State { t, q, u, ..State::default() };
        let out = &mut [axes, momenta, rotors, closure, opening, forces];
        self.evaluate(FunctionKind::Reduction, at, out)
    }

    fn write_projection(
        &self,
        q: &[f64],
        u: &[f64],
        out: ReductionMut<'_, f64>,
        residual: &mut [f64],
        openings: [&mut [f64]; 2],
    ) -> Result<(), Error> {
        let ReductionMut { axes, momenta, rotors, closure } = out;
        let [row_residual, row_velocity] = openings;
        let at = State { q, u, ..State::default() };
        let out = &mut [axes, momenta, rotors, closure, residual, row_residual, row_velocity];
        self.evaluate(FunctionKind::ProjectionReduction, at, out)
    }
}

fn rows(rows: &SparseRows) -> Rows<'_> {
    Rows { ends: &rows.ends, columns: &rows.columns }
}
