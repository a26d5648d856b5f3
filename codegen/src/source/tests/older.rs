//! Older exports of popupCAD: the same design in both formats is one model.

use super::*;

const OLDER: &str = include_str!("two_plates_older.joints");
const NEWER: &str = include_str!("two_plates.joints");

#[test]
fn both_formats_of_a_design_are_one_model() {
    let [older, newer] = [OLDER, NEWER].map(read);
    assert_eq!(newer.tolerance, older.tolerance);
    assert_eq!(bare(&older), bare(&newer));
    assert_round_trip(&older);
}

/// Newer versions of PyYAML write a space behind an alias that is a key.
#[test]
fn aliases_as_keys_may_have_a_space() {
    let spaced = OLDER.replace("*id002: 0.0", "*id002 : 0.0").replace("*id003:\n", "*id003 :\n");
    let spaced = spaced.replace("*id002:\n", "*id002 :\n").replace("*id003: 0.5", "*id003 : 0.5");
    assert!(!spaced.contains("*id003:") && !spaced.contains("*id002:"), "{spaced}");
    assert_eq!(bare(&read(&spaced)), bare(&read(OLDER)));
}

#[test]
fn mistakes_are_located() {
    const LAMINATE: &str = "genericlaminate.GenericLaminate\n    geoms:\n      *id002";
    const POLYGON: &str = "genericshapes.GenericPoly\n        construction: false\n        \
                           exterior:\n        - !ShapeVertex_1 [14";
    let mut missed = Vec::new();
    // What is replaced, by what, and the code and the beginning of the marked text.
    for (from, to, code, marked) in [
        ("- !!python/tuple [0.01, ", "- !!python/tuple [0.01, 7, ", "wrong-length", "[0.01, 7"),
        ("- - !!python/tuple [0.01", "- [] # [0.01", "wrong-length", "-"),
        ("-90, 45", "90, 45", "empty-limits", "90"),
        ("-90, 45", "stiff, 45", "not-a-number", "stiff"),
        ("[17, 100.0, 0.0]", "[17, 100.0, 100.0]", "zero-axis", "!ShapeVertex_1 [17"),
        ("!ShapeVertex_1 [16", "!ShapeVertex [16", "other-object", "!ShapeVertex"),
        ("[16, 200.0, 100.0]", "[16, 200.0]", "wrong-length", "[16, 200.0]"),
        ("GenericPolyline", "GenericCircle", "other-object", "!!python/object:popupcad"),
        (LAMINATE, &LAMINATE.replace("Generic", "Other"), "other-object", "!!python/object"),
        ("- - *id006\n", "- - *id001\n", "unknown-body", "- *id001"),
        ("- - *id006\n", "- - *id004\n", "same-body", "!!python/tuple"),
        ("      *id003:\n", "      other:\n", "missing-key", "geoms"),
        ("- - *id004\n- -", "- []\n- -", "no-fixed-body", "!!python/tuple"),
        ("        thickness: 0.5\n      :", "      :", "missing-key", "!!python/object"),
        (POLYGON, &POLYGON.replace("GenericPoly", "GenericLine"), "bad-polygon", "construction"),
    ] {
        let text = OLDER.replacen(from, to, 1);
        assert_ne!(text, OLDER, "{from}");
        let faults = faults(&text);
        if !faults.iter().any(|(found, at)| *found == code && at.starts_with(marked)) {
            missed.push((to.to_owned(), faults));
        }
    }
    assert!(missed.is_empty(), "{missed:#?}");
}
