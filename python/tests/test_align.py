from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import SITE

import hybridsim

WALK = """
seed = 5

[record]
person.action = "walk_back_forth"
surface.returns = "vertices"
walls.patch_m = 0.2

"""


@pytest.fixture(scope="module")
def walk(tmp_path_factory: pytest.TempPathFactory) -> hybridsim.Recording:
    """A walk before four receivers."""
    folder = tmp_path_factory.mktemp("walk")
    scene = SITE[SITE.index("[record.radar]") :].replace("loops_per_frame = 16", "loops_per_frame = 32")
    two = "[0.0019467, 0.0, 0.0]"
    scene = scene.replace("frames = 6", "frames = 16").replace(two, f"{two}, [0.0038934, 0.0, 0.0], [0.0058401, 0.0, 0.0]")
    (folder / "walk.toml").write_text(WALK + scene)
    return hybridsim.record(folder / "walk.toml", folder / "walk", progress=False)


def test_a_place_and_a_clock_that_are_wrong_are_found(walk: hybridsim.Recording, tmp_path: Path) -> None:
    file = walk.folder / "recording.toml"
    stated = file.read_text()
    wrong = stated.replace("\nstart_s = 0.0\n", "\nstart_s = 0.3\n").replace("origin_m = [0.0, 3.0,", "origin_m = [0.0, 3.3,")
    assert "start_s = 0.3\n" in wrong and "[0.0, 3.3," in wrong
    file.write_text(wrong)
    result = hybridsim.align(walk, out=tmp_path / "align", lag_s=0.5, progress=False)
    assert file.read_text() == wrong, "nothing is applied unasked"
    # So short a walk may look like another; the likeliest is the true one.
    assert result["verdict"] in ("aligned", "ambiguous") and not result["as_stated"]
    assert result["motion"]["start_s"] == pytest.approx(0.0, abs=0.02)
    assert np.allclose(result["motion"]["origin_m"], [0.0, 3.0, -1.0], atol=0.06)
    low, high = result["estimates"]["origin_y_m"]["ci90"]
    assert low < 3.0 < high and high - low < 0.2
    # The antennas lie in one height.
    assert result["estimates"]["origin_z_m"]["identified"] is False
    assert {path.name for path in (tmp_path / "align").iterdir()} >= {"align.json", "align.png"}


def test_without_a_body_there_is_nothing_to_align(recording: hybridsim.Recording, tmp_path: Path) -> None:
    text = (recording.folder / "recording.toml").read_text()
    lines = text[: text.index("[motion]")].splitlines()
    rest = [line for line in text[text.index("[files]") :].splitlines() if not line.startswith(("body", "motion"))]
    (tmp_path / "recording.toml").write_text("\n".join(lines + rest) + "\n")
    (tmp_path / "if.npy").write_bytes((recording.folder / "if.npy").read_bytes())
    with pytest.raises(hybridsim.Error, match="body"):
        hybridsim.align(tmp_path, out=tmp_path / "align", progress=False)
    assert not (tmp_path / "align").exists()
