//! A point cloud as PLY (Stanford polygon format 1.0, text).

use std::io::Write;
use std::path::Path;

use super::Point;
use crate::data::atomic::write_file;
use crate::error::Result;

/// `x y z` in metres, `velocity` in m/s, `snr_db`; a cloud may be empty.
pub fn write(path: &Path, points: &[Point]) -> Result<()> {
    write_file(path, |file| {
        writeln!(file, "ply\nformat ascii 1.0\nelement vertex {}", points.len())?;
        for property in ["x", "y", "z", "velocity", "snr_db"] {
            writeln!(file, "property float {property}")?;
        }
        writeln!(file, "end_header")?;
        points.iter().try_for_each(|point| {
            let [x, y, z, velocity, snr_db] = point.numbers();
            writeln!(file, "{x:.5} {y:.5} {z:.5} {velocity:.5} {snr_db:.3}")
        })
    })
}
