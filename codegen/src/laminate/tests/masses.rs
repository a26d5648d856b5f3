//! Plates against closed forms and against quadrature over a triangulation.

use crate::compare::largest;
use crate::uniform::Random;
use nalgebra::{Matrix3, Rotation3, Vector3};

use super::{body, drawn, material, mechanism, model, plate, point_mass, spanned};
use crate::laminate::MassProperties;
use crate::source::{Body, Plate, Shape};

const DENSITY: f64 = 700.0;
const THICKNESS: f64 = 4e-4;

/// One layer with these plates.
fn single(plates: Vec<Plate>) -> MassProperties {
    of(body("plate", Shape::Plates(vec![plates])))
}

fn of(body: Body) -> MassProperties {
    mechanism(&model(vec![material(DENSITY, THICKNESS)], vec![body])).bodies[1].mass_properties
}

fn assert_close(found: &MassProperties, mass: f64, com: [f64; 3], inertia: Matrix3<f64>) {
    let com = Vector3::from(com);
    assert!((found.mass - mass).abs() <= 1e-12 * mass, "mass {} is not {mass}", found.mass);
    let scale = largest(&com).max(1e-3);
    assert!(largest(&(found.com - com)) <= 1e-12 * scale, "com {} is not {com}", found.com);
    let worst = largest(&(found.inertia - inertia)) / largest(&inertia);
    assert!(worst <= 1e-12, "inertia {} is not {inertia}: {worst:e}", found.inertia);
}

fn rectangle(x: f64, y: f64, width: f64, height: f64) -> Vec<[f64; 2]> {
    vec![[x, y], [x + width, y], [x + width, y + height], [x, y + height]]
}

/// Mass and inertia about its centre of a box with sides a, b, c along x, y, z.
fn cuboid(a: f64, b: f64, c: f64) -> (f64, Matrix3<f64>) {
    let mass = DENSITY * a * b * c;
    let moments = Vector3::new(b * b + c * c, a * a + c * c, a * a + b * b);
    (mass, Matrix3::from_diagonal(&(moments * (mass / 12.0))))
}

/// Steiner's theorem, in its own words.
fn steiner(mass: f64, d: Vector3<f64>) -> Matrix3<f64> {
    let [x, y, z] = d.into();
    let t = Matrix3::new(
        y * y + z * z,
        -x * y,
        -x * z, //
        -x * y,
        x * x + z * z,
        -y * z, //
        -x * z,
        -y * z,
        x * x + y * y,
    );
    t * mass
}

#[test]
fn box_of_either_orientation_near_and_far() {
    let (a, b) = (0.04, 0.02);
    let (mass, inertia) = cuboid(a, b, THICKNESS);
    for (x, y) in [(0.0, 0.0), (-0.3, 0.7), (0.25, -0.125)] {
        let outline = rectangle(x, y, a, b);
        let reversed: Vec<_> = outline.iter().rev().copied().collect();
        for outline in [outline, reversed] {
            let found = single(vec![plate(&outline, &[])]);
            assert_close(&found, mass, [x + a / 2.0, y + b / 2.0, THICKNESS / 2.0], inertia);
        }
    }
}

#[test]
fn hole_is_subtracted_whatever_its_orientation() {
    let outer = rectangle(0.0, 0.0, 0.06, 0.04);
    let inner = rectangle(0.01, 0.01, 0.02, 0.01);
    let (m1, i1) = cuboid(0.06, 0.04, THICKNESS);
    let (m2, i2) = cuboid(0.02, 0.01, THICKNESS);
    let (c1, c2) = (Vector3::new(0.03, 0.02, 2e-4), Vector3::new(0.02, 0.015, 2e-4));
    let mass = m1 - m2;
    let com = (c1 * m1 - c2 * m2) / mass;
    let inertia = i1 + steiner(m1, c1 - com) - i2 - steiner(m2, c2 - com);
    let reversed: Vec<_> = inner.iter().rev().copied().collect();
    for hole in [&inner, &reversed] {
        let found = single(vec![plate(&outer, &[hole])]);
        assert_close(&found, mass, com.into(), inertia);
    }
}

#[test]
fn l_shape_is_two_boxes() {
    let outline = [[0.0, 0.0], [0.05, 0.0], [0.05, 0.01], [0.01, 0.01], [0.01, 0.03], [0.0, 0.03]];
    let whole = single(vec![plate(&outline, &[])]);
    let (m1, i1) = cuboid(0.05, 0.01, THICKNESS);
    let (m2, i2) = cuboid(0.01, 0.02, THICKNESS);
    let (c1, c2) = (Vector3::new(0.025, 0.005, 2e-4), Vector3::new(0.005, 0.02, 2e-4));
    let com = (c1 * m1 + c2 * m2) / (m1 + m2);
    let inertia = i1 + steiner(m1, c1 - com) + i2 + steiner(m2, c2 - com);
    assert_close(&whole, m1 + m2, com.into(), inertia);
    // Two plates of one layer, side by side.
    let apart = single(vec![
        plate(&rectangle(0.0, 0.0, 0.05, 0.01), &[]),
        plate(&rectangle(0.0, 0.01, 0.01, 0.02), &[]),
    ]);
    assert_close(&apart, m1 + m2, com.into(), inertia);
}

