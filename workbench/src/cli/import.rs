//! `lamc import DESIGN -o FILE`: drawings and models of other programs in lamc's schema.

use std::fs::File;
use std::io::{self, Read, Write};

use clap::Args;
use lamc::source::pattern::{self, Ground, Imported, MAX_DRAWING_BYTES, Options};
use lamc::source::{self, SourceFile};
use lamc_drawings::{Format, Reading, Role};

use super::paths::Paths;
use super::{Failed, Outcome, fail, misused, output, read, report};

/// Write a crease pattern (SVG, FOLD, DXF) or a model (popupCAD files too) in lamc's schema.
#[derive(Args)]
pub struct Arguments {
    /// The design: a drawing or a model; `-` reads standard input
    design: String,
    /// Where to write it; `-` writes standard output
    #[arg(short, long, value_name = "FILE")]
    output: String,
    #[command(flatten, next_help_heading = "Drawings")]
    drawing: Drawing,
}

/// How a drawing is read.
#[derive(Args)]
struct Drawing {
    /// Length of one unit of the drawing, such as 0.1mm. Default: what the drawing says, or 1 mm
    #[arg(long, value_name = "LENGTH")]
    scale: Option<String>,
    /// How far points may be moved to mend the drawing. Default: a thousandth of its size
    #[arg(long, value_name = "LENGTH")]
    tolerance: Option<String>,
    /// A layer of a DXF file and what its lines are: border, mountain, valley, flat, hinge or cut.
    /// Lines on layers that are not named are ignored then
    #[arg(long, value_name = "ROLE=NAME")]
    layer: Vec<String>,
    /// Width of the gap between plates at creases: the sheet is card on both sides of a film then
    #[arg(long, value_name = "LENGTH")]
    crease_width: Option<String>,
    /// Make hinges of flat lines, as stiff as the bending sheet
    #[arg(long)]
    triangulate: bool,
    /// The fixed facet: `largest`, or the one around a point X,Y of the drawing, with y upwards.
    /// Default: largest
    #[arg(long, value_name = "FACET", allow_hyphen_values = true)]
    ground: Option<String>,
    /// Where to write the drawing with a mark at everything that is wrong or was mended, as SVG
    #[arg(long, value_name = "FILE")]
    explain: Option<String>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { design, output, drawing } = arguments;
    let paths = Paths::default().input("the design", [design]).output("--output", [output]);
    paths.output("--explain", &drawing.explain).check()?;
    match bytes_of_drawing(design)? {
        Some((path, bytes)) => import_drawing(&path, bytes, output, drawing),
        None => match drawing.given() {
            Some(option) => Err(misused(format_args!(
                "{option} says how a drawing is read, and {design} is a model"
            ))),
            None => import_model(design, output),
        },
    }
}

impl Drawing {
    /// An option that is given, which a model has no use for.
    fn given(&self) -> Option<&'static str> {
        let given = [
            ("--scale", self.scale.is_some()),
            ("--tolerance", self.tolerance.is_some()),
            ("--layer", !self.layer.is_empty()),
            ("--crease-width", self.crease_width.is_some()),
            ("--triangulate", self.triangulate),
            ("--ground", self.ground.is_some()),
            ("--explain", self.explain.is_some()),
        ];
        given.into_iter().find_map(|(option, is_given)| is_given.then_some(option))
    }
}

/// Returns the path and the bytes of a file that is a drawing; None if it is none.
fn bytes_of_drawing(path: &str) -> Result<Option<(String, Vec<u8>)>, Failed> {
    // A model may look like the JSON of FOLD.
    let extension = path.rsplit_once('.').map_or("", |(_, extension)| extension);
    if ["yaml", "yml", "json", "joints"].contains(&extension.to_ascii_lowercase().as_str()) {
        return Ok(None);
    }
    let shown = if path == "-" { "<stdin>" } else { path };
    let failed = |error: io::Error| fail(format_args!("cannot read {shown}: {error}"));
    let reader: Box<dyn Read> = match path {
        "-" => Box::new(io::stdin()),
        _ => Box::new(File::open(path).map_err(failed)?),
    };
    let mut bytes = Vec::new();
    reader.take(MAX_DRAWING_BYTES as u64 + 1).read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() > MAX_DRAWING_BYTES {
        let most = MAX_DRAWING_BYTES >> 20;
        return Err(fail(format_args!(
            "{shown} is larger than {most} MiB, the largest drawing that lamc reads"
        )));
    }
    Ok(Format::of(path, &bytes).map(|_| (shown.to_owned(), bytes)))
}

