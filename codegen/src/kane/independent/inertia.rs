//! Inertia of the independent speeds: N^T M N and its factor.

use super::elimination::{Elimination, transposed};
use super::factor::Factor;
use crate::kane::binder::Binder;
use crate::kane::inertia::Inertias;
use crate::kane::kinematics::Kinematics;
use crate::kane::link::Freedom;
use crate::kane::mass::MassMatrix;
use crate::kane::vector::{Vector, add, cross, dot, zero};
use crate::kane::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;

/// Number of independent speeds up to which N^T M N is summed over the bodies' velocities; for more of
/// them it is computed from M.
const FEW: usize = 2;

/// N^T M N, factored, and what else of M is needed.
pub struct Inertia {
    pub factor: Factor,
    moving: Moving,
}

/// The columns of N as motions of the bodies, with their momenta, or M N.
enum Moving {
    /// By independent speed, by node.
    Bodies(Vec<Vec<(Twist, Wrench)>>),
    /// By speed, one number per independent speed.
    Joints(Vec<Vec<Expr>>),
}

/// Angular velocity and velocity of the origin of a node's frame, in its components.
#[derive(Clone)]
struct Twist {
    omega: Vector,
    velocity: Vector,
}

impl Inertia {
    pub fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        elimination: &Elimination,
    ) -> Self {
        let table = &elimination.null_space;
        let d = table.first().map_or(0, Vec::len);
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
                        of_rotors(kinematics, |joint| &table[joint][k] * &table[joint][l]),
                        |sum, ((twist, _), (_, momentum))| &sum + &twist.with(momentum),
                    ),
                    Moving::Joints(products) => table
                        .iter()
                        .zip(products)
                        .fold(Expr::zero(), |sum, (n, mn)| &sum + &(&n[k] * &mn[l])),
                };
            }
        }
        Self { factor: Factor::new(binder, entries), moving }
    }

    /// Returns N^T M x for the N of `table`.
    pub fn momentum(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        table: &[Vec<Expr>],
        x: &[Expr],
        name: &str,
    ) -> Vec<Expr> {
        match &self.moving {
            Moving::Bodies(columns) => {
                let twists = twists(binder, kinematics, x, &format!("closing_{name}"));
                let product = |(k, column): (usize, &Vec<(Twist, Wrench)>)| {
                    let rotors = of_rotors(kinematics, |joint| &table[joint][k] * &x[joint]);
                    let pairs = twists.iter().zip(column);
                    pairs.fold(rotors, |sum, (x, (_, momentum))| &sum + &x.with(momentum))
                };
                columns.iter().enumerate().map(product).collect()
            }
            Moving::Joints(products) => transposed(products, x),
        }
    }
}

/// Returns the sum over the motors of the inertia of the rotor times a factor of its joint.
fn of_rotors(kinematics: &Kinematics, factor: impl Fn(usize) -> Expr) -> Expr {
    let motors = kinematics.links().iter().filter(|link| !link.rotor.is_zero());
    let terms = motors.map(|link| &link.rotor * &factor(link.speeds().start));
    terms.fold(Expr::zero(), |sum, term| &sum + &term)
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
