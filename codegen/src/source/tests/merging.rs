//! Merge keys, and truth in every spelling of YAML 1.1.

use super::*;

const MERGED: &str = "
bodies:
  base: { fixed: true }
  arm: &arm { point_masses: [{ mass: 1, at: [1, 0, 0] }] }
  hand: { <<: *arm }
joints:
  j0: &hinge { bodies: [base, arm], axis: [[0, 0], [0, 1]], stiffness: 2, damping: 3 }
  j1: { stiffness: 5, <<: *hinge, bodies: [arm, hand] }
  j2: { <<: [{ damping: 7 }, *hinge, { z: 4, stiffness: 9 }], bodies: [arm, hand] }
";

#[test]
fn merged_entries_yield_to_explicit_and_earlier_ones() {
    let written = "
bodies:
  base: { fixed: true }
  arm: { point_masses: [{ mass: 1, at: [1, 0, 0] }] }
  hand: { point_masses: [{ mass: 1, at: [1, 0, 0] }] }
joints:
  j0: { bodies: [base, arm], axis: [[0, 0], [0, 1]], stiffness: 2, damping: 3 }
  j1: { bodies: [arm, hand], axis: [[0, 0], [0, 1]], stiffness: 5, damping: 3 }
  j2: { bodies: [arm, hand], axis: [[0, 0], [0, 1]], stiffness: 2, damping: 7, z: 4 }
";
    assert_eq!(bare(&read(MERGED)), bare(&read(written)));
}

/// The order of joints is that of coordinates.
#[test]
fn merged_entries_stand_where_the_key_does() {
    let names = |joints: &str| {
        let common = "[base, arm], axis: [[0, 0], [0, 1]]";
        let text = format!(
            "bodies: {{ base: {{ fixed: true }}, arm: {{}} }}\njoints:\n{}\n",
            joints.replace("J", &format!("{{ bodies: {common} }}"))
        );
        let model = read(&text);
        let names = model.joints.iter().map(|joint| joint.name.value.clone());
        names.collect::<Vec<_>>().join(" ")
    };
    assert_eq!(names("  a: J\n  <<: { b: J, c: J }\n  d: J"), "a b c d");
    assert_eq!(names("  <<: [{ b: J }, { c: J, b: J }]\n  a: J\n  c: J"), "b a c");
    assert_eq!(names("  a: J\n  b: J\n  <<: {}"), "a b");
}

#[test]
fn merges_of_merges() {
    let chained = "
bodies:
  base: { fixed: true }
  a: &a { mass: 1, com: [0, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }
  b: &b { <<: *a, mass: 2 }
  c: { <<: *b, com: [1, 0, 0] }
joints: { j: { bodies: [base, a], axis: [[0, 0], [0, 1]] } }
";
    let model = read(chained);
    let Shape::Rigid { mass, com, inertia } = &model.bodies[3].shape else { panic!("no shape") };
    assert_eq!((mass.value, com.value, inertia.value[2]), (2.0, [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]));
}

#[test]
fn what_cannot_be_merged() {
    for (text, code, marked) in [
        ("a: { <<: 3 }", "bad-merge", "<<"),
        ("a: &a [1]\nb: { <<: *a }", "bad-merge", "<<"),
        ("a: { <<: [{}, x] }", "bad-merge", "<<"),
        ("a: { <<: [[{}]] }", "bad-merge", "<<"),
        ("a: { <<: {}, b: 1, <<: {} }", "duplicate-key", "<<"),
        ("a: { <<: { c: 1 }, b: 1, b: 2 }", "duplicate-key", "b"),
        ("a: &a { <<: *a }", "self-alias", "*a"),
        ("a: { <<: *b }", "unknown-alias", "*"),
        // In quotes it is a key like any other.
        ("bodies: { a: { \"<<\": {} } }", "unknown-key", "\"<<\""),
    ] {
        let found = faults(text);
        assert!(found.contains(&(code, marked.to_owned())), "{text}: {found:?}");
    }
}

/// A mistake in what is merged is said once, where it stands.
#[test]
fn mistakes_of_merged_entries() {
    let text = "bodies: { a: { fixed: true }, b: &b { mas: 1 }, c: { <<: *b }, d: *b }\n\
                joints: { j: { bodies: [a, b], axis: [[0, 0], [0, 1]] } }";
    assert_eq!(faults(text), [("unknown-key", "mas".to_owned())]);
}

/// Each mapping merges the one before ten times.
#[test]
fn merges_do_not_multiply() {
    let mut bomb = String::from("a: &a0 { k: [x, x, x, x, x, x, x, x, x, x] }\n");
    for i in 1..12 {
        let aliases = vec![format!("*a{}", i - 1); 10].join(", ");
        bomb += &format!("b{i}: &a{i} {{ <<: [{aliases}] }}\n");
    }
    assert_eq!(faults(&bomb)[0].0, "too-large");
}

#[test]
fn truth_in_every_spelling() {
    let fixed = |word: &str| {
        let text = format!(
            "bodies: {{ a: {{ fixed: true }}, b: {{ fixed: {word} }}, c: {{}} }}\n\
             joints: {{ j: {{ bodies: [a, c], axis: [[0, 0], [0, 1]] }} }}"
        );
        match parse(&file(&text)) {
            Ok((model, _)) => Some(model.bodies[1].fixed),
            Err(errors) => {
                assert_eq!(errors.0[0].code.name, "wrong-type", "{word}");
                None
            }
        }
    };
    for word in ["y", "Y", "yes", "Yes", "YES", "true", "True", "TRUE", "on", "On", "ON"] {
        assert_eq!(fixed(word), Some(true), "{word}");
    }
    for word in ["n", "N", "no", "No", "NO", "false", "False", "FALSE", "off", "Off", "OFF"] {
        assert_eq!(fixed(word), Some(false), "{word}");
    }
    for word in ["maybe", "tRUE", "yEs", "TRue", "oN", "1", "0", "t", "[true]", "é"] {
        assert_eq!(fixed(word), None, "{word}");
    }
}
