//! Accelerations of closed mechanisms against the dense pseudo-inverse over all nine closure rows
//! of every loop: at random closed states, and at and next to the flat state, where rank is lost.
//!
//! M, f and the Jacobian of the nine rows are lamc's; gamma is that of a kinematics apart.
//!
//! Where is the pseudo-inverse that of the mechanism, and where that of its rows? Rows with the
//! same null space, C = T N with T of full column rank on the range of N, have the same
//! pseudo-inverse solution if none of their singular values but zeros are dropped and
//! N du/dt = -gamma can be satisfied. Next to the flat state neither holds: speeds that are free to
//! first order (flat) are not so to second order, the equations contradict each other, and least
//! squares weigh the contradiction by the rows; and the space that is dropped at singular values
//! s of the kept ones' size depends on the rows to the order of s. There the reference is made of
//! those combinations of the nine rows that lamc says it uses ([`lamc::topology::Loop::rows`]), and
//! all nine are the reference where both conditions hold.

use std::fmt::{self, Display};

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::{EquationsMut, System, acceleration, assemble, project};
use lamc_tests::linkages::{self, Linkage};
use lamc_tests::nine_rows::nine_rows;
use lamc_tests::random::Random;
use lamc_tests::udwadia::{Constrained, Equations};
use lamc_tests::{compile_text, relative_error};
use nalgebra::{DMatrix, DVector};

/// Eigenvalues of J M^-1 J^T below this share of the largest are dropped.
const CUT: f64 = 1e-7;
/// The runtime takes this decision on its C rows, the test on nine: their eigenvalues differ by
/// less than this factor, and within it of the cut the two may decide differently.
const DOUBT: f64 = 30.0;
/// Random closed states per linkage.
const STATES: usize = 16;
/// Guesses for them.
const GUESSES: usize = 40;
/// Closed states that are flattened, and by how much.
const FLATTENED: usize = 4;
const SCALES: [f64; 14] =
    [1e-1, 1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12, 1e-13, 0.0];

#[test]
fn spherical_four_bar() {
    check(&linkages::spherical("spherical_four_bar", &[0.0, 80.0, 170.0, 260.0]));
}

#[test]
fn spherical_five_bar() {
    check(&linkages::spherical("spherical_five_bar", &[0.0, 80.0, 140.0, 220.0, 290.0]));
}

#[test]
fn spherical_six_bar() {
    check(&linkages::spherical("spherical_six_bar", &[0.0, 50.0, 140.0, 180.0, 220.0, 290.0]));
}

#[test]
fn planar_four_bar() {
    check(&linkages::planar_four_bar());
}

#[test]
fn spatial_seven_bar() {
    check(&linkages::spatial_seven_bar());
}

#[test]
fn bennett_linkage() {
    check(&linkages::bennett());
}

#[test]
fn sarrus_linkage() {
    check(&linkages::sarrus());
}

#[test]
fn watt_six_bar() {
    check(&linkages::watt());
}

#[test]
fn miura_sheet() {
    check(&linkages::miura(4));
}

fn check(linkage: &Linkage) {
    let compiled = compile_text(&linkage.text(1));
    let topology = &compiled.topology;
    assert_eq!((topology.rank, topology.mobility), (linkage.rank, linkage.mobility));
    let system = Interpreter::new(&compiled.program);
    let bench = Bench { linkage, compiled: &compiled, system: &system };
    bench.the_kinematics_are_those_of_the_closure();
    let states = bench.random_states();
    bench.flattened_states(&states);
    bench.continuity(&states);
}

/// The largest of some errors.
#[derive(Default)]
struct Worst {
    count: usize,
    error: f64,
}

impl Worst {
    fn note(&mut self, error: f64) {
        self.count += 1;
        self.error = self.error.max(error);
    }
}

impl Display for Worst {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(out, "{:.1e} of {}", self.error, self.count)
    }
}

#[derive(Clone, Debug)]
struct State {
    q: Vec<f64>,
    u: Vec<f64>,
}

/// The equations of a state: with all nine rows per loop, and with those of them lamc uses.
struct Reference {
    nine: Equations,
    selected: Equations,
}

struct Bench<'a> {
    linkage: &'a Linkage,
    compiled: &'a Compiled,
    system: &'a Interpreter,
}

