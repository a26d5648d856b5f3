//! Pictures of a motion: panels one above the other, as SVG or, drawn from the same, PNG.

use std::error::Error;

use clap::ValueEnum;
use lamc_workbench::motion::{Motion, Sample};
use plotters::coord::Shift;
use plotters::prelude::*;
use resvg::tiny_skia::{Pixmap, Transform};
use resvg::usvg;

/// What a panel shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Panel {
    /// Joint angles over time
    Angles,
    /// Joint rates over time
    Rates,
    /// Joint accelerations over time
    Accelerations,
    /// Kinetic and potential energy and their sum over time
    Energy,
    /// Largest closure residual over time
    Closure,
    /// Joint rates over joint angles
    Phase,
    /// Sizes of the forces on contact points over time
    Contacts,
    /// The paths of the points, seen along the axis of the base frame they move least along
    Paths,
}

/// A file's kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    Svg,
    Png,
}

/// The kind of picture a path asks for.
pub fn format(path: &str) -> Result<Format, String> {
    let extension = path.rsplit_once('.').map(|(_, extension)| extension.to_lowercase());
    match extension.as_deref() {
        _ if path == "-" => Ok(Format::Svg),
        Some("svg") => Ok(Format::Svg),
        Some("png") => Ok(Format::Png),
        // A device, whatever it is called.
        _ if path.starts_with("/dev/") => Ok(Format::Svg),
        _ => Err(format!("`{path}` is neither an .svg nor a .png")),
    }
}

/// Pixels of a picture: its width, a panel's height, that of a tall one, the legend's width, the
/// title's height.
const WIDTH: u32 = 900;
const HEIGHT: u32 = 300;
const TALL: u32 = 480;
const LEGEND: u32 = 190;
const TITLE: u32 = 34;
/// What labels take of a panel's height, and a name of the legend at least.
const LABELS: u32 = 60;
const ROOM: u32 = 12;

/// Units of the drawing to a pixel: plotters rounds to whole units.
const FINE: u32 = 8;

/// Pixels of a PNG to a pixel of the SVG.
const ZOOM: u32 = 2;

/// Well apart also in grey and to most eyes.
const COLORS: [RGBColor; 10] = [
    RGBColor(0, 90, 181),
    RGBColor(214, 69, 0),
    RGBColor(0, 140, 90),
    RGBColor(150, 60, 160),
    RGBColor(200, 150, 0),
    RGBColor(40, 170, 210),
    RGBColor(190, 20, 70),
    RGBColor(110, 110, 110),
    RGBColor(110, 160, 20),
    RGBColor(90, 50, 20),
];

/// The curves of a panel, in the units of its labels.
struct Chart {
    labels: [String; 2],
    curves: Vec<Curve>,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    OverTime,
    /// Any two quantities.
    Plane,
    /// Two lengths at one scale.
    Map,
}

struct Curve {
    name: String,
    points: Vec<(f64, f64)>,
}

/// What is drawn of a sample.
type Quantity = fn(&Sample) -> f64;

/// Draws a motion in the format of a path.
pub fn draw(
    motion: &Motion,
    panels: &[Panel],
    radians: bool,
    path: &str,
) -> Result<Vec<u8>, Box<dyn Error>> {
    let charts: Vec<_> = panels.iter().map(|panel| panel.chart(motion, radians)).collect();
    let svg = svg(&motion.name, &charts)?;
    match format(path)? {
        Format::Svg => Ok(svg.into_bytes()),
        Format::Png => png(&svg),
    }
}

impl Panel {
    fn chart(self, motion: &Motion, radians: bool) -> Chart {
        let (angle, unit) = if radians { (1.0, "rad") } else { (1.0_f64.to_degrees(), "deg") };
        let over_time = |what: String, curves| {
            let labels = [format!("{}, {}", motion.course.name(), motion.course.unit()), what];
            Chart { labels, curves, kind: Kind::OverTime }
        };
        let joints = |of: fn(&Sample) -> &Vec<f64>| {
            let curve = |(joint, name): (usize, &String)| Curve {
                name: name.clone(),
                points: motion.samples.iter().map(|s| (s.t, angle * of(s)[joint])).collect(),
            };
            motion.joints.iter().enumerate().map(curve).collect()
        };
        match self {
            Self::Angles => over_time(format!("angle, {unit}"), joints(|sample| &sample.q)),
            Self::Rates => over_time(format!("rate, {unit}/s"), joints(|sample| &sample.u)),
            Self::Accelerations => {
                over_time(format!("acceleration, {unit}/s²"), joints(|sample| &sample.acceleration))
            }
            Self::Energy => {
                let of: [(&str, Quantity); 3] = [
                    ("kinetic", |sample| sample.energy.kinetic),
                    ("potential", |sample| sample.energy.potential),
                    ("sum", |sample| sample.energy.kinetic + sample.energy.potential),
                ];
                let (factor, unit) = prefixed(motion, "J", &of.map(|(_, of)| of));
                over_time(format!("energy, {unit}"), scalars(motion, factor, &of))
            }
            Self::Closure => {
                let of: [(&str, Quantity); 1] = [("closure", |sample| sample.closure)];
                let (factor, unit) = prefixed(motion, "m", &of.map(|(_, of)| of));
                over_time(format!("open by, {unit}"), scalars(motion, factor, &of))
            }
            Self::Phase => {
                let curve = |(joint, name): (usize, &String)| Curve {
                    name: name.clone(),
                    points: motion
                        .samples
                        .iter()
                        .map(|s| (angle * s.q[joint], angle * s.u[joint]))
                        .collect(),
                };
                let labels = [format!("angle, {unit}"), format!("rate, {unit}/s")];
                let curves = motion.joints.iter().enumerate().map(curve).collect();
                Chart { labels, curves, kind: Kind::Plane }
            }
            Self::Contacts => over_time("contact force, N".to_owned(), contacts(motion)),
            Self::Paths => paths(motion),
        }
    }
}

