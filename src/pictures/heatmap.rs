//! Maps in colour, with axes and a colour bar in decibels.

use std::path::Path;

use plotters::coord::types::RangedCoordf64;
use plotters::prelude::*;

use super::{Area, DrawResult, INK, letters, save, tick};
use crate::error::Result;
use crate::heatmap::{Axis, Map};
use crate::metrics::DbWindow;

const BAR_WIDTH: u32 = 116;
const TITLE_HEIGHT: u32 = 44;
const CAPTION_HEIGHT: u32 = 26;

/// One map of decibels, rows upwards.
pub fn heatmap(path: &Path, title: &str, map_db: &Map, window: DbWindow) -> Result<()> {
    save(path, (900, 640), |area| {
        let area = under(area, title, 26, TITLE_HEIGHT)?;
        let (left, right) = area.split_horizontally(area.dim_in_pixel().0 - BAR_WIDTH);
        draw_map(&left, map_db, &Colours::sequential(window))?;
        draw_bar(&right, "dB", &Colours::sequential(window))
    })
}

/// The words over a comparison of two maps.
#[derive(Clone, Copy, Debug)]
pub struct Captions<'a> {
    pub title: &'a str,
    pub first: &'a str,
    pub second: &'a str,
}

impl<'a> Captions<'a> {
    /// Of a recording and its simulation.
    pub fn simulated(title: &'a str) -> Self {
        Self { title, first: "measured", second: "simulated" }
    }
}

/// Measured, simulated, and simulated less measured.
///
/// The window limits the first two, so that the difference does not count what neither shows; it spans ± half the window,
/// at most ± 30 dB.
///
/// # Panics
/// When the shapes of the maps differ.
pub fn comparison(path: &Path, captions: Captions<'_>, measured_db: &Map, simulated_db: &Map, window: DbWindow) -> Result<()> {
    assert_eq!(measured_db.dims(), simulated_db.dims(), "comparison: maps of different shapes");
    let within = |db: f64| db.clamp(window.low_db, window.high_db);
    let pairs = measured_db.values.iter().zip(&simulated_db.values);
    let difference = measured_db.with_values(pairs.map(|(measured, simulated)| within(*simulated) - within(*measured)).collect());
    let (levels, differences) =
        (Colours::sequential(window), Colours::diverging((0.5 * (window.high_db - window.low_db)).min(30.0)));
    save(path, (1760, 600), |area| {
        let area = under(area, captions.title, 26, TITLE_HEIGHT)?;
        let picture = (area.dim_in_pixel().0 - 2 * BAR_WIDTH) / 3;
        let (measured, rest) = area.split_horizontally(picture);
        let (simulated, rest) = rest.split_horizontally(picture);
        let (bar, rest) = rest.split_horizontally(BAR_WIDTH);
        let (third, last_bar) = rest.split_horizontally(picture);
        draw_map(&under(&measured, captions.first, 20, CAPTION_HEIGHT)?, measured_db, &levels)?;
        draw_map(&under(&simulated, captions.second, 20, CAPTION_HEIGHT)?, simulated_db, &levels)?;
        draw_bar(&under(&bar, "", 20, CAPTION_HEIGHT)?, "dB", &levels)?;
        let less = format!("({}) − ({})", captions.second, captions.first);
        draw_map(&under(&third, &less, 20, CAPTION_HEIGHT)?, &difference, &differences)?;
        draw_bar(&under(&last_bar, "", 20, CAPTION_HEIGHT)?, "dB", &differences)
    })
}

/// From numbers to colours.
pub(super) struct Colours {
    low: f64,
    high: f64,
    gradient: fn(f64) -> colorous::Color,
}

impl Colours {
    pub(super) fn sequential(window: DbWindow) -> Self {
        Self::between(window.low_db, window.high_db)
    }

    pub(super) fn between(low: f64, high: f64) -> Self {
        Self { low, high, gradient: |t| colorous::VIRIDIS.eval_continuous(t) }
    }

    /// White at zero, red above, blue below.
    fn diverging(limit: f64) -> Self {
        Self { low: -limit, high: limit, gradient: |t| colorous::RED_BLUE.eval_continuous(1.0 - t) }
    }

