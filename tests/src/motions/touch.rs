//! What contacts change in the energy of a mechanism: the power of their forces, and what they store.

use lamc::laminate::{Contact, ContactPoint, Mechanism};
use lamc_workbench::verify::{Motion, Values};
use nalgebra::Vector3;

use super::work::velocity;

/// The power of all contacts on T + V, W: the sum of F . v and of the rate of k d^2 / 2.
pub fn of_contacts(mechanism: &Mechanism, motions: &[Motion], values: &Values) -> f64 {
    let contacts = mechanism.contacts.iter();
    let pairs = contacts.flat_map(|contact| contact.points.iter().map(move |it| (contact, it)));
    pairs.map(|(contact, point)| of_point(mechanism, motions, values, contact, point)).sum()
}

fn of_point(
    mechanism: &Mechanism,
    motions: &[Motion],
    values: &Values,
    contact: &Contact,
    point: &ContactPoint,
) -> f64 {
    let body = point.body.index();
    let at = motions[body].rotation * point.at + motions[body].position;
    let own = velocity(mechanism, motions, body, &point.at);
    let plane = contact.plane.body.map(|plane| plane.index());
    // Where the point is on the drawing of the plane's body, and how fast it moves there.
    let (drawn, moves) = match plane {
        None => (at, own),
        Some(plane) => {
            let motion = &motions[plane];
            let drawn = motion.rotation.transpose() * (at - motion.position);
            let carried = velocity(mechanism, motions, plane, &drawn);
            (drawn, motion.rotation.transpose() * (own - carried))
        }
    };
    let normal = contact.plane.normal;
    let (below, sinks) = (normal.dot(&(contact.plane.point - drawn)), -normal.dot(&moves));
    let (depth, deepens) = depth(contact, &drawn, &moves, [below, sinks]);
    if depth <= 0.0 {
        return 0.0;
    }
    let stiffness = values.jet(&contact.stiffness);
    let damped = (1.0 + values.of(&contact.dissipation) * sinks).max(0.0);
    let push = stiffness[0] * depth * damped;
    let sliding = (moves + normal * sinks).norm_squared();
    let rubs = values.of(&contact.friction) * push * sliding
        / (sliding + contact.slip_speed.powi(2)).sqrt();
    -push * sinks - rubs + stiffness[0] * depth * deepens + stiffness[1] * depth * depth / 2.0
}

/// The depth and its rate: those below the plane or, if it is nearer, to an edge or to the back of the plate.
fn depth(
    contact: &Contact,
    drawn: &Vector3<f64>,
    moves: &Vector3<f64>,
    [below, sinks]: [f64; 2],
) -> (f64, f64) {
    let Some(outline) = &contact.plane.outline else { return (below, sinks) };
    let edges = outline
        .edges()
        .map(|([x, y], product)| (x * drawn.x + y * drawn.y - product, x * moves.x + y * moves.y));
    let back = (outline.thickness - below, -sinks);
    edges.chain([back]).fold((below, sinks), |least, other| match other.0 < least.0 {
        true => other,
        false => least,
    })
}
