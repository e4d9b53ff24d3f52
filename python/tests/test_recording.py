from __future__ import annotations

import pickle
from dataclasses import asdict, replace
from pathlib import Path

import numpy as np
import pytest

import hybridsim


def test_samples_are_those_of_the_file(recording: hybridsim.Recording) -> None:
    samples, raw = recording.samples(), recording.raw()
    assert samples.shape == recording.radar.shape == (5, 1, 2, 16, 32)
    assert samples.dtype == np.complex64
    assert recording.has_codes and raw.dtype == np.int16
    assert np.array_equal(samples, raw[..., 0] + 1j * raw[..., 1].astype(np.float32))


def test_frames_are_chosen_as_in_a_list(recording: hybridsim.Recording) -> None:
    samples = recording.samples()
    assert np.array_equal(recording.samples(slice(1, None, 2)), samples[1::2])
    assert np.array_equal(recording.samples([4, -5]), samples[[4, 0]])
    assert np.array_equal(recording.frame(2), samples[2])
    assert recording.samples([]).shape == (0, 1, 2, 16, 32)
    with pytest.raises(IndexError, match="frame 5 of a recording of 5 frames"):
        recording.frame(5)


def test_samples_are_handed_over_without_a_copy(recording: hybridsim.Recording) -> None:
    samples = recording.samples()
    owner = samples.base
    while isinstance(owner, np.ndarray):
        owner = owner.base
    assert isinstance(owner.obj if isinstance(owner, memoryview) else owner, hybridsim._hybridsim.Numbers)
    assert samples.flags.writeable
    samples[0, 0, 0, 0, 0] = 1
    assert recording.raw().base is not None and isinstance(recording.raw(), np.memmap)


def test_what_a_recording_says(recording: hybridsim.Recording) -> None:
    assert recording.labels == {"action": "walk_back_forth", "subject": "s1"}
    assert recording.room is not None and recording.room["front_m"] == 4.2
    assert recording.radar.derived["range_resolution_m"] == pytest.approx(299792458.0 * 2.2e6 / (2 * 60.012e12 * 32))
    assert len(recording) == 5 and "walk_back_forth" in repr(recording)
    poses = recording.poses
    assert poses is not None and poses.rotations is not None and poses.translations is not None
    assert poses.rotations.shape == (len(poses.times_s), 24, 3) and poses.translations.shape == (len(poses.times_s), 3)
    assert poses.vertices is None


def test_a_radar_of_one_s_own_says_what_follows_and_what_cannot_be(recording: hybridsim.Recording) -> None:
    settings = asdict(recording.radar)
    del settings["derived"]
    own = hybridsim.Radar(**settings)
    assert own.derived == recording.radar.derived and own == recording.radar
    with pytest.raises(hybridsim.Error, match="slope_hz_per_s"):
        replace(own, slope_hz_per_s=0.0, derived={})


def test_a_recording_passes_to_other_processes(recording: hybridsim.Recording) -> None:
    again = pickle.loads(pickle.dumps(recording))
    assert np.array_equal(again.samples(), recording.samples())


def test_a_receiver_without_quadrature_gives_floats(config: Path, tmp_path: Path) -> None:
    settings = {"record.radar.sampling": "real", "record.radar.sample_rate_hz": 4.4e6}
    made = hybridsim.record(config, tmp_path / "real", set=settings, progress=False)
    assert made.samples().dtype == np.float32
    assert np.array_equal(made.samples(), made.raw())
