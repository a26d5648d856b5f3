//! `lamc cut MODEL --svg FILE --dxf FILE`: outlines and holes of each layer for a laser cutter.

use std::fmt::Write;

use clap::Args;
use lamc::laminate;
use lamc::source::{self, Diagnostics, SourceModel, read_in};
use lamc_workbench::cut::{Cut, Hole, Layer, Loose, Options, Perforation, cut, svg};

use super::paths::Paths;
use super::{Failed, Outcome, fail, output, read, report, warn};

/// Millimetres in a metre.
const MM: f64 = 1e3;

/// Write outlines and holes of each layer for a laser cutter.
#[derive(Args)]
pub struct Arguments {
    /// The model
    model: String,
    /// Write SVG: with `#` in the name one file for each layer (`#` stands for the layer's number and
    /// material), else one file with a group for each layer; `-` writes standard output
    #[arg(long, value_name = "FILE", required_unless_present = "dxf")]
    svg: Option<String>,
    /// Write DXF: with `#` in the name one file for each layer, else one file; `-` writes standard output
    #[arg(long, value_name = "FILE")]
    dxf: Option<String>,
    /// Width of what the laser removes: outlines grow by half of it, holes shrink: 0.1mm
    #[arg(long, value_name = "LENGTH", value_parser = length, default_value = "0")]
    kerf: f64,
    /// Close gaps up to this width between two bodies at their hinge, so that the film is one piece
    #[arg(long, value_name = "LENGTH", value_parser = length)]
    bridge: Option<f64>,
    /// The material of the layers that bridge hinges. Default: for each hinge one layer, that with the
    /// narrowest gap, then that at the height of the hinge line, then the thinnest
    #[arg(long, value_name = "MATERIAL")]
    film: Option<String>,
    /// Cut along the hinge lines of the layers that bridge them: length of the cuts and of the material
    /// between them: 2mm:1mm
    #[arg(long, value_name = "CUT:BRIDGE", value_parser = perforation)]
    perforate: Option<Perforation>,
    /// Cut registration holes of this diameter at the corners of a frame around all parts: 3mm
    #[arg(long, value_name = "DIAMETER", value_parser = diameter)]
    registration: Option<f64>,
}

/// Reads a length, mm.
fn length(text: &str) -> Result<f64, String> {
    let length = read_in(text, "m")?;
    if length >= 0.0 { Ok(length * MM) } else { Err("a length cannot be negative".to_owned()) }
}

/// Reads a length that is not zero, mm.
fn diameter(text: &str) -> Result<f64, String> {
    length(text).and_then(|length| {
        if length > 0.0 { Ok(length) } else { Err("must not be zero".to_owned()) }
    })
}

fn perforation(text: &str) -> Result<Perforation, String> {
    let Some((cut, bridge)) = text.split_once(':') else {
        return Err("expected two lengths, as in `2mm:1mm`".to_owned());
    };
    Ok(Perforation { cut: diameter(cut)?, bridge: diameter(bridge)? })
}

pub fn run(arguments: &Arguments) -> Outcome {
    output::has_extension(arguments.svg.as_ref(), "svg")?;
    output::has_extension(arguments.dxf.as_ref(), "dxf")?;
    let model = checked(&arguments.model)?;
    let options = Options {
        kerf: arguments.kerf,
        bridge: arguments.bridge,
        film: arguments.film.clone(),
        perforation: arguments.perforate,
        registration: arguments.registration,
    };
    let cut = cut(&model, &options)
        .map_err(|error| fail(format_args!("{}: {error}", arguments.model)))?;
    let drawings = [("--svg", &arguments.svg), ("--dxf", &arguments.dxf)];
    let mut files: Vec<File<'_>> = Vec::new();
    for (argument, path) in drawings {
        let Some(path) = path else { continue };
        files.extend(sheets(&cut, path).into_iter().map(|(path, layers)| File {
            argument,
            path,
            layers,
        }));
    }
    let mut paths = Paths::default().input("the model", [&arguments.model]);
    for file in &files {
        paths = paths.output(file.argument, [&file.path]);
    }
    paths.check()?;
    notes(&cut);
    for File { argument, path, layers } in &files {
        let text = match *argument {
            "--svg" => svg(&cut, layers, &model.name.value),
            _ => dxf(&cut, layers),
        };
        output::write(path, &text)?;
    }
    if paths.is_printed() { Ok(()) } else { output::print(&summary(&cut, &options)) }
}

