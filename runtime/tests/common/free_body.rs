//! A rigid body that floats: position and unit quaternion in q, linear velocity in the base frame and
//! angular velocity in the body's frame in u.
//!
//! ```text
//! m dv/dt = 0        I dw/dt = -w x I w        dr/dt = v        dp/dt = p (0, w) / 2
//! ```

use lamc_runtime::plumbing::{Balance, Change, Dimensions, EquationsMut, workspace_len};
use lamc_runtime::{Energy, Error, Mechanism, State};

/// NQ = 7, NU = 6.
#[derive(Clone, Debug)]
pub struct FreeBody {
    /// kg.
    pub mass: f64,
    /// Principal moments, kg m^2.
    pub inertia: [f64; 3],
    /// v (m/s), then w (rad/s).
    pub u: [f64; 6],
}

pub const DIMENSIONS: Dimensions =
    Dimensions { coordinates: 7, speeds: 6, bodies: 1, points: 1, ..Dimensions::ZERO };

/// The quaternion product, scalar first.
pub fn product(a: [f64; 4], b: [f64; 4]) -> [f64; 4] {
    [
        a[0] * b[0] - a[1] * b[1] - a[2] * b[2] - a[3] * b[3],
        a[0] * b[1] + a[1] * b[0] + a[2] * b[3] - a[3] * b[2],
        a[0] * b[2] - a[1] * b[3] + a[2] * b[0] + a[3] * b[1],
        a[0] * b[3] + a[1] * b[2] - a[2] * b[1] + a[3] * b[0],
    ]
}

pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// A vector of the body's frame in the base frame.
pub fn rotated(p: [f64; 4], x: [f64; 3]) -> [f64; 3] {
    let [_, x, y, z] = product(product(p, [0.0, x[0], x[1], x[2]]), [p[0], -p[1], -p[2], -p[3]]);
    [x, y, z]
}

/// The unit quaternion of a rotation vector, rad.
pub fn quaternion(angle: [f64; 3]) -> [f64; 4] {
    let half = angle.iter().map(|x| x * x).sum::<f64>().sqrt() / 2.0;
    let share = if half < 1e-8 { 0.5 } else { half.sin() / half / 2.0 };
    [half.cos(), share * angle[0], share * angle[1], share * angle[2]]
}

/// The quaternion among the coordinates.
pub fn orientation(q: &[f64]) -> [f64; 4] {
    [q[3], q[4], q[5], q[6]]
}

impl FreeBody {
    /// -w x I w.
    fn gyroscopic(&self, w: &[f64]) -> [f64; 3] {
        let w = [w[0], w[1], w[2]];
        cross(std::array::from_fn(|k| self.inertia[k] * w[k]), w)
    }

    /// Angular momentum in the base frame, kg m^2/s.
    pub fn angular_momentum(&self, q: &[f64], u: &[f64]) -> [f64; 3] {
        rotated(orientation(q), std::array::from_fn(|k| self.inertia[k] * u[3 + k]))
    }
}

impl Mechanism for FreeBody {
    type Scalar = f64;
    type Coordinates = [f64; 7];
    type Speeds = [f64; 6];
    type Matrix = [f64; 36];
    type Workspace = [f64; workspace_len(DIMENSIONS)];
    type Poses = [[f64; 12]; 1];
    type Points = [[f64; 3]; 1];

    fn dimensions(&self) -> Dimensions {
        DIMENSIONS
    }
    fn speeds(&self) -> [f64; 6] {
        [0.0; 6]
    }
    fn matrix(&self) -> [f64; 36] {
        [0.0; 36]
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
    fn initial(&self) -> State<[f64; 7], f64, [f64; 6]> {
        State { t: 0.0, q: [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0], u: self.u }
    }
    fn is_pinned(&self, _: usize) -> bool {
        false
    }
    fn energy(&self, _: f64, _: &[f64; 7], u: &[f64; 6]) -> Result<Energy<f64>, Error> {
        let linear: f64 = u[..3].iter().map(|v| self.mass * v * v / 2.0).sum();
        let angular: f64 = (0..3).map(|k| self.inertia[k] * u[3 + k] * u[3 + k] / 2.0).sum();
        Ok(Energy { kinetic: linear + angular, potential: 0.0 })
    }
    fn poses(&self, q: &[f64; 7]) -> Result<[[f64; 12]; 1], Error> {
        let p = orientation(q);
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|e| rotated(p, e));
        Ok([[x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2], q[0], q[1], q[2]]])
    }
    fn points(&self, q: &[f64; 7]) -> Result<[[f64; 3]; 1], Error> {
        Ok([[q[0], q[1], q[2]]])
    }
    fn write_equations(
        &self,
        _: f64,
        _: &[f64],
        u: &[f64],
        out: EquationsMut<'_, f64>,
    ) -> Result<(), Error> {
        out.mass.fill(0.0);
        for k in 0..3 {
            out.mass[7 * k] = self.mass;
            out.mass[7 * (3 + k)] = self.inertia[k];
        }
        out.forcing[..3].fill(0.0);
        out.forcing[3..].copy_from_slice(&self.gyroscopic(&u[3..]));
        Ok(())
    }
    fn write_closure(&self, _: &[f64], _: &mut [f64], _: &mut [f64]) -> Result<(), Error> {
        Ok(())
    }
    fn advance(&self, q: &mut [f64], step: &[f64]) {
        for k in 0..3 {
            q[k] += step[k];
        }
        let turned = product(orientation(q), quaternion([step[3], step[4], step[5]]));
        q[3..].copy_from_slice(&turned);
        self.normalise(q);
    }
    fn write_rates(&self, q: &[f64], u: &[f64], out: &mut [f64]) {
        out[..3].copy_from_slice(&u[..3]);
        let rate = product(orientation(q), [0.0, u[3] / 2.0, u[4] / 2.0, u[5] / 2.0]);
        out[3..].copy_from_slice(&rate);
    }
    fn write_difference(&self, from: &[f64], to: &[f64], out: &mut [f64]) {
        for k in 0..3 {
            out[k] = to[k] - from[k];
        }
        let [w, x, y, z] = orientation(from);
        let [w, x, y, z] = product([w, -x, -y, -z], orientation(to));
        let sine = (x * x + y * y + z * z).sqrt();
        let share = if sine < 1e-8 { 2.0 / w } else { 2.0 * sine.atan2(w) / sine };
        out[3..].copy_from_slice(&[share * x, share * y, share * z]);
    }
    fn normalise(&self, q: &mut [f64]) {
        let norm = q[3..].iter().map(|x| x * x).sum::<f64>().sqrt();
        q[3..].iter_mut().for_each(|x| *x /= norm);
    }
    fn write_tangent(
        &self,
        at: Balance<'_, f64>,
        change: Change<'_, f64>,
        forces: &mut [f64],
        _: &mut [f64],
    ) -> Result<(), Error> {
        // d(I w x w) along dw.
        let w = [at.u[3], at.u[4], at.u[5]];
        let dw = [change.u[3], change.u[4], change.u[5]];
        let momentum =
            |w: [f64; 3]| -> [f64; 3] { std::array::from_fn(|k| self.inertia[k] * w[k]) };
        let (first, second) = (cross(momentum(dw), w), cross(momentum(w), dw));
        forces[..3].fill(0.0);
        for k in 0..3 {
            forces[3 + k] = first[k] + second[k];
        }
        Ok(())
    }
}
