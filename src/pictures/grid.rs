//! Many small maps side by side: one row for each recording, one column for each way to get it.

use std::path::Path;

use plotters::prelude::*;

use super::heatmap::{Colours, draw_bar, paint, under};
use super::{Area, DrawResult, INK, letters, save, tick};
use crate::error::Result;
use crate::heatmap::{Axis, Map};

const CELL: (u32, u32) = (260, 190);
const GAP: u32 = 8;
const NAMES: u32 = 250;
const BAR: u32 = 116;
const TITLE: u32 = 44;
const HEADS: u32 = 30;
const FOOT: u32 = 34;

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
        let (columns, rows) = (self.columns.len() as u32, self.rows.len() as u32);
        let size = (NAMES + columns * (CELL.0 + GAP) + BAR, TITLE + HEADS + rows * (CELL.1 + GAP) + FOOT);
        let colours = Colours::between(self.low, self.high);
        // Axes that all rows share are said once.
        let alike = maps.iter().all(|row| axes(&row[0]) == axes(&maps[0][0]));
        save(path, size, |area| {
            let area = under(area, self.title, 26, TITLE)?;
            for (column, name) in self.columns.iter().enumerate() {
                let x = NAMES + column as u32 * (CELL.0 + GAP);
                let head = area.clone().shrink((x, 0), (CELL.0, HEADS));
                under(&head, name, 19, HEADS)?;
            }
            for (row, (name, maps)) in self.rows.iter().zip(maps).enumerate() {
                let y = HEADS + row as u32 * (CELL.1 + GAP);
                let middle = (y + CELL.1 / 2) as i32;
                area.draw_text(name, &letters(18), (8, middle - 9))?;
                if !alike {
                    let [right, up] = axes(&maps[0]);
                    area.draw_text(&format!("right: {right}"), &letters(15), (8, middle + 16))?;
                    area.draw_text(&format!("up: {up}"), &letters(15), (8, middle + 34))?;
                }
                for (column, map) in maps.iter().enumerate() {
                    let x = NAMES + column as u32 * (CELL.0 + GAP);
                    draw_cell(&area.clone().shrink((x, y), CELL), map, &colours)?;
                }
            }
            if let Some(unit) = self.unit {
                let height = (rows * (CELL.1 + GAP)).min(2 * (CELL.1 + GAP));
                draw_bar(&area.clone().shrink((size.0 - BAR, HEADS), (BAR, height)), unit, &colours)?;
            }
            if alike {
                let [right, up] = axes(&maps[0][0]);
                let y = (HEADS + rows * (CELL.1 + GAP)) as i32 + 6;
                area.draw_text(&format!("to the right: {right}; upwards: {up}"), &letters(17), (NAMES as i32, y))?;
            }
            Ok(())
        })
    }
}

/// To the right, and upwards.
fn axes(map: &Map) -> [String; 2] {
    [span(&map.columns), span(&map.rows)]
}

fn span(axis: &Axis) -> String {
    format!("{} {} to {} {}", axis.name, tick(&axis.values[0]), tick(&axis.values[axis.len() - 1]), axis.unit)
}

fn draw_cell(area: &Area<'_>, map: &Map, colours: &Colours) -> DrawResult {
    paint(area, map, colours)?;
    let (width, height) = area.dim_in_pixel();
    area.draw(&Rectangle::new([(0, 0), (width as i32 - 1, height as i32 - 1)], INK))?;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

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
            let x = NAMES + column * (CELL.0 + GAP) + CELL.0 / 2;
            let y = TITLE + HEADS + row * (CELL.1 + GAP) + CELL.1 / 2;
            let start = ((y * width + x) * 3) as usize;
            [pixels[start], pixels[start + 1], pixels[start + 2]]
        };
        let colour = |t: f64| colorous::VIRIDIS.eval_continuous(t).as_array();
        assert_eq!([at(0, 0), at(0, 1), at(1, 0), at(1, 1)], [colour(0.0), colour(1.0), colour(0.5), colour(0.0)]);
    }
}