fn contacts(motion: &Motion) -> Vec<Curve> {
    let force = |sample: &Sample, contact: usize| {
        let [.., x, y, z] = sample.contacts.get(contact).copied().unwrap_or_default();
        x.hypot(y).hypot(z)
    };
    let curve = |(contact, name): (usize, &String)| Curve {
        name: name.clone(),
        points: motion.samples.iter().map(|sample| (sample.t, force(sample, contact))).collect(),
    };
    motion.contacts.iter().enumerate().map(curve).collect()
}

fn scalars(motion: &Motion, factor: f64, of: &[(&str, Quantity)]) -> Vec<Curve> {
    let curve = |(name, of): &(&str, Quantity)| Curve {
        name: (*name).to_owned(),
        points: motion.samples.iter().map(|sample| (sample.t, factor * of(sample))).collect(),
    };
    of.iter().map(curve).collect()
}

/// The factor and the unit in which the largest number has one to three digits before the point.
fn prefixed(motion: &Motion, unit: &str, of: &[Quantity]) -> (f64, String) {
    let numbers = motion.samples.iter().flat_map(|sample| of.iter().map(|of| of(sample).abs()));
    let largest = numbers.fold(0.0, f64::max);
    let prefixes = [(1.0, ""), (1e3, "m"), (1e6, "µ"), (1e9, "n"), (1e12, "p"), (1e15, "f")];
    let found = prefixes.into_iter().find(|(factor, _)| largest * factor >= 1.0);
    let (factor, prefix) = found.unwrap_or(if largest > 0.0 { prefixes[5] } else { prefixes[0] });
    (factor, format!("{prefix}{unit}"))
}

fn paths(motion: &Motion) -> Chart {
    const AXES: [&str; 3] = ["x", "y", "z"];
    let spread = |axis: usize| {
        let of = |point: usize| {
            let along = motion.samples.iter().map(move |sample| sample.points[point][axis]);
            let (low, high) = range(along);
            high - low
        };
        (0..motion.points.len()).map(of).fold(0.0, f64::max)
    };
    let least = (0..3).rev().min_by(|&a, &b| spread(a).total_cmp(&spread(b))).unwrap_or(2);
    let [across, up] = [[1, 2], [0, 2], [0, 1]][least];
    let curve = |(point, name): (usize, &String)| Curve {
        name: name.clone(),
        points: motion
            .samples
            .iter()
            .map(|sample| (1e3 * sample.points[point][across], 1e3 * sample.points[point][up]))
            .collect(),
    };
    let labels = [across, up].map(|axis| format!("{}, mm", AXES[axis]));
    Chart { labels, curves: motion.points.iter().enumerate().map(curve).collect(), kind: Kind::Map }
}

fn range(numbers: impl Iterator<Item = f64>) -> (f64, f64) {
    numbers.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

fn svg(title: &str, charts: &[Chart]) -> Result<String, Box<dyn Error>> {
    let height = TITLE + charts.iter().map(Chart::height).sum::<u32>();
    let size = (WIDTH * FINE, height * FINE);
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        root.fill(&WHITE)?;
        let (head, mut rest) = root.split_vertically(TITLE * FINE);
        let style = font(18).into_text_style(&head);
        head.draw_text(title, &style, (px(20), px(10)))?;
        for chart in charts {
            let (panel, below) = rest.split_vertically(chart.height() * FINE);
            chart.draw(&panel)?;
            rest = below;
        }
        root.present()?;
    }
    // The drawing is as fine as it was drawn, the picture as large as it was meant.
    let drawn = format!("width=\"{}\" height=\"{}\"", size.0, size.1);
    Ok(svg.replacen(&drawn, &format!("width=\"{WIDTH}\" height=\"{height}\""), 1))
}

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

impl Chart {
    /// Pixels: enough for the names beside it, if they are not too many.
    fn height(&self) -> u32 {
        let least = if self.kind == Kind::OverTime { HEIGHT } else { TALL };
        let names = LABELS + ROOM * self.curves.len() as u32;
        if names <= TALL + LABELS { least.max(names) } else { least }
    }