    fn of(&self, value: f64) -> RGBColor {
        let colorous::Color { r, g, b } = (self.gradient)(((value - self.low) / (self.high - self.low)).clamp(0.0, 1.0));
        RGBColor(r, g, b)
    }
}

/// The area below a centred line of text.
pub(super) fn under<'a>(
    area: &Area<'a>,
    text: &str,
    size: u32,
    height: u32,
) -> std::result::Result<Area<'a>, Box<dyn std::error::Error>> {
    let (top, rest) = area.split_vertically(height);
    let style = letters(size);
    let width = area.estimate_text_size(text, &style)?.0 as i32;
    top.draw_text(text, &style, ((area.dim_in_pixel().0 as i32 - width) / 2, (height as i32 - size as i32) * 2 / 3))?;
    Ok(rest)
}

/// From the outer edge of the first cell to that of the last.
fn edges(axis: &Axis) -> std::ops::Range<f64> {
    let (first, last) = (axis.values[0], axis.values[axis.len() - 1]);
    let half = if axis.len() > 1 { 0.5 * (last - first) / (axis.len() - 1) as f64 } else { 0.5 };
    first - half..last + half
}

fn label(axis: &Axis) -> String {
    format!("{} ({})", axis.name, axis.unit)
}

fn draw_map(area: &Area<'_>, map: &Map, colours: &Colours) -> DrawResult {
    draw_map_under(area, map, colours, &[])
}

/// A map with lines over it, each of points in the axes' units.
pub(super) fn draw_map_under(area: &Area<'_>, map: &Map, colours: &Colours, lines: &[Vec<(f64, f64)>]) -> DrawResult {
    let axes = Axes { below: 52, left: 66, ticks: [8, 9], names: 19, numbers: 17 };
    let mut chart = with_axes(&area.margin(10, 10, 10, 16), map, colours, &axes)?;
    for (edge, width) in [(BLACK, 4), (WHITE, 2)] {
        for line in lines {
            chart.draw_series(LineSeries::new(line.iter().copied(), edge.stroke_width(width)))?;
        }
    }
    Ok(())
}

/// How a map's axes are drawn.
pub(super) struct Axes {
    /// Pixels of the abscissa and of the ordinate; none where they are 0.
    pub below: u32,
    pub left: u32,
    /// To the right and upwards, about so many.
    pub ticks: [usize; 2],
    /// Sizes of letters.
    pub names: u32,
    pub numbers: u32,
}

type Chart<'a> = ChartContext<'a, BitMapBackend<'a>, Cartesian2d<RangedCoordf64, RangedCoordf64>>;

/// A map and its axes, over all of an area.
pub(super) fn with_axes<'a>(
    area: &Area<'a>,
    map: &Map,
    colours: &Colours,
    axes: &Axes,
) -> std::result::Result<Chart<'a>, Box<dyn std::error::Error>> {
    let mut chart = ChartBuilder::on(area)
        .x_label_area_size(axes.below)
        .y_label_area_size(axes.left)
        .build_cartesian_2d(edges(&map.columns), edges(&map.rows))?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_desc(label(&map.columns))
        .y_desc(label(&map.rows))
        .axis_desc_style(letters(axes.names))
        .label_style(letters(axes.numbers))
        .axis_style(INK)
        .x_labels(axes.ticks[0])
        .y_labels(axes.ticks[1])
        .x_label_formatter(&tick)
        .y_label_formatter(&tick)
        .draw()?;
    paint(&chart.plotting_area().strip_coord_spec(), map, colours)?;
    Ok(chart)
}

/// The map alone, over all of an area.
fn paint(plot: &Area<'_>, map: &Map, colours: &Colours) -> DrawResult {
    // pixel by pixel, so that neighbouring cells leave no seams
    let (width, height) = plot.dim_in_pixel();
    let [rows, columns] = map.dims();
    for y in 0..height {
        let row = rows - 1 - (y as usize * rows / height as usize);
        for x in 0..width {
            let column = x as usize * columns / width as usize;
            plot.draw_pixel((x as i32, y as i32), &colours.of(map.at(row, column)))?;
        }
    }
    Ok(())
}

