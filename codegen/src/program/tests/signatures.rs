//! The table of signatures.

use std::collections::BTreeSet;

use crate::program::{FunctionKind, SIGNATURES};

#[test]
fn each_kind_has_the_signature_at_its_place() {
    for (index, signature) in SIGNATURES.iter().enumerate() {
        assert_eq!(signature.kind as usize, index, "{}", signature.name);
        assert_eq!(format!("{:?}", signature.kind).to_lowercase(), signature.name.replace('_', ""));
    }
}

#[test]
fn names_are_unambiguous_and_documented() {
    for signature in &SIGNATURES {
        let inputs: BTreeSet<_> = signature.inputs.iter().map(|input| input.name()).collect();
        let outputs: BTreeSet<_> = signature.outputs.iter().map(|output| output.name).collect();
        assert_eq!(inputs.len(), signature.inputs.len(), "{}", signature.name);
        assert_eq!(outputs.len(), signature.outputs.len(), "{}", signature.name);
        assert!(inputs.is_disjoint(&outputs), "{} writes what it reads", signature.name);
        let docs = signature.outputs.iter().map(|output| output.doc).chain([signature.doc]);
        assert!(docs.into_iter().all(|doc| !doc.is_empty() && !doc.ends_with('.')));
    }
}

#[test]
fn shapes_read_like_the_literature() {
    let shape = |kind: FunctionKind, output: usize| kind.signature().outputs[output].shape;
    assert_eq!(shape(FunctionKind::Equations, 2).to_string(), "C x NU");
    assert_eq!(shape(FunctionKind::Closure, 0).to_string(), "9 L");
    assert_eq!(shape(FunctionKind::Energy, 0).to_string(), "1");
}
