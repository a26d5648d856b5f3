//! Contacts: forces between points of bodies and planes, which the ground or a body carries.
//!
//! For a point at the depth d behind the plane with the unit normal n, and its velocity v relative to the
//! plane's body:
//!
//! ```text
//! d' = -n . v        v_t = v - (n . v) n        f = k d max(0, 1 + c d')
//! force on the body: f n - mu f v_t / sqrt(v_t^2 + s^2)
//! ```
//!
//! The normal force is the law of K. H. Hunt and F. R. E. Crossley, "Coefficient of restitution interpreted as
//! damping in vibroimpact", Journal of Applied Mechanics 42 (1975), 440-445, with the exponent 1 for which k is a
//! stiffness, as in Drake's compliant point contact: no force pulls, and none jumps when a point arrives. The
//! friction is Coulomb's law with the corner at v_t = 0 rounded; for laws of this kind see F. Marques, P. Flores,
//! J. C. P. Claro and H. M. Lankarani, "A survey and comparison of several friction force models for dynamic
//! analysis of multibody mechanical systems", Nonlinear Dynamics 86 (2016), 1407-1443.
//!
//! The force acts at the point, and the opposite force at the same place on the body of the plane. What the
//! points of a body have in common is computed once: the plane and the relative motion in the body's frame. In
//! it the height of a point over the plane is linear in the point's constant coordinates.

use super::binder::Binder;
use super::facts::AXES;
use super::frame::Frame;
use super::kinematics::{Kinematics, node_of};
use super::motion::Motion;
use super::placement::Placement;
use super::touch::{Law, touch};
use super::vector::{Vector, add, cross, dot, sub};
use super::wrench::Wrench;
use crate::laminate::{Contact, ContactPoint, Number, Plane, fixed};
use crate::program::{Phase, Quantity, Section, Subject};
use crate::source::{BodyId, ContactId};
use crate::symbolic::Expr;
use crate::topology::NodeId;
use nalgebra::Vector3;

/// The contacts of a mechanism.
pub struct Contacts {
    /// Wrenches by node.
    wrenches: Vec<Wrench>,
    /// Position and force of each point, in the base frame.
    outputs: Vec<Expr>,
    /// Energy of all contacts, J.
    stored: Expr,
    /// What rigid contacts need.
    pub gaps: Gaps,
}

/// What rigid contacts need of K points.
#[derive(Default)]
pub struct Gaps {
    /// Height over the plane, and distance within the edges and the back of its plate, K x 2, m.
    pub gap: Vec<Expr>,
    /// Coefficient of friction, K.
    pub friction: Vec<Expr>,
    /// Unit normal of the plane in the base frame, K x 3.
    pub normal: Vec<Expr>,
    /// Velocity relative to the body of the plane in the base frame, K x 3, m/s.
    pub velocity: Vec<Expr>,
}

/// The distance within the edges of a plane that has none, m: large, and finite as `f32`.
const ENDLESS: f64 = 1e30;

/// A contact point, and where it is drawn, m.
pub type Touching<'a> = (&'a ContactPoint, Vector3<Number>);

/// A body that takes part in a contact, or the ground.
pub struct Carrier<'a> {
    pub node: Option<NodeId>,
    pub name: &'a str,
    pub frame: Frame,
    pub placement: Placement,
    pub motion: Motion,
}

/// What a body sees of a plane: all vectors are in the body's frame.
pub struct Seen {
    /// Unit normal.
    pub normal: Vector,
    /// Height of the body's origin over the plane, m.
    pub height: Expr,
    /// The plate's directions x and y, and the coordinates of the body's origin along them, m: where a plane ends.
    pub sheet: Option<[(Vector, Expr); 2]>,
    /// Angular velocity of the body relative to the plane's, rad/s.
    pub omega: Vector,
    /// Velocity of the body's origin relative to what the plane's body carries there, m/s.
    pub velocity: Vector,
}

/// The plane of a contact in the base frame.
struct Placed {
    normal: Vector,
    point: Vector,
    /// Directions x and y of the plate, and its drawing's origin.
    sheet: Option<([Vector; 2], Vector)>,
    /// Angular velocity of its body, rad/s.
    omega: Vector,
    /// Velocity of `point`, m/s.
    velocity: Vector,
}