pub(super) fn draw_bar(area: &Area<'_>, unit: &str, colours: &Colours) -> DrawResult {
    let mut chart = ChartBuilder::on(area)
        .margin(10)
        .margin_left(0)
        .margin_right(14)
        .x_label_area_size(52)
        .right_y_label_area_size(68)
        .build_cartesian_2d(0.0..1.0, colours.low..colours.high)?;
    chart
        .configure_mesh()
        .disable_mesh()
        .x_labels(0)
        .y_labels(9)
        .y_desc(unit)
        .axis_desc_style(letters(19))
        .label_style(letters(17))
        .axis_style(INK)
        .set_tick_mark_size(LabelAreaPosition::Right, 8)
        .y_label_formatter(&tick)
        .draw()?;
    let plot = chart.plotting_area().strip_coord_spec();
    let (width, height) = plot.dim_in_pixel();
    for y in 0..height {
        let value = colours.high - (y as f64 + 0.5) / height as f64 * (colours.high - colours.low);
        for x in 0..width {
            plot.draw_pixel((x as i32, y as i32), &colours.of(value))?;
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map() -> Map {
        let rows = Axis::new("velocity", "m/s", (0..5).map(|row| row as f64 - 2.0).collect());
        let columns = Axis::new("range", "m", (0..8).map(|column| 0.5 * column as f64).collect());
        let mut values = vec![-80.0; 40];
        values[4 * 8] = 0.0;
        Map::new(rows, columns, values)
    }

    fn pixels(path: &Path) -> (u32, Vec<[u8; 3]>) {
        let file = std::io::BufReader::new(std::fs::File::open(path).unwrap());
        let mut reader = png::Decoder::new(file).read_info().unwrap();
        let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
        reader.next_frame(&mut bytes).unwrap();
        (reader.info().width, bytes.chunks_exact(3).map(|pixel| [pixel[0], pixel[1], pixel[2]]).collect())
    }

    #[test]
    fn the_fastest_row_is_on_top_and_the_nearest_column_on_the_left() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.png");
        heatmap(&path, "a map", &map(), DbWindow { low_db: -80.0, high_db: 0.0 }).unwrap();
        let (width, pixels) = pixels(&path);
        let brightest = colorous::VIRIDIS.eval_continuous(1.0).as_array();
        // the colour bar, on the right, ends with the same colour
        let found: Vec<usize> = (0..pixels.len()).filter(|&i| pixels[i] == brightest && i % (width as usize) < 700).collect();
        let (rows, columns): (Vec<_>, Vec<_>) = found.iter().map(|i| (i / width as usize, i % width as usize)).unzip();
        // a fifth of the height by an eighth of the width, in the upper left corner
        assert!((80 * 70..110 * 100).contains(&found.len()), "{} bright pixels", found.len());
        assert!(*rows.iter().max().unwrap() < 200 && *columns.iter().max().unwrap() < 250);
    }

    #[test]
    fn a_difference_is_white_where_both_agree_and_red_where_the_simulation_is_stronger() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("difference.png");
        let mut simulated = map();
        simulated.values[20] = -50.0;
        comparison(&path, Captions::simulated("compared"), &map(), &simulated, DbWindow { low_db: -80.0, high_db: 0.0 }).unwrap();
        let red = colorous::RED_BLUE.eval_continuous(0.0).as_array();
        let blue = colorous::RED_BLUE.eval_continuous(1.0).as_array();
        let (width, pixels) = pixels(&path);
        let cell = |colour| (0..pixels.len()).filter(|&i| pixels[i] == colour && i % (width as usize) < 1600).count();
        assert!(cell(red) > 1000 && cell(blue) == 0, "{} red, {} blue", cell(red), cell(blue));
    }

    #[test]
    fn edges_lie_half_a_cell_outside() {
        assert_eq!(edges(&map().columns), -0.25..3.75);
        assert_eq!(edges(&Axis::new("time", "s", vec![2.0])), 1.5..2.5);
    }
}
