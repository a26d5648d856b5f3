//! Codes of contacts between points and planes.

codes! {
    ZERO_NORMAL "zero-normal"
        "The normal of a contact's plane has no length, so the plane has no direction."
        "Give the direction in which the plane pushes, as in `normal: [0, 0, 1]`.";
    BODIES_OF_POINTS "bodies-of-points"
        "A contact has both `bodies` and a list of `points`, which belong to bodies already."
        "Remove `bodies`, or write `points: corners`.";
    OWN_PLANE "own-plane"
        "A contact's plane is fixed to the body of one of its points, or both are part of the ground: the \
         distance between them never changes."
        "Name points or bodies that move relative to the plane.";
    NO_CONTACT_POINTS "no-contact-points"
        "Nothing can touch the plane of a contact: its bodies have no plates, and so no corners."
        "Give the bodies an `outline` or `layers`, or name output points, as in `points: [tip]`.";
    TOUCHES_TWICE "touches-twice"
        "Two contacts push the same point away from the same plane, each with its own law."
        "Remove the point from one of them.";
    NO_CONTACT_SCALE "no-contact-scale"
        "A contact has no `stiffness`, and the default needs the weight of the bodies and the thickness of \
         the layup: there is no constant gravity, or no `layup`."
        "Give the `stiffness`, as in `stiffness: 2000 N/m`.";
    NEGATIVE_CONTACT "negative-contact"
        "The stiffness of a contact is zero or negative, or its dissipation or friction is negative or not \
         finite: it would pull, or add energy."
        "Give a stiffness greater than zero, and a dissipation and a friction of zero or more.";
    NO_OUTLINE "no-outline"
        "The plane of a contact ends at the outline of a body's plate, but the plane is not parallel to the \
         sheet, or the body is not one plate with a convex outline that is the same in every layer."
        "Give the plane a normal along z and a body with a convex outline without holes. Split other plates \
         into convex bodies that a joint with `drive: 0` holds, or leave out `within`.";
}
