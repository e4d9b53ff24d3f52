"""Imports a capture of a DCA1000: adc_data.bin and the .mmwave.json that describes the radar.

There is no board here, so the script makes the capture: it records a corner reflector in the open with the antennas of an
IWR6843ISK, and exports the recording as a DCA1000 would write it. It then imports the capture, says whether the samples are
equal, and prints the range of the reflector.

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
empty = true                  # nobody in the room
room = {{}}
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
frames = 12
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

    files = sorted(capture.glob("*.bin"))
    description = next(capture.glob("*.mmwave.json"))
    with warnings.catch_warnings():
        # What had to be assumed is a warning, and a note of the recording.
        warnings.simplefilter("ignore", hybridsim.Note)
        recording = hybridsim.import_(
            files, folder / "recording", config=description, board="IWR6843ISK", progress=False
        )
    for note in recording.notes:
        print("note:", note)
    print("samples equal:", np.array_equal(recording.samples(), made.samples()))

    found = hybridsim.heatmaps(recording)["range_doppler"]
    _, column = np.unravel_index(found.values.argmax(), found.values.shape)
    print(f"reflector: recorded at {np.linalg.norm(REFLECTOR_M):.3f} m, found at {found.columns.values[column]:.3f} m")
    print(f"one cell: {recording.radar.derived['range_resolution_m']:.3f} m")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
