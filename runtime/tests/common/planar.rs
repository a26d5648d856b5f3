//! Two mechanisms written by hand in the number type under test: a pendulum and a planar
//! four-bar whose four hinge angles close through a ghost of the ground.

use lamc_runtime::plumbing::{Dimensions, EquationsMut, workspace_len};
use lamc_runtime::{Energy, Error, Mechanism, Scalar, State};

/// A point mass on a massless rod: theta'' = -(g / l) sin theta - c theta'.
#[derive(Clone, Debug)]
pub struct Pendulum<S> {
    pub mass: S,
    pub length: S,
    pub gravity: S,
    pub initial: [S; 2],
}

const PENDULUM: Dimensions = Dimensions { bodies: 1, points: 1, ..Dimensions::of_joints(1) };

impl<S: Scalar> Mechanism for Pendulum<S> {
    type Scalar = S;
    type Coordinates = [S; 1];
    type Speeds = [S; 1];
    type Poses = [[S; 12]; 1];
    type Points = [[S; 3]; 1];
    type Matrix = [S; 1];
    type Workspace = [S; workspace_len(PENDULUM)];

    fn dimensions(&self) -> Dimensions {
        PENDULUM
    }
    fn matrix(&self) -> Self::Matrix {
        [S::ZERO; 1]
    }

    fn speeds(&self) -> Self::Speeds {
        [S::ZERO]
    }
    fn workspace(&self) -> Self::Workspace {
        [S::ZERO; workspace_len(PENDULUM)]
    }
    fn size(&self) -> S {
        self.length
    }
    fn limits(&self, _: usize) -> [S; 2] {
        [f64::NEG_INFINITY, f64::INFINITY].map(S::from_f64)
    }
    fn initial(&self) -> State<[S; 1], S> {
        State { t: S::ZERO, q: [self.initial[0]], u: [self.initial[1]] }
    }
    fn is_pinned(&self, _: usize) -> bool {
        true
    }
    fn write_equations(
        &self,
        _: S,
        q: &[S],
        _: &[S],
        out: EquationsMut<'_, S>,
    ) -> Result<(), Error> {
        out.mass[0] = self.mass * self.length * self.length;
        out.forcing[0] = -self.mass * self.gravity * self.length * q[0].sin_cos().0;
        Ok(())
    }
    fn write_closure(&self, _: &[S], _: &mut [S], _: &mut [S]) -> Result<(), Error> {
        Ok(())
    }
    fn energy(&self, _: S, q: &[S; 1], u: &[S; 1]) -> Result<Energy<S>, Error> {
        let speed = self.length * u[0];
        Ok(Energy {
            kinetic: S::from_f64(0.5) * self.mass * speed * speed,
            potential: -self.mass * self.gravity * self.length * q[0].sin_cos().1,
        })
    }
    fn poses(&self, q: &[S; 1]) -> Result<[[S; 12]; 1], Error> {
        let (s, c) = q[0].sin_cos();
        let (o, i) = (S::ZERO, S::ONE);
        Ok([[c, -s, o, s, c, o, o, o, i, o, o, o]])
    }
    fn points(&self, q: &[S; 1]) -> Result<[[S; 3]; 1], Error> {
        let (s, c) = q[0].sin_cos();
        Ok([[self.length * s, -self.length * c, S::ZERO]])
    }
}

/// Of a body: cosine and sine of its angle, its hinge, omega, and the hinge's acceleration without
/// the part of du/dt.
type Frame<S> = ([S; 2], [S; 2], S, [S; 2]);

/// Links of `lengths` between hinges along z, gravity along -y; the last hinge at (ground, 0).
#[derive(Clone, Debug)]
pub struct FourBar<S> {
    pub lengths: [S; 3],
    pub ground: S,
    /// Of the links (at their middles) and of the ground's ghost (at its hinge).
    pub masses: [S; 4],
    /// About the centres of mass.
    pub inertias: [S; 4],
    pub gravity: S,
    pub guess: [S; 4],
}

