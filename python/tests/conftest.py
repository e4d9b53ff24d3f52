"""Recordings that the tests make themselves, through the module."""

from __future__ import annotations

from pathlib import Path

import pytest

import hybridsim

ROOT = Path(__file__).resolve().parents[2]

SITE = """
seed = 11
subjects = ["s1", "s2", "s3"]
unseen = ["s3"]
actions = ["walk_back_forth", "arm_swing"]
repetitions = 1

[style]
path_scale = [0.6, 0.8]

[record]
frames = 6

[record.surface]
returns = "vertices"

[record.walls]
patch_m = 0.2

[record.radar]
start_frequency_hz = 77.0e9
slope_hz_per_s = 60.012e12
sample_rate_hz = 4.4e6
samples_per_chirp = 64
loops_per_frame = 16
adc_start_s = 6.0e-6
chirp_period_s = 216.0e-6
frame_period_s = 0.1
frames = 6
tx_m = [[0.0, 0.0, 0.0]]
rx_m = [[0.0, 0.0, 0.0], [0.0019467, 0.0, 0.0]]

[record.room]
left_m = 2.2
right_m = 2.5
front_m = 5.4
back_m = 0.6
floor_m = 1.0
ceiling_m = 1.7
"""


@pytest.fixture(scope="session")
def config() -> Path:
    """The smallest experiment that still learns."""
    return ROOT / "configs" / "test.toml"


@pytest.fixture(scope="session")
def recording(config: Path, tmp_path_factory: pytest.TempPathFactory) -> hybridsim.Recording:
    return hybridsim.record(config, tmp_path_factory.mktemp("made") / "recording", progress=False)


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    (folder / "site.toml").write_text(SITE)
    hybridsim.site(folder / "site.toml", folder / "made", progress=False)
    return folder / "made"


@pytest.fixture(scope="session")
def run(config: Path, tmp_path_factory: pytest.TempPathFactory) -> hybridsim.Run:
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        # The recording that is made to train on lies below the working folder.
        patch.chdir(folder)
        return hybridsim.train(config, out=folder / "run", set={"training.epochs": 2}, device="flex", progress=False)
