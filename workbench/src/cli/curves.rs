//! Measured and computed angles over time as SVG: points and lines.

use std::error::Error;

use plotters::prelude::*;

/// Pixels.
const SIZE: (u32, u32) = (900, 480);
/// More names than this hide what they name.
const MOST_NAMES: usize = 20;

/// An angle over time.
pub struct Curve {
    pub name: String,
    /// Same number, same color.
    pub color: usize,
    /// s and deg.
    pub samples: Vec<(f64, f64)>,
    /// Drawn as points, not as a line.
    pub is_points: bool,
}

impl Curve {
    pub fn line(name: &str, color: usize, samples: Vec<(f64, f64)>) -> Self {
        Self { name: name.to_owned(), color, samples, is_points: false }
    }

    pub fn points(name: &str, color: usize, samples: Vec<(f64, f64)>) -> Self {
        Self { is_points: true, ..Self::line(name, color, samples) }
    }
}

/// Draws angles in degrees.
pub fn draw(title: &str, curves: &[Curve]) -> Result<String, Box<dyn Error>> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let samples = || curves.iter().flat_map(|curve| &curve.samples);
        let low = samples().map(|(_, y)| *y).fold(f64::INFINITY, f64::min);
        let high = samples().map(|(_, y)| *y).fold(f64::NEG_INFINITY, f64::max);
        let begin = samples().map(|(t, _)| *t).fold(f64::INFINITY, f64::min).min(0.0);
        let end = samples().map(|(t, _)| *t).fold(f64::NEG_INFINITY, f64::max);
        let margin =
            0.05 * (high - low) + if high - low > 10.0 { 0.5 } else { 0.05 * (high - low) };
        let mut chart = ChartBuilder::on(&root)
            .caption(title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(begin..end, low - margin..high + margin)?;
        chart
            .configure_mesh()
            .x_desc("time, s")
            .y_desc("angle, deg")
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 15))
            .draw()?;
        for Curve { name, color, samples, is_points } in curves {
            let color = Palette99::pick(*color).to_rgba();
            let style = color.stroke_width(2);
            if *is_points {
                let dots = samples.iter().map(|&at| Circle::new(at, 2, color.filled()));
                chart
                    .draw_series(dots)?
                    .label(name)
                    .legend(move |(x, y)| Circle::new((x + 9, y), 2, color.filled()));
            } else {
                chart
                    .draw_series(LineSeries::new(samples.iter().copied(), style))?
                    .label(name)
                    .legend(move |(x, y)| PathElement::new([(x, y), (x + 18, y)], style));
            }
        }
        if curves.len() <= MOST_NAMES {
            chart
                .configure_series_labels()
                .position(SeriesLabelPosition::UpperRight)
                .background_style(WHITE.mix(0.85))
                .border_style(BLACK.mix(0.3))
                .label_font(("sans-serif", 14))
                .draw()?;
        }
        root.present()?;
    }
    Ok(svg)
}
