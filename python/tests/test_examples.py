"""Every example runs by the command that its docstring names, and what it prints is right."""

from __future__ import annotations

import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import hybridsim

NUMBER = r"([-+]?\d+(?:\.\d+)?)"


def numbers(said: str, line: str) -> list[float]:
    """The numbers where the pattern `line` has `#`."""
    found = re.search("^" + line.replace("#", NUMBER) + "$", said, re.MULTILINE)
    assert found, f"no line `{line}` in:\n{said}"
    return [float(number) for number in found.groups()]


def is_the_walker(said: str, frame: int, recording: hybridsim.Recording, folder: Path, more: str = "") -> None:
    """The strongest moving cell that was printed is within a cell of where the body is and how fast its parts are."""
    [range_m, velocity_mps] = numbers(said, rf"strongest moving cell of frame {frame}: # m, # m/s{more}")
    exported = hybridsim.export(recording, "npz", folder / "truth", progress=False)
    [archive] = exported.glob("*.npz")
    truth = np.load(archive)
    distances = np.linalg.norm(truth["vertices"][frame - 1 : frame + 2].astype(float), axis=-1)  # [frame, vertex]
    speeds = (distances[2] - distances[0]) / (2 * recording.radar.frame_period_s)
    derived = recording.radar.derived
    cell_m, cell_mps = derived["range_resolution_m"], derived["velocity_resolution_mps"]
    assert distances[1].min() - cell_m <= range_m <= distances[1].max() + cell_m, (range_m, distances[1])
    # Of most parts at that range: limbs that swing are faster, and change their velocity within two frame periods.
    slow, fast = np.percentile(speeds[np.abs(distances[1] - range_m) <= 2 * cell_m], [10, 90])
    assert slow - cell_mps <= velocity_mps <= fast + cell_mps, (slow, velocity_mps, fast)


def new_motion(said: str, folder: Path) -> None:
    recording = hybridsim.read(folder / "made" / "recording")
    assert "samples: 8 x 1 x 2 x 64 x 128" in said and recording.labels == {"action": "walk_clockwise"}
    is_the_walker(said, 5, recording, folder, ".*")
    assert (folder / "made" / "range_doppler.png").is_file()


def own_radar(said: str, folder: Path) -> None:
    recording = hybridsim.read(folder / "recording")
    radar, c = recording.radar, 299_792_458.0
    swept_hz = radar.slope_hz_per_s * radar.samples_per_chirp / radar.sample_rate_hz
    [resolution_m, farthest_m] = numbers(said, "range resolution: # m, up to # m")
    assert resolution_m == pytest.approx(c / (2 * swept_hz), rel=1e-3)
    assert farthest_m == pytest.approx(radar.samples_per_chirp * resolution_m, rel=2e-3)
    [resolution_mps, fastest_mps] = numbers(said, "velocity resolution: # m/s, up to # m/s")
    centre_hz = radar.start_frequency_hz + radar.slope_hz_per_s * radar.adc_start_s + swept_hz / 2
    # Both transmitters take their turn within a loop.
    assert fastest_mps == pytest.approx(c / centre_hz / (4 * 2 * radar.chirp_period_s), rel=0.01)
    assert resolution_mps == pytest.approx(2 * fastest_mps / radar.loops_per_frame, rel=2e-3)
    is_the_walker(said, 2, recording, folder)


def import_dca1000(said: str, folder: Path) -> None:
    assert "samples equal: True" in said
    made, recording = hybridsim.read(folder / "made"), hybridsim.read(folder / "recording")
    assert np.array_equal(made.raw(), recording.raw()) and np.ptp(made.raw()) > 1000
    [truth_m, found_m] = numbers(said, "reflector: recorded at # m, found at # m")
    [cell_m] = numbers(said, "one cell: # m")
    assert truth_m == pytest.approx(np.hypot(0.4, 3.2), abs=1e-3) and abs(found_m - truth_m) <= cell_m / 2 + 1e-3


def diagnose_and_add(said: str, folder: Path) -> None:
    assert re.findall("^found: (\\w+)", said, re.MULTILINE) == ["tx_leakage"]
    [_, range_m] = numbers(said, "found: tx_leakage, level_db # range_m #")
    assert range_m == pytest.approx(0.09, abs=0.01)
    error = {name: numbers(said, rf"held-out error {name}: # dB\^2, PSNR # dB") for name in ("without it", "with it")}
    assert error["with it"][0] < error["without it"][0] - 5 and error["with it"][1] > error["without it"][1] + 1
    names = ("recorded", "simulated without it", "simulated with it")
    recorded, without, added = (numbers(said, rf"{name}: # dB at 0\.09 m, 0 m/s")[0] for name in names)
    assert abs(added - recorded) < 3 and without < recorded - 20
    assert (folder / "why" / "report.html").is_file()


def dataset(said: str, folder: Path) -> None:
    [train, test, velocities] = numbers(said, "train: # windows of s1, s2; test: # of s3; # velocities")
    kept = np.load(folder / "dataset.npz")
    assert kept["x"].shape == (train, velocities) and kept["x_test"].shape == (test, velocities)
    assert list(kept["classes"]) == ["arm_swing", "walk_back_forth"] and set(kept["y_test"]) == {0, 1}
    correct = [numbers(said, f"{name}: # of # windows of s3 correct") for name in kept["classes"]]
    # Chance is a half.
    assert sum(of for _, of in correct) == test and sum(number for number, _ in correct) >= 0.75 * test


EXAMPLES: dict[str, Callable[[str, Path], None]] = {
    function.__name__: function for function in (new_motion, own_radar, import_dca1000, diagnose_and_add, dataset)
}


def test_every_example_is_tested_short_and_says_how_to_run_it() -> None:
    files = sorted((ROOT / "examples").glob("*.py"))
    assert [file.stem for file in files] == sorted(EXAMPLES)
    page = (ROOT / "docs" / "python.md").read_text()
    for file in files:
        text = file.read_text()
        assert len(text.splitlines()) <= 60 and f"python examples/{file.name} [FOLDER]" in text, file
        assert f"python examples/{file.name}" in page, file


@pytest.mark.parametrize("name", sorted(EXAMPLES))
def test_an_example_prints_what_is_true(name: str, tmp_path: Path) -> None:
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    command = [sys.executable, str(ROOT / "examples" / f"{name}.py"), str(tmp_path / "out")]
    done = subprocess.run(command, cwd=elsewhere, capture_output=True, text=True, timeout=600)
    assert done.returncode == 0, done.stderr
    EXAMPLES[name](done.stdout, tmp_path / "out")
    assert not list(elsewhere.iterdir()), "an example writes into its folder alone"


def test_an_example_needs_no_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    command = [sys.executable, str(ROOT / "examples" / "import_dca1000.py")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600, check=True)
    assert "samples equal: True" in done.stdout and len(list(tmp_path.iterdir())) == 1
