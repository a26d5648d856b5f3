//! Rigid contacts: the conditions of complementarity at random states, and closed forms of a point on a plane.

mod common;

use common::compare::{keep_largest, largest};
use common::uniform::Random;
use lamc_runtime::plumbing::{Dimensions, EquationsMut, GapsMut, workspace_len};
use lamc_runtime::{Error, Mechanism, Rigid, State, StateOf};

type Vector = Vec<f64>;

/// M du/dt = f and gaps that are linear in q, with a compliant law that the rigid method must not see.
#[derive(Clone)]
struct Linear {
    mass: Vector,
    force: Vector,
    gaps: Vector,
    friction: Vector,
    normals: Vec<[f64; 3]>,
    rows: Vector,
    limits: Vec<[f64; 2]>,
    law: f64,
    start: State<Vector, f64>,
}

impl Linear {
    fn velocities(&self, u: &[f64]) -> Vec<[f64; 3]> {
        let w: Vec<f64> = self.rows.chunks(u.len()).map(|row| dot(row, u)).collect();
        w.as_chunks().0.to_vec()
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

impl Mechanism for Linear {
    type Scalar = f64;
    type Coordinates = Vector;
    type Speeds = Vector;
    type Matrix = Vector;
    type Workspace = Vector;
    type Poses = Vec<[f64; 12]>;
    type Points = Vec<[f64; 3]>;

    fn dimensions(&self) -> Dimensions {
        Dimensions { contacts: self.gaps.len(), ..Dimensions::of_joints(self.force.len()) }
    }
    fn speeds(&self) -> Vector {
        vec![0.0; self.force.len()]
    }
    fn matrix(&self) -> Vector {
        vec![0.0; self.force.len().pow(2)]
    }
    fn workspace(&self) -> Vector {
        vec![f64::NAN; workspace_len(self.dimensions())]
    }
    fn size(&self) -> f64 {
        1.0
    }
    fn limits(&self, joint: usize) -> [f64; 2] {
        self.limits[joint]
    }
    fn initial(&self) -> StateOf<Self> {
        self.start.clone()
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
        out.mass.copy_from_slice(&self.mass);
        out.forcing.copy_from_slice(&self.force);
        let mut law = vec![0.0; 6 * self.gaps.len()];
        self.write_contacts(t, q, u, &mut law)?;
        for (k, law) in law.chunks(6).enumerate() {
            for axis in 0..3 {
                let row = &self.rows[(3 * k + axis) * u.len()..][..u.len()];
                out.forcing.iter_mut().zip(row).for_each(|(f, g)| *f += g * law[3 + axis]);
            }
        }
        Ok(())
    }
    fn write_closure(&self, _: &[f64], _: &mut [f64], _: &mut [f64]) -> Result<(), Error> {
        Ok(())
    }
    fn write_contacts(&self, _: f64, q: &[f64], _: &[f64], out: &mut [f64]) -> Result<(), Error> {
        for (k, out) in out.chunks_mut(6).enumerate() {
            out.fill(self.law * (1.0 + k as f64 + q[0]));
        }
        Ok(())
    }
    fn write_gaps(&self, _: f64, q: &[f64], out: GapsMut<'_, f64>) -> Result<(), Error> {
        for (k, (out, w)) in out.gap.chunks_mut(2).zip(self.velocities(q)).enumerate() {
            out.copy_from_slice(&[self.gaps[k] + dot(&self.normals[k], &w), 1e9]);
        }
        out.friction.copy_from_slice(&self.friction);
        out.normal.copy_from_slice(self.normals.as_flattened());
        out.rows.copy_from_slice(&self.rows);
        Ok(())
    }
}

fn unit(v: Vec<f64>) -> [f64; 3] {
    let length = dot(&v, &v).sqrt();
    [v[0] / length, v[1] / length, v[2] / length]
}

/// A random mechanism of n speeds and k points, some near and some far, with limits on its first two.
fn random(n: usize, k: usize, seed: u64) -> Linear {
    let mut random = Random::new(seed);
    let root = random.normals(n * n, 0.3);
    let mass = |i: usize, j: usize| {
        let own = if i == j { 1.0 } else { 0.0 };
        own + dot(&root[i * n..(i + 1) * n], &root[j * n..(j + 1) * n])
    };
    let free = [f64::NEG_INFINITY, f64::INFINITY];
    let mut limits = vec![free; n];
    limits[0] = [-1e-3, 2e-3];
    limits[1] = [f64::NEG_INFINITY, 0.0];
    let normals: Vec<_> = (0..k).map(|_| unit(random.normals(3, 1.0))).collect();
    let rows = random.normals(3 * k * n, 1.0);
    let (mut force, mut speed) = (random.normals(n, 10.0), 1.0);
    let presses = !seed.is_multiple_of(2);
    if presses {
        // Against every plane, and hardly along it.
        force.iter_mut().for_each(|force| *force *= 0.05);
        for (index, row) in rows.chunks(n).enumerate() {
            let along = 10.0 * normals[index / 3][index % 3];
            force.iter_mut().zip(row).for_each(|(force, g)| *force -= along * g);
        }
        speed = 1e-3;
    }
    Linear {
        mass: (0..n * n).map(|index| mass(index / n, index % n)).collect(),
        force,
        gaps: (0..k).map(|_| random.range(0.0, 2e-3 * speed)).collect(),
        friction: (0..k).map(|index| [0.0, 0.3, 0.5][(index + seed as usize) % 3]).collect(),
        normals,
        rows,
        limits,
        law: 3.0,
        start: State { t: 0.0, q: vec![0.0; n], u: random.normals(n, speed) },
    }
}

/// What a step does to a mechanism: adds to `counts` how often a point is off its plane, sticks, slides, and a joint
/// is held at its least and at its greatest angle. `slack` is allowed of the cones, as a share of their radius.
fn check(
    system: &Linear,
    (before, state): (&State<Vector, f64>, &State<Vector, f64>),
    rigid: &Rigid<Linear>,
    [h, slack]: [f64; 2],
    counts: &mut [usize; 5],
) {
    let n = state.u.len();
    let left = |i: usize| {
        let row = &system.mass[i * n..(i + 1) * n];
        dot(row, &state.u) - dot(row, &before.u) - h * system.force[i]
    };
    let mut left: Vec<f64> = (0..n).map(left).collect();
    let forces = rigid.forces(system);
    let (from, to) = (system.velocities(&before.q), system.velocities(&state.q));
    for (point, w) in system.velocities(&state.u).into_iter().enumerate() {
        for (axis, force) in forces[point].into_iter().enumerate() {
            let row = &system.rows[(3 * point + axis) * n..][..n];
            left.iter_mut().zip(row).for_each(|(left, g)| *left -= h * g * force);
        }
        let normal = system.normals[point];
        let (push, leaves) = (dot(&normal, &forces[point]), dot(&normal, &w));
        let gaps = [from[point], to[point]].map(|at| system.gaps[point] + dot(&normal, &at));
        assert!(push >= -1e-9 && gaps[1] >= -1e-12, "{push} {gaps:?}");
        assert!((push * (gaps[0].max(0.0) + h * leaves)).abs() <= 1e-9 * (1.0 + push));
        let rub: Vec<f64> = (0..3).map(|i| forces[point][i] - push * normal[i]).collect();
        let slide: Vec<f64> = (0..3).map(|i| w[i] - leaves * normal[i]).collect();
        let [size, speed] = [&rub, &slide].map(|v| dot(v, v).sqrt());
        let most = system.friction[point] * push;
        assert!(size <= most * (1.0 + slack) + 1e-9, "{size} {most}");
        let (power, expected) = (dot(&rub, &slide), -most * speed);
        assert!((power - expected).abs() <= slack * (1.0 + most), "{power} {expected}");
        counts[0] += usize::from(push == 0.0);
        counts[1] += usize::from(most > 0.0 && speed < 1e-12);
        counts[2] += usize::from(most > 0.0 && speed > 1e-6);
    }
    for (joint, torque) in rigid.torques(system).iter().enumerate() {
        left[joint] -= h * torque;
        let ([least, most], q) = (system.limits[joint], state.q[joint]);
        assert!(q >= least - 1e-12 && q <= most + 1e-12, "{q}");
        assert!(*torque <= 1e-9 || (q - least).abs() <= 1e-12, "{torque} {q}");
        assert!(*torque >= -1e-9 || (q - most).abs() <= 1e-12, "{torque} {q}");
        counts[3] += usize::from(*torque > 0.0);
        counts[4] += usize::from(*torque < 0.0);
    }
    let most = 1.0 + h * largest(forces.as_flattened());
    assert!(largest(&left) <= 1e-9 * most, "{left:?}");
}

/// The impulses of a step explain the change of u, push, stay in their cones and act against what slides; nothing gets
/// behind its plane.
#[test]
fn a_step_fulfils_every_condition() {
    let (h, mut counts) = (1e-3, [0; 5]);
    for seed in 0..300 {
        let n = 6 + seed % 4;
        let system = random(n, 1 + seed % (n / 3), seed as u64);
        let mut state = system.initial();
        let mut rigid = Rigid::new(&system);
        for _ in 0..5 {
            let before = state.clone();
            rigid.step(&system, &mut state, h).unwrap();
            check(&system, (&before, &state), &rigid, [h, 1e-8], &mut counts);
        }
        assert_eq!(rigid.unsolved, 0);
    }
    assert!(counts.iter().all(|&count| count > 100), "{counts:?}");
}

/// With many points and much friction there are steps without a solution that sweeps find. All others fulfil every
/// condition.
#[test]
fn a_step_that_is_not_solved_is_counted() {
    let (h, mut counts, mut unsolved) = (1e-3, [0; 5], 0);
    for seed in 0..300 {
        let mut system = random(6, 4, seed);
        system.friction.fill(0.9);
        let mut state = system.initial();
        let mut rigid = Rigid::new(&system);
        for _ in 0..5 {
            let (before, known) = (state.clone(), rigid.unsolved);
            rigid.step(&system, &mut state, h).unwrap();
            if rigid.unsolved == known {
                check(&system, (&before, &state), &rigid, [h, 1e-6], &mut counts);
            }
        }
        unsolved += rigid.unsolved;
    }
    assert!((1..150).contains(&unsolved) && counts[1] > 100, "{unsolved} {counts:?}");
}

/// A point of 2 kg over the plane z = 0.
fn point(force: [f64; 3], q: [f64; 3], u: [f64; 3], friction: f64) -> Linear {
    let unit = |i: usize| if i / 3 == i % 3 { 1.0 } else { 0.0 };
    Linear {
        mass: (0..9).map(|i| 2.0 * unit(i)).collect(),
        force: force.map(|f| 2.0 * f).to_vec(),
        gaps: vec![0.0],
        friction: vec![friction],
        normals: vec![[0.0, 0.0, 1.0]],
        rows: (0..9).map(unit).collect(),
        limits: vec![[f64::NEG_INFINITY, f64::INFINITY]; 3],
        law: 0.0,
        start: State { t: 0.0, q: q.to_vec(), u: u.to_vec() },
    }
}

fn run(system: &Linear, t: f64, h: f64) -> State<Vector, f64> {
    let mut state = system.initial();
    Rigid::new(system).run(system, &mut state, t, h, |_| ()).unwrap();
    state
}

/// It stops after v^2 / (2 mu g), exactly on a straight line; the error is of order 1.
#[test]
fn a_sliding_point_stops_after_its_distance() {
    let (friction, speed) = (0.3, 0.5_f64);
    let system = point([0.0, 0.0, -9.81], [0.0; 3], [0.3, 0.4, 0.0], friction);
    let exact = speed * speed / (2.0 * friction * 9.81);
    let errors = [1e-3, 5e-4, 2.5e-4].map(|h| {
        let end = run(&system, 0.3, h);
        assert!(end.u.iter().all(|u| u.abs() <= 1e-15), "{end:?}");
        assert!((end.q[0] * 0.4 - end.q[1] * 0.3).abs() <= 1e-12);
        1.0 - end.q[0].hypot(end.q[1]) / exact
    });
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] - 2.0).abs() <= 0.2, "{errors:?}");
    }
    assert!(errors[2].abs() < 2e-3, "{errors:?}");
}

