//! Codes of files that popupCAD and foldable_robotics have written.

codes! {
    NO_MODEL "no-model"
        "The file is a list or another value that is neither a model nor a `DynamicsInfo` of \
         foldable_robotics."
        "Write a mapping with at least `bodies` and `joints`.";
    OLD_EXPORT "old-export"
        "The file is an older export of popupCAD, in which the data have no names. lamc cannot \
         read it."
        "Export the design with `DynamicsInfo` of foldable_robotics, or describe the mechanism in a model \
         file.";
    OTHER_OBJECT "other-object"
        "The file is an object of a Python program that lamc cannot read, such as the design of popupCAD \
         itself."
        "Export the design with `DynamicsInfo` of foldable_robotics, or describe the mechanism in a model \
         file.";
    BAD_POLYGON "bad-polygon"
        "A layer of a popupCAD file does not hold a polygon as well-known text."
        "Export the design again. A layer holds `POLYGON ((x y, ..))` or `MULTIPOLYGON`.";
}
