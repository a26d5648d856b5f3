//! Accelerations of closed linkages against the dense pseudo-inverse over all nine closure rows of
//! every loop: at random closed states, and at and next to the flat state, where rank is lost.
//!
//! M, f and the Jacobian of the nine rows are lamc's; their gamma comes from independent kinematics.
//!
//! Nine rows and the C the runtime uses of them, C = T N, say the same where N du/dt = -gamma can
//! be met and nothing but zeros is dropped: there the pseudo-inverse does not depend on the rows.
//! Next to the flat state it does. Speeds that are free to first order are not to second, so the
//! equations contradict each other, and least squares share that out by the rows they are given;
//! and the space that is dropped depends on the rows as soon as its singular values are not zero.
//! Two references therefore: everywhere, to 1e-6, the combinations of the nine rows that
//! [`lamc::topology::Loop::rows`] names; and all nine, within what these two effects amount to
//! ([`Constrained::by_other_rows`]), which is nothing at the flat state at rest and far from it.
//!
//! A constraint that fades on the way to the flat state counts as long as its direction is known
//! ([`udwadia::cut`]). Of motions less than 1e-4 rad from the flat state the last digits of J decide:
//! there, and only there, what rounding amounts to ([`Constrained::by_rounding`]) is allowed on top.

use lamc_tests::compare::{keep_largest, largest};
use std::fmt::{self, Display};

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism, acceleration, acceleration_and_forces, assemble, project};
use lamc_tests::linkages::{self, Linkage};
use lamc_tests::nine_rows::nine_rows;
use lamc_tests::random::Random;
use lamc_tests::udwadia::{self, Constrained, Equations};
use lamc_tests::{compile_text, relative_error};
use nalgebra::{DMatrix, DVector};

/// The runtime decides on the rank by its C rows, the test by nine: their singular values differ by
/// less than this factor, so that within it of the cut the two may decide differently.
const DOUBT: f64 = 6.0;
/// The same for a decision on the same rows: rounding.
const ROUNDING: f64 = 1.01;
/// Next to the flat state: the largest angle, rad.
const NEXT_TO_FLAT: f64 = 1e-4;
/// [`acceleration`] takes a moving state's directions from the motion where they are weaker than this
/// share of the strongest (2.3e-6), or where redundant rows do not vanish as they should (sixteen times
/// the openness over the weakest): these bounds keep a factor of two from both.
const BY_ITSELF: f64 = 5e-6;
const REDUNDANT: f64 = 8.0;
/// What rounding adds to bounds that are exact, over the length of the acceleration.
const NOISE: f64 = 1e-8;

/// Masses, springs and states differ by seed.
const SEEDS: [u64; 3] = [1, 2, 3];
/// Random closed states per linkage, and guesses for them.
const STATES: usize = 16;
const GUESSES: usize = 40;
/// Random speeds, rad/s.
const SPEED: f64 = 10.0;
/// Of these states, how many are flattened, and by how much.
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
    for seed in SEEDS {
        let compiled = compile_text(&linkage.text(seed));
        let topology = &compiled.topology;
        assert_eq!((topology.rank, topology.mobility), (linkage.rank, linkage.mobility));
        let system = Interpreter::new(&compiled.program);
        let bench = Bench { linkage, compiled: &compiled, system: &system, seed };
        bench.the_kinematics_are_those_of_the_closure();
        let states = bench.random_states();
        bench.flattened_states(&states);
        bench.continuity(&states);
    }
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
        self.error = keep_largest(self.error, error);
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

/// The equations of a state: with all nine rows per loop, and with what lamc uses of them.
struct Reference {
    /// The largest residual over the mechanism's size, and no less than rounding.
    openness: f64,
    nine: Equations,
    selected: Equations,
    /// T.
    selection: DMatrix<f64>,
}

