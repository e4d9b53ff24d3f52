from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import hybridsim


def test_a_site_becomes_windows_with_classes(site: Path) -> None:
    windows = hybridsim.Windows(site, window=4, hop=2)
    assert windows.classes == ["arm_swing", "walk_back_forth"]
    # Six frames hold two windows of four, two frames apart; three subjects, two actions.
    assert len(windows) == 2 * 3 * 2 and sorted(set(windows.targets)) == [0, 1]
    samples, number = windows[1]
    first = windows.recordings[0]
    assert np.array_equal(samples, first.samples(slice(2, 6)))
    assert windows.classes[number] == first.labels["action"]


def test_subjects_are_split_and_share_their_classes(site: Path) -> None:
    train = hybridsim.Windows(site, where=lambda recording: recording.labels["subject"] != "s3")
    test = hybridsim.Windows(site, classes=train.classes, where=lambda recording: recording.labels["subject"] == "s3")
    assert (len(train), len(test)) == (4, 2) and test.classes == train.classes
    few = hybridsim.Windows(site, transform=lambda samples: float(np.abs(samples).mean()), label="subject")
    assert few.classes == ["s1", "s2", "s3"] and isinstance(few[0][0], float)


def test_what_cannot_be_windows_is_refused(site: Path, tmp_path: Path) -> None:
    with pytest.raises(hybridsim.Error, match="no recordings in it"):
        hybridsim.Windows(tmp_path)
    with pytest.raises(hybridsim.Error, match="6 frames, expected at least a window of 7"):
        hybridsim.Windows(site, window=7)
    with pytest.raises(hybridsim.Error, match="`labels.mood` is missing"):
        hybridsim.Windows(site, label="mood")
    with pytest.raises(hybridsim.Error, match="class `arm_swing`, expected one of walk_back_forth"):
        hybridsim.Windows(site, classes=["walk_back_forth"])
    with pytest.raises(hybridsim.Error, match="`hop` is 0"):
        hybridsim.Windows(site, window=2, hop=0)


def test_pytorch_loads_it_in_workers(site: Path) -> None:
    torch = pytest.importorskip("torch", reason="needs torch: pip install torch")
    dataset = hybridsim.torch.RecordingDataset(site, window=3)
    assert isinstance(dataset, torch.utils.data.Dataset)
    alone = list(torch.utils.data.DataLoader(dataset, batch_size=4))
    shared = list(torch.utils.data.DataLoader(dataset, batch_size=4, num_workers=2, multiprocessing_context="spawn"))
    assert len(alone) == len(shared) == 3
    for (a, one), (b, other) in zip(alone, shared, strict=True):
        assert a.dtype == torch.complex64 and a.shape == (4, 3, 1, 2, 16, 64)
        assert torch.equal(a, b) and torch.equal(one, other)
