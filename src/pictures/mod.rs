//! PNG pictures for people: heatmaps, measured beside simulated, curves.
//!
//! The letters come with the program, so that a bare machine draws them too.

mod chart;
mod confusion;
mod grid;
mod heatmap;
mod overlay;
pub mod page;
mod panels;
mod scale;
mod window;

pub use chart::{Chart, Series};
pub use confusion::confusion;
pub use grid::Grid;
pub use heatmap::{Captions, comparison, heatmap};
pub use overlay::{Line, overlay};
pub use panels::{Panel, panels};
pub use scale::Scale;
pub use window::window;

use std::{io, path::Path, sync::Once};

use plotters::coord::Shift;
use plotters::prelude::*;

use crate::{data::atomic::write_file, error::Result};

type Area<'a> = DrawingArea<BitMapBackend<'a>, Shift>;
type DrawResult = std::result::Result<(), Box<dyn std::error::Error>>;

const FONT: &str = "sans-serif";
const INK: RGBColor = RGBColor(30, 30, 30);

fn letters(size: u32) -> TextStyle<'static> {
    static REGISTERED: Once = Once::new();
    REGISTERED.call_once(|| {
        let registered = plotters::style::register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT);
        assert!(registered.is_ok(), "the embedded font cannot be read");
    });
    (FONT, size).into_font().color(&INK)
}

/// Draw on a white canvas, and write it as PNG.
fn save(path: &Path, size: (u32, u32), draw: impl FnOnce(&Area<'_>) -> DrawResult) -> Result<()> {
    let mut pixels = vec![255; (size.0 * size.1 * 3) as usize];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, size).into_drawing_area();
        // only a bug can make drawing into memory fail
        draw(&area).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        area.present().expect("a buffer of the right size");
    }
    write_file(path, |file| {
        let mut encoder = png::Encoder::new(file, size.0, size.1);
        encoder.set_color(png::ColorType::Rgb);
        encoder.set_depth(png::BitDepth::Eight);
        let mut writer = encoder.write_header()?;
        writer.write_image_data(&pixels)?;
        writer.finish().map_err(io::Error::from)
    })
}

/// Ticks without needless digits; thousands and millions as k and M, where plain numbers would be long.
fn tick(value: &f64) -> String {
    let (scale, suffix) = match value.abs() {
        size if size >= 1e6 => (1e6, "M"),
        size if size >= 1e4 => (1e3, "k"),
        _ => (1.0, ""),
    };
    // −0 reads as 0
    let text = format!("{:.3}", value / scale + 0.0);
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0".into() } else { text.replace('-', "−") + suffix }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;

    #[test]
    fn ticks_have_no_needless_digits() {
        assert_eq!(
            [0.0, -0.0, 2.5, -40.0, 100.0, 0.125, -0.0001, 9999.0, 350e3, -2.5e6].map(|v| tick(&v)),
            ["0", "0", "2.5", "−40", "100", "0.125", "0", "9999", "350k", "−2.5M"]
        );
    }

    #[test]
    fn a_picture_is_whole_or_absent() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.png");
        save(&path, (20, 10), |area| Ok(area.fill(&RED)?)).unwrap();
        let reader = png::Decoder::new(io::BufReader::new(std::fs::File::open(&path).unwrap())).read_info().unwrap();
        assert_eq!((reader.info().width, reader.info().height), (20, 10));
        // nothing else was left
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
        let absent = folder.path().join("absent/a.png");
        let error = save(&absent, (20, 10), |_| Ok(())).unwrap_err();
        assert!(matches!(&error, Error::Write { path, .. } if path == &absent), "{error}");
    }

    #[test]
    fn letters_are_drawn_without_a_font_on_the_machine() {
        let mut pixels = vec![255; 200 * 40 * 3];
        {
            let area = BitMapBackend::with_buffer(&mut pixels, (200, 40)).into_drawing_area();
            area.draw_text("range (m) °", &letters(24), (5, 5)).unwrap();
        }
        let dark = pixels.chunks_exact(3).filter(|pixel| pixel[0] < 128).count();
        assert!((100..2000).contains(&dark), "{dark} dark pixels");
    }
}
