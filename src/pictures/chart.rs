//! Curves, such as a loss over training.

use std::path::Path;

use plotters::prelude::*;

use super::{INK, letters, save, tick};
use crate::error::Result;

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub name: String,
    pub points: Vec<[f64; 2]>,
}

/// Curves over one axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Chart {
    pub title: String,
    /// What the axes show, with unit: "time (s)".
    pub x_label: String,
    pub y_label: String,
    pub series: Vec<Series>,
}

// told apart by the colour-blind too, and named in the legend
const COLOURS: [RGBColor; 6] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

impl Chart {
    /// Write the chart as PNG. Points that are not finite are gaps.
    pub fn save(&self, path: &Path) -> Result<()> {
        save(path, (900, 560), |area| {
            let mut chart = ChartBuilder::on(area)
                .caption(&self.title, letters(26))
                .margin(14)
                .margin_right(28)
                .x_label_area_size(54)
                .y_label_area_size(80)
                .build_cartesian_2d(self.span(0), self.span(1))?;
            chart
                .configure_mesh()
                .x_desc(&self.x_label)
                .y_desc(&self.y_label)
                .axis_desc_style(letters(19))
                .label_style(letters(17))
                .axis_style(INK)
                .bold_line_style(BLACK.mix(0.12))
                .light_line_style(TRANSPARENT)
                .x_label_formatter(&tick)
                .y_label_formatter(&tick)
                .draw()?;
            for (series, colour) in self.series.iter().zip(COLOURS.iter().cycle()) {
                for (index, part) in series.points.split(|point| !finite(point)).filter(|part| !part.is_empty()).enumerate() {
                    let line = LineSeries::new(part.iter().map(|&[x, y]| (x, y)), colour.stroke_width(2));
                    let drawn = chart.draw_series(line)?;
                    if index == 0 {
                        let stroke = colour.stroke_width(3);
                        drawn.label(&series.name).legend(move |(x, y)| PathElement::new([(x, y), (x + 22, y)], stroke));
                    }
                }
            }
            if self.series.len() > 1 {
                chart
                    .configure_series_labels()
                    .position(SeriesLabelPosition::UpperRight)
                    .label_font(letters(18))
                    .background_style(WHITE.mix(0.85))
                    .border_style(BLACK.mix(0.2))
                    .margin(10)
                    .legend_area_size(30)
                    .draw()?;
            }
            Ok(())
        })
    }

    /// From the smallest to the largest number of an axis, with some air above and below for y.
    fn span(&self, axis: usize) -> std::ops::Range<f64> {
        let values = self.series.iter().flat_map(|series| &series.points).filter(|point| finite(point)).map(|point| point[axis]);
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), v| (low.min(v), high.max(v)));
        if low > high {
            return 0.0..1.0;
        }
        let air = if axis == 1 { 0.05 * (high - low) } else { 0.0 };
        // a single value still needs some width
        let air = if high > low { air } else { 0.5 * high.abs().max(1.0) };
        low - air..high + air
    }
}

fn finite(point: &[f64; 2]) -> bool {
    point.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(points: Vec<[f64; 2]>) -> Chart {
        let series = vec![Series { name: "training".into(), points }];
        Chart { title: "loss".into(), x_label: "step".into(), y_label: "loss".into(), series }
    }

    #[test]
    fn the_axes_span_the_finite_points() {
        let chart = chart(vec![[0.0, 10.0], [1.0, f64::NAN], [4.0, 20.0]]);
        assert_eq!(chart.span(0), 0.0..4.0);
        assert_eq!(chart.span(1), 9.5..20.5);
    }

    #[test]
    fn curves_that_are_empty_constant_or_broken_are_drawn_all_the_same() {
        let folder = tempfile::tempdir().unwrap();
        for (name, points) in [
            ("empty", vec![]),
            ("single", vec![[1.0, 5.0]]),
            ("constant", vec![[0.0, 0.0], [1.0, 0.0]]),
            ("broken", vec![[0.0, 1.0], [1.0, f64::INFINITY], [2.0, 3.0]]),
        ] {
            let path = folder.path().join(format!("{name}.png"));
            chart(points).save(&path).unwrap();
            assert!(std::fs::metadata(&path).unwrap().len() > 1000, "{name}");
        }
    }
}
