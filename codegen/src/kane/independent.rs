//! Phase 11, independent speeds: du/dt of mechanisms whose loops depend on each other, without closure
//! forces.
//!
//! The closure J a = b is solved by the elimination that [`Reduction`] describes: a = N y + p, where y
//! belongs to the independent joints, N solves it for b = 0, and p has zeros for y. Kane's equations of
//! the independent speeds have no closure forces, because N^T J^T = 0:
//!
//! ```text
//! J du/dt = -gamma       du/dt = N y + p
//! N^T M N y = N^T (f - M p)
//! ```
//!
//! f - M p is one pass of inverse dynamics at du/dt = p (J. Wittenburg, "Dynamics of Multibody Systems",
//! 2008, 5.5; for the choice of y R. A. Wehage, E. J. Haug, "Generalized coordinate partitioning for
//! dimension reduction in analysis of constrained dynamic systems", 1982). The cut bodies are whole here:
//! a joint that closes a loop carries only its own torque. What closes the loops, to be taken from q or u,
//! is the x with J x = b for which x^T M x is least:
//!
//! ```text
//! x = p - N y,    N^T M N y = N^T M p
//! ```

use std::collections::BTreeMap;

use super::binder::Binder;
use super::closure::Closure;
use super::forces::{along_hinge, gathered};
use super::frame::Frames;
use super::inertia::Inertias;
use super::inverse::{Given, GivenMotion};
use super::kinematics::Kinematics;
use super::loads::{Loads, WrenchNames};
use super::mass::MassMatrix;
use super::section::{Phase, Section};
use super::vector::{Vector, add, cross, dot};
use super::wrench::Wrench;
use crate::symbolic::{Expr, Function};
use crate::topology::{Pivot, Reduction};

/// Number of independent speeds up to which N^T M N is summed over the bodies' velocities; for more of
/// them it is computed from M.
const FEW: usize = 2;

/// Entries of N whose size makes a margin as small as a pivot of a hundredth: 20.
const GROWTH: f64 = 5.0;

/// Results of the reduction; see [`Reduced`](super::Reduced) for shapes.
pub struct IndependentSpeeds {
    pub accelerations: Vec<Expr>,
    pub positions: Vec<Expr>,
    pub speeds: Vec<Expr>,
    pub margin: Vec<Expr>,
}

/// The phases that the reduction needs.
pub struct Phases<'a> {
    pub frames: &'a Frames,
    pub kinematics: &'a Kinematics,
    pub loads: &'a Loads,
    pub closure: &'a Closure,
}

/// The closure after its elimination.
struct Elimination {
    /// Pivots with the other entries of their row, by column.
    rows: Vec<(Pivot, BTreeMap<usize, Expr>)>,
    /// 1 / pivot.
    inverse_pivots: Vec<Expr>,
    /// Multiples of an earlier pivot row that were taken from each pivot row: its place and the factor.
    factors: Vec<Vec<(usize, Expr)>>,
    /// N, by joint, one number per independent joint.
    null_space: Vec<Vec<Expr>>,
}

/// N^T M N, factored, and what else of M is needed.
struct Inertia {
    /// L below its diagonal, by rows.
    lower: Vec<Vec<Expr>>,
    inverse_pivots: Vec<Expr>,
    moving: Moving,
}

/// The columns of N as motions of the bodies, with their momenta, or M N.
enum Moving {
    /// By independent joint, by node.
    Bodies(Vec<Vec<(Twist, Wrench)>>),
    /// By joint, one number per independent joint.
    Joints(Vec<Vec<Expr>>),
}

/// Angular velocity and velocity of the origin of a node's frame, in its components.
#[derive(Clone)]
struct Twist {
    omega: Vector,
    velocity: Vector,
}

