//! Contacts: the corners of plates, the planes that they touch, and the default stiffness.
//!
//! The default of the stiffness k lets one point carry the weight m g of all moving bodies with a
//! penetration of [`SINKING`] of the thickness h of the layup:
//!
//! ```text
//! k = m g / (SINKING h)
//! ```

use geo::{ConvexHull, Coord, MultiPoint, Point};
use nalgebra::{Vector2, Vector3};

use super::mechanism::{
    Body, Contact, ContactPoint, DefaultStiffness, Mechanism, Plane, PlateOutline, Sheet,
};
use super::{check, plate};
use crate::source::codes::{self, Code};
use crate::source::{
    BodyId, ContactPlane, ContactPoints, Diagnostic, Diagnostics, Expression, PointId, SourceModel,
    Span, Spanned,
};

/// Share of the thickness by which one point sinks in under the weight of all moving bodies, if the stiffness is
/// the default.
pub const SINKING: f64 = 0.01;

/// Lengths below this share of the mechanism's size, and sines below it, are rounding errors.
const ROUNDING: f64 = 1e-9;

/// Returns the contacts of a mechanism that has everything else.
pub fn contacts(
    model: &SourceModel,
    mechanism: &Mechanism,
    found: &mut Diagnostics,
) -> Vec<Contact> {
    let mut contacts: Vec<Contact> = Vec::new();
    for source in &model.contacts {
        check::positive("slip speed", &source.slip_speed, "m/s", found);
        let build = Build { model, mechanism, source };
        match build.contact() {
            Ok(contact) => {
                build.refuse_twice(&contacts, &contact, found);
                contacts.push(contact);
            }
            Err(problem) => found.push(*problem),
        }
    }
    contacts
}

/// One contact and what it belongs to.
struct Build<'a> {
    model: &'a SourceModel,
    mechanism: &'a Mechanism,
    source: &'a crate::source::Contact,
}

type Refused = Box<Diagnostic>;

