//! Codes of the schema: unknown and missing keys, and values of the wrong type.

codes! {
    UNKNOWN_KEY "unknown-key"
        "A mapping has a key that the schema does not allow there. Often the key is misspelt or \
         indented wrongly. In files of popupCAD this is a warning."
        "Take a key from [SCHEMA.md](SCHEMA.md), or remove it.";
    MISSING_KEY "missing-key"
        "A required key is missing."
        "Add the key. [SCHEMA.md](SCHEMA.md) says which keys each mapping needs.";
    NO_VALUE "no-value"
        "A key has no value."
        "Write the value after the colon, or remove the key.";
    WRONG_TYPE "wrong-type"
        "A value has the wrong type for its key: a list where a mapping is expected, a number \
         where a list is expected, a word where `true` or `false` is expected."
        "Write the value as [SCHEMA.md](SCHEMA.md) shows it for this key.";
    WRONG_LENGTH "wrong-length"
        "A list does not have as many items as it must, such as two coordinates for a vertex, or as many \
         lists of plates as the layup has layers."
        "Add or remove items.";
    NO_JOINTS "no-joints"
        "The model has neither joints nor a free body, so nothing can move."
        "Add a joint between two bodies, or give a body `free: true`.";
    NO_FIXED_BODY "no-fixed-body"
        "No body is fixed, so there is no ground relative to which the motion could be \
         described, and none is free."
        "Give one of the bodies `fixed: true`, or `free: true` if nothing holds it.";
    FIXED_AND_FREE "fixed-and-free"
        "A body has both `fixed` and `free`."
        "Remove one of the two keys.";
    NOT_FREE "not-free"
        "`initial.bodies` names a body that is not free. Where a body on hinges is follows from their angles."
        "Give the body `free: true`, or the angles of its joints under `initial.q`.";
    TWO_ORIENTATIONS "two-orientations"
        "The orientation of a free body is given twice, as a quaternion and as a rotation vector."
        "Keep `orientation` or `turn`.";
    NO_ORIENTATION "no-orientation"
        "The quaternion of an `orientation` is zero, so it has no direction."
        "Write `[1, 0, 0, 0]` for the orientation of the drawing, or remove the key.";
    MIXED_SHAPE "mixed-shape"
        "A body defines its mass properties in two ways."
        "Keep one of `outline` (with `holes`), `layers`, and `mass` with `com` and `inertia`. \
         `point_masses` may be added to any of them.";
    NO_LAYUP "no-layup"
        "A body has plates, but the model does not say which materials the sheet is made of."
        "Add `materials` and a `layup`, or give the body's `mass`, `com` and `inertia`.";
    EMPTY_LAYUP "empty-layup"
        "The layup is an empty list, so plates would have neither thickness nor mass."
        "List materials from bottom to top, or remove the key.";
    DRIVEN_TORQUE "driven-torque"
        "A joint has both a prescribed angle (`drive`) and a `torque`. The torque would not change the \
         motion."
        "Keep one of the two keys. The torque that the prescribed motion needs is computed.";
    TWO_SPRINGS "two-springs"
        "A joint has both a `stiffness` and a model of the `hinge`, which computes the stiffness."
        "Keep one of the two keys.";
    TWO_DAMPINGS "two-dampings"
        "A joint has both a `damping` and a model of the `hinge`, which computes the damping."
        "Remove `damping`, or give `stiffness` and `damping` without a hinge model.";
    UNKNOWN_HINGE "unknown-hinge"
        "The `model` of a `hinge` is neither built in nor an entry of `hinge_models`."
        "Write `beam`, `sharifzadeh2018`, or the name of an entry of `hinge_models`.";
    UNKNOWN_COEFFICIENTS "unknown-coefficients"
        "The `coefficients` of a `sharifzadeh2018` hinge are neither `corrected` nor `printed`."
        "Write one of these words, or remove the key, which means `corrected`.";
    UNKNOWN_TUNABLE "unknown-tunable"
        "The list `tunable` names something that cannot become a parameter of every joint or body."
        "Use `stiffness`, `damping`, `rest` or `mass`. Other numbers become parameters through \
         `parameters` and formulas.";
    BAD_EXPONENT "bad-exponent"
        "A term of a hinge model has an exponent that is not a whole number from 0 to 9."
        "Write a term as `[coefficient, i, j, k]` with whole exponents of length, width and area.";
}