struct Bench<'a> {
    linkage: &'a Linkage,
    compiled: &'a Compiled,
    system: &'a Interpreter,
    seed: u64,
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
        self.system.write_closure(q, &mut residual, &mut jacobian).unwrap();
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
        self.system.write_equations(0.0, q, u, out).unwrap();
        let rows = nine_rows(&self.compiled.topology, q, u);
        let (residual, jacobian) = self.closure(q);
        let openness = (largest(&residual) / self.system.size()).max(4.0 * f64::EPSILON);
        let nine = Equations {
            mass: DMatrix::from_row_slice(n, n, &mass),
            forcing: DVector::from_vec(forcing),
            jacobian,
            gamma: rows.gamma,
        };
        let jacobian = &rows.selection * &nine.jacobian;
        let gamma = &rows.selection * &nine.gamma;
        let selected = Equations { jacobian, gamma, ..nine.clone() };
        Reference { openness, nine, selected, selection: rows.selection }
    }

    /// lamc's acceleration and rank.
    fn acceleration(&self, State { q, u }: &State) -> (Vec<f64>, usize) {
        let (mut found, mut workspace) = (self.system.speeds(), self.system.workspace());
        let constraint = acceleration(self.system, 0.0, q, u, &mut workspace, &mut found)
            .unwrap_or_else(|error| panic!("{}: {error} at {q:?}, {u:?}", self.linkage.name));
        assert!(found.iter().all(|x| x.is_finite()), "{}: {found:?}", self.linkage.name);
        (found, constraint.rank)
    }

    /// The same by the state alone: with the closure forces, never along the motion.
    fn acceleration_by_itself(&self, State { q, u }: &State) -> (Vec<f64>, usize) {
        let (mut found, mut workspace) = (self.system.speeds(), self.system.workspace());
        let mut lambda = vec![0.0; self.system.dimensions().rows];
        let constraint = acceleration_and_forces(
            self.system,
            0.0,
            q,
            u,
            &mut workspace,
            &mut found,
            &mut lambda,
        )
        .unwrap_or_else(|error| panic!("{}: {error} at {q:?}, {u:?}", self.linkage.name));
        let finite = found.iter().chain(&lambda).all(|x| x.is_finite());
        assert!(finite, "{}: {found:?}, {lambda:?}", self.linkage.name);
        (found, constraint.rank)
    }

    /// The closed state next to this one, if it can be reached.
    fn closed(&self, State { mut q, mut u }: State, assembled: bool) -> Option<State> {
        let mut workspace = self.system.workspace();
        if assembled {
            assemble(self.system, 0.0, &mut q, &vec![false; self.n()], &mut workspace).ok()?;
        }
        project(self.system, 0.0, &mut q, &mut u, &mut workspace).ok()?;
        Some(State { q, u })
    }

    /// At open states: position and velocity to rounding; gamma as sixth-order differences of
    /// lamc's Jacobian along u give it, which err by some 1e-10.
    fn the_kinematics_are_those_of_the_closure(&self) {
        const H: f64 = 4e-3;
        let mut random = Random::new(11 + 100 * self.seed);
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
            exact.note(largest(&(self.closure(&q).0 - &rows.residual)) / largest(&rows.residual));
            exact.note(largest(&(velocity(0.0) - &rows.velocity)) / largest(&rows.velocity));
            differenced.note(largest(&(gamma - &rows.gamma)) / largest(&rows.gamma));
        }
        let name = self.linkage.name;
        println!("{name}: kinematics to {exact}, gamma to differences {differenced}");
        assert!(exact.error < 1e-12, "{name}: {exact}");
        assert!(differenced.error < 1e-9, "{name}: {differenced}");
    }

    /// Random closed states, each compared to 1e-9 of the largest acceleration.
    fn random_states(&self) -> Vec<State> {
        let name = self.linkage.name;
        let mut random = Random::new(7 + 100 * self.seed);
        let (mut states, mut worst, mut bias) = (Vec::new(), Worst::default(), Worst::default());
        let folded = self.linkage.folded.iter().any(|angle| *angle != 0.0);
        for _ in 0..GUESSES {
            if states.len() == STATES {
                break;
            }
            let mut q = self.random_vector(&mut random, if folded { 0.3 } else { 1.2 });
            q.iter_mut().zip(&self.linkage.folded).for_each(|(q, folded)| *q += folded);
            let u = self.random_vector(&mut random, SPEED);
            let Some(state) = self.closed(State { q, u }, true) else { continue };
            let Reference { nine, openness, .. } = self.reference(&state);
            let cut = udwadia::cut(openness);
            let expected = nine.solve(cut);
            if is_doubtful(&expected, cut, DOUBT) {
                continue;
            }
            let (found, rank) = self.acceleration(&state);
            assert_eq!((rank, expected.rank), (self.linkage.rank, self.linkage.rank), "{name}");
            worst.note(relative_error(&found, expected.acceleration.as_slice()));
            let nine = expected.equations;
            let gamma = DVector::zeros(nine.gamma.len());
            let unbiased = Equations { gamma, ..nine }.solve(cut).acceleration;
            bias.note(relative_error(unbiased.as_slice(), &found));
            states.push(state);
        }
        println!("{name}: random states {worst}; without gamma {:.1e}", bias.error);
        assert_eq!(states.len(), STATES, "{name}: too few states could be compared");
        assert!(worst.error < 1e-9, "{name}: acceleration off by {worst}");
        // Otherwise gamma was not put to the test.
        assert!(bias.error > 1e-3, "{name}: gamma makes a difference of {:e} only", bias.error);
        states
    }

    /// Closed states flattened and closed again, at rest and with random speeds.
    fn flattened_states(&self, states: &[State]) {
        let name = self.linkage.name;
        let mut random = Random::new(5 + 100 * self.seed);
        let [mut selected, mut alone, mut same, mut differ] = [(); 4].map(|()| Worst::default());
        let [mut rounded, mut bound] = [(); 2].map(|()| Worst::default());
        let (mut ranks, mut compared) = ((usize::MAX, 0), 0);
        for (state, scale) in pairs(&states[..FLATTENED], &SCALES) {
            for speed in [0.0, SPEED] {
                let at = format!("{name}, {scale:e} of a closed state, speeds {speed}");
                let state = self.flattened(state, scale, speed, &mut random);
                let is_certain = speed == 0.0 || state.q.iter().any(|q| q.abs() >= NEXT_TO_FLAT);
                let (found, rank) = self.acceleration_by_itself(&state);
                let Reference { openness, nine, selected: few, selection } = self.reference(&state);
                let cut = udwadia::cut(openness);
                let few = few.solve(cut);
                if is_doubtful(&few, cut, ROUNDING) {
                    continue;
                }
                assert_eq!(rank, few.rank, "{at}");
                let mut compare = |found: &[f64], worst: &mut Worst| {
                    if is_certain {
                        worst.note(relative_error(found, few.acceleration.as_slice()));
                    } else {
                        let off = DVector::from_column_slice(found) - &few.acceleration;
                        let allowed = 1e-6 * few.length(&few.acceleration);
                        let allowed = allowed + few.by_rounding(&state.u);
                        rounded.note(few.length(&off) / allowed);
                    }
                };
                compare(&found, &mut selected);
                compared += 1;
                if speed == 0.0 || is_by_itself(&few, openness) {
                    let (found, rank) = self.acceleration(&state);
                    assert_eq!(rank, few.rank, "{at}");
                    compare(&found, &mut alone);
                }
                let nine = nine.solve(cut);
                if is_doubtful(&nine, cut, DOUBT) {
                    continue;
                }
                assert_eq!(rank, nine.rank, "{at}: of nine rows");
                ranks = (rank.min(ranks.0), rank.max(ranks.1));
                let error = relative_error(&found, nine.acceleration.as_slice());
                let scale = nine.length(&nine.acceleration);
                let off = nine.length(&(DVector::from_vec(found) - &nine.acceleration));
                let mut allowed = nine.by_other_rows(&selection, &few);
                if !is_certain {
                    allowed += nine.by_rounding(&state.u);
                }
                if allowed < 1e-6 * scale {
                    same.note(error);
                } else {
                    differ.note(error);
                }
                bound.note(off / (allowed + NOISE * scale));
            }
        }
        println!(
            "{name}: flattened, ranks {ranks:?}: rows in use {selected}, also by the motion {alone}; \
             next to flat over rounding {rounded}; nine rows, the same {same}; dependent on the rows \
             {differ}; all over their bound {bound}"
        );
        assert!(selected.count >= 60 && selected.error < 1e-6, "{name}: off by {selected}");
        assert!(alone.count >= 60 && alone.error < 1e-6, "{name}: off by {alone}");
        assert!(rounded.error < 1.0, "{name}: off by more than rounding, {rounded}");
        assert!(compared >= 100, "{name}: only {compared} states could be compared");
        assert!(same.count >= 20 && same.error < 1e-6, "{name}: nine rows off by {same}");
        assert!(bound.error < 1.0, "{name}: nine rows off by more than their bound, {bound}");
    }

    /// A closed state with random speeds near the flattened one.
    fn flattened(&self, state: &State, scale: f64, speed: f64, random: &mut Random) -> State {
        let q: Vec<f64> = state.q.iter().map(|q| q * scale).collect();
        let state = State { q, u: self.random_vector(random, speed) };
        let closed = self.closed(state.clone(), false).or_else(|| self.closed(state, true));
        closed.unwrap_or_else(|| panic!("{}: open at {scale:e}", self.linkage.name))
    }

    /// Of two states some 1e-9 apart, where their rank is the same.
    fn continuity(&self, states: &[State]) {
        let name = self.linkage.name;
        let mut random = Random::new(3 + 100 * self.seed);
        let (mut bound, mut widest) = (Worst::default(), Worst::default());
        for (state, scale) in pairs(states, &[1.0, 1e-1, 1e-2, 1e-3, 1e-5, 1e-7, 0.0]) {
            let state = self.flattened(state, scale, SPEED, &mut random);
            let mut shifted = |values: &[f64], most: f64| -> Vec<f64> {
                values.iter().map(|value| value + random.range(-most, most)).collect()
            };
            let (q, u) = (shifted(&state.q, 1e-9), shifted(&state.u, 1e-9 * SPEED));
            let Some(other) = self.closed(State { q, u }, false) else { continue };
            let (found, rank) = self.acceleration_by_itself(&state);
            let (moved, other_rank) = self.acceleration_by_itself(&other);
            if rank == other_rank {
                let [here, there] = [&state, &other].map(|state| {
                    let Reference { openness, selected, .. } = self.reference(state);
                    selected.solve(udwadia::cut(openness))
                });
                let scale = here.length(&here.acceleration);
                let allowed = here.by_distance(&there);
                let change = here.length(&(DVector::from_vec(moved) - DVector::from_vec(found)));
                let rounding = here.by_rounding(&state.u) + there.by_rounding(&state.u);
                bound.note(change / (allowed + rounding + 1e-3 * NOISE * scale));
                widest.note(allowed / scale);
            }
        }
        println!("{name}: change over its bound {bound}, which is at most {widest}");
        assert!(bound.count >= 90, "{name}: only {bound} could be compared");
        assert!(bound.error < 1.0, "{name}: not continuous, {bound}");
    }
}

fn pairs<'a>(states: &'a [State], scales: &'a [f64]) -> impl Iterator<Item = (&'a State, f64)> {
    states.iter().flat_map(|state| scales.iter().map(move |scale| (state, *scale)))
}

/// Whether a singular value lies within this factor of the cut.
fn is_doubtful(found: &Constrained, cut: f64, factor: f64) -> bool {
    found.spectrum.iter().any(|value| (cut / factor..cut * factor).contains(value))
}

/// Whether the rows of a state show all directions well enough not to look at its motion.
fn is_by_itself(found: &Constrained, openness: f64) -> bool {
    let share = |value: f64| value / found.kept.max();
    let least = share(found.least());
    least > BY_ITSELF && share(found.dropped) < REDUNDANT * openness / least
}