    fn draw(&self, area: &Area<'_>) -> Result<(), Box<dyn Error>> {
        let (left, right) = area.split_horizontally((WIDTH - LEGEND) * FINE);
        let [x, y] = self.ranges();
        let mut chart = ChartBuilder::on(&left)
            .margin_top(px(6))
            .margin_left(px(12))
            .margin_right(px(6))
            .margin_bottom(px(4))
            .x_label_area_size(px(42))
            .y_label_area_size(px(68))
            .build_cartesian_2d(x.0..x.1, y.0..y.1)?;
        let decimals = |(low, high): (f64, f64)| {
            // Ticks are some tenth of the range apart.
            move |value: &f64| {
                let digits = (1.0 - ((high - low) / 10.0).log10()).floor().clamp(0.0, 9.0);
                let text = format!("{value:.*}", digits as usize);
                let text = if text.contains('.') {
                    text.trim_end_matches('0').trim_end_matches('.').to_owned()
                } else {
                    text
                };
                if text == "-0" { "0".to_owned() } else { text }
            }
        };
        chart
            .configure_mesh()
            .x_labels(9)
            .y_labels(if self.kind == Kind::OverTime { 7 } else { 9 })
            .x_desc(&self.labels[0])
            .y_desc(&self.labels[1])
            .x_label_formatter(&decimals(x))
            .y_label_formatter(&decimals(y))
            .light_line_style(TRANSPARENT)
            .bold_line_style(BLACK.mix(0.13).stroke_width(FINE))
            .axis_style(BLACK.mix(0.7).stroke_width(FINE))
            .set_all_tick_mark_size(px(4))
            .label_style(font(13))
            .axis_desc_style(font(14))
            .draw()?;
        for (index, curve) in self.curves.iter().enumerate() {
            let style = color(index).stroke_width(2 * FINE);
            chart.draw_series(LineSeries::new(curve.points.iter().copied(), style))?;
        }
        self.legend(&right)
    }

    /// The names beside the panel, as far as there is room to read them.
    fn legend(&self, area: &Area<'_>) -> Result<(), Box<dyn Error>> {
        let height = (self.height() - LABELS) as i32;
        let step = (height / (self.curves.len() as i32).max(1)).min(20);
        if step < ROOM as i32 {
            let style = font(13).into_text_style(area);
            area.draw_text(&format!("{} curves", self.curves.len()), &style, (px(10), px(8)))?;
            return Ok(());
        }
        let style = font(step.min(13) as u32).into_text_style(area);
        for (index, curve) in self.curves.iter().enumerate() {
            let y = px(14 + step * index as i32);
            let line = [(px(8), y), (px(30), y)];
            area.draw(&PathElement::new(line, color(index).stroke_width(2 * FINE)))?;
            area.draw_text(&curve.name, &style, (px(38), y - px(7)))?;
        }
        Ok(())
    }

    /// Of both axes, with room around the curves; time without.
    fn ranges(&self) -> [(f64, f64); 2] {
        let points = || self.curves.iter().flat_map(|curve| &curve.points);
        let wide = |(low, high): (f64, f64)| {
            if !(low.is_finite() && high.is_finite()) {
                return (0.0, 1.0);
            }
            let middle = 0.5 * (low + high);
            let half = match high > low {
                true => (0.53 * (high - low)).max(1e-4 * middle.abs()),
                false => (0.1 * middle.abs()).max(1.0),
            };
            (middle - half, middle + half)
        };
        let x = range(points().map(|point| point.0));
        let y = wide(range(points().map(|point| point.1)));
        if self.kind == Kind::OverTime && x.1 > x.0 {
            return [x, y];
        }
        if self.kind != Kind::Map {
            return [wide(x), y];
        }
        // The panel's inside, by the sizes of its labels.
        let ratio = f64::from(WIDTH - LEGEND - 86) / f64::from(TALL - 52);
        let x = wide(x);
        let half = (0.5 * (y.1 - y.0)).max(0.5 * (x.1 - x.0) / ratio);
        let around = |(low, high): (f64, f64), half: f64| {
            (0.5 * (low + high) - half, 0.5 * (low + high) + half)
        };
        [around(x, half * ratio), around(y, half)]
    }
}

fn color(index: usize) -> RGBColor {
    COLORS[index % COLORS.len()]
}

/// Pixels in units of the drawing.
fn px(pixels: i32) -> i32 {
    pixels * FINE as i32
}

fn font(pixels: u32) -> FontDesc<'static> {
    ("sans-serif", pixels * FINE).into_font()
}

/// An SVG as PNG, with letters of our own: what is installed does not matter.
fn png(svg: &str) -> Result<Vec<u8>, Box<dyn Error>> {
    let mut options = usvg::Options::default();
    let fonts = options.fontdb_mut();
    fonts.load_font_data(dejavu::sans::regular().to_vec());
    fonts.set_sans_serif_family("DejaVu Sans");
    let tree = usvg::Tree::from_str(svg, &options)?;
    let size = tree.size().to_int_size();
    let (width, height) = (size.width() * ZOOM, size.height() * ZOOM);
    let mut pixels = Pixmap::new(width, height).ok_or("a picture without size")?;
    let zoom = Transform::from_scale(ZOOM as f32, ZOOM as f32);
    resvg::render(&tree, zoom, &mut pixels.as_mut());
    Ok(pixels.encode_png()?)
}
