//! What the parameters change in the drawing: the numbers of the mechanism that have formulas.

use std::collections::BTreeMap;

use nalgebra::{Vector2, Vector3};
use num_traits::Zero;

use super::lift::{Formulas, Lift};
use super::mechanism::{MassProperties, Mechanism};
use super::number::{Number, POINTS, Real};
use super::plate;
use crate::source::codes;
use crate::source::{
    BodyId, ContactId, ContactPoints, Diagnostic, Diagnostics, Drawn, JointId, Parameter, PointId,
    Shape, SourceModel, Span,
};

/// Two numbers from 0 to 1 in no simple ratio: where in the ranges of the parameters numbers are known.
const SHARES: [f64; POINTS - 1] = [0.381_966_011_250_105, 0.792_893_218_813_452];

/// Share of its default by which a parameter without a range changes.
const NEAR: f64 = 1e-3;

/// Components below this share of a line's length are rounding errors of its direction.
const ALONG_AXIS: f64 = 1e-15;

/// The numbers of a mechanism that depend on parameters. All others are in the [`Mechanism`].
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    bodies: BTreeMap<BodyId, MassProperties<Number>>,
    lines: BTreeMap<JointId, HingeLine>,
    points: BTreeMap<PointId, Vector3<Number>>,
    planes: BTreeMap<ContactId, Vector3<Number>>,
    touching: BTreeMap<(ContactId, usize), Vector3<Number>>,
}

/// The line of a hinge in the flat state.
#[derive(Clone, Debug)]
pub struct HingeLine {
    /// First point, m.
    pub point: Vector3<Number>,
    /// Unit vector; its z component is exactly 0.
    pub direction: Vector3<Number>,
}

/// Returns a vector of constant numbers.
pub fn fixed(vector: &Vector3<f64>) -> Vector3<Number> {
    vector.map(Number::from)
}

impl Geometry {
    /// Finds the numbers that depend on parameters in a model and its mechanism.
    ///
    /// # Errors
    /// Returns errors for what lamc cannot derive from numbers that depend on parameters.
    pub fn new(model: &SourceModel, mechanism: &Mechanism) -> Result<Self, Diagnostics> {
        let mut found = Diagnostics::default();
        let lift = Formulas(points(&model.parameters));
        let mut geometry = Self::default();
        geometry.add_bodies(model, &lift, &mut found);
        for (index, joint) in model.joints.iter().enumerate() {
            if !(joint.axis.is_fixed() && joint.z.is_fixed()) {
                geometry.lines.insert(JointId(index), line(&joint.axis, &joint.z, &lift));
            }
        }
        for (index, point) in model.points.iter().enumerate() {
            if !point.at.is_fixed() {
                geometry.points.insert(PointId(index), lift.point(&point.at));
            }
        }
        geometry.add_contacts(model, mechanism, &lift, &mut found);
        if found.has_errors() { Err(found) } else { Ok(geometry) }
    }

    /// Returns whether nothing depends on parameters.
    pub fn is_fixed(&self) -> bool {
        let Self { bodies, lines, points, planes, touching } = self;
        bodies.is_empty()
            && lines.is_empty()
            && points.is_empty()
            && planes.is_empty()
            && touching.is_empty()
    }

    /// Returns the mass properties of a body.
    pub fn mass_properties(&self, mechanism: &Mechanism, body: BodyId) -> MassProperties<Number> {
        self.bodies.get(&body).cloned().unwrap_or_else(|| {
            let MassProperties { mass, com, inertia } =
                mechanism.bodies[body.index()].mass_properties;
            MassProperties {
                mass: mass.into(),
                com: fixed(&com),
                inertia: inertia.map(Number::from),
            }
        })
    }

    /// Returns the line of a hinge.
    pub fn line(&self, mechanism: &Mechanism, joint: JointId) -> HingeLine {
        self.lines.get(&joint).cloned().unwrap_or_else(|| {
            let joint = &mechanism.joints[joint.index()];
            HingeLine { point: fixed(&joint.point), direction: fixed(&joint.direction) }
        })
    }

    /// Returns whether the line of a hinge depends on parameters.
    pub fn moves(&self, joint: JointId) -> bool {
        self.lines.contains_key(&joint)
    }