impl Contacts {
    /// Derives the contacts.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics) -> Self {
        let nodes = binder.topology().nodes.len();
        let mut contacts = Self {
            wrenches: vec![Wrench::zero(); nodes],
            outputs: Vec::new(),
            stored: Expr::zero(),
            gaps: Gaps::default(),
        };
        for index in 0..binder.mechanism().contacts.len() {
            contacts.add(binder, kinematics, ContactId(index));
        }
        contacts
    }

    /// Returns the wrench on a node.
    pub fn on(&self, node: NodeId) -> &Wrench {
        &self.wrenches[node.index()]
    }

    /// Returns position and force of each point, in the base frame, K x 6.
    pub fn outputs(&self) -> &[Expr] {
        &self.outputs
    }

    /// Returns the energy of all contacts, J: the sum of k d^2 / 2.
    pub fn stored(&self) -> &Expr {
        &self.stored
    }

    fn add(&mut self, binder: &mut Binder, kinematics: &Kinematics, id: ContactId) {
        let contact = &binder.mechanism().contacts[id.index()];
        let law = Law::new(binder, contact);
        let plane = Carrier::new(binder, kinematics, contact.plane.body);
        let point = binder.geometry().plane(binder.mechanism(), id);
        let placed = Placed::new(binder, &plane, (&contact.plane, &point), &contact.name);
        let mut first = 0;
        for points in contact.points.chunk_by(|a, b| a.body == b.body) {
            let body = Carrier::new(binder, kinematics, Some(points[0].body));
            let at = |index| binder.geometry().touching(binder.mechanism(), id, index);
            let points: Vec<Touching> = points.iter().zip((first..).map(at)).collect();
            self.pair(binder, contact, &law, (&plane, &placed), &body, &points);
            first += points.len();
        }
    }

    /// Adds the forces between a plane and the points of one body.
    fn pair(
        &mut self,
        binder: &mut Binder,
        contact: &Contact,
        law: &Law,
        (plane, placed): (&Carrier, &Placed),
        body: &Carrier,
        points: &[Touching],
    ) {
        let seen = placed.seen(binder, body, &contact.name);
        let touched = touch(binder, contact, law, body, &seen, points);
        for (at, force) in &touched.forces {
            self.outputs.extend(body.placement.place(at));
            self.outputs.extend(body.placement.turn(force));
        }
        for gap in &touched.gaps {
            let within = gap.within.clone().unwrap_or_else(|| binder.constant(ENDLESS));
            self.gaps.gap.extend([gap.height.clone(), within]);
            self.gaps.friction.push(law.friction.clone());
            self.gaps.normal.extend(placed.normal.clone());
            self.gaps.velocity.extend(body.placement.turn(&gap.velocity));
        }
        let half = binder.constant(0.5);
        let energy = &(&half * &law.stiffness) * &touched.squares;
        let energy = body.bind(
            binder,
            Phase::PotentialEnergy,
            &format!("contact_energy_{}", contact.name),
            energy,
        );
        self.stored = &self.stored + &energy;
        if let Some(node) = plane.node {
            let opposite = plane.opposite(binder, body, &contact.name, &touched.wrench);
            self.wrenches[node.index()] = self.wrenches[node.index()].plus(&opposite);
        }
        if let Some(node) = body.node {
            self.wrenches[node.index()] = self.wrenches[node.index()].plus(&touched.wrench);
        }
    }
}

impl<'a> Carrier<'a> {
    fn new(binder: &Binder<'a>, kinematics: &Kinematics, body: Option<BodyId>) -> Self {
        let topology = binder.topology();
        let node = body.and_then(|body| node_of(topology, body));
        let name = body.map_or("ground", |body| &binder.mechanism().bodies[body.index()].name);
        let (frame, placement) = match body {
            Some(body) => kinematics.body(topology, body),
            None => (Frame::base(), Placement::identity()),
        };
        let motion = node.map_or_else(Motion::rest, |node| kinematics.motion(node).clone());
        Self { node, name, frame, placement, motion }
    }

    /// Returns the numbers of a point or a direction in the carrier's frame, named after what they are.
    pub fn facts(
        &self,
        binder: &mut Binder,
        name: &'static str,
        meaning: &'static str,
        components: [Number; 3],
    ) -> Vector {
        let subject = Subject::of(self.node);
        binder.facts_about(subject, self.name, Quantity::new(name, meaning), AXES, components)
    }

    /// Returns the section of a phase of the carrier.
    pub fn section(&self, phase: Phase) -> Section {
        self.node.map_or(Section::mechanism(phase), |node| Section::body(node, phase))
    }

    /// Binds a number of the carrier.
    pub fn bind(&self, binder: &mut Binder, phase: Phase, name: &str, value: Expr) -> Expr {
        binder.bind(self.section(phase), format!("{name}_{}", self.name), value)
    }

