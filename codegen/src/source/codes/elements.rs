//! Codes of springs, tendons and motors.

codes! {
    SAME_POINT "same-point"
        "A spring or a tendon runs from a point to the same point."
        "Name another point.";
    ONE_BODY "one-body"
        "All points of a spring or a tendon are on the same body or on the ground, so its length never changes \
         and it moves nothing."
        "Name points on at least two bodies, of which one is not fixed.";
    FEW_POINTS "few-points"
        "A tendon has fewer than two points."
        "Name the points from one end of the tendon to the other.";
    TWO_TENSIONS "two-tensions"
        "A tendon has both a given `tension` and the keys of an elastic one: `stiffness`, `damping` or `rest_length`."
        "Keep the `tension`, or the others.";
    NEGATIVE_ELEMENT "negative-element"
        "The stiffness, the damping or the rest length of a spring or a tendon, the tension of a tendon or the \
         inertia of a motor is negative or not finite."
        "Give a number of zero or more. What pushes is a spring that is shorter than its `rest_length`.";
    SECOND_MOTOR "second-motor"
        "Two motors turn the same joint."
        "Remove one of the motors.";
    DRIVEN_MOTOR "driven-motor"
        "A motor turns a joint whose angle is prescribed by `drive`. The motor would not change the motion."
        "Remove the motor or the `drive`. The torque that a prescribed motion needs is computed.";
}
