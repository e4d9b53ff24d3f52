//! Many small maps side by side: one row for each recording, one column for each way to get it.

use std::path::Path;

use plotters::prelude::*;

use super::heatmap::{Axes, Colours, draw_bar, under, with_axes};
use super::{Area, DrawResult, INK, letters, save};
use crate::error::Result;
use crate::heatmap::Map;

const CELL: (u32, u32) = (260, 190);
const GAP: u32 = 14;
/// Of the rows' names.
const NAMES: u32 = 215;
/// Of the ordinate, left of the first column.
const LEFT: u32 = 64;
/// Of an abscissa, below a row.
const BELOW: u32 = 50;
const BAR: u32 = 116;
const TITLE: u32 = 44;
const HEADS: u32 = 30;

/// What all maps of a grid share.
pub struct Grid<'a> {
    pub title: &'a str,
    pub columns: &'a [String],
    pub rows: &'a [String],
    /// From the darkest to the brightest colour.
    pub low: f64,
    pub high: f64,
    /// Of the colour bar; none where columns have units of their own.
    pub unit: Option<&'a str>,
}

impl Grid<'_> {
    /// Writes the grid as PNG. `maps`: `[row][column]`, their rows upwards.
    ///
    /// # Panics
    /// When there are not as many maps as the names say, or none.
    pub fn save(&self, path: &Path, maps: &[Vec<Map>]) -> Result<()> {
        assert!(!maps.is_empty() && maps.len() == self.rows.len(), "grid: {} rows for {} names", maps.len(), self.rows.len());
        assert!(maps.iter().all(|row| row.len() == self.columns.len()), "grid: rows of {} columns", self.columns.len());
        // An abscissa that all rows share stands below the last.
        let alike = maps.iter().all(|row| row[0].columns == maps[0][0].columns);
        let layout = Layout { alike, rows: self.rows.len() as u32, columns: self.columns.len() as u32 };
        let colours = Colours::between(self.low, self.high);
        save(path, layout.size(), |area| {
            let area = under(area, self.title, 26, TITLE)?;
            for (column, name) in (0..).zip(self.columns) {
                let (x, _) = layout.corner(0, column);
                under(&area.clone().shrink((x, 0), (CELL.0, HEADS)), name, 19, HEADS)?;
            }
            for (row, (name, maps)) in (0..).zip(self.rows.iter().zip(maps)) {
                let (_, y) = layout.corner(row, 0);
                area.draw_text(name, &letters(18), (8, (y + CELL.1 / 2) as i32 - 9))?;
                for (column, map) in (0..).zip(maps) {
                    draw_cell(&area, &layout, (row, column), map, &colours)?;
                }
            }
            if let Some(unit) = self.unit {
                let (x, y) = (layout.size().0 - BAR, HEADS);
                let height = (layout.size().1 - TITLE - HEADS).min(2 * (CELL.1 + BELOW));
                draw_bar(&area.clone().shrink((x, y), (BAR, height)), unit, &colours)?;
            }
            Ok(())
        })
    }
}

/// Where the cells are, pixels below the title.
struct Layout {
    /// Whether all rows have one abscissa.
    alike: bool,
    rows: u32,
    columns: u32,
}

impl Layout {
    fn size(&self) -> (u32, u32) {
        let (_, last) = self.corner(self.rows - 1, 0);
        (NAMES + LEFT + self.columns * (CELL.0 + GAP) + BAR, TITLE + last + CELL.1 + BELOW)
    }

    /// Of a cell's map, left and above.
    fn corner(&self, row: u32, column: u32) -> (u32, u32) {
        let below = if self.alike { 0 } else { BELOW };
        (NAMES + LEFT + column * (CELL.0 + GAP), HEADS + row * (CELL.1 + GAP + below))
    }

    fn has_abscissa(&self, row: u32) -> bool {
        !self.alike || row + 1 == self.rows
    }
}

/// A map with its frame; the ordinate in the first column, the abscissa where the row has one.
fn draw_cell(area: &Area<'_>, layout: &Layout, (row, column): (u32, u32), map: &Map, colours: &Colours) -> DrawResult {
    let (x, y) = layout.corner(row, column);
    let left = if column == 0 { LEFT } else { 0 };
    let below = if layout.has_abscissa(row) { BELOW } else { 0 };
    let axes = Axes { below, left, ticks: [6, 5], names: 17, numbers: 15 };
    with_axes(&area.clone().shrink((x - left, y), (CELL.0 + left, CELL.1 + below)), map, colours, &axes)?;
    let (right, bottom) = ((x + CELL.0) as i32 - 1, (y + CELL.1) as i32 - 1);
    Ok(area.draw(&Rectangle::new([(x as i32, y as i32), (right, bottom)], INK))?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::Axis;

    #[test]
    fn every_map_stands_in_its_row_and_column() {
        let map = |value: f64| {
            let rows = Axis::new("velocity", "m/s", vec![-1.0, 0.0, 1.0]);
            Map::new(rows, Axis::new("range", "m", vec![0.0, 1.0]), vec![value; 6])
        };
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("grid.png");
        let names = |names: [&str; 2]| names.map(String::from);
        let grid = Grid {
            title: "a grid",
            columns: &names(["left", "right"]),
            rows: &names(["above", "below"]),
            low: -40.0,
            high: 0.0,
            unit: Some("dB"),
        };
        grid.save(&path, &[vec![map(-40.0), map(0.0)], vec![map(-20.0), map(-100.0)]]).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap())).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let width = reader.next_frame(&mut pixels).unwrap().width;
        let at = |row: u32, column: u32| {
            let (x, y) = Layout { alike: true, rows: 2, columns: 2 }.corner(row, column);
            let start = (((TITLE + y + CELL.1 / 2) * width + x + CELL.0 / 2) * 3) as usize;
            [pixels[start], pixels[start + 1], pixels[start + 2]]
        };
        let colour = |t: f64| colorous::VIRIDIS.eval_continuous(t).as_array();
        assert_eq!([at(0, 0), at(0, 1), at(1, 0), at(1, 1)], [colour(0.0), colour(1.0), colour(0.5), colour(0.0)]);
    }
}