/// Reads a model and checks its plates; the equations are not needed.
fn checked(path: &str) -> Result<SourceModel, Failed> {
    let file = read(path)?;
    let refuse = |problems: Diagnostics| {
        report(&problems, &file);
        Failed(1)
    };
    let (model, mut warnings) = source::parse(&file).map_err(refuse)?;
    laminate::build(&model, &mut warnings).map_err(refuse)?;
    report(&warnings, &file);
    Ok(model)
}

/// A file to write.
struct File<'a> {
    argument: &'static str,
    path: String,
    layers: Vec<&'a Layer>,
}

/// The files of a path: one for each layer if it has a `#`, which stands for the layer.
fn sheets<'a>(cut: &'a Cut, path: &str) -> Vec<(String, Vec<&'a Layer>)> {
    match path.contains('#') {
        true => {
            cut.layers.iter().map(|layer| (path.replace('#', &layer.name()), vec![layer])).collect()
        }
        false => vec![(path.to_owned(), cut.layers.iter().collect())],
    }
}

/// All lines of layers as DXF, in millimetres. An outline of two points is a line.
fn dxf(cut: &Cut, layers: &[&Layer]) -> String {
    let mut named: Vec<(String, Vec<Vec<[f64; 2]>>)> = Vec::new();
    for layer in layers {
        let name = layer.name();
        named.push((name.clone(), layer.rings().cloned().collect()));
        for (kind, lines) in [("slits", &layer.slits), ("perforation", &layer.perforation)] {
            if !lines.is_empty() {
                named.push((
                    format!("{name}-{kind}"),
                    lines.iter().map(|line| line.to_vec()).collect(),
                ));
            }
        }
    }
    if !cut.registration.is_empty() {
        named.push(("registration".to_owned(), cut.registration.iter().map(Hole::ring).collect()));
    }
    lamc_drawings::dxf::write(&named, 1.0 / MM)
}

/// What the user should know before cutting.
fn notes(cut: &Cut) {
    for number in &cut.empty {
        warn(format_args!("layer {number} has no plates: nothing is written for it"));
    }
    for Loose { joint, gap } in &cut.loose {
        match gap {
            Some((gap, layer)) => warn(format_args!(
                "no layer bridges the hinge `{joint}`: the narrowest gap is {gap:.4} mm, in layer {layer} \
                 (--bridge closes gaps)"
            )),
            None => warn(format_args!(
                "no layer bridges the hinge `{joint}`: its bodies have no edges along the hinge line in any \
                 layer"
            )),
        }
    }
}

/// A table of the layers.
fn summary(cut: &Cut, options: &Options) -> String {
    let [width, height] = cut.size;
    let mut text = format!("sheet: {width:.1} mm x {height:.1} mm\n");
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "{:<24} {:>6} {:>6} {:>6} {:>12} {:>14}",
        "layer", "pieces", "holes", "slits", "area mm^2", "cut length mm"
    );
    for layer in &cut.layers {
        let holes: usize = layer.pieces.iter().map(|piece| piece.holes.len()).sum();
        let _ = writeln!(
            text,
            "{:<24} {:>6} {holes:>6} {:>6} {:>12.1} {:>14.1}",
            layer.name(),
            layer.pieces.len(),
            layer.slits.len(),
            layer.area(),
            layer.length()
        );
    }
    if let Some(Perforation { cut: length, bridge }) = options.perforation {
        for layer in cut.layers.iter().filter(|layer| !layer.perforation.is_empty()) {
            let count = layer.perforation.len();
            let _ = writeln!(
                text,
                "perforation of {}: {count} cuts of {length} mm, at least {bridge} mm apart",
                layer.name()
            );
        }
        if cut.layers.iter().all(|layer| layer.perforation.is_empty()) {
            let _ = writeln!(
                text,
                "perforation: no hinge line is long enough for a cut of {length} mm"
            );
        }
    }
    text
}