fn import_model(design: &str, path: &str) -> Outcome {
    let file = read(design)?;
    match source::parse(&file) {
        Ok((model, warnings)) => {
            report(&warnings, &file);
            output::write(path, &source::to_yaml(&model))
        }
        Err(problems) => {
            report(&problems, &file);
            Err(Failed(1))
        }
    }
}

fn import_drawing(path: &str, bytes: Vec<u8>, output: &str, drawing: &Drawing) -> Outcome {
    let options = options(drawing)?;
    let file = SourceFile { path: path.to_owned(), text: String::new() };
    let Imported { yaml, summary, found, explanation } =
        pattern::import(path, bytes, &file.module_name(), &options);
    // If standard error is closed, the summary is lost.
    summary.into_iter().for_each(|summary| drop(writeln!(io::stderr(), "{summary}")));
    report(&found, &file);
    if let (Some(path), Some(explanation)) = (&drawing.explain, explanation) {
        output::write(path, &explanation)?;
    }
    match yaml.filter(|_| !found.has_errors()) {
        Some(yaml) => output::write(output, &yaml),
        None => Err(Failed(1)),
    }
}

fn options(drawing: &Drawing) -> Result<Options, Failed> {
    let scale = positive("--scale", drawing.scale.as_ref())?;
    let tolerance = positive("--tolerance", drawing.tolerance.as_ref())?;
    let crease_width = length("--crease-width", drawing.crease_width.as_ref())?.unwrap_or(0.0);
    if crease_width < 0.0 {
        return Err(misused("--crease-width is a length of 0 or more"));
    }
    let layers = drawing.layer.iter().map(|given| layer(given)).collect::<Result<_, _>>()?;
    Ok(Options {
        scale,
        tolerance,
        reading: Reading { layers, ..Reading::default() },
        crease_width,
        triangulate: drawing.triangulate,
        ground: drawing.ground.as_deref().map_or(Ok(Ground::Largest), ground)?,
    })
}

/// Reads a length, m.
fn length(option: &str, text: Option<&String>) -> Result<Option<f64>, Failed> {
    let Some(text) = text else { return Ok(None) };
    match source::read_in(text, "m") {
        Ok(length) => Ok(Some(length)),
        Err(reason) => Err(misused(format_args!("{option} {text}: {reason}"))),
    }
}

fn positive(option: &str, text: Option<&String>) -> Result<Option<f64>, Failed> {
    match length(option, text)? {
        Some(length) if length <= 0.0 => {
            Err(misused(format_args!("{option} is a length greater than 0")))
        }
        length => Ok(length),
    }
}

fn layer(given: &str) -> Result<(Role, String), Failed> {
    const ROLES: [(&str, Role); 6] = [
        ("border", Role::Border),
        ("mountain", Role::Mountain),
        ("valley", Role::Valley),
        ("flat", Role::Flat),
        ("hinge", Role::Hinge),
        ("cut", Role::Cut),
    ];
    let (role, name) = given.split_once('=').unwrap_or((given, ""));
    let role = ROLES.iter().find(|(known, _)| *known == role);
    match role.filter(|_| !name.is_empty()) {
        Some((_, role)) => Ok((*role, name.to_owned())),
        None => Err(misused(format_args!(
            "--layer {given}: write ROLE=NAME, with border, mountain, valley, flat, hinge or cut, \
             such as --layer cut=OUTLINE"
        ))),
    }
}

fn ground(given: &str) -> Result<Ground, Failed> {
    if given == "largest" {
        return Ok(Ground::Largest);
    }
    let number = |text: &str| text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
    let point = given.split_once(',').and_then(|(x, y)| Some([number(x)?, number(y)?]));
    point.map(Ground::Around).ok_or_else(|| {
        misused(format_args!("--ground {given}: write `largest`, or a point X,Y of the drawing"))
    })
}
