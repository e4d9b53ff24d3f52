//! Small charts of one kind side by side, each with its own abscissa: points with their intervals, and a curve through them.

use std::path::Path;

use plotters::prelude::*;

use super::{INK, Scale, letters, save, tick};
use crate::error::Result;

/// One of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    pub title: String,
    pub x_label: String,
    pub x_scale: Scale,
    /// Abscissa, value, and its interval.
    pub points: Vec<[f64; 4]>,
    /// Empty: none.
    pub curve: Vec<[f64; 2]>,
}

/// In a row.
const COLUMNS: usize = 4;
/// Of one, pixels.
const SIZE: [u32; 2] = [340, 240];
const COLOUR: RGBColor = RGBColor(0, 114, 178);
const CURVE: RGBColor = RGBColor(213, 94, 0);

/// Writes shares, 0 to 1, as PNG.
pub fn panels(path: &Path, panels: &[Panel]) -> Result<()> {
    let columns = panels.len().clamp(1, COLUMNS);
    let rows = panels.len().div_ceil(columns).max(1);
    save(path, (SIZE[0] * columns as u32, SIZE[1] * rows as u32), |area| {
        for (panel, area) in panels.iter().zip(area.split_evenly((rows, columns))) {
            let scale = panel.x_scale;
            let mut chart = ChartBuilder::on(&area)
                .caption(&panel.title, letters(18))
                .margin(8)
                .margin_right(16)
                .x_label_area_size(40)
                .y_label_area_size(40)
                .build_cartesian_2d(scale.axis(span(panel)), -0.05..1.05)?;
            chart
                .configure_mesh()
                .x_desc(&panel.x_label)
                .axis_desc_style(letters(14))
                .label_style(letters(13))
                .axis_style(INK)
                .x_labels(5)
                .y_labels(5)
                .bold_line_style(BLACK.mix(0.12))
                .light_line_style(TRANSPARENT)
                .x_label_formatter(&|place| scale.label(*place))
                .y_label_formatter(&tick)
                .draw()?;
            chart.draw_series(LineSeries::new(panel.curve.iter().map(|&[x, y]| (scale.place(x), y)), CURVE.stroke_width(2)))?;
            let whisker = |&[x, _, low, high]: &[f64; 4]| {
                PathElement::new([(scale.place(x), low), (scale.place(x), high)], COLOUR.stroke_width(2))
            };
            chart.draw_series(panel.points.iter().map(whisker))?;
            chart.draw_series(panel.points.iter().map(|&[x, y, ..]| Circle::new((scale.place(x), y), 4, COLOUR.filled())))?;
        }
        Ok(())
    })
}

/// From the smallest to the largest place, with some air.
fn span(panel: &Panel) -> std::ops::Range<f64> {
    let places = panel.points.iter().map(|point| panel.x_scale.place(point[0]));
    let low = places.clone().fold(f64::INFINITY, f64::min);
    let high = places.fold(f64::NEG_INFINITY, f64::max);
    match low < high {
        true => low - 0.06 * (high - low)..high + 0.06 * (high - low),
        // None, or a single one.
        false if low.is_finite() => low - 0.5..low + 0.5,
        false => 0.0..1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn any_number_of_panels_is_drawn() {
        let folder = tempfile::tempdir().unwrap();
        let panel = |count: usize| Panel {
            title: "spur".into(),
            x_label: "strength".into(),
            x_scale: Scale::Log,
            points: (0..count).map(|i| [10f64.powi(i as i32 - 3), 0.5, 0.2, 0.8]).collect(),
            curve: vec![[1e-3, 0.1], [1.0, 0.9]],
        };
        for count in [0, 1, 5] {
            let path = folder.path().join(format!("{count}.png"));
            panels(&path, &(0..count).map(panel).collect::<Vec<_>>()).unwrap();
            assert!(std::fs::metadata(&path).unwrap().len() > 200);
        }
    }
}
