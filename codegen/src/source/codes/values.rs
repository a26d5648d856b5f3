//! Codes of numbers, units and formulas.

codes! {
    NOT_A_NUMBER "not-a-number"
        "The key takes a number, with or without a unit, and the text is none. A formula cannot stand \
         there."
        "Write a number, such as `0.5` or `20 mm`. Angles in degrees are written `180 deg`, not `pi`.";
    NOT_FINITE "not-finite"
        "A number or a part of a formula is infinite or has no value, such as `1/0`, `log(-1)` or a \
         number that is too large for a double."
        "Correct the number or the argument of the function. [MODEL.md](MODEL.md#formulas) lists where \
         functions are defined.";
    BAD_UNIT "bad-unit"
        "A unit cannot be read, or `units` names something that is not a unit of length or of angle."
        "A unit is a product of powers, such as `mN*m/rad` or `g*mm^2`. `units` takes one name, such as \
         `mm` or `deg`.";
    UNKNOWN_UNIT "unknown-unit"
        "The name after a number is not a unit. A product of a number and a parameter needs its `*`."
        "Take a unit from [SCHEMA.md](SCHEMA.md#units-of-quantities), or write the product with `*`.";
    WRONG_DIMENSION "wrong-dimension"
        "A number has a unit of another quantity than the key takes. Angle is a dimension of its own: \
         `N*m` is a torque and `N*m/rad` is a stiffness. A parameter with a unit can only stand for its \
         own quantity."
        "Use a unit of the quantity that is expected.";
    MANY_TURNS "many-turns"
        "An angle in radians is more than a full turn. It may have been meant in degrees. The model is \
         compiled all the same."
        "Write `30 deg`, in a formula `30*pi/180`, or set `units: { angle: deg }` for bare angles.";
    BAD_TOLERANCE "bad-tolerance"
        "The `tolerance` is negative, or more than a hundredth of the drawing's size."
        "Give the rounding error of the coordinates of hinge lines, which is a small length. 0 takes the \
         coordinates as they are.";
    BAD_EXPRESSION "bad-expression"
        "A formula does not follow the rules: an operator, an operand or a parenthesis is missing, or a \
         unit stands within it."
        "Correct it at the place that is marked. Products need `*`, powers are written `^`, and formulas \
         are in SI units and radians without units.";
    TOO_LONG "too-long"
        "A formula has more than 100,000 numbers and names."
        "Divide the formula, or use a function of fewer terms."
        no example "the formula would fill pages";
    UNKNOWN_NAME "unknown-name"
        "A formula has a name that is not a parameter, an input, `t` or `pi`."
        "Declare the parameter or the input, or correct the name. The angle of a joint is `q.<joint>`, \
         its speed `u.<joint>`.";
    UNKNOWN_FUNCTION "unknown-function"
        "A formula calls a function that does not exist, or multiplies a name by a parenthesis without \
         `*`."
        "Take a function from [MODEL.md](MODEL.md#formulas), or write the product with `*`.";
    WRONG_ARGUMENTS "wrong-arguments"
        "A function is called with more or fewer arguments than it takes."
        "`atan2`, `min` and `max` take two arguments, all other functions take one.";
    NOT_HERE "not-here"
        "A formula depends on `q` or `u` where it may depend only on time, parameters and inputs."
        "Put laws of the motion into `torque` or into the components of a force.";
    DIVISION_BY_ZERO "division-by-zero"
        "A formula divides by something that is zero for every motion and every parameter, such as \
         `1/(t - t)`."
        "Correct the divisor.";
}
