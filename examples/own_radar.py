"""A radar of your own, described by its chirp parameters: what it resolves, and what it records of a person who walks.

The script prints the limits that follow from the chirp, and the strongest moving cell of a frame.

    python examples/own_radar.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import hybridsim

# 60 GHz, 2 GHz of sampled bandwidth. Two transmitters in turn and two receivers make a row of four virtual antennas.
RADAR = """
[record.radar]
start_frequency_hz = 60.25e9
slope_hz_per_s = 50.0e12
sample_rate_hz = 2.4e6
samples_per_chirp = 96
loops_per_frame = 64
adc_start_s = 6.0e-6
chirp_period_s = 150.0e-6
frame_period_s = 0.1
frames = 4
tx_m = [[0.0, 0.0, 0.0], [0.00489, 0.0, 0.0]]
rx_m = [[0.0, 0.0, 0.0], [0.002445, 0.0, 0.0]]
"""
SCENE = """
[record.person]
subject = "s2"
action = "walk_clockwise"
distance_m = 3.0

[record.surface]
returns = "vertices"
"""


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "radar.toml").write_text(RADAR + SCENE)
    recording = hybridsim.record(folder / "radar.toml", folder / "recording", progress=False)
    derived = recording.radar.derived
    print(f"range resolution: {derived['range_resolution_m']:.4f} m, up to {derived['max_range_m']:.2f} m")
    print(f"velocity resolution: {derived['velocity_resolution_mps']:.4f} m/s, up to {derived['max_velocity_mps']:.3f} m/s")

    # Of one frame, without its static returns.
    found = hybridsim.heatmaps(recording, frames=[2])["range_doppler_moving"]
    row, column = np.unravel_index(found.values.argmax(), found.values.shape)
    print(f"strongest moving cell of frame 2: {found.columns.values[column]:.2f} m, {found.rows.values[row]:+.2f} m/s")
    print("recording:", recording.folder)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
