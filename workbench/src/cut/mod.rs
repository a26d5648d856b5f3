//! What a laser cutter needs of a model: outlines and holes of each layer of the layup.
//!
//! ```text
//! plates of a layer -> union across hinges, slits elsewhere -> kerf -> outlines, holes, lines
//! ```
//!
//! All bodies are in the flat state, as drawn. In the layer that bridges a hinge, the plates on both sides
//! are one piece: so a film stays whole. Other common edges of two bodies are cut: they are slits, as are those
//! within a body. All lengths in this module are in millimetres.

mod edges;
mod kerf;
mod perforation;
mod pieces;
mod registration;
mod sheets;
mod svg;
#[cfg(test)]
mod tests;

use geo::{BoundingRect, Coord, MultiPolygon, Rect};

use lamc::source::SourceModel;

use edges::{Hinge, Joint};
use sheets::Sheet;

pub use perforation::Perforation;
pub use registration::Hole;
pub use svg::svg;

/// Millimetres in a metre.
const MM: f64 = 1e3;
/// The empty strip around everything on a sheet, mm.
const MARGIN: f64 = 5.0;

/// A closed line, mm; the last vertex is joined to the first.
pub type Ring = Vec<[f64; 2]>;
/// A straight line between two points, mm.
pub type Line = [[f64; 2]; 2];

/// How to cut.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Width of what the laser removes, mm: outlines grow by half of it, holes shrink.
    pub kerf: f64,
    /// Widest gap at a hinge that is closed, mm; None: rounding errors of the drawing only.
    pub bridge: Option<f64>,
    /// The material of the layers that bridge hinges; None: the layer with the narrowest gap.
    pub film: Option<String>,
    /// Cuts along the hinge lines of the layers that bridge them.
    pub perforation: Option<Perforation>,
    /// Diameter of registration holes at the corners of a frame around all parts, mm.
    pub registration: Option<f64>,
}

/// All layers of a model on sheets of one size.
#[derive(Clone, Debug)]
pub struct Cut {
    /// The lower left corner of every sheet, mm, in the coordinates of the model.
    pub corner: [f64; 2],
    /// Width and height of every sheet, mm.
    pub size: [f64; 2],
    /// The layers that have plates, from the bottom to the top.
    pub layers: Vec<Layer>,
    /// The registration holes of every sheet.
    pub registration: Vec<Hole>,
    /// The layers without plates: their numbers, from 1.
    pub empty: Vec<usize>,
    /// The joints that no layer bridges: their two bodies come apart.
    pub loose: Vec<Loose>,
}

/// What is cut of one layer, mm, in the coordinates of the model.
#[derive(Clone, Debug)]
pub struct Layer {
    /// Its number in the layup, from 1 at the bottom.
    pub number: usize,
    /// The name of its material.
    pub material: String,
    /// The pieces: an outline (counterclockwise) and its holes (clockwise).
    pub pieces: Vec<Piece>,
    /// Cuts without width: between bodies that touch and have no hinge there, and within bodies.
    pub slits: Vec<Line>,
    /// Cuts along hinge lines.
    pub perforation: Vec<Line>,
}

/// A connected piece of a layer.
#[derive(Clone, Debug, PartialEq)]
pub struct Piece {
    /// Its outer boundary, counterclockwise.
    pub outline: Ring,
    /// The boundaries of its holes, clockwise.
    pub holes: Vec<Ring>,
}

/// A joint that no layer bridges.
#[derive(Clone, Debug, PartialEq)]
pub struct Loose {
    /// Its name.
    pub joint: String,
    /// The narrowest gap at it and the number of the layer with this gap; None if no layer has edges of
    /// both bodies along the hinge line.
    pub gap: Option<(f64, usize)>,
}

/// Why a model cannot be cut.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CutError {
    /// No body has plates.
    #[error("the model has no plates: nothing to cut (bodies given by their mass have no outline)")]
    NoPlates,
    /// No layer is of the material that should bridge the hinges.
    #[error("no layer of the layup is of the material `{0}`")]
    UnknownFilm(String),
    /// The kerf is as large as a piece.
    #[error(
        "the kerf of {kerf} mm is larger than a piece of layer {layer}, which is {width:.3} mm wide at \
         ({x:.3}, {y:.3}) mm"
    )]
    KerfOfPiece {
        /// The kerf, mm.
        kerf: f64,
        /// The number of the layer.
        layer: usize,
        /// The smaller side of the piece's bounding box, mm.
        width: f64,
        /// Where the piece is, mm.
        x: f64,
        /// Where the piece is, mm.
        y: f64,
    },
    /// A hole is so narrow that the laser would make it wider than drawn.
    #[error(
        "the hole of layer {layer} at ({x:.3}, {y:.3}) mm is narrower than the kerf of {kerf} mm: the \
         laser would make it wider"
    )]
    KerfOfHole {
        /// The kerf, mm.
        kerf: f64,
        /// The number of the layer.
        layer: usize,
        /// Where the hole is, mm.
        x: f64,
        /// Where the hole is, mm.
        y: f64,
    },
    /// Two pieces are so close that one cut would go through the other.
    #[error(
        "pieces of layer {layer} at ({x:.3}, {y:.3}) mm are closer to each other than the kerf of {kerf} \
         mm: the laser would cut into them"
    )]
    KerfOfGap {
        /// The kerf, mm.
        kerf: f64,
        /// The number of the layer.
        layer: usize,
        /// Where one of the pieces is, mm.
        x: f64,
        /// Where one of the pieces is, mm.
        y: f64,
    },
    /// The laser makes a cut of the perforation longer than asked for.
    #[error("the cuts of the perforation, {cut} mm, must be longer than the kerf, {kerf} mm")]
    KerfOfPerforation {
        /// The kerf, mm.
        kerf: f64,
        /// The length of each cut, mm.
        cut: f64,
    },
    /// The laser makes a registration hole larger than asked for.
    #[error("the registration holes, {diameter} mm, must be larger than the kerf, {kerf} mm")]
    KerfOfRegistration {
        /// The kerf, mm.
        kerf: f64,
        /// The diameter, mm.
        diameter: f64,
    },
}

