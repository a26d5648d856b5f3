//! Free bodies: they stay out of the elimination of the closure, and out of gravity.
//!
//! The loops have no part in how a free body moves, so that N has rows of joints only. The unknowns of a free
//! body are the accelerations alpha and a' = a - A^T g of its frame's origin, in the frame. With the mass m, first
//! moment h and I of the composite, the momenta (f_k, n_k) of the columns of N, and the loads (f, n) and tau at
//! alpha = a' = y = 0, less M p:
//!
//! ```text
//! m a' + alpha x h + sum_k f_k y_k = f        h x a' + I alpha + sum_k n_k y_k = n
//! f_k . a' + n_k . alpha + sum_l B_kl y_l = tau_k,    B = N^T M N of the joints
//! ```
//!
//! a' goes out first, because m is a number. What is left is about the centre of mass c = h / m:
//!
//! ```text
//! I_c alpha + sum_k (n_k - c x f_k) y_k = n - c x f
//! (n_k - c x f_k) . alpha + sum_l (B_kl - f_k . f_l / m) y_l = tau_k - f_k . f / m
//! a' = f / m + c x alpha - sum_k f_k y_k / m        dV/dt = A (a' + alpha x r + E r) + g
//! ```

use super::elimination::transposed;
use super::factor::Factor;
use crate::kane::binder::Binder;
use crate::kane::composite::Composites;
use crate::kane::free::Free;
use crate::kane::inertia::{Inertias, SpatialInertia};
use crate::kane::kinematics::Kinematics;
use crate::kane::link::Freedom;
use crate::kane::vector::{Tensor, Vector, add, cross, dot, scale, sub};
use crate::kane::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;
use crate::topology::NodeId;

const PHASE: Phase = Phase::IndependentInertia;

/// The inertia of the independent joints and the free bodies, factored.
pub struct FreeInertia<'k> {
    roots: Vec<Root<'k>>,
    /// Momenta of the joints.
    momenta: Vec<Option<(NodeId, Wrench)>>,
    /// M N of the joints, by joint, one number per independent speed.
    products: Vec<Vec<Expr>>,
    pub factor: Factor,
}

/// A free body with all that hangs on it.
struct Root<'k> {
    node: NodeId,
    free: &'k Free,
    /// 1 / m.
    inverse_mass: Expr,
    /// c, m.
    centre: Vector,
    /// f_k, by independent speed.
    forces: Vec<Vector>,
    /// f_k / m.
    specific: Vec<Vector>,
    /// n_k - c x f_k.
    moments: Vec<Vector>,
}

/// Accelerations of the independent joints and, by root, alpha and a'.
pub struct Solution {
    pub joints: Vec<Expr>,
    pub roots: Vec<[Vector; 2]>,
}

impl<'k> FreeInertia<'k> {
    /// Derives the inertia and its factor for N.
    pub fn new(
        binder: &mut Binder,
        kinematics: &'k Kinematics,
        inertias: &Inertias,
        table: &[Vec<Expr>],
    ) -> Self {
        let Composites { joints, momenta, bodies } = Composites::new(binder, kinematics, inertias);
        let table = &table[..joints.len()];
        let d = table.first().map_or(0, Vec::len);
        let products = products(binder, &joints, table);
        let mut roots = Vec::new();
        let mut entries: Vec<Vec<Expr>> = Vec::new();
        for (node, body) in &bodies {
            let Freedom::Free(free) = &kinematics.link(*node).freedom else { continue };
            let (root, inertia) = Root::new(binder, (*node, free), body, &momenta, table);
            let before = 3 * roots.len();
            for row in central_rows(&inertia) {
                let mut entries_of_row = vec![Expr::zero(); before];
                entries_of_row.extend(row);
                entries.push(entries_of_row);
            }
            roots.push(root);
        }
        for k in 0..d {
            let mut row: Vec<Expr> =
                roots.iter().flat_map(|root: &Root| root.moments[k].clone()).collect();
            for l in 0..=k {
                let terms = table.iter().zip(&products).map(|(n, mn)| &n[k] * &mn[l]);
                let whole = terms.fold(Expr::zero(), |sum, term| &sum + &term);
                let carried = roots.iter().map(|root| dot(&root.forces[k], &root.specific[l]));
                row.push(carried.fold(whole, |sum, term| &sum - &term));
            }
            entries.push(row);
        }
        let size = entries.len();
        entries.iter_mut().for_each(|row| row.resize(size, Expr::zero()));
        Self { roots, momenta, products, factor: Factor::new(binder, entries) }
    }

