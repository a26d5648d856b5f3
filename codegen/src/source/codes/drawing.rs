//! Codes of the drawing: outlines, hinge lines, sizes.

codes! {
    SHORT_OUTLINE "short-outline"
        "An outline or a hole has fewer than three different vertices."
        "Add vertices.";
    TOO_MANY_VERTICES "too-many-vertices"
        "An outline or a hole has more than 10,000 vertices."
        "Draw curves with fewer vertices. A circle with a hundred vertices encloses 0.07 % less than its area."
        no example "the outline would have more than 10,000 vertices";
    TOO_MANY_LAYERS "too-many-layers"
        "The layup has more than 64 layers."
        "Combine layers of the same material into one with the sum of their thicknesses.";
    REPEATED_VERTEX "repeated-vertex"
        "An outline lists the same vertex twice in a row, or a slit begins where it ends."
        "Remove one of the two. Only the first vertex of an outline may be repeated, at the end.";
    ZERO_AREA "zero-area"
        "All vertices of an outline or hole are on one line, so it encloses nothing."
        "Correct the vertices.";
    SELF_CROSSING_OUTLINE "self-crossing-outline"
        "The outline of a plate crosses itself, touches itself, or passes twice through a vertex."
        "Give the vertices in order, once around. Draw parts that touch in one point as two plates.";
    SELF_CROSSING_HOLE "self-crossing-hole"
        "The outline of a hole crosses itself."
        "Give the vertices in order, once around.";
    HOLE_OUTSIDE "hole-outside"
        "A hole is not completely within the outline of its plate."
        "Move the hole. A cut-out at the edge belongs to the outline itself.";
    OVERLAPPING_HOLES "overlapping-holes"
        "Two holes of a plate overlap, so the area that both cut out would be subtracted twice."
        "Draw both as one hole.";
    OVERLAPPING_PLATES "overlapping-plates"
        "Two plates of one body overlap in a layer. The overlapping area counts twice in the \
         mass. At most 20 pairs of a layer are reported. The model is compiled nevertheless."
        "Cut one of them back, or draw both as one outline.";
    OVERLAPPING_BODIES "overlapping-bodies"
        "Plates of two bodies overlap in a layer, although the material of a sheet can belong to \
         one body only. Overlaps that are less deep than 0.2 % of the diagonal of the smaller \
         plate count as rounding, and plates within a hole do not overlap. All fixed bodies \
         count as one body. At most 20 pairs are reported. The model is compiled nevertheless."
        "Cut one of the plates back.";
    ZERO_AXIS "zero-axis"
        "The two points of a hinge line are the same, so the line has no direction."
        "Give two different points on the line.";
    FAR_HINGE "far-hinge"
        "A hinge line is farther from the plates of both its bodies than 5 % of the mechanism's \
         size, which is the diagonal of the whole drawing. A fixed body without plates is \
         ignored, and nothing is reported if a moving body has no plates. The model is compiled \
         nevertheless."
        "Check the points of the joint's `axis`, its height `z`, and their units.";
    OUT_OF_SCALE "out-of-scale"
        "The mechanism is smaller than a nanometre or larger than a million kilometres, or a body's mass \
         properties are too large for a double."
        "Check the units of lengths and masses.";
}
