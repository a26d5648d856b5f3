//! Joint angles over time as SVG.

use std::error::Error;

use plotters::prelude::*;

use lamc::motion::Motion;

/// Pixels.
const SIZE: (u32, u32) = (900, 480);

/// Draws every joint's angle in degrees.
pub fn angles(title: &str, motion: &Motion) -> Result<String, Box<dyn Error>> {
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, SIZE).into_drawing_area();
        root.fill(&WHITE)?;
        let degrees = || motion.samples.iter().flat_map(|sample| &sample.q).map(|q| q.to_degrees());
        let low = degrees().fold(f64::INFINITY, f64::min);
        let high = degrees().fold(f64::NEG_INFINITY, f64::max);
        let margin = 0.05 * (high - low) + 0.5;
        let end = motion.samples.last().map_or(1.0, |sample| sample.t);
        let mut chart = ChartBuilder::on(&root)
            .caption(title, ("sans-serif", 20))
            .margin(12)
            .x_label_area_size(44)
            .y_label_area_size(56)
            .build_cartesian_2d(0.0..end, low - margin..high + margin)?;
        chart
            .configure_mesh()
            .x_desc("time, s")
            .y_desc("angle, deg")
            .light_line_style(TRANSPARENT)
            .label_style(("sans-serif", 14))
            .axis_desc_style(("sans-serif", 15))
            .draw()?;
        for (joint, name) in motion.joints.iter().enumerate() {
            let color = Palette99::pick(joint).to_rgba();
            let points =
                motion.samples.iter().map(|sample| (sample.t, sample.q[joint].to_degrees()));
            chart.draw_series(LineSeries::new(points, color.stroke_width(2)))?.label(name).legend(
                move |(x, y)| PathElement::new([(x, y), (x + 18, y)], color.stroke_width(2)),
            );
        }
        if motion.joints.len() <= 20 {
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
