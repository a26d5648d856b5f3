//! Codes of files that popupCAD and foldable_robotics have written.

codes! {
    NO_MODEL "no-model"
        "The file is a list or another value that is neither a model nor a `DynamicsInfo` of \
         foldable_robotics."
        "Write a mapping with at least `bodies` and `joints`.";
    OTHER_OBJECT "other-object"
        "The file holds objects of a Python program that lamc cannot read, such as the design of popupCAD \
         itself, or objects at a place where lamc expects others."
        "Export the design with `DynamicsInfo` of foldable_robotics, or describe the mechanism in a model \
         file.";
    BAD_POLYGON "bad-polygon"
        "A layer of a popupCAD file does not hold polygons: as well-known text, or in older exports as \
         objects `GenericPoly`."
        "Export the design again. A layer holds `POLYGON ((x y, ..))` or `MULTIPOLYGON`.";
}
