"""Finds what physics a simulator leaves out of a recording, and adds it.

The script records a person with a radar whose transmitter leaks into its receivers, and diagnoses the recording. It prints
what is found, the held-out error of a trained simulator without and with it, and the level in the leakage's range cell.

    python examples/diagnose_and_add.py [FOLDER]
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import hybridsim

ROOT = Path(__file__).resolve().parents[1]
# The scene and simulator of configs/test.toml, with more samples. The simulator is not told of the leakage.
CONFIG = f"""
extends = "{ROOT / 'configs/test.toml'}"

[record]
frames = 8
surface.returns = "vertices"
radar.sample_rate_hz = 4.4e6
radar.samples_per_chirp = 64
effects.tx_leakage = {{ range_m = 0.09, relative = 0.3 }}     # 0.3 of the signal's largest sample
[diagnosis]
epochs = 6
limits = false                # true: also how strong can be at most what was not found; takes several times as long
"""


def main(folder: Path) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "leakage.toml").write_text(CONFIG)
    recording = hybridsim.record(folder / "leakage.toml", folder / "recording", progress=False)
    report = hybridsim.diagnose(recording, out=folder / "why", config=folder / "leakage.toml", progress=False)
    print(f"{report.sentence}\nreport: {report.html}")
    for effect in report.effects:
        print(f"found: {effect['id']},", *(f"{name} {value['value']:.3f}" for name, value in effect["parameters"].items()))
    for name, when in (("without it", "before"), ("with it", "after")):
        error = report.data["simulator"][when]
        print(f"held-out error {name}: {error['db_mse']:.2f} dB^2, PSNR {error['psnr_db']:.2f} dB")

    # The checkpoint holds the effect, for this and any other motion; `without_effects` leaves it out.
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
