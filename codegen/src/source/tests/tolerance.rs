//! The tolerance of a drawing: given, or by the decimals of its coordinates.

use super::{faults, read};

/// A sheet of 300 by 400 millimetres with these hinge lines, and what else is given.
fn tolerance(more: &str, axes: &[&str]) -> f64 {
    let mut text = format!(
        "units: {{length: mm}}\nmaterials: {{m: {{density: 1, thickness: 0.127}}}}\nlayup: [m]\n\
         bodies:\n  a: {{fixed: true, outline: [[0,0],[300,0],[300,400]]}}\n  \
         b: {{mass: 1, com: [0.123456789,0,0], inertia: [[1,0,0],[0,1,0],[0,0,1]]}}\n\
         points: {{p: {{body: a, at: [0.0000001, 0, 0]}}}}\n{more}\njoints:\n"
    );
    for (i, axis) in axes.iter().enumerate() {
        text += &format!("  j{i}: {{bodies: [a, b], axis: {axis}, stiffness: 0.00001}}\n");
    }
    read(&text).tolerance
}

#[test]
fn it_is_half_a_unit_of_the_last_decimal() {
    for (axes, expected) in [
        (vec!["[[0, 0], [1.2345, 10]]"], 0.5e-7),
        (vec!["[[0, 0], [1.2345, 10]]", "[[0, 0], [1.25, 10]]"], 0.5e-7),
        (vec!["[[0, 0], [1.2340, 10]]"], 0.5e-7),
        // Values with units of their own count in these.
        (vec!["[[0, 0], [0.0125 m, 10]]"], 5e-6 * 1e1),
        (vec!["[[0, 0], [12.5 um, 10]]"], 0.5e-7),
        (vec!["[[0, 0], [0.5 in, 10]]"], 5e-5),
        // At most 1e-4 of the size, which is half a metre.
        (vec!["[[0, 0], [1.2, 10]]"], 5e-5),
        (vec!["[[0, 0], [1.25, 10]]"], 5e-6),
        // Whole numbers, also as programs write them.
        (vec!["[[0, 0], [1, 10]]"], 0.5e-9),
        (vec!["[[0.0, 0.0], [1.0, 10.0]]"], 0.5e-9),
        (vec!["[[0, 0], [6.123e-17, 10]]"], 0.5e-9),
        (vec!["[[0, 0], [6.123e-17, 10.25]]"], 5e-6),
        (vec!["[[0, 0], [0.30000000000000004, 10.25]]"], 5e-6),
        (vec!["[[0, 0], [0.0123456789012345, 10.25]]"], 0.5e-19),
    ] {
        let found = tolerance("", &axes);
        assert!((found / expected - 1.0).abs() < 1e-12, "{axes:?}: {found:e}, not {expected:e}");
    }
}

#[test]
fn outlines_holes_and_heights_count() {
    let plain = "[[0, 0], [1.25, 10]]";
    let joint = |z: &str| format!("{plain}, z: {z}");
    for (axis, expected) in
        [(joint("0.5"), 5e-6), (joint("0.1275"), 0.5e-7), (joint("1.5 um"), 0.5e-7)]
    {
        let found = tolerance("", &[&axis]);
        assert!((found / expected - 1.0_f64).abs() < 1e-12, "{axis}: {found:e}");
    }
    let body = |shape: &str| {
        read(&format!(
            "materials: {{m: {{density: 1, thickness: 1}}}}\nlayup: [m]\nbodies:\n  \
             a: {{fixed: true}}\n  b: {{{shape}}}\n\
             joints: {{j: {{bodies: [a, b], axis: [[0,0],[1.25,0]]}}}}"
        ))
        .tolerance
    };
    assert_eq!(body("outline: [[0,0],[100,0],[0.0625,100]]"), 0.5e-4);
    assert_eq!(body("outline: [[0,0],[100,0],[0,100]], holes: [[[1,1],[2,1],[1.005,2]]]"), 0.5e-3);
}

#[test]
fn it_may_be_given() {
    for (more, expected) in
        [("tolerance: 0", 0.0), ("tolerance: 0.02", 2e-5), ("tolerance: 3 um", 3e-6)]
    {
        assert_eq!(tolerance(more, &["[[0, 0], [1.2345, 10]]"]), expected, "{more}");
    }
    let text = |tolerance: &str| {
        format!(
            "tolerance: {tolerance}\nbodies: {{a: {{fixed: true}}, b: {{}}}}\n\
             joints: {{j: {{bodies: [a, b], axis: [[0,0],[1,0]]}}}}"
        )
    };
    for (wrong, code) in
        [("-0.001", "bad-tolerance"), ("0.02", "bad-tolerance"), ("1 deg", "wrong-dimension")]
    {
        assert_eq!(faults(&text(wrong)), [(code, wrong.to_owned())]);
    }
}

#[test]
fn files_of_popupcad_have_decimals_too() {
    let design = |corner: &str, end: &str, height: &str| {
        read(&format!(
            "!!python/object:foldable_robotics.dynamics_info.DynamicsInfo\nconnected_items:\n\
             - id: 11\n  layers:\n  - geoms: ['POLYGON ((0 0, 1 0, {corner} 1, 0 0))']\n\
             - id: 12\n  layers:\n  - geoms: ['POLYGON ((1 0, 2 0, 2 1, 1 0))']\n\
             connections:\n- !!python/tuple\n  - !!python/tuple\n    \
             - !!python/tuple [1.0, 0.0]\n    - !!python/tuple [1.0, {end}]\n  \
             - !!python/tuple [11, 12]\n  \
             - !!python/object:foldable_robotics.dynamics_info.JointProps {{damping: 0.0001,\n    \
             limit_neg: -180, limit_pos: 180, preload: 0.0, stiffness: 0.00001, z_pos: {height}}}\n\
             material_properties:\n\
             - !!python/object:foldable_robotics.dynamics_info.MaterialProperty\n  density: 1000\n  \
             name: rigid\n  thickness: 0.001\nnewtonian_ids: [11]\n"
        ))
        .tolerance
    };
    for (corner, end, height, expected) in [
        ("1", "0.98765", "0.0", 0.5e-5),
        ("1", "0.98765", "0.00025", 0.5e-5),
        ("1", "0.98765", "0.000251", 0.5e-6),
        ("1.00000625", "0.98765", "0.0", 0.5e-8),
        ("1", "0.030000000000000002", "0.00025", 0.5e-5),
        ("1", "0.4974452554744527", "0.00025", 0.5e-16),
    ] {
        let found = design(corner, end, height);
        assert!((found / expected - 1.0).abs() < 1e-12, "{corner} {end} {height}: {found:e}");
    }
}