impl IndependentSpeeds {
    /// Derives the reduction.
    pub fn new(binder: &mut Binder, phases: &Phases, reduction: &Reduction) -> Self {
        let Phases { frames, kinematics, loads, closure } = phases;
        let inertias = Inertias::of_whole_bodies(binder, frames);
        let elimination = Elimination::new(binder, closure, reduction);
        let inertia = Inertia::new(binder, kinematics, &inertias, &elimination, reduction);
        let wanted: Vec<Expr> = closure.gamma.iter().map(|gamma| -gamma).collect();
        let given = elimination.solve(binder, &wanted, "given");
        let forces = imbalance(binder, kinematics, &inertias, loads, given.clone());
        let reduced = transposed(&elimination.null_space, &forces);
        let y = inertia.solve(binder, reduced, "independent");
        let accelerations = elimination.combined(binder, &given, &y, "acceleration", 1.0);
        let mut correct = |wanted: &[Expr], name: &str| {
            let given = elimination.solve(binder, wanted, &format!("closing_{name}"));
            let reduced = inertia.momentum(binder, kinematics, &given, name);
            let y = inertia.solve(binder, reduced, &format!("along_{name}"));
            elimination.combined(binder, &given, &y, &format!("correction_{name}"), -1.0)
        };
        let positions = correct(&closure.row_residual, "q");
        let speeds = correct(&closure.row_velocity, "u");
        let margin = margin(binder, closure, &elimination, &inertia);
        Self { accelerations, positions, speeds, margin }
    }
}

impl Elimination {
    fn new(binder: &mut Binder, closure: &Closure, reduction: &Reduction) -> Self {
        let phase = Section::mechanism(Phase::Elimination);
        let n = binder.mechanism().joints.len();
        let entries = |row: usize| -> BTreeMap<usize, Expr> {
            let row = closure.jacobian[row * n..][..n].iter().enumerate();
            row.filter(|(_, entry)| !entry.is_zero()).map(|(j, x)| (j, x.clone())).collect()
        };
        let mut waiting: Vec<_> =
            reduction.pivots.iter().map(|&pivot| (pivot, entries(pivot.row))).collect();
        let mut factors = vec![Vec::new(); waiting.len()];
        let mut inverse_pivots = Vec::with_capacity(waiting.len());
        for done in 0..waiting.len() {
            let (head, later) = waiting.split_at_mut(done + 1);
            let (Pivot { row, joint }, pivot_row) = &mut head[done];
            let pivot = pivot_row.remove(&joint.index()).unwrap_or_else(Expr::zero);
            let pivot = binder.bind(phase, format!("pivot_row{row}"), pivot);
            let inverse =
                binder.bind(phase, format!("inverse_pivot_row{row}"), pivot.power(-1));
            for (ahead, (Pivot { row: other, .. }, entries)) in later.iter_mut().enumerate() {
                let Some(entry) = entries.remove(&joint.index()) else { continue };
                let factor = binder.bind(phase, format!("factor_row{other}_{row}"), &entry * &inverse);
                for (&column, value) in pivot_row.iter() {
                    let name = &binder.mechanism().joints[column].name;
                    let name = format!("row{other}_less_{row}_{name}");
                    let entry = entries.entry(column).or_insert_with(Expr::zero);
                    *entry = binder.bind(phase, name, &*entry - &(&factor * value));
                }
                factors[done + 1 + ahead].push((done, factor));
            }
            inverse_pivots.push(inverse);
        }
        let mut elimination =
            Self { rows: waiting, inverse_pivots, factors, null_space: Vec::new() };
        elimination.null_space = elimination.null_space(binder, reduction, n);
        elimination
    }

    fn null_space(&self, binder: &mut Binder, reduction: &Reduction, n: usize) -> Vec<Vec<Expr>> {
        let d = reduction.independent.len();
        let mut table = vec![vec![Expr::zero(); d]; n];
        for (k, joint) in reduction.independent.iter().enumerate() {
            table[joint.index()][k] = Expr::one();
        }
        let section = Section::mechanism(Phase::NullSpace);
        for ((Pivot { joint, .. }, row), inverse) in self.rows.iter().zip(&self.inverse_pivots).rev()
        {
            for k in 0..d {
                let mut sum = Expr::zero();
                for (&column, value) in row {
                    sum = &sum - &(value * &table[column][k]);
                }
                let name = format!("{}_by_{k}", binder.mechanism().joints[joint.index()].name);
                table[joint.index()][k] = binder.bind(section, name, inverse * &sum);
            }
        }
        table
    }