const FOURBAR: Dimensions =
    Dimensions { rows: 3, rank: 3, loops: 1, bodies: 4, ..Dimensions::of_joints(4) };

impl<S: Scalar> FourBar<S> {
    /// Four different links of a few centimetres.
    pub fn example() -> Self {
        let of = S::from_f64;
        Self {
            lengths: [0.02, 0.05, 0.04].map(of),
            ground: of(0.045),
            masses: [6e-4, 9e-4, 7e-4, 3e-4].map(of),
            inertias: [4e-8, 2e-7, 1e-7, 5e-8].map(of),
            gravity: of(9.81),
            guess: [1.0, -0.5, -1.5, -2.0].map(of),
        }
    }

    fn frames(&self, q: &[S], u: &[S]) -> [Frame<S>; 4] {
        let mut frames = [([S::ZERO; 2], [S::ZERO; 2], S::ZERO, [S::ZERO; 2]); 4];
        let (mut angle, mut omega) = (S::ZERO, S::ZERO);
        let (mut at, mut bias) = ([S::ZERO; 2], [S::ZERO; 2]);
        for k in 0..4 {
            angle += q[k];
            omega += u[k];
            let (s, c) = angle.sin_cos();
            frames[k] = ([c, s], at, omega, bias);
            if k < 3 {
                let arm = [self.lengths[k] * c, self.lengths[k] * s];
                for axis in 0..2 {
                    at[axis] += arm[axis];
                    bias[axis] -= omega * omega * arm[axis];
                }
            }
        }
        frames
    }

    /// Points of the ghost, relative to its hinge, in ground directions: residual, gradient by q
    /// and bias, in x and y.
    fn closure_point(&self, q: &[S], u: &[S], drawn: [f64; 2]) -> [(S, [S; 4], S); 2] {
        let frames = self.frames(q, u);
        let ([c, s], at, omega, bias) = frames[3];
        let drawn = drawn.map(S::from_f64);
        let arm = [c * drawn[0] - s * drawn[1], s * drawn[0] + c * drawn[1]];
        let point = [at[0] + arm[0], at[1] + arm[1]];
        let original = [self.ground + drawn[0], drawn[1]];
        let columns = |axis: usize| {
            core::array::from_fn(|j| {
                let hinge = frames[j].1;
                if axis == 0 { -(point[1] - hinge[1]) } else { point[0] - hinge[0] }
            })
        };
        [0, 1].map(|axis| {
            (point[axis] - original[axis], columns(axis), bias[axis] - omega * omega * arm[axis])
        })
    }

    fn centre(&self, k: usize, frame: &Frame<S>) -> [S; 2] {
        let reach = if k < 3 { S::from_f64(0.5) * self.lengths[k] } else { S::ZERO };
        [reach * frame.0[0], reach * frame.0[1]]
    }
}

const DRAWN: [[f64; 2]; 3] = [[0.0, 0.0], [0.02, 0.0], [0.01, 0.015]];

impl<S: Scalar> Mechanism for FourBar<S> {
    type Scalar = S;
    type Coordinates = [S; 4];
    type Speeds = [S; 4];
    type Poses = [[S; 12]; 4];
    type Points = [[S; 3]; 0];
    type Matrix = [S; 16];
    type Workspace = [S; workspace_len(FOURBAR)];

    fn dimensions(&self) -> Dimensions {
        FOURBAR
    }
    fn matrix(&self) -> Self::Matrix {
        [S::ZERO; 16]
    }