    /// Binds a vector of the carrier.
    pub fn vector(&self, binder: &mut Binder, name: &str, value: Vector) -> Vector {
        let mut axes = AXES.into_iter();
        value.map(|component| {
            let axis = axes.next().unwrap_or_default();
            let name = format!("{name}_{}_{axis}", self.name);
            binder.bind(self.section(Phase::Contact), name, component)
        })
    }

    /// Returns the components in the carrier's frame of a vector in the base frame.
    fn down(&self, base: &Vector) -> Vector {
        self.placement.axes.each_ref().map(|axis| dot(axis, base))
    }

    /// Returns the opposite of a wrench on a body, as a wrench on this carrier.
    fn opposite(
        &self,
        binder: &mut Binder,
        body: &Carrier,
        contact: &str,
        wrench: &Wrench,
    ) -> Wrench {
        let [name, from] = [contact, body.name];
        let force = body.placement.turn(&wrench.force);
        let force = body.vector(binder, &format!("force_{name}_in_base"), force);
        let arm = sub(&body.placement.origin, &self.placement.origin);
        let moment = add(&body.placement.turn(&wrench.moment), &cross(&arm, &force));
        let moment = body.vector(binder, &format!("moment_{name}_in_base"), moment);
        let force = self.vector(binder, &format!("force_{name}_of_{from}"), self.down(&force));
        let moment = self.vector(binder, &format!("moment_{name}_of_{from}"), self.down(&moment));
        Wrench { force, moment }.opposite()
    }
}

impl Placed {
    fn new(
        binder: &mut Binder,
        carrier: &Carrier,
        (plane, point): (&Plane, &Vector3<Number>),
        contact: &str,
    ) -> Self {
        let Carrier { frame, placement, motion, .. } = carrier;
        let size = binder.mechanism().size;
        let direction = |binder: &mut Binder, name, flat: &Vector3<f64>| {
            let flat = &fixed(flat);
            let meaning = "direction of a plane, in the frame of its body";
            let components = carrier.facts(binder, name, meaning, frame.direction(flat));
            carrier.vector(binder, &format!("{name}_{contact}"), placement.turn(&components))
        };
        let normal = direction(binder, "plane_normal", &plane.normal);
        let sheet = plane.outline.as_ref().map(|_| {
            [("plate_x", Vector3::x()), ("plate_y", Vector3::y())]
                .map(|(name, flat)| direction(binder, name, &flat))
        });
        let place = |binder: &mut Binder, name: &'static str, flat: &Vector3<Number>| {
            let meaning = "point of a plane, in the frame of its body, m";
            let at = carrier.facts(binder, name, meaning, frame.coordinates(flat, size));
            let point = placement.place(&at);
            (carrier.vector(binder, &format!("{name}_{contact}"), point), at)
        };
        let (point, at) = place(binder, "plane_point", point);
        let sheet = sheet.map(|axes| (axes, place(binder, "plate_origin", &Vector3::zeros()).0));
        let omega = placement.turn(&motion.omega);
        let omega = carrier.vector(binder, &format!("plane_omega_{contact}"), omega);
        let velocity = placement.turn(&motion.velocity_at(&at));
        let velocity = carrier.vector(binder, &format!("plane_velocity_{contact}"), velocity);
        Self { normal, point, sheet, omega, velocity }
    }

    /// Derives what a body sees of the plane.
    fn seen(&self, binder: &mut Binder, body: &Carrier, contact: &str) -> Seen {
        let origin = &body.placement.origin;
        let normal = body.vector(binder, &format!("normal_{contact}"), body.down(&self.normal));
        let over = sub(origin, &self.point);
        let height = dot(&self.normal, &over);
        let height = body.bind(binder, Phase::Contact, &format!("height_{contact}"), height);
        let sheet = self.sheet.as_ref().map(|(axes, drawn)| {
            let from = sub(origin, drawn);
            let mut names = ["along_x", "along_y"].into_iter();
            axes.each_ref().map(|axis| {
                let name = format!("{}_{contact}", names.next().unwrap_or_default());
                let direction = body.vector(binder, &name, body.down(axis));
                let at = body.bind(binder, Phase::Contact, &name, dot(axis, &from));
                (direction, at)
            })
        });
        let carried = add(&self.velocity, &cross(&self.omega, &over));
        let omega = sub(&body.motion.omega, &body.down(&self.omega));
        let velocity = sub(&body.motion.velocity, &body.down(&carried));
        let omega = body.vector(binder, &format!("relative_omega_{contact}"), omega);
        let velocity = body.vector(binder, &format!("relative_velocity_{contact}"), velocity);
        Seen { normal, height, sheet, omega, velocity }
    }
}
