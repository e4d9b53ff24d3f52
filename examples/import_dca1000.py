"""Imports a capture of a DCA1000: adc_data.bin and the .mmwave.json that describes the radar.

The script makes the capture itself: it records a reflector in the open with a transmitter and the receivers of an IWR6843ISK
and exports the recording. It then imports the capture, compares the samples, and prints the range of the reflector.

    python examples/import_dca1000.py [FOLDER]
"""

import sys
import tempfile
import warnings
from pathlib import Path

import numpy as np

import hybridsim

REFLECTOR_M = (0.4, 3.2, 0.0)
CAPTURE = f"""
[record]
empty = true                  # no person
room = {{}}                     # no walls
furniture = [{{ position_m = {list(REFLECTOR_M)}, rcs_m2 = 0.1 }}]

[record.radar]
start_frequency_hz = 60.25e9
slope_hz_per_s = 50.0e12
sample_rate_hz = 4.0e6
samples_per_chirp = 128
loops_per_frame = 16
adc_start_s = 6.0e-6
chirp_period_s = 60.0e-6
frame_period_s = 0.05
frames = 8
tx_m = [[0.0, 0.0, 0.0]]
rx_m = [[0.0, 0.0, 0.0], [0.0024177, 0.0, 0.0], [0.0048354, 0.0, 0.0], [0.0072531, 0.0, 0.0]]
full_scale_codes = 32767
"""


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "capture.toml").write_text(CAPTURE)
    made = hybridsim.record(folder / "capture.toml", folder / "made", progress=False)
    capture = hybridsim.export(made, "dca1000", folder / "capture", board="IWR6843ISK", progress=False)
    print("capture:", *sorted(path.name for path in capture.iterdir()))
    files, description = sorted(capture.glob("*.bin")), next(capture.glob("*.mmwave.json"))
    # What is assumed is a warning, and a note of the recording.
    warnings.simplefilter("ignore", hybridsim.Note)
    recording = hybridsim.import_(files, folder / "recording", config=description, board="IWR6843ISK", progress=False)
    print(*(f"note: {note}" for note in recording.notes), sep="\n")
    print("samples equal:", np.array_equal(recording.samples(), made.samples()))
    found = hybridsim.heatmaps(recording)["range_doppler"]
    range_m = found.columns.values[found.values.max(axis=0).argmax()]
    print(f"reflector: recorded at {np.linalg.norm(REFLECTOR_M):.3f} m, found at {range_m:.3f} m")
    print(f"one cell: {recording.radar.derived['range_resolution_m']:.3f} m")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