impl Build<'_> {
    fn contact(&self) -> Result<Contact, Refused> {
        let source = self.source;
        let plane = self.plane(&source.plane)?;
        let points = self.points(plane.body)?;
        let (stiffness, default) = match &source.stiffness {
            Some(given) => (given.value.clone(), None),
            None => {
                let default = self.default_stiffness()?;
                (Expression::Number(default.stiffness()), Some(default))
            }
        };
        Ok(Contact {
            name: source.name.value.clone(),
            plane,
            points,
            stiffness,
            default,
            dissipation: source.dissipation.value.clone(),
            friction: source.friction.value.clone(),
            slip_speed: source.slip_speed.value,
        })
    }

    fn refuse(&self, code: Code, span: Span, message: impl Into<String>, hint: &str) -> Refused {
        Box::new(Diagnostic::error(code, span, message).hint(hint))
    }

    fn body(&self, id: BodyId) -> &Body {
        &self.mechanism.bodies[id.index()]
    }

    /// Whether a body is part of the ground, as a plane without body is.
    fn is_ground(&self, body: Option<BodyId>) -> bool {
        body.is_none_or(|body| self.body(body).fixed)
    }

    fn plane(&self, source: &ContactPlane) -> Result<Plane, Refused> {
        let normal = Vector3::from(source.normal.value);
        // The squares of large components overflow.
        let normal = (normal / normal.amax()).normalize();
        let body = source.body.as_ref().map(|body| body.value);
        let outline = match &source.within {
            None => None,
            Some(within) => Some(self.outline(body, &normal, within.span)?),
        };
        Ok(Plane { body, point: source.point.value.into(), normal, outline })
    }

    /// Returns the outline and the thickness of the plate that carries a plane.
    fn outline(
        &self,
        body: Option<BodyId>,
        normal: &Vector3<f64>,
        span: Span,
    ) -> Result<PlateOutline, Refused> {
        let refuse =
            |message: String, hint| Err(self.refuse(codes::NO_OUTLINE, span, message, hint));
        let Some(body) = body.map(|body| self.body(body)) else {
            let message = "the ground has no outline".to_owned();
            return refuse(message, "name the `body` of the plane, or leave out `within`");
        };
        if normal.xy().norm() > ROUNDING {
            let message = format!("the plane is not parallel to the plate of `{}`", body.name);
            return refuse(message, "give a normal along z: `[0, 0, 1]` or `[0, 0, -1]`");
        }
        let Some([low, high]) = faces(&body.sheets) else {
            let message = format!("`{}` has no plates", body.name);
            return refuse(message, "give the body an `outline`, or leave out `within`");
        };
        let first = &body.sheets[0];
        let layers = self.model.layup.len();
        let is_one = body
            .sheets
            .iter()
            .all(|sheet| sheet.outline == first.outline && sheet.holes.is_empty());
        let hull = hull(body.sheets.iter());
        let is_convex = first.outline.iter().all(|vertex| is_on(&hull, vertex));
        if !is_one || body.sheets.len() != layers || !is_convex {
            let message = format!("`{}` is not one convex plate through all layers", body.name);
            return refuse(
                message,
                "only a convex `outline` without holes can be the edge of a plane; split the body \
                 into convex ones, or leave out `within`",
            );
        }
        Ok(PlateOutline { vertices: hull, thickness: high - low })
    }

    /// Returns the points that may touch the plane of a body.
    fn points(&self, plane: Option<BodyId>) -> Result<Vec<ContactPoint>, Refused> {
        let name = &self.source.name;
        let bodies = (0..self.mechanism.bodies.len()).map(BodyId);
        let points: Vec<ContactPoint> = match &self.source.points {
            ContactPoints::Corners => bodies
                .filter(|&body| !self.body(body).fixed && Some(body) != plane)
                .flat_map(|body| self.corners(body))
                .collect(),
            ContactPoints::CornersOf(bodies) => {
                let mut points = Vec::new();
                for body in bodies {
                    self.refuse_own(plane, body.value, body.span)?;
                    let corners = self.corners(body.value);
                    if corners.is_empty() {
                        let message = format!(
                            "`{}` has no plates, and so no corners",
                            self.body(body.value).name
                        );
                        let hint = "name output points instead, as in `points: [tip]`";
                        return Err(self.refuse(
                            codes::NO_CONTACT_POINTS,
                            body.span,
                            message,
                            hint,
                        ));
                    }
                    points.extend(corners);
                }
                points
            }
            ContactPoints::Named(points) => {
                points.iter().map(|point| self.named(plane, point)).collect::<Result<_, _>>()?
            }
        };
        if points.is_empty() {
            let message = format!("nothing can touch the plane of `{}`", name.value);
            let hint = "name output points, as in `points: [tip]`, or give the bodies plates";
            return Err(self.refuse(codes::NO_CONTACT_POINTS, name.span, message, hint));
        }
        Ok(points)
    }

    fn named(&self, plane: Option<BodyId>, id: &Spanned<PointId>) -> Result<ContactPoint, Refused> {
        let point = &self.mechanism.points[id.value.index()];
        self.refuse_own(plane, point.body, id.span)?;
        let name = format!("{}.{}", self.source.name.value, point.name);
        Ok(ContactPoint { name, body: point.body, at: point.at })
    }

    /// Refuses points that never move relative to the plane.
    fn refuse_own(&self, plane: Option<BodyId>, body: BodyId, span: Span) -> Result<(), Refused> {
        let is_ground = self.is_ground(plane) && self.body(body).fixed;
        if plane != Some(body) && !is_ground {
            return Ok(());
        }
        let message = match is_ground {
            true => format!("`{}` and the plane are both part of the ground", self.body(body).name),
            false => format!("`{}` carries the plane itself", self.body(body).name),
        };
        let hint = "name what moves relative to the plane";
        Err(self.refuse(codes::OWN_PLANE, span, message, hint))
    }

    /// Returns the vertices of the convex hull of a body's plates, on both outer faces.
    fn corners(&self, body: BodyId) -> Vec<ContactPoint> {
        let Body { name, sheets, .. } = self.body(body);
        let Some(z) = faces(sheets) else { return Vec::new() };
        let at_face = |side: usize| {
            let on_it = sheets.iter().filter(move |sheet| sheet.z[side] == z[side]);
            hull(on_it).into_iter().map(move |[x, y]| Vector3::new(x, y, z[side]))
        };
        let all = at_face(0).chain(at_face(1)).enumerate();
        all.map(|(index, at)| ContactPoint {
            name: format!("{}.{name}.c{index}", self.source.name.value),
            body,
            at,
        })
        .collect()
    }

    /// Returns what the default of the stiffness follows from.
    fn default_stiffness(&self) -> Result<DefaultStiffness, Refused> {
        let Mechanism { bodies, gravity, parameters, .. } = self.mechanism;
        let values: Vec<f64> = parameters.iter().map(|parameter| parameter.value).collect();
        let gravity = gravity.each_ref().map(|law| law.at(&values).unwrap_or(f64::NAN));
        let gravity = Vector3::from(gravity).norm();
        let moving = bodies.iter().filter(|body| !body.fixed);
        let mass: f64 = moving.map(|body| body.mass_properties.mass).sum();
        let thickness: f64 = plate::stack(self.model).map(|layer| layer.thickness).sum();
        let missing = match (gravity > 0.0 && gravity.is_finite(), thickness > 0.0) {
            (false, _) => "there is no constant gravity",
            (_, false) => "there is no `layup`",
            _ => return Ok(DefaultStiffness { mass, gravity, thickness }),
        };
        let name = &self.source.name;
        let message =
            format!("`{}` has no `stiffness`, and {missing} to derive one from", name.value);
        Err(self.refuse(
            codes::NO_CONTACT_SCALE,
            name.span,
            message,
            "give one, as in `stiffness: 2000 N/m`",
        ))
    }

    /// Refuses points that an earlier contact pushes away from the same plane.
    fn refuse_twice(&self, earlier: &[Contact], contact: &Contact, found: &mut Diagnostics) {
        let near = ROUNDING * self.mechanism.size;
        let same_plane = |other: &&Contact| {
            let (a, b) = (&other.plane, &contact.plane);
            let same_body = a.body == b.body || (self.is_ground(a.body) && self.is_ground(b.body));
            let apart = a.normal.dot(&(a.point - b.point)).abs();
            same_body && (a.normal - b.normal).amax() <= ROUNDING && apart <= near
        };
        for other in earlier.iter().filter(same_plane) {
            let is_there = |point: &&ContactPoint| {
                let same =
                    |it: &ContactPoint| it.body == point.body && (it.at - point.at).amax() <= near;
                other.points.iter().any(same)
            };
            let Some(point) = contact.points.iter().find(is_there) else { continue };
            let (first, name) = (&other.name, &self.source.name);
            let message = format!(
                "`{first}` and `{}` both push a point of `{}` from the same plane",
                name.value,
                self.body(point.body).name
            );
            let mut problem = Diagnostic::error(codes::TOUCHES_TWICE, name.span, message);
            let before = self.model.contacts.iter().find(|it| it.name.value == *first);
            if let Some(before) = before {
                problem = problem.also(before.name.span, "the first contact");
            }
            found.push(problem.hint("remove the point from one of them"));
        }
    }
}