    /// Returns p, by joint, with zeros for the independent joints, for b by row.
    fn solve(&self, binder: &mut Binder, wanted: &[Expr], name: &str) -> Vec<Expr> {
        let section = Section::mechanism(Phase::DependentPart);
        let mut right: Vec<Expr> = Vec::with_capacity(self.rows.len());
        for ((Pivot { row, .. }, _), factors) in self.rows.iter().zip(&self.factors) {
            let mut sum = wanted[*row].clone();
            for (earlier, factor) in factors {
                sum = &sum - &(factor * &right[*earlier]);
            }
            right.push(binder.bind(section, format!("{name}_row{row}"), sum));
        }
        let mut solution = vec![Expr::zero(); self.null_space.len()];
        for (at, (Pivot { joint, .. }, row)) in self.rows.iter().enumerate().rev() {
            let mut sum = right[at].clone();
            for (&column, value) in row {
                sum = &sum - &(value * &solution[column]);
            }
            let name = format!("{name}_{}", binder.mechanism().joints[joint.index()].name);
            solution[joint.index()] =
                binder.bind(section, name, &self.inverse_pivots[at] * &sum);
        }
        solution
    }

    /// Returns p + `sign` N y, by joint.
    fn combined(
        &self,
        binder: &mut Binder,
        given: &[Expr],
        y: &[Expr],
        name: &str,
        sign: f64,
    ) -> Vec<Expr> {
        let section = Section::mechanism(Phase::Combination);
        let mut solution = Vec::with_capacity(given.len());
        for (joint, (given, row)) in given.iter().zip(&self.null_space).enumerate() {
            let mut sum = given.clone();
            for (n, y) in row.iter().zip(y) {
                let term = n * y;
                sum = if sign < 0.0 { &sum - &term } else { &sum + &term };
            }
            let name = format!("{name}_{}", binder.mechanism().joints[joint].name);
            solution.push(binder.bind(section, name, sum));
        }
        solution
    }
}

/// Returns N^T x.
fn transposed(null_space: &[Vec<Expr>], x: &[Expr]) -> Vec<Expr> {
    let d = null_space.first().map_or(0, Vec::len);
    let sum = |k: usize| {
        let terms = null_space.iter().zip(x).map(|(row, x)| &row[k] * x);
        terms.fold(Expr::zero(), |sum, term| &sum + &term)
    };
    (0..d).map(sum).collect()
}

/// Returns f - M a at given a, by joint.
fn imbalance(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    loads: &Loads,
    accelerations: Vec<Expr>,
) -> Vec<Expr> {
    let given = Given::of(accelerations);
    let motion = GivenMotion::on_tree(binder, kinematics, &given);
    let phase = Phase::InverseDynamics;
    let names = WrenchNames { gravity_phase: phase, phase, name: "net" };
    let motion_of = |node| motion.of(node);
    let wrenches = loads.on_bodies(binder, kinematics, inertias.minimal(), motion_of, &names);
    let beyond = gathered(binder, kinematics, phase, "balance", wrenches);
    let mut imbalance = vec![Expr::zero(); beyond.len()];
    for link in kinematics.links() {
        let along = along_hinge(kinematics, link.node, &beyond[link.node.index()]);
        let name = format!("imbalance_{}", binder.joint_name(link.node));
        let value = &along + loads.torque(link.node);
        imbalance[link.joint.index()] =
            binder.bind(Section::body(link.node, phase), name, value);
    }
    imbalance
}

