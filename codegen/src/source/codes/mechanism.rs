//! Codes of the mechanism: what the joints connect and which loops they close.

codes! {
    SAME_BODY "same-body"
        "A joint or a torsion spring connects a body with itself."
        "Name two different bodies.";
    BOTH_FIXED "both-fixed"
        "A joint or a torsion spring connects two fixed bodies, so it can never turn."
        "Remove it, or `fixed` from one of the bodies.";
    DEAD_JOINT "dead-joint"
        "A joint of a mechanism that was built through the Rust interface connects a body with \
         itself or two fixed bodies."
        "Remove the joint, or name two bodies between which it can turn."
        no example "a file with this mistake is refused as `same-body` or `both-fixed`";
    OUT_OF_REACH "out-of-reach"
        "No chain of joints connects a body with the ground or with a free body."
        "Add a joint to a body that is connected, or make the body `fixed: true` or `free: true`.";
    HELD_BODY "held-body"
        "A chain of joints connects a free body with the ground or with another free body. Such a body is \
         not free: its joints say how it moves."
        "Leave out its `free: true`, or remove a joint.";
    TOO_MANY_HINGES "too-many-hinges"
        "The model has more hinges than lamc compiles by default: memory and time grow as the \
         square of their number."
        "Raise the limit with `--max-hinges NUMBER`, or in a build script with \
         `Config::max_hinges`."
        no example "the model would have more than 2000 joints";
    NO_LOOP "no-loop"
        "The option `--cut` names a joint that is not part of a loop. Without this joint, a body \
         would not be connected with the ground."
        "Name joints that are part of a loop, one for each loop."
        no example "it depends on the command line";
    ROUNDED "rounded"
        "Hinge lines were moved, by no more than the rounding of the drawing, to be exactly parallel, \
         concurrent or in line. See [DRAWINGS.md](DRAWINGS.md)."
        "Nothing needs to be done. `tolerance: 0` takes the lines as they are drawn.";
    NEAR_MISS "near-miss"
        "The hinge lines of a loop are almost, but not exactly, parallel, concurrent or in line. \
         The loop is compiled as a spatial one and may be rigid. See [DRAWINGS.md](DRAWINGS.md)."
        "Correct the coordinates of the line that the message names. If the deviation is only \
         rounding, give the rounding error as `tolerance`.";
    IMMOBILE "immobile"
        "A loop, or loops that share hinges, or single hinges of a loop cannot move. The model is compiled \
         nevertheless. Where the hinges of such a loop lie in one plane, where creases end at a straight edge of \
         a plate, or where the plates of a ring are shaky in every state (some rings of eight around a hole of a folded \
         sheet), the equations allow small motions that do not exist, and commands that compute motions refuse the \
         model."
        "Check the hinge lines. A planar or spherical loop needs four hinges to move, any other seven. \
         Remove a joint, or split a body by another hinge. To keep a rigid loop or hinge, hold one of its hinges \
         with `drive: 0`. A shaky ring needs a hinge less or more, or other proportions.";
    FLAT_HINGES "flat-hinges"
        "The drawing is flat and says nothing of the folded state. A sheet of many hinges has many motions from there; the \
         one that was found does not turn all hinges."
        "Give each hinge its `fold`, of which the sign says mountain or valley, or a guess of its angles in `initial`.";
    OVERDRIVEN "overdriven"
        "More joints have a `drive` than the mechanism has degrees of freedom. Unless their \
         angles agree with the loops at all times, no motion is possible."
        "Remove a `drive`.";
}
