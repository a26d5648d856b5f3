//! Codes of values that are physically impossible or unusual: masses, springs, angles.

codes! {
    NOT_POSITIVE "not-positive"
        "A density, thickness, modulus, mass, size of a hinge, speed of friction, or a torque constant, resistance, \
         gear or limit of a motor is zero or negative."
        "Give a number greater than zero.";
    NO_MASS "no-mass"
        "A body moves but has no mass."
        "Give it an `outline`, `layers` with plates, `point_masses`, or `mass`, `com` and `inertia`.";
    SINGULAR_INERTIA "singular-inertia"
        "The moment of inertia about a joint is zero: all mass that turns lies on the hinge \
         line."
        "Give the body an `outline`, or add mass away from the hinge line.";
    ASYMMETRIC_INERTIA "asymmetric-inertia"
        "The matrix of a body's inertia is not symmetric."
        "Write it with xy = yx, xz = zx and yz = zy.";
    INERTIA_NOT_POSITIVE "inertia-not-positive"
        "The inertia has a negative principal moment, which no distribution of mass can have."
        "Check the signs: products of inertia have a minus sign, xy = -sum(m x y), and moments are about \
         the centre of mass.";
    INERTIA_TRIANGLE "inertia-triangle"
        "The largest principal moment of inertia exceeds the sum of the two others, which no rigid body \
         can have."
        "Check the numbers, and check that the moments are about the centre of mass.";
    NEGATIVE_DAMPING "negative-damping"
        "The damping of a joint is negative, so the joint would add energy to the motion."
        "Give a damping of zero or more.";
    NEGATIVE_STIFFNESS "negative-stiffness"
        "The stiffness of a joint is negative, so its spring pushes away from the rest angle. \
         The model is compiled nevertheless."
        "Correct the sign, unless the hinge is bistable.";
    NEGATIVE_FRICTION "negative-friction"
        "The torque of a joint's friction is negative or not finite."
        "Give the magnitude: friction acts against the motion.";
    NEGATIVE_DRAG "negative-drag"
        "The density of the air or the drag coefficient is negative or not finite."
        "Give a number of zero or more.";
    NO_MODULUS "no-modulus"
        "A hinge bends as a `beam`, but its material has no `youngs_modulus`."
        "Add the modulus to the material, as in `youngs_modulus: 4.4 GPa`.";
    NO_WIDTH "no-width"
        "The `gaps` of a `beam` hinge are negative or are as large as its width."
        "Give the part of the width that is cut out. It must be less than the width.";
    OUTSIDE_MODEL "outside-model"
        "A hinge has a size for which its model gives an impossible stiffness or damping, such \
         as a negative one."
        "Use a size within the bounds of the model ([HINGES.md](HINGES.md#models)), or give \
         `stiffness` and `damping` directly.";
    OUTSIDE_SPECIMENS "outside-specimens"
        "A hinge lies outside of the convex hull of the specimens that its model was fitted to. \
         The polynomials are not reliable there. The model is compiled nevertheless."
        "Use a size within the specimens, or measure more of them.";
    EMPTY_LIMITS "empty-limits"
        "The first of a joint's `limits` is not less than the second, so no angle is allowed."
        "Write the lower limit first.";
    INITIAL_OUTSIDE_LIMITS "initial-outside-limits"
        "The initial angle of a joint is outside of its `limits`."
        "Change the angle or the limits.";
    FOLD_ANGLE "fold-angle"
        "The `fold` of a joint, the angle of the finished fold, is more than half a turn."
        "Give an angle from -180 deg (a mountain) to 180 deg (a valley).";
    FOLD_SHARE "fold-share"
        "The `fold` of the initial state is less than nothing or more than the finished fold."
        "Give a share from 0 to 100 %: `30%`, which is the same as `0.3`.";
    NO_FOLD "no-fold"
        "The initial state is given as a share of the finished fold, or `lamc fold` is called, but no \
         joint has a `fold`."
        "Give the joints that fold their angle, as in `fold: -180 deg` for a mountain.";
    DRIVEN_OUTSIDE_LIMITS "driven-outside-limits"
        "The constant angle that a joint is driven to is outside of its `limits`."
        "Change the angle or the limits.";
}
