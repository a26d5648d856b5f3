//! Codes of patterns: drawings whose facets become bodies.

codes! {
    NO_DRAWINGS "no-drawings"
        "The model has a `pattern`, but this program was built without the readers of drawings. The command \
         `lamc` has them. A build script has them only if it asks for them, because most models have no \
         drawing."
        "Enable the feature `drawings`: `lamc = { version = \"0.1\", features = [\"drawings\"] }` under \
         `[build-dependencies]`. Or write the bodies and joints into the model with `lamc import`."
        no example "it depends on how the program was built";
    UNREADABLE_DRAWING "unreadable-drawing"
        "The file of a `pattern` cannot be read: it does not exist, it is larger than 64 MiB, or the operating \
         system refuses."
        "Correct the path, which is relative to the folder of the model.";
    NO_SCALE "no-scale"
        "The drawing does not say how long its unit is, and the model does not say it either."
        "Give the length of one unit of the drawing as `scale`, such as `scale: 1 mm`.";
    DRAWING_SYNTAX "drawing-syntax"
        "A drawing does not follow the syntax of its format, or it is in a format that lamc does not read."
        "Save it again as SVG, FOLD or DXF.";
    DRAWING_NUMBER "drawing-number"
        "A coordinate or an angle of a drawing is not a finite number, or it is too large."
        "Correct the number.";
    DRAWING_LIMIT "drawing-limit"
        "A drawing is larger than lamc reads, or it is nested too deeply."
        "Divide the drawing, or save it without nested groups."
        no example "the drawing would be too long";
    EMPTY_DRAWING "empty-drawing"
        "A drawing has no line that belongs to a pattern."
        "Check the colours and layers of the lines. [PATTERNS.md](PATTERNS.md) lists what they mean.";
    OPEN_OUTLINE "open-outline"
        "The outline of the sheet has a gap, so nothing encloses the facets beside it."
        "Close the gap. If it is only rounding, give a larger `tolerance`.";
    CONTRADICTION "contradiction"
        "Two lines of a drawing, or two parts of its file, contradict each other: a mountain and a valley on \
         the same place, a fold angle with the sign of the other assignment, or faces that do not fit the edges."
        "Remove one of the two.";
    DANGLING_LINE "dangling-line"
        "A line of a drawing is no edge of a facet: it ends within one, or it is outside of the sheet."
        "Draw the line to the next line, or remove it.";
    CREASED_RIM "creased-rim"
        "A crease is at the edge of the sheet, so it has a facet on one side only and folds nothing."
        "Draw the edge of the sheet in the colour or on the layer of borders.";
    THIN_FACET "thin-facet"
        "A facet of a drawing is thinner than the tolerance. Often two lines were meant to be one."
        "Move the lines onto each other, or give a smaller `tolerance`.";
    MENDED "mended"
        "A small mistake of the drawing was mended: ends that nearly met, lines drawn twice, crossings \
         without a vertex. Nothing was moved by more than the tolerance."
        "Nothing needs to be done. Check the points if they are not what you meant.";
    IGNORED "ignored"
        "The drawing has something that is not a line of a pattern, such as text or a picture."
        "Nothing needs to be done. If it should be a line, convert it into a path.";
    NO_GROUND "no-ground"
        "No facet of the pattern is around the point that `ground` gives, or the pattern has no facet at all."
        "Give a point within a facet, in units of the drawing with y upwards, or write `ground: largest`.";
    LOOSE_PIECE "loose-piece"
        "No chain of creases connects a piece of the sheet with the ground, so nothing would hold it. The \
         piece is left out."
        "Nothing needs to be done if it is scrap. Otherwise connect it: draw a crease, or add a joint.";
    NO_CREASE "no-crease"
        "The pattern has no crease between two facets, so nothing can fold."
        "Draw creases that divide the sheet, in the colours or layers of mountains and valleys.";
    LOCKED_FACETS "locked-facets"
        "Two facets have creases in common that are not on one line. They cannot move against each other."
        "Nothing needs to be done if this is meant. Otherwise cut one of the creases, or divide one of the \
         facets.";
    MIXED_CREASE "mixed-crease"
        "Pieces of one crease, between the same two facets, have different angles of the finished fold. The \
         angle of the longest piece is taken."
        "Give all pieces the same colour.";
    WIDE_CREASE "wide-crease"
        "The creases are so wide that nothing of a facet is left in the layers that are not flexible."
        "Give a smaller `width`, or make the facet larger.";
    FOLD_SIGN "fold-sign"
        "The angle of the finished fold of mountains is not from -180 to 0 deg, or that of valleys not from 0 to \
         180 deg."
        "Write a mountain's angle with a minus sign, and a valley's without.";
    UNUSED_FOLD "unused-fold"
        "The `fold` of a pattern gives an angle of the finished fold, but the drawing itself gives one to each of \
         its creases. In SVG this is the opacity, over 180 deg. An opacity of 1 that is written is an angle too."
        "Remove the `fold`, or remove the angles from the drawing. Inkscape writes `stroke-opacity:1`.";
    UNUSED_LAYERS "unused-layers"
        "Layers are named to say what lines mean, but the drawing is no DXF file. In SVG a line's colour says what \
         it means, in FOLD its assignment."
        "Remove the `layers`, or save the drawing as DXF.";
    NO_CREASE_WIDTH "no-crease-width"
        "A model of the hinges of a pattern needs the length of the part that bends, and the `crease` has no \
         `width`."
        "Give the `width` of the gap between the plates, such as `width: 1 mm`.";
    NO_CREASE_MATERIAL "no-crease-material"
        "The hinges of a pattern are beams, but their `material` is not given, or it is not in the layup."
        "Name the flexible material of the layup, as in `hinge: { model: beam, material: film }`.";
}
