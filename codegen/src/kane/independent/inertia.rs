//! Inertia of the independent speeds: N^T M N and its factor, and M N.

use super::Imbalance;
use super::elimination::transposed;
use super::factor::Factor;
use crate::kane::binder::Binder;
use crate::kane::forces::{along_speeds, gathered};
use crate::kane::inertia::Inertias;
use crate::kane::kinematics::Kinematics;
use crate::kane::link::{Freedom, Link};
use crate::kane::mass::MassMatrix;
use crate::kane::vector::{Vector, add, cross, dot, zero};
use crate::kane::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;

/// Number of independent speeds up to which sums are taken over the bodies' velocities; for more of them M and sums by
/// joint need fewer operations.
const FEW: usize = 2;

/// N^T M N, factored.
pub struct Inertia {
    pub factor: Factor,
    /// The columns of N as motions of the bodies, if they are few: by independent speed, by node.
    columns: Option<Vec<Vec<Twist>>>,
}

/// M N, with N^T M N, factored: what a projection needs.
pub struct Metric {
    /// M N, by speed, one number per independent speed.
    pub products: Vec<Vec<Expr>>,
    pub factor: Factor,
}

/// Angular velocity and velocity of the origin of a node's frame, in its components.
#[derive(Clone)]
struct Twist {
    omega: Vector,
    velocity: Vector,
}

impl Inertia {
    /// Derives the inertia for the N of `table`.
    pub fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        table: &[Vec<Expr>],
    ) -> Self {
        if independent(table) > FEW {
            let Metric { factor, .. } = Metric::new(binder, kinematics, inertias, table);
            return Self { factor, columns: None };
        }
        let columns = columns(binder, kinematics, table);
        let mut momenta = Vec::new();
        for (k, twists) in columns.iter().enumerate() {
            momenta.push(momenta_of(binder, kinematics, inertias, twists, k));
        }
        let phase = Phase::NullSpaceMotion;
        let entry = |k: usize, l: usize| {
            let rotors = of_rotors(kinematics, |joint| &table[joint][k] * &table[joint][l]);
            let name = format!("partial{k}_energy{l}");
            let shares = powers(binder, kinematics, (phase, &name), &columns[k], &momenta[l]);
            shares.into_iter().fold(rotors, |sum, share| &sum + &share)
        };
        let entries = entries(columns.len(), entry);
        let factor = Factor::new(binder, entries);
        Self { factor, columns: Some(columns) }
    }

    /// Returns N^T (f - M p) for the N of `table`.
    pub fn forces(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        table: &[Vec<Expr>],
        imbalance: Imbalance,
    ) -> Vec<Expr> {
        match &self.columns {
            None => transposed(table, &imbalance.by_speed(binder, kinematics).0),
            Some(columns) => {
                let force = |(k, twists): (usize, &Vec<Twist>)| {
                    let (phase, name) = (Phase::InverseDynamics, format!("partial{k}_power"));
                    let wrenches = &imbalance.wrenches;
                    let shares = powers(binder, kinematics, (phase, &name), twists, wrenches);
                    let mut sum = Expr::zero();
                    for (link, share) in kinematics.links().iter().zip(shares) {
                        let torques =
                            link.speeds().map(|speed| &table[speed][k] * &imbalance.torques[speed]);
                        let name = format!("partial{k}_power_with_torque");
                        let share = torques.fold(share, |share, torque| &share + &torque);
                        let phase = Phase::IndependentAcceleration;
                        sum = &sum + &binder.scalar(link.node, phase, &name, share);
                    }
                    sum
                };
                columns.iter().enumerate().map(force).collect()
            }
        }
    }
}

impl Metric {
    /// Derives M N for the N of `table`.
    pub fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        table: &[Vec<Expr>],
    ) -> Self {
        let d = independent(table);
        let products = if d > FEW {
            products(binder, kinematics, inertias, table)
        } else {
            products_of_few(binder, kinematics, inertias, table)
        };
        let entry = |k: usize, l: usize| {
            let terms = table.iter().zip(&products).map(|(n, mn)| &n[k] * &mn[l]);
            terms.fold(Expr::zero(), |sum, term| &sum + &term)
        };
        let factor = Factor::new(binder, entries(d, entry));
        Self { products, factor }
    }
}

/// Returns the number of independent speeds.
fn independent(table: &[Vec<Expr>]) -> usize {
    table.first().map_or(0, Vec::len)
}

/// Returns the entries on and below the diagonal of a symmetric matrix, and zeros above.
fn entries(d: usize, mut of: impl FnMut(usize, usize) -> Expr) -> Vec<Vec<Expr>> {
    let mut entry = |k: usize, l: usize| if l <= k { of(k, l) } else { Expr::zero() };
    (0..d).map(|k| (0..d).map(|l| entry(k, l)).collect()).collect()
}