    fn speeds(&self) -> Self::Speeds {
        [S::ZERO; 4]
    }
    fn workspace(&self) -> Self::Workspace {
        [S::ZERO; workspace_len(FOURBAR)]
    }
    fn size(&self) -> S {
        S::from_f64(0.06)
    }
    fn limits(&self, _: usize) -> [S; 2] {
        [f64::NEG_INFINITY, f64::INFINITY].map(S::from_f64)
    }
    fn initial(&self) -> State<[S; 4], S> {
        State { t: S::ZERO, q: self.guess, u: [S::ONE, S::ZERO, S::ZERO, S::ZERO] }
    }
    fn is_pinned(&self, joint: usize) -> bool {
        joint == 0
    }
    fn write_equations(
        &self,
        _: S,
        q: &[S],
        u: &[S],
        out: EquationsMut<'_, S>,
    ) -> Result<(), Error> {
        out.mass.fill(S::ZERO);
        out.forcing.fill(S::ZERO);
        let frames = self.frames(q, u);
        for k in 0..4 {
            let arm = self.centre(k, &frames[k]);
            let (_, at, omega, bias) = frames[k];
            let column = |j: usize| {
                let hinge = frames[j].1;
                [-(at[1] + arm[1] - hinge[1]), at[0] + arm[0] - hinge[0]]
            };
            let pull = [S::ZERO, -self.gravity];
            for i in 0..=k {
                let a = column(i);
                for j in 0..=k {
                    let b = column(j);
                    out.mass[i * 4 + j] +=
                        self.masses[k] * (a[0] * b[0] + a[1] * b[1]) + self.inertias[k];
                }
                for axis in 0..2 {
                    let acceleration = bias[axis] - omega * omega * arm[axis];
                    out.forcing[i] += self.masses[k] * a[axis] * (pull[axis] - acceleration);
                }
            }
        }
        let [x, y] = self.closure_point(q, u, DRAWN[0]);
        let [_, turned] = self.closure_point(q, u, DRAWN[1]);
        for (i, (_, row, bias)) in [x, y, turned].into_iter().enumerate() {
            out.jacobian[i * 4..(i + 1) * 4].copy_from_slice(&row);
            out.gamma[i] = bias;
        }
        Ok(())
    }
    fn write_closure(&self, q: &[S], residual: &mut [S], jacobian: &mut [S]) -> Result<(), Error> {
        residual.fill(S::ZERO);
        jacobian.fill(S::ZERO);
        for (p, drawn) in DRAWN.into_iter().enumerate() {
            let rows = self.closure_point(q, &[S::ZERO; 4], drawn);
            for (axis, (value, row, _)) in rows.into_iter().enumerate() {
                let i = 3 * p + axis;
                residual[i] = value;
                jacobian[i * 4..(i + 1) * 4].copy_from_slice(&row);
            }
        }
        Ok(())
    }
    fn energy(&self, _: S, q: &[S; 4], u: &[S; 4]) -> Result<Energy<S>, Error> {
        let (mut mass, mut unused) = ([S::ZERO; 16], [S::ZERO; 20]);
        let (forcing, rest) = unused.split_at_mut(4);
        let (jacobian, gamma) = rest.split_at_mut(12);
        self.write_equations(
            S::ZERO,
            q,
            u,
            EquationsMut { mass: &mut mass, forcing, jacobian, gamma: &mut gamma[..3] },
        )
        .expect("the lengths are right");
        let mut energy = Energy { kinetic: S::ZERO, potential: S::ZERO };
        let frames = self.frames(q, u);
        for i in 0..4 {
            for j in 0..4 {
                energy.kinetic += S::from_f64(0.5) * u[i] * mass[4 * i + j] * u[j];
            }
            let height = frames[i].1[1] + self.centre(i, &frames[i])[1];
            energy.potential += self.masses[i] * self.gravity * height;
        }
        Ok(energy)
    }
    fn poses(&self, q: &[S; 4]) -> Result<[[S; 12]; 4], Error> {
        let (o, i) = (S::ZERO, S::ONE);
        Ok(self
            .frames(q, &[o; 4])
            .map(|([c, s], [x, y], ..)| [c, -s, o, s, c, o, o, o, i, x, y, o]))
    }
    fn points(&self, _: &[S; 4]) -> Result<[[S; 3]; 0], Error> {
        Ok([])
    }
}
