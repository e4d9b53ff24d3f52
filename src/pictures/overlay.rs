//! Maps with what is expected drawn over them.

use std::path::Path;

use super::heatmap::{Colours, draw_bar, draw_map_under, under};
use super::save;
use crate::error::Result;
use crate::heatmap::Map;
use crate::metrics::DbWindow;

const TITLE_HEIGHT: u32 = 44;
const CAPTION_HEIGHT: u32 = 26;
const BAR_WIDTH: u32 = 116;
const PANEL: (u32, u32) = (760, 400);

/// Points (column, row) in the units of a map's axes.
pub type Line = Vec<(f64, f64)>;

/// Writes maps as PNG, one below the other, each in columns with other lines over it. `rows`: of each row the map of decibels, and its
/// lines by column; `columns`: what the columns are called.
///
/// # Panics
/// When a row has not as many columns as there are names.
pub fn overlay(path: &Path, title: &str, columns: &[&str], rows: &[(&Map, Vec<Vec<Line>>)], window: DbWindow) -> Result<()> {
    assert!(rows.iter().all(|(_, lines)| lines.len() == columns.len()), "overlay: rows of {} columns", columns.len());
    let size = (columns.len() as u32 * PANEL.0 + BAR_WIDTH, TITLE_HEIGHT + rows.len() as u32 * PANEL.1);
    let colours = Colours::sequential(window);
    save(path, size, |area| {
        let area = under(area, title, 26, TITLE_HEIGHT)?;
        for (row, (map, lines)) in rows.iter().enumerate() {
            let top = row as u32 * PANEL.1;
            for (column, (name, lines)) in columns.iter().zip(lines).enumerate() {
                let panel = area.clone().shrink((column as u32 * PANEL.0, top), PANEL);
                draw_map_under(&under(&panel, name, 20, CAPTION_HEIGHT)?, map, &colours, lines)?;
            }
            let bar = area.clone().shrink((columns.len() as u32 * PANEL.0, top), (BAR_WIDTH, PANEL.1));
            draw_bar(&under(&bar, "", 20, CAPTION_HEIGHT)?, "dB", &colours)?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::Axis;

    #[test]
    fn a_line_lies_over_its_own_column_only() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("overlay.png");
        let map = Map::new(Axis::new("range", "m", vec![0.0, 1.0, 2.0]), Axis::new("time", "s", vec![0.0, 1.0]), vec![0.0; 6]);
        let line: Line = vec![(0.0, 1.0), (1.0, 1.0)];
        let window = DbWindow { low_db: 0.0, high_db: 40.0 };
        overlay(&path, "t", &["as stated", "as found"], &[(&map, vec![vec![], vec![line]])], window).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap())).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let width = reader.next_frame(&mut pixels).unwrap().width;
        // White where the line is, and the map's colour above and below.
        let is = |left: u32, y: u32, wanted: std::ops::RangeInclusive<u8>| {
            (left + 300..left + 500)
                .all(|x| pixels[((y * width + x) * 3) as usize..][..3].iter().all(|value| wanted.contains(value)))
        };
        let rows = TITLE_HEIGHT + CAPTION_HEIGHT + 20..TITLE_HEIGHT + PANEL.1 - 20;
        let white =
            |left: u32| rows.clone().any(|y| is(left, y, 200..=255) && is(left, y - 10, 0..=150) && is(left, y + 10, 0..=150));
        assert!(!white(0) && white(PANEL.0));
    }
}