    /// Solves for y and the accelerations of the free bodies, where the joints have `given` accelerations p in
    /// addition, for the loads N^T tau of the joints and, by node, those on the free bodies with all that hangs
    /// on them.
    pub fn solve(
        &self,
        binder: &mut Binder,
        given: &[Expr],
        mut joints: Vec<Expr>,
        loads: impl Fn(NodeId) -> Wrench,
        name: &str,
    ) -> Solution {
        let phase = Phase::IndependentAcceleration;
        // Loads do not wait for p, which comes after the elimination of the closure.
        for (joint, taken) in joints.iter_mut().zip(transposed(&self.products, given)) {
            *joint = &*joint - &taken;
        }
        let mut right = Vec::new();
        let mut falls = Vec::new();
        for root in &self.roots {
            let load = binder.wrench(root.node, phase, &format!("{name}_load"), loads(root.node));
            let Wrench { force, moment } = load.minus(&self.momentum(root.node, given));
            let force = binder.vector(root.node, phase, &format!("{name}_force"), force);
            let fall = scale(&root.inverse_mass, &force);
            let fall = binder.vector(root.node, phase, &format!("{name}_fall"), fall);
            right.extend(sub(&moment, &cross(&root.centre, &force)));
            for (joint, force) in joints.iter_mut().zip(&root.forces) {
                *joint = &*joint - &dot(force, &fall);
            }
            falls.push(fall);
        }
        right.extend(joints);
        let mut solution = self.factor.solve(binder, right, name);
        let joints = solution.split_off(3 * self.roots.len());
        let alphas = solution.chunks_exact(3);
        let roots = self.roots.iter().zip(falls).zip(alphas).map(|((root, fall), alpha)| {
            let alpha: Vector = std::array::from_fn(|k| alpha[k].clone());
            let a = add(&fall, &cross(&root.centre, &alpha));
            let pairs = root.specific.iter().zip(&joints);
            let a = pairs.fold(a, |a, (specific, y)| sub(&a, &scale(y, specific)));
            let a = binder.vector(root.node, Phase::Combination, &format!("{name}_origin"), a);
            [alpha, a]
        });
        let roots = roots.collect();
        Solution { joints, roots }
    }

    /// Returns the momentum of the joints that hang on a free body at given speeds.
    fn momentum(&self, node: NodeId, speeds: &[Expr]) -> Wrench {
        let joints = self.momenta.iter().zip(speeds);
        let own = joints.filter_map(|(momentum, u)| {
            let (root, momentum) = momentum.as_ref()?;
            (*root == node && !u.is_zero()).then(|| momentum.times(u))
        });
        own.fold(Wrench::zero(), |sum, momentum| sum.plus(&momentum))
    }

    /// Returns, with their places in u, the accelerations of the free bodies' centres and their angular
    /// accelerations, before gravity. `bias` is E r of the velocities.
    pub fn accelerations(
        &self,
        solution: &Solution,
        bias: impl Fn(NodeId, &Free) -> Vector,
    ) -> Vec<(usize, [Vector; 2])> {
        let roots = self.roots.iter().zip(&solution.roots);
        let result = roots.map(|(Root { node, free, .. }, [alpha, a])| {
            let linear = free.acceleration_of_centre(alpha, &add(a, &bias(*node, free)));
            (free.first, [linear, alpha.clone()])
        });
        result.collect()
    }
}

impl<'k> Root<'k> {
    /// Returns the body with its second moments about its centre of mass.
    fn new(
        binder: &mut Binder,
        (node, free): (NodeId, &'k Free),
        body: &SpatialInertia,
        momenta: &[Option<(NodeId, Wrench)>],
        table: &[Vec<Expr>],
    ) -> (Self, SpatialInertia) {
        let inverse_mass = binder.scalar(node, PHASE, "inverse_mass", body.mass.power(-1));
        let h = &body.first_moment;
        let centre = binder.vector(node, PHASE, "composite_centre", scale(&inverse_mass, h));
        let pairs = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
        let mut pairs = pairs.into_iter();
        let second_moment = body.second_moment.each_ref().map(|s| match pairs.next() {
            Some((i, k)) => s - &(&h[i] * &centre[k]),
            None => Expr::zero(),
        });
        let second_moment = binder.tensor(node, PHASE, "central_second_moment", second_moment);
        let central = SpatialInertia { second_moment, ..body.clone() };
        let mut root = Self {
            node,
            free,
            inverse_mass,
            centre,
            forces: Vec::new(),
            specific: Vec::new(),
            moments: Vec::new(),
        };
        for k in 0..table.first().map_or(0, Vec::len) {
            let own = momenta.iter().zip(table).filter_map(|(momentum, row)| {
                let (on, momentum) = momentum.as_ref()?;
                (*on == node && !row[k].is_zero()).then(|| momentum.times(&row[k]))
            });
            let sum = own.fold(Wrench::zero(), |sum, momentum| sum.plus(&momentum));
            let Wrench { force, moment } =
                binder.wrench(node, PHASE, &format!("momentum_by_{k}"), sum);
            let specific = scale(&root.inverse_mass, &force);
            let specific = binder.vector(node, PHASE, &format!("velocity_by_{k}"), specific);
            root.moments.push(sub(&moment, &cross(&root.centre, &force)));
            root.forces.push(force);
            root.specific.push(specific);
        }
        (root, central)
    }
}

/// Returns the rows on and below the diagonal of I about the centre of mass.
fn central_rows(body: &SpatialInertia) -> [Vec<Expr>; 3] {
    let [xx, xy, xz, yy, yz, zz]: Tensor = body.rotational();
    [vec![xx], vec![xy, yy], vec![xz, yz, zz]]
}

/// Returns M N of the joints.
fn products(binder: &mut Binder, mass: &[Vec<Expr>], table: &[Vec<Expr>]) -> Vec<Vec<Expr>> {
    let section = Section::mechanism(PHASE);
    let mut products = Vec::with_capacity(mass.len());
    for (joint, row) in mass.iter().enumerate() {
        let name = binder.speed_name(joint).to_owned();
        let entries = transposed(table, row).into_iter().enumerate();
        let bound =
            entries.map(|(k, x)| binder.bind(section, format!("momentum_{name}_by_{k}"), x));
        products.push(bound.collect());
    }
    products
}
