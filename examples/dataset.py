"""A labelled data set of micro-Doppler: three people, two actions, one room. One person is left out for the test.

The script records a small site, makes velocity spectra with classes of windows of frames, and prints how many windows of the
unseen person the nearest class mean classifies correctly. With torch the data set is a torch.utils.data.Dataset.

    python examples/dataset.py [FOLDER]
"""

import importlib.util
import sys
import tempfile
from pathlib import Path

import numpy as np

import hybridsim

ROOT = Path(__file__).resolve().parents[1]
# The smallest site that ships, with fewer people and actions.
SUBJECTS, ACTIONS = ["s1", "s2", "s3"], ["walk_back_forth", "arm_swing"]
CHANGES = {"subjects": SUBJECTS, "unseen": ["s3"], "actions": ACTIONS, "record.frames": 10}
Dataset = hybridsim.torch.RecordingDataset if importlib.util.find_spec("torch") else hybridsim.Windows


def main(folder: Path) -> None:
    made = hybridsim.site(ROOT / "configs/site_smoke.toml", folder / "site", set=CHANGES, progress=False)
    radar = made[0].radar
    print(f"{len(made)} recordings of {len(made[0])} frames, one every {radar.frame_period_s} s")

    def spectrum(samples: np.ndarray) -> np.ndarray:
        """The share of the moving power at each velocity in dB."""
        power = hybridsim.heatmaps(samples, radar, db=False)["time_doppler"].values.mean(axis=1)
        return 10 * np.log10(power / power.sum() + 1e-6)

    def windows(unseen: bool, classes: list[str] | None = None) -> tuple[np.ndarray, np.ndarray, list[str]]:
        data = Dataset(
            folder / "site",
            window=4,
            hop=2,
            transform=spectrum,
            classes=classes,
            where=lambda recording: (recording.labels["subject"] == "s3") == unseen,
        )
        return np.array([np.asarray(x) for x, _ in data]), np.array(data.targets), data.classes

    x, y, classes = windows(unseen=False)
    x_test, y_test, _ = windows(unseen=True, classes=classes)
    np.savez(folder / "dataset.npz", x=x, y=y, x_test=x_test, y_test=y_test, classes=classes)
    print(f"train: {len(x)} windows of s1, s2; test: {len(x_test)} of s3; {x.shape[1]} velocities")

    centroids = np.stack([x[y == number].mean(axis=0) for number in range(len(classes))])
    found = np.linalg.norm(x_test[:, None] - centroids, axis=2).argmin(axis=1)
    for number, name in enumerate(classes):
        print(f"{name}: {np.sum(found[y_test == number] == number)} of {np.sum(y_test == number)} windows of s3 correct")
    print("data set:", folder / "dataset.npz")


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else tempfile.mkdtemp()))
