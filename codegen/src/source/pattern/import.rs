//! `lamc import` of a drawing: a complete model from a pattern alone.
//!
//! A drawing does not say what the sheet is made of. The model says what was assumed in a comment, and
//! why, so that a designer replaces it:
//!
//! - Without a width of the creases, the sheet is card that is creased. The stiffness of a crease per length is
//!   D / L*, with the bending stiffness D = E t^3 / (12 (1 - nu^2)) of the card and the length L*, for which
//!   E. T. Filipov, K. Liu, T. Tachi, M. Schenk, G. H. Paulino: *Bar and hinge models for scalable analysis of
//!   origami*, Int. J. Solids Struct. 124 (2017), give some tens of millimetres for paper.
//! - With a width, the sheet is card, film, card, and the film is what bends: a beam across the gap.

use lamc_drawings::{Drawing, Mark, Pattern, Reading, Role};

use super::bending::POISSON;
use super::build::Stack;
use super::drawn::{Bytes, Drawn, Lines};
use super::sheet::Sheet;
use super::{Crease, CreaseSpring, Ground, Settings};
use crate::source::codes;
use crate::source::diagnostic::{Diagnostic, Diagnostics, Severity, Span, Spanned};
use crate::source::expression::Expression;
use crate::source::model::{Material, SourceModel};
use crate::source::{popupcad, to_yaml};

/// Length of a unit of drawings that do not say it, m.
const UNIT: f64 = 1e-3;
/// Default angles of mountains and valleys: folded flat, rad.
pub(in crate::source) const FOLDED: [f64; 2] = [-std::f64::consts::PI, std::f64::consts::PI];
/// The length L* by which the stiffness of a crease is smaller than that of the sheet, m.
const CREASE_LENGTH: f64 = 0.05;
/// Damping divided by stiffness, s: a guess that lets a facet of some centimetres swing a few times.
const RELAXATION: f64 = 1e-3;
/// Card of 0.3 mm: density, kg/m^3, thickness, m, and Young's modulus, Pa, in the middle of the values of card
/// along and across its fibres.
const CARD: (&str, [f64; 3]) = ("card", [700.0, 3e-4, 2e9]);
/// Polyester film of 0.05 mm, in the same order.
const FILM: (&str, [f64; 3]) = ("film", [1380.0, 5e-5, 4.4e9]);

/// How a drawing is imported.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// Length of one unit of the drawing, m; None: what the drawing says.
    pub scale: Option<f64>,
    /// How far points of the drawing may be moved, m; None: a part of its size.
    pub tolerance: Option<f64>,
    /// How the file is read.
    pub reading: Reading,
    /// Width of the creases, m; 0 without a gap.
    pub crease_width: f64,
    /// Whether flat lines become hinges.
    pub triangulate: bool,
    /// Which facet is fixed.
    pub ground: Ground,
}

/// What an import gives.
pub struct Imported {
    /// The model in our schema, with a comment; None after an error.
    pub yaml: Option<String>,
    /// The number of facets and lines of each kind; None if there is no pattern.
    pub summary: Option<String>,
    /// What is wrong with the drawing, what was mended, and what is not part of the pattern.
    pub found: Diagnostics,
    /// The drawing as SVG, with a mark at everything that was found; None if it could not be read.
    pub explanation: Option<String>,
}

/// Makes a model from the bytes of a drawing; `path` is shown in diagnostics, and `name` is the name of the model.
pub fn import(path: &str, bytes: Vec<u8>, name: &str, options: &Options) -> Imported {
    let failed = |found, explanation| Imported { yaml: None, summary: None, found, explanation };
    let bytes = Bytes { path: path.to_owned(), bytes };
    let lines = match Lines::read(&bytes, &options.reading) {
        Ok(lines) => lines,
        Err(found) => return failed(found, None),
    };
    let unit = options.scale.or(lines.drawing.unit);
    let scale = unit.unwrap_or(UNIT);
    let drawn = match lines.drawn(options.tolerance.map(|tolerance| tolerance / scale)) {
        Ok(drawn) => drawn,
        Err(wrong) => {
            let explanation = explanation(&wrong.drawing, None, &wrong.found);
            return failed(wrong.found, Some(explanation));
        }
    };
    let mut found = drawn.notes();
    if unit.is_none() {
        let message = format!("the drawing {}; 1 mm is taken", drawn.drawing.why_no_unit());
        let warning = drawn.finding(Severity::Warning, codes::NO_SCALE, None, message);
        found.push(warning.hint("give the length of one unit, as in `--scale 0.1mm`"));
    }
    let model = model(&drawn, name, scale, options, &mut found);
    let explanation = explanation(&drawn.drawing, Some(&drawn.pattern), &found);
    Imported {
        yaml: model.map(|model| comment(&drawn, scale, options) + to_yaml(&model).as_str()),
        summary: Some(summary(&drawn)),
        found,
        explanation: Some(explanation),
    }
}

fn explanation(drawing: &Drawing, pattern: Option<&Pattern>, found: &Diagnostics) -> String {
    let marks: Vec<Mark> = found.0.iter().map(Diagnostic::mark).collect();
    lamc_drawings::explain(drawing, pattern, &marks)
}

