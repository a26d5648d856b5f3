//! Codes of names: declarations and references.

codes! {
    BAD_NAME "bad-name"
        "A name cannot be an identifier of the generated code."
        "Use the letters A to Z in either case, digits and `_`, and do not start with a digit.";
    RESERVED_NAME "reserved-name"
        "A name has another meaning: a keyword of Rust, C, C++ or Python, or a name with a fixed \
         meaning in formulas."
        "Choose another name.";
    DUPLICATE_NAME "duplicate-name"
        "Two things that need different names have the same name: a parameter and an input, two \
         inputs, a parameter and one that `tunable` makes, a hinge model and a built-in one, or \
         two bodies of a popupCAD file."
        "Rename one of them.";
    UNKNOWN_BODY "unknown-body"
        "A joint, a point or a torsion spring refers to a body that is not under `bodies`."
        "Correct the name, or declare the body.";
    UNKNOWN_JOINT "unknown-joint"
        "A formula, a motor or `initial` refers to a joint that is not under `joints`."
        "Correct the name, or declare the joint.";
    UNKNOWN_MATERIAL "unknown-material"
        "The layup or a hinge refers to a material that is not under `materials`."
        "Correct the name, or declare the material.";
    UNKNOWN_POINT "unknown-point"
        "A force acts at a point, or a spring or a tendon runs to a point, that is not under `points`."
        "Correct the name, or declare the point.";
}