#[test]
fn a_point_on_a_slope_sticks_without_creep_or_slides() {
    for (share, sticks) in [(0.99, true), (1.01, false)] {
        let slope = share * 0.5_f64;
        let system = point([9.81 * slope, 0.0, -9.81], [0.0; 3], [0.0; 3], 0.5);
        let end = run(&system, 100.0, 1e-3);
        let moved = if sticks { 0.0 } else { 0.5 * 9.81 * 0.005 * 1e4 };
        let error = end.q[0] - moved;
        assert!(error.abs() <= if sticks { 1e-12 } else { 1e-4 * moved }, "{share}: {end:?}");
    }
}

/// Falls from h, and rises to e^2 h; at rest it stays on the plane.
#[test]
fn a_point_rebounds_with_its_restitution() {
    for restitution in [0.0, 0.5, 1.0] {
        let system = point([0.0, 0.0, -9.81], [0.0, 0.0, 0.1], [0.0; 3], 0.5);
        let mut rigid = Rigid::new(&system);
        rigid.restitution = restitution;
        let (mut state, mut highest, mut landed) = (system.initial(), 0.0_f64, false);
        let end = 0.3;
        rigid
            .run(&system, &mut state, end, 1e-5, |state| {
                landed |= state.q[2] < 1e-5;
                highest = keep_largest(highest, if landed { state.q[2] } else { 0.0 });
                assert!(state.q[2] >= -1e-15);
            })
            .unwrap();
        let expected = 0.1 * restitution * restitution;
        assert!((highest - expected).abs() <= 1e-4, "{restitution}: {highest}");
    }
    let end = run(&point([0.0, 0.0, -9.81], [0.0, 0.0, 0.1], [0.0; 3], 0.5), 2.0, 1e-3);
    assert!(end.q[2].abs() <= 1e-15 && end.u[2].abs() <= 1e-15, "{end:?}");
}

/// What overlaps at the start is separated by one step, and gets no speed from that.
#[test]
fn what_overlaps_is_separated_without_speed() {
    let system = point([0.0, 0.0, -9.81], [0.0, 0.0, -0.01], [0.0; 3], 0.5);
    let end = run(&system, 1e-3, 1e-3);
    assert!(end.q[2].abs() <= 1e-15 && end.u[2].abs() <= 1e-15, "{end:?}");
}
