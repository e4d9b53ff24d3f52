"""Finds what physics a simulator leaves out of a recording, and adds it.

The script records a person with a radar whose transmitter leaks into its receivers, and asks why a simulator disagrees with
the recording. It prints what is found, the held-out error of a trained simulator without and with it, and the level in the
leakage's range cell. The report is FOLDER/why/report.html.

    python examples/diagnose_and_add.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import hybridsim

ROOT = Path(__file__).resolve().parents[1]
# The radar, room and simulator of configs/test.toml, with more samples; the leakage is what the simulator is not told about.
CONFIG = f"""
extends = "{ROOT / 'configs/test.toml'}"

[record]
frames = 8

[record.radar]
sample_rate_hz = 4.4e6
samples_per_chirp = 64

[record.surface]
returns = "vertices"

[record.effects.tx_leakage]
range_m = 0.09
relative = 0.3                # of the signal's largest sample

[diagnosis]
epochs = 6
limits = false                # how strong the effects can be at most that were not found takes much longer
"""


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "leakage.toml").write_text(CONFIG)
    recording = hybridsim.record(folder / "leakage.toml", folder / "recording", progress=False)
    report = hybridsim.diagnose(recording, out=folder / "why", config=folder / "leakage.toml", progress=False)
    print(report.sentence)
    for effect in report.effects:
        print(f"found: {effect['id']}", {name: value["value"] for name, value in effect["parameters"].items()})
    for when, error in report.data["simulator"].items():
        print(f"held-out error {when}: {error['db_mse']:.2f} dB^2, PSNR {error['psnr_db']:.2f} dB")

    # The checkpoint has the effect in it, for this and every other motion; it can be left out again.
    same = dict(recording=recording, progress=False)
    made = {
        "recorded": recording.samples(),
        "simulated without it": hybridsim.simulate(report.checkpoint, without_effects=True, **same),
        "simulated with it": hybridsim.simulate(report.checkpoint, **same),
    }
    for name, samples in made.items():
        found = hybridsim.heatmaps(samples, recording.radar)["range_doppler"]
        level = found.values[np.abs(found.rows.values).argmin(), np.abs(found.columns.values - 0.09).argmin()]
        print(f"{name}: {level:.1f} dB at 0.09 m, 0 m/s")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