    /// Returns an output point, m.
    pub fn point(&self, mechanism: &Mechanism, point: PointId) -> Vector3<Number> {
        let known = self.points.get(&point).cloned();
        known.unwrap_or_else(|| fixed(&mechanism.points[point.index()].at))
    }

    /// Returns a point of the plane of a contact, m.
    pub fn plane(&self, mechanism: &Mechanism, contact: ContactId) -> Vector3<Number> {
        let known = self.planes.get(&contact).cloned();
        known.unwrap_or_else(|| fixed(&mechanism.contacts[contact.index()].plane.point))
    }

    /// Returns one of the points that may touch the plane of a contact, m.
    pub fn touching(
        &self,
        mechanism: &Mechanism,
        contact: ContactId,
        index: usize,
    ) -> Vector3<Number> {
        let known = self.touching.get(&(contact, index)).cloned();
        known.unwrap_or_else(|| fixed(&mechanism.contacts[contact.index()].points[index].at))
    }

    fn add_bodies(&mut self, model: &SourceModel, lift: &Formulas, found: &mut Diagnostics) {
        for (index, body) in model.bodies.iter().enumerate() {
            if body.is_fixed_drawing(model) {
                continue;
            }
            if let Some(air) = model.air.as_ref().filter(|_| !body.fixed) {
                let message = format!("the plates of `{}` depend on parameters", body.name.value);
                let error = Diagnostic::error(codes::NOT_PARAMETRIC, body.name.span, message);
                found.push(
                    error
                        .label("its shape is a formula")
                        .also(air.drag.span, "the air resists plates of constant shape only")
                        .hint("remove `air`, or give the body constant outlines"),
                );
                continue;
            }
            self.bodies.insert(BodyId(index), plate::mass_properties(model, body, lift));
        }
    }

    fn add_contacts(
        &mut self,
        model: &SourceModel,
        mechanism: &Mechanism,
        lift: &Formulas,
        found: &mut Diagnostics,
    ) {
        for (index, given) in model.contacts.iter().enumerate() {
            let contact = ContactId(index);
            if !given.plane.point.is_fixed() {
                self.planes.insert(contact, lift.point(&given.plane.point));
            }
            if let (Some(within), Some(carrier)) = (&given.plane.within, &given.plane.body)
                && !model.bodies[carrier.value.index()].is_fixed_drawing(model)
            {
                let message = "the outline of the plane depends on parameters";
                let error = Diagnostic::error(codes::NOT_PARAMETRIC, within.span, message);
                found.push(error.hint("give the body of the plane a constant outline"));
            }
            let changing = model.bodies.iter().find(|it| !(it.fixed || it.is_fixed_drawing(model)));
            if let (None, Some(body)) = (&given.stiffness, changing) {
                let message = "the default of the stiffness follows from masses and thicknesses";
                let error = Diagnostic::error(codes::NOT_PARAMETRIC, given.name.span, message);
                let depends = "the shape of this body depends on parameters";
                let hint = "give the contact its stiffness, as in `stiffness: 2000 N/m`";
                found.push(error.also(body.name.span, depends).hint(hint));
            }
            let named = match &given.points {
                ContactPoints::Named(points) => Some(points),
                ContactPoints::Corners | ContactPoints::CornersOf(_) => None,
            };
            for (place, point) in mechanism.contacts[index].points.iter().enumerate() {
                let body = &model.bodies[point.body.index()];
                let at = match named {
                    Some(points) => self.points.get(&points[place].value).cloned(),
                    None if body.is_fixed_drawing(model) => None,
                    None => match corner(model, point.body, &point.at, lift) {
                        Ok(at) => Some(at),
                        Err(()) => {
                            found.push(ambiguous(&point.name, given.name.span));
                            None
                        }
                    },
                };
                self.touching.extend(at.map(|at| ((contact, place), at)));
            }
        }
    }
}

impl crate::source::Body {
    /// Returns whether neither its shape nor its mass depends on a parameter.
    fn is_fixed_drawing(&self, model: &SourceModel) -> bool {
        let shape = match &self.shape {
            Shape::None => true,
            Shape::Plates(layers) => {
                let rings = layers.iter().flatten();
                let mut rings =
                    rings.flat_map(|plate| [&plate.outline].into_iter().chain(&plate.holes));
                let materials = model.layup.iter().map(|index| &model.materials[*index]);
                let mut sheets =
                    materials.flat_map(|material| [&material.density, &material.thickness]);
                rings.all(Drawn::is_fixed) && sheets.all(Drawn::is_fixed)
            }
            Shape::Rigid { mass, com, .. } => mass.is_fixed() && com.is_fixed(),
        };
        let mut points = self.point_masses.iter();
        shape && points.all(|point| point.mass.is_fixed() && point.at.is_fixed())
    }
}