#[test]
fn right_triangular_prism() {
    // Textbook: Ixx = b h^3/36, Iyy = h b^3/36, Ixy = -b^2 h^2/72 (areas) about the centroid.
    let (b, h, t) = (0.03, 0.05, THICKNESS);
    let found = single(vec![plate(&[[0.0, 0.0], [b, 0.0], [0.0, h]], &[])]);
    let surface = DENSITY * t;
    let mass = surface * b * h / 2.0;
    let (xx, yy) = (surface * b * h.powi(3) / 36.0, surface * h * b.powi(3) / 36.0);
    let product = -surface * b * b * h * h / 72.0;
    let own = mass * t * t / 12.0;
    let inertia = Matrix3::new(
        xx + own,
        -product,
        0.0, //
        -product,
        yy + own,
        0.0, //
        0.0,
        0.0,
        xx + yy,
    );
    assert_close(&found, mass, [b / 3.0, h / 3.0, t / 2.0], inertia);
}

#[test]
fn many_sided_polygon_tends_to_the_disk() {
    let radius = 0.02;
    let error = |n: usize| {
        let angle = |i: usize| std::f64::consts::TAU * i as f64 / n as f64;
        let outline: Vec<_> =
            (0..n).map(|i| [radius * angle(i).cos(), radius * angle(i).sin()]).collect();
        let found = single(vec![plate(&outline, &[])]);
        let mass = DENSITY * THICKNESS * std::f64::consts::PI * radius * radius;
        assert!(
            (found.inertia[(0, 0)] - found.inertia[(1, 1)]).abs() < 1e-12 * largest(&found.inertia)
        );
        found.inertia[(2, 2)] / (mass * radius * radius / 2.0) - 1.0
    };
    // The deficit of a regular n-gon's polar moment is 4 pi^2/(3 n^2) to first order.
    for n in [100, 400] {
        let expected = -4.0 * std::f64::consts::PI.powi(2) / (3.0 * (n * n) as f64);
        assert!((error(n) / expected - 1.0).abs() < 1e-2, "{n}: {} {expected}", error(n));
    }
}

#[test]
fn layers_are_stacked_from_zero() {
    let sheets = [(700.0, 4e-4), (1380.0, 1.27e-4), (950.0, 2e-4)];
    let outline = rectangle(-0.01, 0.02, 0.04, 0.02);
    let square = rectangle(0.0, 0.0, 0.01, 0.01);
    let materials = sheets.iter().map(|(density, thickness)| material(*density, *thickness));
    // The middle layer is empty in the second body.
    let layers = vec![vec![plate(&outline, &[])], vec![], vec![plate(&square, &[])]];
    let stacked = body("stacked", Shape::Plates(layers));
    let built = mechanism(&model(materials.collect(), vec![stacked]));
    let m1 = 700.0 * 4e-4 * 0.04 * 0.02;
    let m2 = 950.0 * 2e-4 * 0.01 * 0.01;
    let c1 = Vector3::new(0.01, 0.03, 2e-4);
    let c2 = Vector3::new(0.005, 0.005, 4e-4 + 1.27e-4 + 1e-4);
    let i1 = cuboid(0.04, 0.02, 4e-4).1 * (m1 / cuboid(0.04, 0.02, 4e-4).0);
    let i2 = cuboid(0.01, 0.01, 2e-4).1 * (m2 / cuboid(0.01, 0.01, 2e-4).0);
    let com = (c1 * m1 + c2 * m2) / (m1 + m2);
    let inertia = i1 + steiner(m1, c1 - com) + i2 + steiner(m2, c2 - com);
    assert_close(&built.bodies[1].mass_properties, m1 + m2, com.into(), inertia);
}