impl Bench<'_> {
    fn n(&self) -> usize {
        self.linkage.hinges.len()
    }

    fn random_vector(&self, random: &mut Random, most: f64) -> Vec<f64> {
        (0..self.n()).map(|_| random.range(-most, most)).collect()
    }

    /// lamc's nine residuals and their Jacobian.
    fn closure(&self, q: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
        let rows = 9 * self.system.dimensions().loops;
        let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * self.n()]);
        self.system.write_closure(q, &mut residual, &mut jacobian);
        (DVector::from_vec(residual), DMatrix::from_row_slice(rows, self.n(), &jacobian))
    }

    fn reference(&self, State { q, u }: &State) -> Reference {
        let n = self.n();
        let rows = self.system.dimensions().rows;
        let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
        let (mut jacobian, mut gamma) = (vec![0.0; rows * n], vec![0.0; rows]);
        let out = EquationsMut {
            mass: &mut mass,
            forcing: &mut forcing,
            jacobian: &mut jacobian,
            gamma: &mut gamma,
        };
        self.system.write_equations(0.0, q, u, out);
        let rows = nine_rows(&self.compiled.topology, q, u);
        let nine = Equations {
            mass: DMatrix::from_row_slice(n, n, &mass),
            forcing: DVector::from_vec(forcing),
            jacobian: self.closure(q).1,
            gamma: rows.gamma,
        };
        let jacobian = &rows.selection * &nine.jacobian;
        let gamma = &rows.selection * &nine.gamma;
        let selected = Equations { jacobian, gamma, ..nine.clone() };
        Reference { nine, selected }
    }

    /// lamc's acceleration and rank.
    fn acceleration(&self, State { q, u }: &State) -> (Vec<f64>, usize) {
        let (mut found, mut workspace) = (self.system.vector(), self.system.workspace());
        let constraint = acceleration(self.system, 0.0, q, u, &mut workspace, &mut found)
            .unwrap_or_else(|error| panic!("{}: {error} at {q:?}, {u:?}", self.linkage.name));
        assert!(found.iter().all(|x| x.is_finite()), "{}: {found:?}", self.linkage.name);
        (found, constraint.rank)
    }

    /// The closed state next to this one, if it can be reached.
    fn closed(&self, State { mut q, mut u }: State, assembled: bool) -> Option<State> {
        let mut workspace = self.system.workspace();
        if assembled {
            assemble(self.system, &mut q, &vec![false; self.n()], &mut workspace).ok()?;
        }
        project(self.system, 0.0, &mut q, &mut u, &mut workspace).ok()?;
        Some(State { q, u })
    }

    /// At open states: position and velocity to rounding; gamma as sixth-order differences of
    /// lamc's Jacobian along u give it, which err by some 1e-10.
    fn the_kinematics_are_those_of_the_closure(&self) {
        const H: f64 = 4e-3;
        let mut random = Random::new(11);
        let (mut exact, mut differenced) = (Worst::default(), Worst::default());
        for _ in 0..10 {
            let q = self.random_vector(&mut random, 1.5);
            let u = self.random_vector(&mut random, 1.0);
            let rows = nine_rows(&self.compiled.topology, &q, &u);
            let speeds = DVector::from_column_slice(&u);
            let velocity = |s: f64| {
                let q: Vec<f64> = q.iter().zip(&u).map(|(q, u)| q + s * u).collect();
                self.closure(&q).1 * &speeds
            };
            let slope = |steps: f64| velocity(steps * H) - velocity(-steps * H);
            let gamma = (slope(1.0) * 45.0 - slope(2.0) * 9.0 + slope(3.0)) / (60.0 * H);
            exact.note((self.closure(&q).0 - &rows.residual).amax() / rows.residual.amax());
            exact.note((velocity(0.0) - &rows.velocity).amax() / rows.velocity.amax());
            differenced.note((gamma - &rows.gamma).amax() / rows.gamma.amax());
        }
        let name = self.linkage.name;
        println!("{name}: kinematics to {exact}, gamma to differences {differenced}");
        assert!(exact.error < 1e-12, "{name}: {exact}");
        assert!(differenced.error < 1e-9, "{name}: {differenced}");
    }

    /// Random closed states, each compared to 1e-9 of the largest acceleration.
    fn random_states(&self) -> Vec<State> {
        let name = self.linkage.name;
        let mut random = Random::new(7);
        let (mut states, mut worst, mut bias) = (Vec::new(), Worst::default(), Worst::default());
        let folded = self.linkage.folded.iter().any(|angle| *angle != 0.0);
        for _ in 0..GUESSES {
            if states.len() == STATES {
                break;
            }
            let mut q = self.random_vector(&mut random, if folded { 0.3 } else { 1.2 });
            q.iter_mut().zip(&self.linkage.folded).for_each(|(q, folded)| *q += folded);
            let u = self.random_vector(&mut random, 10.0);
            let Some(state) = self.closed(State { q, u }, true) else { continue };
            let Reference { nine, .. } = self.reference(&state);
            let expected = nine.solve(CUT);
            if is_doubtful(&expected, DOUBT) {
                continue;
            }
            let (found, rank) = self.acceleration(&state);
            assert_eq!((rank, expected.rank), (self.linkage.rank, self.linkage.rank), "{name}");
            worst.note(relative_error(&found, expected.acceleration.as_slice()));
            let gamma = DVector::zeros(nine.gamma.len());
            let unbiased = Equations { gamma, ..nine }.solve(CUT).acceleration;
            bias.note(relative_error(unbiased.as_slice(), &found));
            states.push(state);
        }
        println!("{name}: random states {worst}; without gamma {:.1e}", bias.error);
        assert_eq!(states.len(), STATES, "{name}: too few states could be compared");
        assert!(worst.error < 1e-9, "{name}: acceleration off by {worst}");
        // Otherwise gamma was not put to the test.
        assert!(bias.error > 1e-2, "{name}: gamma makes a difference of {:e} only", bias.error);
        states
    }

    /// Closed states flattened and closed again, at rest and with random speeds.
    fn flattened_states(&self, states: &[State]) {
        let name = self.linkage.name;
        let mut random = Random::new(5);
        let [mut selected, mut nine, mut apart, mut first_order] =
            [(); 4].map(|()| Worst::default());
        let (mut least_rank, mut skipped) = (usize::MAX, 0);
        for (state, scale) in
            states[..FLATTENED].iter().flat_map(|state| SCALES.map(|scale| (state, scale)))
        {
            for speed in [0.0, 10.0] {
                let Some(state) = self.flattened(state, scale, speed, &mut random) else {
                    skipped += 1;
                    continue;
                };
                let (found, rank) = self.acceleration(&state);
                let reference = self.reference(&state);
                let expected = reference.selected.solve(CUT);
                let off = |from: &Constrained| relative_error(&found, from.acceleration.as_slice());
                if !is_doubtful(&expected, 1.01) {
                    assert_eq!(rank, expected.rank, "{name} at {scale:e}");
                    least_rank = least_rank.min(rank);
                    selected.note(off(&expected));
                }
                let expected = reference.nine.solve(CUT);
                if is_doubtful(&expected, DOUBT) {
                    continue;
                }
                assert_eq!(rank, expected.rank, "{name} at {scale:e}");
                let small = (expected.greatest_dropped() / expected.least_kept()).sqrt();
                println!(
                    "   {scale:e} speed {speed} rank {rank} small {small:.1e} contr {:.1e} selected {:.1e} nine {:.1e}",
                    reference.nine.contradiction(&expected),
                    off(&reference.selected.solve(CUT)),
                    off(&expected)
                );
                if reference.nine.contradiction(&expected) > 1e-7 {
                    apart.note(off(&expected));
                } else if small < 1e-7 {
                    nine.note(off(&expected))
                } else {
                    first_order.note(off(&expected) / small)
                }
            }
        }
        println!(
            "{name}: flattened, rank {least_rank}: selected {selected}; nine rows {nine}, first order {first_order}; contradictory {apart}; skipped {skipped}"
        );
    }

    fn flattened(
        &self,
        state: &State,
        scale: f64,
        speed: f64,
        random: &mut Random,
    ) -> Option<State> {
        let q: Vec<f64> = state.q.iter().map(|q| q * scale).collect();
        let state = State { q, u: self.random_vector(random, speed) };
        self.closed(state.clone(), false).or_else(|| self.closed(state, true))
    }

    fn continuity(&self, states: &[State]) {
        let name = self.linkage.name;
        let mut random = Random::new(3);
        let (mut worst, mut worst2) = (Worst::default(), Worst::default());
        let mut other = 0;
        for (state, scale) in states
            .iter()
            .flat_map(|state| [1.0, 1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 0.0].map(|scale| (state, scale)))
        {
            let Some(first) = self.flattened(state, scale, 10.0, &mut random) else { continue };
            let shifted = |values: &[f64], most: f64, random: &mut Random| -> Vec<f64> {
                values.iter().map(|x| x + random.range(-most, most)).collect()
            };
            let second = State {
                q: shifted(&first.q, 1e-9, &mut random),
                u: shifted(&first.u, 1e-8, &mut random),
            };
            let Some(second) = self.closed(second, false) else { continue };
            let distance =
                first.q.iter().zip(&second.q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max).max(
                    first
                        .u
                        .iter()
                        .zip(&second.u)
                        .map(|(a, b)| (a - b).abs() / 10.0)
                        .fold(0.0, f64::max),
                );
            let (a, ra) = self.acceleration(&first);
            let (b, rb) = self.acceleration(&second);
            if ra != rb {
                other += 1;
                continue;
            }
            let e = self.reference(&first).selected.solve(CUT);
            let change = relative_error(&b, &a);
            println!(
                "   {scale:e} rank {ra} distance {distance:.1e} change {change:.1e} kept {:.1e} L {:.1e} L*s {:.1e}",
                e.least_kept(),
                change / distance,
                change / distance * e.least_kept().sqrt()
            );
            worst.note(change / distance * e.least_kept().sqrt());
            worst2.note(change / distance * e.least_kept());
        }
        println!("{name}: continuity L sqrt {worst} L {worst2}; other rank {other}");
    }
}

/// Whether an eigenvalue lies within this factor of the cut.
fn is_doubtful(found: &Constrained, factor: f64) -> bool {
    found.spectrum.iter().any(|value| (CUT / factor..CUT * factor).contains(value))
}