/// Returns the points in the space of the parameters at which numbers are known: the defaults, and others within the
/// ranges, or near the defaults.
fn points(parameters: &[Parameter]) -> [Vec<f64>; POINTS] {
    std::array::from_fn(|point| {
        let place = |(index, parameter): (usize, &Parameter)| {
            let Some(share) = point.checked_sub(1).map(|other| SHARES[other]) else {
                return parameter.value;
            };
            // Parameters with the same range take different values.
            let share = (share + index as f64 * SHARES[0]).fract();
            match &parameter.range {
                Some(range) => range.value[0] + share * (range.value[1] - range.value[0]),
                None if parameter.value == 0.0 => NEAR * (0.5 + share),
                None => parameter.value * (1.0 + NEAR * (0.5 + share)),
            }
        };
        parameters.iter().enumerate().map(place).collect()
    })
}

/// Returns the line of a hinge. A direction that is along an axis for all parameters is exactly so.
fn line(axis: &Drawn<[[f64; 2]; 2]>, z: &Drawn<f64>, lift: &Formulas) -> HingeLine {
    let [x, y, to_x, to_y] = std::array::from_fn(|place| lift.number(axis, place));
    let (dx, dy) = (to_x - x.clone(), to_y - y.clone());
    let length = (dx.clone() * dx.clone() + dy.clone() * dy.clone()).root();
    let least = ALONG_AXIS * length.magnitude();
    let sign = |number: &Number| Number::from(number.value().signum());
    let (zero, across) = (Number::zero, [dx.magnitude() <= least, dy.magnitude() <= least]);
    let direction = match across {
        [true, _] => Vector3::new(zero(), sign(&dy), zero()),
        [_, true] => Vector3::new(sign(&dx), zero(), zero()),
        _ => Vector3::new(dx / length.clone(), dy / length, zero()),
    };
    HingeLine { point: Vector3::new(x, y, lift.number(z, 0)), direction }
}

/// A vertex, the ring that it is of, and its number there.
type Vertex<'a> = (Vector2<Number>, &'a Drawn<Vec<[f64; 2]>>, usize);

/// Returns the vertex of a body's plates whose place at the defaults is `at`; an error if several that differ are there.
fn corner(
    model: &SourceModel,
    body: BodyId,
    at: &Vector3<f64>,
    lift: &Formulas,
) -> Result<Vector3<Number>, ()> {
    let Shape::Plates(layers) = &model.bodies[body.index()].shape else { return Ok(fixed(at)) };
    let mut candidates: Vec<Vertex> = Vec::new();
    for ring in layers.iter().flatten().map(|plate| &plate.outline) {
        let there = ring.value.iter().enumerate().filter(|(_, vertex)| **vertex == [at.x, at.y]);
        for (index, _) in there {
            let vertex = Vector2::from_fn(|axis, _| lift.number(ring, 2 * index + axis));
            candidates.push((vertex, ring, index));
        }
    }
    let formulas = |ring: &Drawn<Vec<[f64; 2]>>, index: usize| {
        [0, 1].map(|axis| ring.formula(2 * index + axis).cloned())
    };
    let Some((vertex, ring, index)) = candidates.first() else { return Ok(fixed(at)) };
    let first = formulas(ring, *index);
    if candidates.iter().any(|(_, ring, index)| formulas(ring, *index) != first) {
        return Err(());
    }
    let mut heights = vec![Number::zero()];
    for material in &model.layup {
        let top = heights[heights.len() - 1].clone();
        heights.push(top + lift.number(&model.materials[*material].thickness, 0));
    }
    let z = heights.into_iter().find(|height| height.value() == at.z);
    Ok(Vector3::new(vertex.x.clone(), vertex.y.clone(), z.unwrap_or_else(|| at.z.into())))
}

fn ambiguous(point: &str, span: Span) -> Diagnostic {
    let message = format!("`{point}` is a corner of several plates whose formulas differ");
    Diagnostic::error(codes::NOT_PARAMETRIC, span, message)
        .hint("name output points, as in `points: [tip]`")
}