/// Returns w . n + v . f of each node.
fn powers(
    binder: &mut Binder,
    kinematics: &Kinematics,
    (phase, name): (Phase, &str),
    twists: &[Twist],
    wrenches: &[Wrench],
) -> Vec<Expr> {
    let nodes = kinematics.links().iter().zip(twists.iter().zip(wrenches));
    let power = |(link, (twist, wrench)): (&Link, (&Twist, &Wrench))| {
        let Twist { omega, velocity } = twist;
        let power = &dot(omega, &wrench.moment) + &dot(velocity, &wrench.force);
        binder.scalar(link.node, phase, name, power)
    };
    nodes.map(power).collect()
}

/// Returns the sum over the motors of the inertia of the rotor times a factor of its joint.
fn of_rotors(kinematics: &Kinematics, factor: impl Fn(usize) -> Expr) -> Expr {
    let motors = kinematics.links().iter().filter(|link| !link.rotor.is_zero());
    let terms = motors.map(|link| &link.rotor * &factor(link.speeds().start));
    terms.fold(Expr::zero(), |sum, term| &sum + &term)
}

/// Returns M N by way of M.
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
    for (speed, row) in mass.entries().chunks_exact(n).enumerate() {
        let name = binder.speed_name(speed).to_owned();
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

/// Returns the velocities of the nodes of the tree at speeds u, by node.
fn twists(binder: &mut Binder, kinematics: &Kinematics, u: &[Expr], name: &str) -> Vec<Twist> {
    let phase = Phase::NullSpaceMotion;
    let mut twists: Vec<Twist> = Vec::with_capacity(kinematics.links().len());
    for link in kinematics.links() {
        let rate = match &link.freedom {
            Freedom::Hinge(hinge) => &u[hinge.joint.index()],
            Freedom::Free(free) => {
                let speed = |k: usize| u[free.first + k].clone();
                let omega = [speed(3), speed(4), speed(5)];
                let velocity = free.velocity_of_origin(&[speed(0), speed(1), speed(2)], &omega);
                let name = format!("{name}_velocity");
                let velocity = binder.vector(link.node, phase, &name, velocity);
                twists.push(Twist { omega, velocity });
                continue;
            }
        };
        let (above, carried) = match link.parent {
            None => (zero(), zero()),
            Some(parent) => {
                let Twist { omega, velocity } = &twists[parent.index()];
                (omega.clone(), add(velocity, &cross(omega, &link.offset)))
            }
        };
        let [x, y, z] = link.down(binder, phase, &format!("{name}_omega"), &above);
        let omega = binder.vector(link.node, phase, &format!("{name}_omega"), [&x + rate, y, z]);
        let carried =
            binder.vector(link.node, phase, &format!("{name}_velocity_in_parent"), carried);
        let velocity = link.down(binder, phase, &format!("{name}_velocity"), &carried);
        let velocity = binder.vector(link.node, phase, &format!("{name}_velocity"), velocity);
        twists.push(Twist { omega, velocity });
    }
    twists
}

/// Returns the columns of N as motions of the nodes, by independent speed.
fn columns(binder: &mut Binder, kinematics: &Kinematics, table: &[Vec<Expr>]) -> Vec<Vec<Twist>> {
    let mut columns = Vec::new();
    for k in 0..independent(table) {
        let column: Vec<Expr> = table.iter().map(|row| row[k].clone()).collect();
        columns.push(twists(binder, kinematics, &column, &format!("partial{k}")));
    }
    columns
}

/// Returns the momenta of the nodes at the velocities of independent speed k.
fn momenta_of(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    twists: &[Twist],
    k: usize,
) -> Vec<Wrench> {
    let name = format!("partial{k}_momentum");
    let links = kinematics.links().iter().zip(inertias.minimal()).zip(twists);
    links
        .map(|((link, inertia), twist)| {
            let momentum = inertia.wrench(&twist.omega, &twist.velocity);
            binder.wrench(link.node, Phase::NullSpaceMotion, &name, momentum)
        })
        .collect()
}

/// Returns M N by sums of the bodies' momenta from the leaves to the root.
fn products_of_few(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    table: &[Vec<Expr>],
) -> Vec<Vec<Expr>> {
    let phase = Phase::IndependentInertia;
    let mut products = vec![vec![Expr::zero(); independent(table)]; table.len()];
    for (k, twists) in columns(binder, kinematics, table).iter().enumerate() {
        let momenta = momenta_of(binder, kinematics, inertias, twists, k);
        let name = format!("momentum{k}_beyond");
        let beyond = gathered(binder, kinematics, phase, &name, momenta);
        for link in kinematics.links() {
            for (speed, along) in along_speeds(kinematics, link.node, &beyond[link.node.index()]) {
                let name = format!("momentum_{}_by_{k}", binder.speed_name(speed));
                let value = &along + &(&link.rotor * &table[speed][k]);
                products[speed][k] = binder.bind(Section::body(link.node, phase), name, value);
            }
        }
    }
    products
}
