//! How much of a file is read at most. Files of any origin are read, so each limit has a reason: a file must
//! not take more than 2 s and 512 MB before it is refused.

/// Bytes of a file. A line of a drawing takes about 100 bytes, so this is more than [`STROKES`] in most files.
pub(crate) const BYTES: usize = 64 << 20;

/// Straight lines after curves are flattened: ten times what a drawing by hand or by a script has,
/// and 100 MB as [`Stroke`](crate::Stroke).
pub(crate) const STROKES: usize = 1_000_000;

/// Opening tags of an SVG file, and half of all `<`, for each of which the XML reader sets 72 bytes aside.
pub(crate) const TAGS: usize = 500_000;

/// Equal signs of an SVG file. The XML reader sets 72 bytes aside for each, as if it were an attribute.
pub(crate) const EQUAL_SIGNS: usize = 2_000_000;

/// Attributes of one tag: the XML reader compares each with all others.
pub(crate) const ATTRIBUTES_OF_A_TAG: usize = 200;

/// Prefixes of XML namespaces. The XML reader copies them for each element that declares one.
pub(crate) const PREFIXES: usize = 100;

/// Bytes that entities of an XML file add to its text: Illustrator's are shorter than a thousand bytes.
pub(crate) const EXPANSION: usize = 4 << 20;

/// Groups, clones or blocks inside each other. Drawings of today's programs have at most some twenty.
pub(crate) const DEPTH: usize = 200;

/// Characters of attributes that are read, clones again for each use: twice [`BYTES`].
pub(crate) const WORK: usize = 128 << 20;

/// Bytes of all style sheets of a file.
pub(crate) const STYLES: usize = 2 << 20;

/// Work for one element, counted as for [`WORK`]: a million elements, clones again for each use.
pub(crate) const WORK_OF_AN_ELEMENT: usize = 128;

/// How much more the characters of a clone count: a small file must not cost as much as the largest.
pub(crate) const WORK_OF_A_CLONE: usize = 2;

/// Work for one rule that is tried on one element, counted as for [`WORK`].
pub(crate) const WORK_OF_A_RULE: usize = 32;

/// Rules of all style sheets of a file.
pub(crate) const RULES: usize = 20_000;

/// Magnitude of a coordinate, in units of the drawing: 1000 km in millimetres. From here on an `f64` resolves
/// no more than a ten-millionth of the unit, so that the tolerances of the graph lose their meaning.
pub(crate) const COORDINATE: f64 = 1e9;

/// Faults that are reported together.
pub(crate) const FAULTS: usize = 20;

/// Kinds of things that are listed as ignored; the rest is counted as `others`.
pub(crate) const KINDS: usize = 100;

/// Degree of a spline. CAD programs write at most 25.
pub(crate) const DEGREE: usize = 25;

/// Groups of one record of a DXF file: a polyline with a vertex per group, twice [`STROKES`] at 48 bytes.
pub(crate) const PAIRS_OF_A_RECORD: usize = 2_000_000;

/// Entities and vertices of a DXF file that are drawn, those of a block again for each INSERT, and steps of
/// splines: four times [`STROKES`].
pub(crate) const WORK_OF_BLOCKS: usize = 4_000_000;