#[test]
fn point_masses_and_rigid_parts_add_up() {
    // A dumbbell cross: four equal masses on the axes.
    let mut cross = body("cross", Shape::None);
    let (m, r) = (0.003, 0.05);
    cross.point_masses = vec![
        point_mass(m, [r, 0.0, 0.1]),
        point_mass(m, [-r, 0.0, 0.1]),
        point_mass(m, [0.0, r, 0.1]),
        point_mass(m, [0.0, -r, 0.1]),
    ];
    let i = 2.0 * m * r * r;
    let inertia = Matrix3::from_diagonal(&Vector3::new(i, i, 2.0 * i));
    assert_close(&of(cross), 4.0 * m, [0.0, 0.0, 0.1], inertia);

    let (mass, inertia) = cuboid(0.04, 0.02, 0.01);
    let turn = Rotation3::from_euler_angles(0.3, -0.7, 1.1);
    let turned = turn * inertia * turn.inverse();
    let rows = [0, 1, 2].map(|i| [0, 1, 2].map(|j| turned[(i, j)]));
    let mut rigid = body(
        "rigid",
        Shape::Rigid { mass: drawn(mass), com: drawn([1.0, 2.0, 3.0]), inertia: spanned(rows) },
    );
    assert_close(&of(rigid.clone()), mass, [1.0, 2.0, 3.0], turned);
    rigid.point_masses = vec![point_mass(mass, [1.0, 2.0, 3.2])];
    let offset = Vector3::new(0.0, 0.0, 0.1);
    let both = turned + steiner(mass, offset) * 2.0;
    assert_close(&of(rigid), 2.0 * mass, [1.0, 2.0, 3.1], both);
}

/// Integrals of 1, x, y, x^2, y^2, x y over a triangle by the edge-midpoint rule, which is exact
/// for quadratic integrands.
fn triangle([a, b, c]: [[f64; 2]; 3]) -> [f64; 6] {
    let area = ((b[0] - a[0]) * (c[1] - a[1]) - (c[0] - a[0]) * (b[1] - a[1])) / 2.0;
    let mut sums = [0.0; 6];
    for (p, q) in [(a, b), (b, c), (c, a)] {
        let (x, y) = ((p[0] + q[0]) / 2.0, (p[1] + q[1]) / 2.0);
        for (sum, value) in sums.iter_mut().zip([1.0, x, y, x * x, y * y, x * y]) {
            *sum += value * area / 3.0;
        }
    }
    sums
}

#[test]
fn random_polygons_agree_with_quadrature_and_turn_and_shift_along() {
    let mut numbers = Random::new(7);
    let mut random = || numbers.range(0.0, 1.0);
    for _ in 0..200 {
        // Star-shaped about a centre: its fan of triangles is a triangulation.
        let n = 3 + (random() * 30.0) as usize;
        let centre = [random() - 0.5, random() - 0.5];
        let mut angles: Vec<f64> = (0..n).map(|i| (i as f64 + 0.8 * random()) / n as f64).collect();
        angles.iter_mut().for_each(|a| *a *= std::f64::consts::TAU);
        let outline: Vec<[f64; 2]> = angles
            .iter()
            .map(|a| (a, 0.01 + 0.05 * random()))
            .map(|(a, r)| [centre[0] + r * a.cos(), centre[1] + r * a.sin()])
            .collect();
        let mut sums = [0.0; 6];
        for i in 0..n {
            // About the centre, for digits.
            let at = |v: [f64; 2]| [v[0] - centre[0], v[1] - centre[1]];
            let fan = triangle([[0.0; 2], at(outline[i]), at(outline[(i + 1) % n])]);
            sums.iter_mut().zip(fan).for_each(|(sum, part)| *sum += part);
        }
        let surface = DENSITY * THICKNESS;
        let [area, x, y, xx, yy, xy] = sums;
        let (cx, cy) = (x / area, y / area);
        let mass = surface * area;
        let own = mass * THICKNESS * THICKNESS / 12.0;
        let (jx, jy) = (surface * (yy - area * cy * cy), surface * (xx - area * cx * cx));
        let jxy = -surface * (xy - area * cx * cy);
        let inertia = Matrix3::new(
            jx + own,
            jxy,
            0.0, //
            jxy,
            jy + own,
            0.0, //
            0.0,
            0.0,
            jx + jy,
        );
        let found = single(vec![plate(&outline, &[])]);
        let com = [centre[0] + cx, centre[1] + cy, THICKNESS / 2.0];
        assert_close(&found, mass, com, inertia);

        let angle = std::f64::consts::TAU * random();
        let turn = Rotation3::from_axis_angle(&Vector3::z_axis(), angle);
        let shift = Vector3::new(random(), random(), 0.0);
        let moved: Vec<[f64; 2]> = outline
            .iter()
            .map(|v| turn * Vector3::new(v[0], v[1], 0.0) + shift)
            .map(|v| [v.x, v.y])
            .collect();
        let moved = single(vec![plate(&moved, &[])]);
        let expected = turn * found.inertia * turn.inverse();
        let rounding = largest(&(moved.inertia - expected)) / largest(&expected);
        assert!(rounding < 1e-11, "{rounding:e}");
        assert!(largest(&(moved.com - (turn * found.com + shift))) < 1e-14);
    }
}