impl Inertia {
    fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        elimination: &Elimination,
        reduction: &Reduction,
    ) -> Self {
        let table = &elimination.null_space;
        let d = reduction.independent.len();
        let moving = if d <= FEW {
            let column = |k: usize| table.iter().map(|row| row[k].clone()).collect::<Vec<_>>();
            let mut columns = Vec::new();
            for k in 0..d {
                let name = format!("partial{k}");
                let twists = twists(binder, kinematics, &column(k), &name);
                columns.push(with_momenta(binder, kinematics, inertias, twists, &name));
            }
            Moving::Bodies(columns)
        } else {
            Moving::Joints(products(binder, kinematics, inertias, table))
        };
        let mut entries = vec![vec![Expr::zero(); d]; d];
        for k in 0..d {
            for l in 0..=k {
                entries[k][l] = match &moving {
                    Moving::Bodies(columns) => columns[k].iter().zip(&columns[l]).fold(
                        Expr::zero(),
                        |sum, ((twist, _), (_, momentum))| &sum + &twist.with(momentum),
                    ),
                    Moving::Joints(products) => table
                        .iter()
                        .zip(products)
                        .fold(Expr::zero(), |sum, (n, mn)| &sum + &(&n[k] * &mn[l])),
                };
            }
        }
        let (lower, inverse_pivots) = factored(binder, entries);
        Self { lower, inverse_pivots, moving }
    }

    /// Returns N^T M x.
    fn momentum(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        x: &[Expr],
        name: &str,
    ) -> Vec<Expr> {
        match &self.moving {
            Moving::Bodies(columns) => {
                let twists = twists(binder, kinematics, x, &format!("closing_{name}"));
                let product = |column: &Vec<(Twist, Wrench)>| {
                    let pairs = twists.iter().zip(column);
                    pairs.fold(Expr::zero(), |sum, (x, (_, momentum))| &sum + &x.with(momentum))
                };
                columns.iter().map(product).collect()
            }
            Moving::Joints(products) => transposed(products, x),
        }
    }

    /// Returns (N^T M N)^-1 b.
    fn solve(&self, binder: &mut Binder, mut b: Vec<Expr>, name: &str) -> Vec<Expr> {
        let section = Section::mechanism(Phase::IndependentAcceleration);
        let d = b.len();
        for k in 0..d {
            let mut sum = b[k].clone();
            for l in 0..k {
                sum = &sum - &(&self.lower[k][l] * &b[l]);
            }
            b[k] = binder.bind(section, format!("reduced_{name}_{k}"), sum);
        }
        for k in (0..d).rev() {
            let mut sum = &self.inverse_pivots[k] * &b[k];
            for l in k + 1..d {
                sum = &sum - &(&self.lower[l][k] * &b[l]);
            }
            b[k] = binder.bind(section, format!("{name}_{k}"), sum);
        }
        b
    }
}

/// Returns L and 1 / D of a symmetric matrix L D L^T.
fn factored(binder: &mut Binder, mut entries: Vec<Vec<Expr>>) -> (Vec<Vec<Expr>>, Vec<Expr>) {
    let section = Section::mechanism(Phase::IndependentInertia);
    let d = entries.len();
    let mut lower = vec![vec![Expr::zero(); d]; d];
    let mut inverse_pivots = Vec::with_capacity(d);
    for k in 0..d {
        for row in k..d {
            let mut sum = entries[row][k].clone();
            for earlier in 0..k {
                // lower holds L D until the column is divided.
                sum = &sum - &(&lower[row][earlier] * &entries[k][earlier]);
            }
            entries[row][k] = binder.bind(section, format!("inertia_{row}_{k}"), sum);
        }
        let inverse = entries[k][k].power(-1);
        let inverse = binder.bind(section, format!("inverse_inertia_{k}"), inverse);
        for row in k + 1..d {
            let value = &entries[row][k] * &inverse;
            lower[row][k] = binder.bind(section, format!("lower_{row}_{k}"), value);
        }
        inverse_pivots.push(inverse);
    }
    (lower, inverse_pivots)
}

/// Returns M N.
fn products(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    table: &[Vec<Expr>],
) -> Vec<Vec<Expr>> {
    let mass = MassMatrix::new(binder, kinematics, inertias);
    let section = Section::mechanism(Phase::IndependentInertia);
    let n = table.len();
    let mut products = Vec::with_capacity(n);
    for (joint, row) in mass.entries().chunks_exact(n).enumerate() {
        let name = binder.mechanism().joints[joint].name.clone();
        products.push(
            transposed(table, row)
                .into_iter()
                .enumerate()
                .map(|(k, x)| binder.bind(section, format!("momentum_{name}_by_{k}"), x))
                .collect(),
        );
    }
    products
}

impl Twist {
    /// Returns w . n + v . f.
    fn with(&self, momentum: &Wrench) -> Expr {
        &dot(&self.omega, &momentum.moment) + &dot(&self.velocity, &momentum.force)
    }
}

