//! Codes of numbers, units and formulas.

codes! {
    NOT_A_NUMBER "not-a-number"
        "The key takes a number, with or without a unit, and the text is not a number. A formula \
         is not allowed there."
        "Write a number, such as `0.5` or `20 mm`. Write `180 deg`, not `pi`.";
    NOT_FINITE "not-finite"
        "A number or a part of a formula is infinite or has no value, such as `1/0`, `log(-1)` or a \
         number that is too large for a double."
        "Correct the number or the argument of the function. [MODEL.md](MODEL.md#formulas) lists \
         the domains of all functions.";
    BAD_UNIT "bad-unit"
        "A unit cannot be read, or `units` names something that is not a unit of length or of angle."
        "A unit is a product of powers, such as `mN*m/rad` or `g*mm^2`. `units` takes one name, such as \
         `mm` or `deg`.";
    UNKNOWN_UNIT "unknown-unit"
        "The name after a number is not a unit. A product of a number and a parameter needs its `*`."
        "Take a unit from [SCHEMA.md](SCHEMA.md#units-of-quantities), or write the product with `*`.";
    WRONG_DIMENSION "wrong-dimension"
        "A number has a unit of the wrong quantity for its key. Angle is a dimension of its own: \
         `N*m` is a torque and `N*m/rad` is a stiffness. A parameter with a unit can only be \
         used for the same quantity."
        "Use a unit of the quantity that is expected.";
    MANY_TURNS "many-turns"
        "An angle in radians is more than a full turn. Perhaps it was meant in degrees. The \
         model is compiled nevertheless."
        "Write `30 deg`, in a formula `30*pi/180`, or set `units: { angle: deg }` for angles \
         without a unit.";
    BAD_TOLERANCE "bad-tolerance"
        "The `tolerance` is negative, or more than a hundredth of the drawing's size."
        "Give the rounding error of the coordinates of hinge lines, which is a small length. 0 \
         uses the coordinates as they are.";
    EMPTY_RANGE "empty-range"
        "The `range` of a parameter has no values: its smallest value is not less than its largest one."
        "Give the smallest value first, then the largest.";
    NOT_PARAMETRIC "not-parametric"
        "A number of the drawing depends on a parameter, and something needs it to be constant: the air, the \
         outline of a contact's plane, the `tolerance` of hinge lines, a `pattern`, or corners of plates with several formulas."
        "Give the number itself, or remove what needs it.";
    CHANGED_STRUCTURE "changed-structure"
        "The drawing depends on parameters, and for some of their values it is impossible, or its loops are of \
         another kind than by default."
        "Make the `range` of the parameter smaller, or correct the formulas of the drawing.";
    OUTSIDE_RANGE "outside-range"
        "The value of a parameter is not in its `range`."
        "Widen the range, or choose another value.";
    BAD_EXPRESSION "bad-expression"
        "A formula has a syntax error: an operator, an operand or a parenthesis is missing, or \
         it contains a unit."
        "Correct it at the marked position. Products need `*`, powers are written `^`, and \
         numbers in formulas are in SI units and radians, without a unit.";
    NESTED_FORMULA "nested-formula"
        "A formula has more than 64 parentheses, calls, signs, powers and right operands nested in each other."
        "Write the formula with less nesting. A long sum needs no parentheses.";
    TOO_LONG "too-long"
        "A formula has more than 100,000 numbers and names."
        "Divide the formula, or use a function with fewer terms."
        no example "the formula would be too long for an example";
    UNKNOWN_NAME "unknown-name"
        "A formula has a name that is not a parameter, an input, `t` or `pi`."
        "Declare the parameter or the input, or correct the name. The angle of a joint is `q.<joint>`, \
         its speed `u.<joint>`.";
    UNKNOWN_FUNCTION "unknown-function"
        "A formula calls a function that does not exist, or a product of a name and a \
         parenthesis lacks its `*`."
        "Take a function from [MODEL.md](MODEL.md#formulas), or write the product with `*`.";
    WRONG_ARGUMENTS "wrong-arguments"
        "A function is called with more or fewer arguments than it takes."
        "`atan2`, `min` and `max` take two arguments, all other functions take one.";
    NOT_HERE "not-here"
        "A formula depends on `q` or `u` where it may depend only on time, parameters and inputs, or a number of the \
         drawing on something other than parameters."
        "Put formulas that depend on the motion into `torque` or into the components of a force.";
    DIVISION_BY_ZERO "division-by-zero"
        "A formula divides by something that is always zero, such as `1/(t - t)`."
        "Correct the divisor.";
}
