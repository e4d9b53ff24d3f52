//! Curves, such as a loss over training.

use std::path::Path;

use plotters::prelude::*;

use super::heatmap::under;
use super::{Area, DrawResult, INK, Scale, letters, save};
use crate::error::Result;

/// Heights of the line of names and of the title, pixels.
const LEGEND_HEIGHT: u32 = 34;
const TITLE_HEIGHT: u32 = 44;

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    pub name: String,
    /// x, y.
    pub points: Vec<[f64; 2]>,
}

/// Curves over one axis.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Chart {
    pub title: String,
    /// What the axes show, with unit: "time (s)".
    pub x_label: String,
    pub y_label: String,
    pub x_scale: Scale,
    pub y_scale: Scale,
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
    /// Write the chart as PNG. Points that are not finite, and those that the scale has no place for, are gaps.
    pub fn save(&self, path: &Path) -> Result<()> {
        save(path, (900, 560), |area| {
            let area = under(area, &self.title, 26, TITLE_HEIGHT)?;
            let area = match self.drawn().count() {
                0 | 1 => area,
                _ => {
                    let (names, rest) = area.split_vertically(LEGEND_HEIGHT);
                    self.draw_names(&names)?;
                    rest
                }
            };
            let mut chart = ChartBuilder::on(&area)
                .margin(14)
                .margin_right(28)
                .x_label_area_size(54)
                .y_label_area_size(80)
                .build_cartesian_2d(self.x_scale.axis(self.span(0)), self.y_scale.axis(self.span(1)))?;
            chart
                .configure_mesh()
                .x_desc(&self.x_label)
                .y_desc(&self.y_label)
                .axis_desc_style(letters(19))
                .label_style(letters(17))
                .axis_style(INK)
                .bold_line_style(BLACK.mix(0.12))
                .light_line_style(TRANSPARENT)
                .x_label_formatter(&|place| self.x_scale.label(*place))
                .y_label_formatter(&|place| self.y_scale.label(*place))
                .draw()?;
            for (series, colour) in self.drawn() {
                let places: Vec<[f64; 2]> = series.points.iter().map(|point| self.place(point)).collect();
                for part in places.split(|point| !finite(point)) {
                    match part {
                        // A line of one point is none.
                        [[x, y]] => drop(chart.draw_series([Circle::new((*x, *y), 4, colour.filled())])?),
                        _ => drop(chart.draw_series(LineSeries::new(part.iter().map(|&[x, y]| (x, y)), colour.stroke_width(2)))?),
                    }
                }
            }
            Ok(())
        })
    }

    /// The curves' names in one line, where no curve is.
    fn draw_names(&self, area: &Area<'_>) -> DrawResult {
        const STROKE: i32 = 26;
        const GAP: i32 = 8;
        let style = letters(18);
        let middle = area.dim_in_pixel().1 as i32 / 2;
        let mut left = 94;
        for (series, colour) in self.drawn() {
            let (width, height) = area.estimate_text_size(&series.name, &style)?;
            area.draw(&PathElement::new([(left, middle), (left + STROKE, middle)], colour.stroke_width(3)))?;
            area.draw_text(&series.name, &style, (left + STROKE + GAP, middle - height as i32 / 2))?;
            left += STROKE + width as i32 + 3 * GAP;
        }
        Ok(())
    }

    /// Curves that have a point, and their colours.
    fn drawn(&self) -> impl Iterator<Item = (&Series, &'static RGBColor)> {
        let has_point = |series: &Series| series.points.iter().any(|point| finite(&self.place(point)));
        self.series.iter().zip(COLOURS.iter().cycle()).filter(move |(series, _)| has_point(series))
    }

    fn place(&self, point: &[f64; 2]) -> [f64; 2] {
        [self.x_scale.place(point[0]), self.y_scale.place(point[1])]
    }

    /// From the smallest to the largest place of an axis, with some air above and below for y.
    fn span(&self, axis: usize) -> std::ops::Range<f64> {
        let places = self.series.iter().flat_map(|series| &series.points).map(|point| self.place(point));
        let values = places.filter(finite).map(|point| point[axis]);
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
        Chart { title: "loss".into(), x_label: "step".into(), y_label: "loss".into(), series, ..Chart::default() }
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