/// Finds what is to be cut of each layer.
///
/// # Errors
/// Those of [`CutError`].
pub fn cut(model: &SourceModel, options: &Options) -> Result<Cut, CutError> {
    let kerf = options.kerf;
    if let Some(Perforation { cut, .. }) =
        options.perforation.filter(|perforation| perforation.cut <= kerf)
    {
        return Err(CutError::KerfOfPerforation { kerf, cut });
    }
    if let Some(diameter) = options.registration.filter(|diameter| *diameter <= kerf) {
        return Err(CutError::KerfOfRegistration { kerf, diameter });
    }
    if let Some(film) = options
        .film
        .as_ref()
        .filter(|film| !model.layup.iter().any(|m| model.materials[*m].name.value == **film))
    {
        return Err(CutError::UnknownFilm(film.clone()));
    }
    let joints = edges::joints(model);
    let exact = edges::ROUNDED * model.tolerance * MM;
    let reach = options.bridge.map_or(exact, |bridge| bridge.max(exact));
    let (mut sheets, empty) = sheets::sheets(model);
    let loose = sheets::bridge(&mut sheets, &joints, reach, options.film.as_deref());
    let mut layers = Vec::with_capacity(sheets.len());
    for sheet in sheets {
        let bridged: Vec<(&Joint, &Hinge)> = (joints.iter().zip(&sheet.hinges))
            .filter_map(|(joint, hinge)| Some((joint, hinge.as_ref()?)))
            .collect();
        let joined = pieces::join(&sheet.plates, &bridged);
        let grown = kerf::grow(&joined, kerf, sheet.number)?;
        let mut slits = sheet.edges.slits(bridged.iter().map(|(joint, _)| *joint), exact);
        slits.extend(pieces::slits(model, sheet.number - 1));
        let perforation = options.perforation.map_or(Vec::new(), |it| it.lines(&bridged, kerf));
        let pieces = grown.into_iter().map(pieces::piece).collect();
        let Sheet { number, material, .. } = sheet;
        layers.push(Layer { number, material, pieces, slits, perforation });
    }
    let Some(parts) = bounds(&layers) else { return Err(CutError::NoPlates) };
    let registration = options
        .registration
        .map_or(Vec::new(), |diameter| registration::holes(parts, diameter, kerf));
    let [corner, size] = sheet(parts, &registration);
    Ok(Cut { corner, size, layers, registration, empty, loose })
}

/// The box around all pieces.
fn bounds(layers: &[Layer]) -> Option<Rect<f64>> {
    let corners = layers.iter().flat_map(|layer| &layer.pieces).flat_map(|piece| &piece.outline);
    let line: geo::LineString<f64> = corners.map(|&[x, y]| Coord { x, y }).collect();
    line.bounding_rect()
}

/// The corner and the size of the sheets: the box around all pieces and registration holes, and a margin.
fn sheet(parts: Rect<f64>, registration: &[Hole]) -> [[f64; 2]; 2] {
    let (mut low, mut high) = ([parts.min().x, parts.min().y], [parts.max().x, parts.max().y]);
    for Hole { center, diameter } in registration {
        for axis in 0..2 {
            low[axis] = low[axis].min(center[axis] - diameter / 2.0);
            high[axis] = high[axis].max(center[axis] + diameter / 2.0);
        }
    }
    let corner = low.map(|low| low - MARGIN);
    [corner, std::array::from_fn(|axis| high[axis] + MARGIN - corner[axis])]
}

impl Layer {
    /// A name for files and for layers of a drawing: number and material.
    pub fn name(&self) -> String {
        let plain = |c: char| if c.is_alphanumeric() || c == '-' { c } else { '_' };
        format!("{}_{}", self.number, self.material.chars().map(plain).collect::<String>())
    }

    /// The area of its pieces, mm^2.
    pub fn area(&self) -> f64 {
        let ring = |ring: &Ring| -> f64 {
            let next = ring.iter().cycle().skip(1);
            ring.iter().zip(next).map(|(a, b)| (a[0] * b[1] - b[0] * a[1]) / 2.0).sum()
        };
        let holes = |piece: &Piece| piece.holes.iter().map(ring).sum::<f64>();
        self.pieces.iter().map(|piece| ring(&piece.outline) + holes(piece)).sum()
    }

    /// The closed lines of its pieces: outlines and holes.
    pub fn rings(&self) -> impl Iterator<Item = &Ring> {
        self.pieces.iter().flat_map(|piece| std::iter::once(&piece.outline).chain(&piece.holes))
    }

    /// The length of all cuts, mm, without registration holes.
    pub fn length(&self) -> f64 {
        let along = |a: &[f64; 2], b: &[f64; 2]| (b[0] - a[0]).hypot(b[1] - a[1]);
        let around = |ring: &Ring| -> f64 {
            ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| along(a, b)).sum()
        };
        let lines = self.slits.iter().chain(&self.perforation).map(|[a, b]| along(a, b));
        self.rings().map(around).sum::<f64>() + lines.sum::<f64>()
    }
}

/// Pieces as geo has them.
type Pieces = MultiPolygon<f64>;