/// Returns the velocities of the nodes of the tree at speeds u, by node.
fn twists(binder: &mut Binder, kinematics: &Kinematics, u: &[Expr], name: &str) -> Vec<Twist> {
    let phase = Phase::NullSpaceMotion;
    let mut twists: Vec<Twist> = Vec::with_capacity(kinematics.links().len());
    for link in kinematics.links() {
        let rate = &u[link.joint.index()];
        let still = [Expr::zero(), Expr::zero(), Expr::zero()];
        let (above, carried) = match link.parent {
            None => (still.clone(), still),
            Some(parent) => {
                let Twist { omega, velocity } = &twists[parent.index()];
                (omega.clone(), add(velocity, &cross(omega, &link.offset)))
            }
        };
        let [x, y, z] = link.down(binder, phase, &format!("{name}_omega"), &above);
        let omega =
            binder.vector(link.node, phase, &format!("{name}_omega"), [&x + rate, y, z]);
        let carried =
            binder.vector(link.node, phase, &format!("{name}_velocity_in_parent"), carried);
        let velocity = link.down(binder, phase, &format!("{name}_velocity"), &carried);
        let velocity = binder.vector(link.node, phase, &format!("{name}_velocity"), velocity);
        twists.push(Twist { omega, velocity });
    }
    twists
}

fn with_momenta(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    twists: Vec<Twist>,
    name: &str,
) -> Vec<(Twist, Wrench)> {
    let links = kinematics.links().iter().zip(inertias.minimal());
    links
        .zip(twists)
        .map(|((link, inertia), twist)| {
            let momentum = inertia.wrench(&twist.omega, &twist.velocity);
            let name = format!("{name}_momentum");
            let momentum = binder.wrench(link.node, Phase::NullSpaceMotion, &name, momentum);
            (twist, momentum)
        })
        .collect()
}

/// Returns by how much the results can be trusted: the least pivot of 1 / D, and the square of the
/// smallest pivot of the closure over the loop's length, or less where entries of N are large. The pivots
/// become zero where the mechanism is singular, as the smallest singular value of J does.
fn margin(
    binder: &mut Binder,
    closure: &Closure,
    elimination: &Elimination,
    inertia: &Inertia,
) -> Vec<Expr> {
    let section = Section::mechanism(Phase::EliminationMargin);
    let two = |function: Function, a: &Expr, b: &Expr| Expr::apply(function, &[a.clone(), b.clone()]);
    let mut worst = Expr::zero();
    let lengths: Vec<f64> = binder
        .topology()
        .loops
        .iter()
        .map(|closed| (closed.points[1] - closed.points[0]).norm())
        .collect();
    for ((Pivot { row, .. }, _), inverse) in elimination.rows.iter().zip(&elimination.inverse_pivots) {
        let length = binder.constant(lengths[closure.rows()[*row].closed.index()]);
        let size = Expr::apply(Function::Abs, &[&length * inverse]);
        worst = binder.bind(section, format!("worst_to_row{row}"), two(Function::Max, &worst, &size));
    }
    let growth = binder.constant(GROWTH);
    let mut largest = Expr::zero();
    for ((Pivot { joint, .. }, _), row) in
        elimination.rows.iter().map(|row| (row, &elimination.null_space[row.0.joint.index()]))
    {
        for entry in row.iter().filter(|entry| !entry.is_zero()) {
            let size = Expr::apply(Function::Abs, &[entry.clone()]);
            let name = format!("largest_to_{}", binder.mechanism().joints[joint.index()].name);
            largest = binder.bind(section, name, two(Function::Max, &largest, &size));
        }
    }
    let worst = two(Function::Max, &worst, &(&growth * &largest));
    let worst = binder.bind(section, "worst".to_owned(), worst);
    let mut least: Option<Expr> = None;
    for inverse in &inertia.inverse_pivots {
        least = Some(match least {
            Some(least) => two(Function::Min, &least, inverse),
            None => inverse.clone(),
        });
    }
    vec![least.unwrap_or_else(Expr::one), worst.power(-2)]
}