fn model(
    drawn: &Drawn,
    name: &str,
    scale: f64,
    options: &Options,
    found: &mut Diagnostics,
) -> Option<SourceModel> {
    let sheet = Sheet::of(drawn, options.triangulate, (options.ground, None), (&[], &[]), found)?;
    let materials = vec![material(CARD), material(FILM)];
    // Without a gap, nothing is made of film.
    let (materials, layup) = match options.crease_width > 0.0 {
        true => (materials, vec![0, 1, 0]),
        false => (materials.into_iter().take(1).collect(), vec![0]),
    };
    let stack = Stack { materials: &materials, layup: &layup };
    let crease = crease(&stack, options.crease_width);
    let settings = Settings { scale, fold: FOLDED, crease, free: false };
    let built = sheet.build(drawn, &settings, &stack, Span::default(), [0, 0], found)?;
    Some(SourceModel {
        bodies: built.bodies,
        joints: built.joints,
        initial_q: built.initial_q,
        tolerance: drawn.tolerance() * scale,
        materials,
        layup,
        ..popupcad::empty(name.to_owned())
    })
}

fn spanned<T>(value: T) -> Spanned<T> {
    Spanned { value, span: Span::default() }
}

fn material((name, [density, thickness, modulus]): (&str, [f64; 3])) -> Material {
    Material {
        name: spanned(name.to_owned()),
        density: spanned(density).into(),
        thickness: spanned(thickness).into(),
        youngs_modulus: Some(spanned(modulus).into()),
        yield_stress: None,
    }
}

/// The bending stiffness of the card per length, N m.
fn rigidity() -> f64 {
    let (_, [_, thickness, modulus]) = CARD;
    modulus * thickness * thickness * thickness / (12.0 * (1.0 - POISSON * POISSON))
}

/// The stiffness of the creases per length, N/rad.
fn stiffness(width: f64) -> f64 {
    let (_, [_, thickness, modulus]) = FILM;
    match width > 0.0 {
        true => modulus * thickness * thickness * thickness / 12.0 / width,
        false => rigidity() / CREASE_LENGTH,
    }
}

fn crease(stack: &Stack, width: f64) -> Crease {
    let film = stack.materials.iter().position(|material| material.name.value == FILM.0);
    let number = |value| spanned(Expression::Number(value));
    let spring = match film {
        Some(film) => CreaseSpring::Beam(spanned(film)),
        None => CreaseSpring::Stiffness(number(stiffness(width))),
    };
    Crease { width, spring, flexible: film, damping: number(RELAXATION * stiffness(width)) }
}

/// Says what was assumed.
fn comment(drawn: &Drawn, scale: f64, options: &Options) -> String {
    let [card, film] = [CARD, FILM].map(|(name, [density, thickness, modulus])| {
        let (thickness, modulus) = (thickness * 1e3, modulus / 1e9);
        format!("{name} of {thickness} mm, {density} kg/m^3, {modulus} GPa")
    });
    let sheet = match options.crease_width > 0.0 {
        true => vec![
            format!("- The sheet is {card},"),
            format!("  on both sides of {film}, which bends at the creases."),
        ],
        false => vec![
            format!("- The sheet is {card}."),
            format!(
                "- The stiffness of a crease per length is D / L*, with D = E t^3 / (12 (1 - nu^2)), \
                 nu = {POISSON},"
            ),
            format!(
                "  and L* = {} mm, as in Filipov et al., Int. J. Solids Struct. 124 (2017).",
                CREASE_LENGTH * 1e3
            ),
        ],
    };
    let mut lines = vec![
        format!("Made by `lamc import` from {}.", drawn.file.name()),
        format!("One unit of the drawing is {scale} m."),
        "A drawing does not say what the sheet is made of. Assumed, for you to replace:".into(),
    ];
    lines.extend(sheet);
    lines.push(format!("- Damping is stiffness times {} ms: a guess.", RELAXATION * 1e3));
    if options.triangulate {
        lines.push(
            "- Flat creases have the bending stiffness of the sheet: docs/PATTERNS.md.".into(),
        );
    }
    lines.iter().map(|line| format!("# {line}\n")).collect()
}

/// `132 facets, 240 creases: 120 mountain, 100 valley, 20 flat; 48 border edges, 0 cuts`.
fn summary(drawn: &Drawn) -> String {
    let count = |role| drawn.pattern.edges.iter().filter(|edge| edge.role == role).count();
    let plural = |count: usize, one: &str, more: &str| match count {
        1 => format!("1 {one}"),
        _ => format!("{count} {more}"),
    };
    let [mountain, valley, flat, undriven] =
        [Role::Mountain, Role::Valley, Role::Flat, Role::Hinge].map(count);
    let creases = mountain + valley + flat + undriven;
    let undriven = match undriven {
        0 => String::new(),
        count => format!(", {count} undriven"),
    };
    format!(
        "{}, {}: {mountain} mountain, {valley} valley, {flat} flat{undriven}; {}, {}",
        plural(drawn.pattern.facets.len(), "facet", "facets"),
        plural(creases, "crease", "creases"),
        plural(count(Role::Border), "border edge", "border edges"),
        plural(count(Role::Cut), "cut", "cuts"),
    )
}
