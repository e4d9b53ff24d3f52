//! What was taken for what.

use std::path::Path;

use plotters::prelude::*;

use super::{INK, letters, save};
use crate::error::Result;

const CELL: i32 = 84;
const NAMES: i32 = 250;
const TITLE: i32 = 50;

/// Counts `[class][judged]` as a square of cells, dark where a class often is judged so; every row sums to the class's count.
///
/// # Panics
/// When the counts are not as many rows and columns as there are names.
pub fn confusion(path: &Path, title: &str, names: &[String], counts: &[Vec<usize>]) -> Result<()> {
    let classes = names.len();
    assert!(counts.len() == classes && counts.iter().all(|row| row.len() == classes), "confusion: {classes} names");
    let side = classes as i32 * CELL;
    save(path, ((NAMES + side + 30) as u32, (TITLE + side + NAMES) as u32), |area| {
        area.draw_text(title, &letters(26), (NAMES, 12))?;
        for (row, (name, judged)) in names.iter().zip(counts).enumerate() {
            let y = TITLE + row as i32 * CELL;
            let width = area.estimate_text_size(name, &letters(18))?.0 as i32;
            area.draw_text(name, &letters(18), (NAMES - 12 - width, y + CELL / 2 - 9))?;
            let all = judged.iter().sum::<usize>().max(1) as f64;
            for (column, &count) in judged.iter().enumerate() {
                let x = NAMES + column as i32 * CELL;
                let share = count as f64 / all;
                let colorous::Color { r, g, b } = colorous::BLUES.eval_continuous(0.9 * share);
                let corners = [(x, y), (x + CELL - 2, y + CELL - 2)];
                area.draw(&Rectangle::new(corners, RGBColor(r, g, b).filled()))?;
                if count > 0 {
                    let text = count.to_string();
                    let colour = if share > 0.5 { WHITE } else { INK };
                    let style = letters(22).color(&colour);
                    let (width, height) = area.estimate_text_size(&text, &style)?;
                    area.draw_text(&text, &style, (x + (CELL - width as i32) / 2, y + (CELL - height as i32) / 2))?;
                }
            }
        }
        for (column, name) in names.iter().enumerate() {
            let style = letters(18).transform(FontTransform::Rotate90);
            area.draw_text(name, &style, (NAMES + column as i32 * CELL + CELL / 2 + 9, TITLE + side + 12))?;
        }
        Ok(())
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_that_are_full_are_dark_and_empty_ones_are_light() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("confusion.png");
        confusion(&path, "t", &["a".into(), "b".into()], &[vec![9, 0], vec![0, 3]]).unwrap();
        let mut reader = png::Decoder::new(std::io::BufReader::new(std::fs::File::open(&path).unwrap())).read_info().unwrap();
        let mut pixels = vec![0; reader.output_buffer_size().unwrap()];
        let info = reader.next_frame(&mut pixels).unwrap();
        let at = |row: i32, column: i32| {
            let (x, y) = (NAMES + column * CELL + 4, TITLE + row * CELL + 4);
            pixels[((y as u32 * info.width + x as u32) * 3) as usize]
        };
        assert!(at(0, 0) < 80 && at(1, 1) < 80, "{} {}", at(0, 0), at(1, 1));
        assert!(at(0, 1) > 200 && at(1, 0) > 200);
    }
}
