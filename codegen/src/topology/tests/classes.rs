//! Classes of hinge lines, where closure is written, near misses.

use crate::compare::largest;
use nalgebra::{Matrix3, Vector3};

use super::{codes, hinge, ray, topology};
use crate::topology::{LoopClass, Row, Topology};

fn around(centre: [f64; 2], miss: f64, tilt: f64) -> Topology {
    let angles = [0.1, 1.4, 2.9, 4.6];
    let hinges: Vec<_> = (0..4)
        .map(|i| {
            let off = if i == 2 { miss } else { 0.0 };
            ray(
                [i, (i + 1) % 4],
                [centre[0] + off, centre[1]],
                angles[i],
                tilt * (i == 1) as u8 as f64,
            )
        })
        .collect();
    topology(&hinges)
}

fn rows(rows: &[(usize, usize)]) -> Vec<Row> {
    rows.iter().map(|(point, axis)| Row { point: *point, axis: *axis }).collect()
}

fn assert_frame(topology: &Topology) {
    let closed = &topology.loops[0];
    let [p1, p2, p3] = closed.points;
    let (x, y) = (closed.frame.column(0), closed.frame.column(1));
    assert!(largest(&(closed.frame.transpose() * closed.frame - Matrix3::identity())) < 1e-15);
    assert!((closed.frame.determinant() - 1.0).abs() < 1e-15);
    let length = (p2 - p1).norm();
    let rounding = 1e-15 * (1.0 + largest(&p1));
    assert!(largest(&(p2 - p1 - x * length)) < rounding);
    assert!(largest(&(p3 - p1 - y * length)) < rounding);
    assert!(length > 0.05 * topology.mechanism.size && length <= topology.mechanism.size);
}

#[test]
fn spherical_centre_is_found_and_is_a_point_of_the_frame() {
    for centre in [[0.0, 0.0], [0.3, -0.2], [100.0, 50.0]] {
        let topology = around(centre, 0.0, 0.0);
        assert_frame(&topology);
        let closed = &topology.loops[0];
        assert_eq!(
            closed.class,
            LoopClass::Spherical { centre: [centre[0], centre[1], 0.0].into() }
        );
        assert_eq!(closed.points[0], Vector3::new(centre[0], centre[1], 0.0));
        assert_eq!(closed.rows, rows(&[(1, 1), (1, 2), (2, 2)]));
        let closing = &topology.mechanism.joints[closed.joint.index()];
        assert!(largest(&closed.frame.column(0).cross(&closing.direction)) < 1e-15);
    }
    // Where the lines would meet need not be where they end.
    let far = [0.1_f64, 1.4, 2.9, 4.6].map(|a| [0.2 * a.cos(), 0.2 * a.sin()]);
    let angles = [0.1_f64, 1.4, 2.9, 4.6];
    let hinges: Vec<_> = (0..4).map(|i| ray([i, (i + 1) % 4], far[i], angles[i], 0.0)).collect();
    let LoopClass::Spherical { centre } = topology(&hinges).loops[0].class else {
        panic!("not spherical")
    };
    assert!(centre.norm() < 1e-16);
}

#[test]
fn planar_frame_has_the_normal_along_z() {
    let xs = [0.0, 1.0, 4.0, 0.5];
    let at = |i: usize| hinge([i, (i + 1) % 4], [xs[i], 0.0], [xs[i] + 1.0, 1.0]);
    let topology = topology(&[at(0), at(1), at(2), at(3)]);
    assert_frame(&topology);
    let closed = &topology.loops[0];
    let LoopClass::Planar { normal } = closed.class else { panic!("not planar") };
    assert!(largest(&closed.frame.column(2).cross(&normal)) < 1e-15);
    assert_eq!(closed.frame.column(1), Vector3::z());
    assert_eq!(closed.rows, rows(&[(0, 0), (0, 1), (1, 1)]));
    assert_eq!(
        topology.summary_lines(),
        ["loop 0: planar, 9 equations, 3 independent, mobility 1"]
    );
}

#[test]
fn near_misses_are_reported_with_their_size() {
    // The offender is the hinge that is off, not the closing one.
    let topology = around([0.0, 0.0], 3e-4, 0.0);
    assert_eq!(topology.loops[0].class, LoopClass::Spatial);
    assert_frame(&topology);
    assert_eq!(codes(&topology.warnings)[0], "near-miss");
    let message = &topology.warnings.0[0].message;
    let miss = 0.3 * 2.9_f64.sin();
    assert!(message.contains(&format!("spherical by {miss:.3} mm")), "{message}");
    assert!(message.ends_with("by `j2`"), "{message}");

    let topology = around([0.0, 0.0], 0.0, 2e-4);
    let message = &topology.warnings.0[0].message;
    assert!(message.contains("spherical by 0.200 mm") && message.ends_with("by `j1`"), "{message}");

    let xs = [0.0, 1.0, 4.0, 0.5];
    let at = |i: usize| {
        hinge([i, (i + 1) % 4], [xs[i], 0.0], [xs[i] + if i == 3 { 1e-3 } else { 0.0 }, 1.0])
    };
    let topology = self::topology(&[at(0), at(1), at(2), at(3)]);
    assert_eq!(topology.loops[0].class, LoopClass::Spatial);
    let message = &topology.warnings.0[0].message;
    assert!(
        message.contains("planar by 5.730e-2 deg") && message.ends_with("by `j3`"),
        "{message}"
    );

    let apart = [hinge([0, 1], [0.0, 0.0], [0.0, 1.0]), hinge([0, 1], [1e-3, 2.0], [1e-3, 3.0])];
    let topology = self::topology(&apart);
    assert_eq!(codes(&topology.warnings), ["near-miss", "immobile"]);
    let message = &topology.warnings.0[0].message;
    assert!(message.contains("one hinge line by 1.000 mm"), "{message}");
}

#[test]
fn rounding_of_the_drawing_is_no_miss() {
    let topology = around([0.0, 0.0], 1e-13, 0.0);
    assert!(matches!(topology.loops[0].class, LoopClass::Spherical { .. }));
    assert_eq!(codes(&topology.warnings), [""; 0]);
}
