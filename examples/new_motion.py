"""A new person and a new motion through the trained model that ships here (models/quickstart); no training.

The script prints the strongest moving cell of a frame's range-Doppler map.

    python examples/new_motion.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import hybridsim

ROOT = Path(__file__).resolve().parents[1]
FRAME = 5


def main(folder: Path) -> None:
    # The model was trained on person s1. A recording holds its person's body: a frame of s3 gives that of s3.
    other = {"record.frames": 1, "record.person.subject": "s3", "record.surface.returns": "vertices"}
    body = hybridsim.record(ROOT / "configs/quickstart.toml", folder / "s3", set=other, progress=False).folder / "body.npz"

    recording = hybridsim.simulate(
        ROOT / "models/quickstart",
        action="walk_clockwise",
        body=body,
        distance_m=3.0,
        frames=8,
        out=folder / "made",
        progress=False,
    )
    print("samples:", " x ".join(map(str, recording.radar.shape)), "(frame x tx x rx x loop x sample)")

    # Of one frame, without its static returns.
    found = hybridsim.heatmaps(recording, frames=[FRAME])["range_doppler_moving"]
    row, column = np.unravel_index(found.values.argmax(), found.values.shape)
    print(
        f"strongest moving cell of frame {FRAME}: {found.columns.values[column]:.2f} m, {found.rows.values[row]:+.2f} m/s, "
        f"{found.values[row, column]:.1f} dB above one ADC code"
    )
    derived = recording.radar.derived
    print(f"one cell: {derived['range_resolution_m']:.3f} m, {derived['velocity_resolution_mps']:.3f} m/s")
    print("recording and pictures:", folder / "made")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