/// Returns the heights of the lowest and the highest face, m.
fn faces(sheets: &[Sheet]) -> Option<[f64; 2]> {
    let low = sheets.iter().map(|sheet| sheet.z[0]).min_by(f64::total_cmp)?;
    let high = sheets.iter().map(|sheet| sheet.z[1]).max_by(f64::total_cmp)?;
    Some([low, high])
}

/// Returns whether a point within a convex ring lies on its edge.
fn is_on(ring: &[[f64; 2]], at: &[f64; 2]) -> bool {
    let ends = ring.iter().zip(ring.iter().cycle().skip(1));
    ends.map(|(from, to)| (Vector2::from(*from), Vector2::from(*to))).any(|(from, to)| {
        let (along, there) = (to - from, Vector2::from(*at) - from);
        along.perp(&there).abs() <= ROUNDING * along.norm_squared()
    })
}

/// Returns the vertices of the convex hull of outlines, counterclockwise.
fn hull<'s>(sheets: impl Iterator<Item = &'s Sheet>) -> Vec<[f64; 2]> {
    let points: MultiPoint<f64> =
        sheets.flat_map(|sheet| &sheet.outline).map(|&[x, y]| Point::new(x, y)).collect();
    let ring = points.convex_hull();
    let vertices: Vec<Coord<f64>> = ring.exterior().coords().copied().collect();
    vertices.iter().skip(1).map(|at| [at.x, at.y]).collect()
}
