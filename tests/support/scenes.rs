//! Recordings of scenes that tests describe: antennas, and a recorder's settings as text.

use std::path::{Path, PathBuf};

use hybridsim::data::settings::read_text;
use hybridsim::recorder::{self, RecorderConfig};

/// One transmitter, four receivers half a wavelength apart.
pub const ONE: &str =
    "tx_m = [[-0.0153, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]";
/// Two transmitters that make eight receivers of four.
pub const TWO: &str = "tx_m = [[-0.0153, 0.0, 0.0], [-0.0077, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]";
/// Three transmitters in turn, one of them higher.
pub const THREE: &str = "tx_m = [[-0.0153, 0.0, 0.0], [-0.0115, 0.0, 0.0019], [-0.0077, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0038, 0.0, 0.0], [0.0057, 0.0, 0.0]]";
/// A square of receivers.
pub const SQUARE: &str =
    "tx_m = [[-0.0153, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0], [0.0, 0.0, 0.0019], [0.0019, 0.0, 0.0019]]";

/// `text` is TOML over the recorder's defaults; ten frames a second.
pub fn recorded(folder: &Path, text: &str, antennas: &str) -> PathBuf {
    recorded_as("loops_per_frame = 32\nchirp_period_s = 108.0e-6\nframe_period_s = 0.1", folder, text, antennas)
}

pub fn recorded_as(timing: &str, folder: &Path, text: &str, antennas: &str) -> PathBuf {
    let radar = format!(
        "[radar]\nstart_frequency_hz = 77.0e9\nslope_hz_per_s = 60.012e12\nsample_rate_hz = 4.4e6\nsamples_per_chirp = 128\n\
         adc_start_s = 6.0e-6\n{timing}\nframes = 12\n{antennas}"
    );
    let surface = if text.contains("[surface]") { "" } else { "[surface]\nedge_m = 0.012" };
    let config: RecorderConfig = read_text(&format!("{text}\n{surface}\n{radar}")).unwrap();
    let out = folder.join("recording");
    recorder::record_to(&config, Path::new("."), &out, &mut |_, _| {}).unwrap();
    out
}
