from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import ROOT

import hybridsim


def test_an_array_becomes_a_recording(recording: hybridsim.Recording, tmp_path: Path) -> None:
    samples = recording.samples()[:, 0]  # [frame, rx, loop, sample]
    np.save(tmp_path / "capture.npy", samples.transpose(0, 2, 1, 3))
    text = (recording.folder / "recording.toml").read_text()
    radar = text[text.index("[radar]") : text.index("[room]")]
    (tmp_path / "radar.toml").write_text(radar)
    made = hybridsim.import_(
        tmp_path / "capture.npy",
        tmp_path / "out",
        config=tmp_path / "radar.toml",
        layout="frame loop rx sample",
        labels={"action": "walk"},
        progress=False,
    )
    assert made.labels == {"action": "walk"} and made.radar == recording.radar
    assert np.array_equal(made.samples(), recording.samples())


CFG = """
channelCfg 15 1 0
adcCfg 2 1
adcbufCfg -1 0 0 1 1
profileCfg 0 77 48 6 60 0 0 60.012 1 128 4400 0 0 30
profileCfg 1 77.05 48 6 60 0 0 60.012 1 128 4400 0 0 30
chirpCfg 0 0 0 0 0 0 0 1
chirpCfg 1 1 1 0 0 0 0 1
frameCfg 0 1 8 2 100 1 0
sensorStart
"""
"""Two profiles in turn."""


@pytest.mark.filterwarnings("ignore::hybridsim.Note")
def test_a_frame_of_several_profiles_is_split(tmp_path: Path) -> None:
    words = np.random.default_rng(3).integers(-999, 999, 2 * 8 * 2 * 4 * 128 * 2)  # [frame, loop, profile, rx, sample, iq]
    words.astype("<i2").tofile(tmp_path / "adc_data.bin")
    (tmp_path / "radar.cfg").write_text(CFG)

    def made(out: str, profile: Any) -> Any:
        return hybridsim.import_(tmp_path / "adc_data.bin", tmp_path / out, profile=profile, as_stated=True, progress=False)

    split = made("out", "all")
    assert [recording.folder.name for recording in split] == ["profile0", "profile1"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["profile0", "profile1"]
    for profile, recording in enumerate(split):
        alone = made(f"alone{profile}", profile)
        assert recording.radar == alone.radar and recording.notes == alone.notes
        assert np.array_equal(recording.raw(), alone.raw())
    assert [recording.radar.start_frequency_hz for recording in split] == [77e9, 77.05e9]
    with pytest.raises(hybridsim.Error, match="^`profile` is both, expected the number of a profile, or all$"):
        made("none", "both")
    np.save(tmp_path / "capture.npy", np.zeros((2, 8, 4, 128)))
    with pytest.raises(hybridsim.Error, match="no description with chirp profiles"):
        hybridsim.import_(tmp_path / "capture.npy", tmp_path / "none", profile="all", progress=False)
    assert not (tmp_path / "none").exists()


def test_what_is_odd_is_a_warning_where_the_verb_was_called(config: Path, tmp_path: Path) -> None:
    # Half of a quadrature receiver's range: the room ends beyond it.
    settings = {"record.radar.sampling": "real"}
    with pytest.raises(hybridsim.Error, match="unambiguous range of 2.75 m") as caught:
        hybridsim.record(config, tmp_path / "out", set=settings, progress=False)
    assert caught.value.hint is not None and caught.value.hint.endswith("--as-stated takes it as it is")
    with pytest.warns(hybridsim.Note, match="taken as stated") as said:
        hybridsim.record(config, tmp_path / "out", set=settings, as_stated=True, progress=False)
    assert said[0].filename == __file__


def test_check_finds_what_is_damaged(recording: hybridsim.Recording, tmp_path: Path) -> None:
    whole = hybridsim.check(recording)
    assert whole.ok and {finding.about for finding in whole.findings} >= {"radar", "integrity"}
    for file in recording.folder.iterdir():
        (tmp_path / file.name).write_bytes(file.read_bytes())
    samples = np.load(tmp_path / "if.npy")
    samples[3] = samples[2]
    np.save(tmp_path / "if.npy", samples)
    damaged = [finding for finding in hybridsim.check(tmp_path).findings if not finding.ok]
    assert [finding.about for finding in damaged] == ["integrity"] and damaged[0].frames == [3]
    assert damaged[0].kept == "questioned"
    assert damaged[0].p_value is not None and damaged[0].p_value < 1e-3


def test_check_has_the_rows_of_its_table(recording: hybridsim.Recording) -> None:
    rows = {finding.check: finding for finding in hybridsim.check(recording).findings if finding.about == "integrity"}
    assert {finding.kept for finding in rows.values()} == {"as stated", "as stated, undecided"}
    assert rows["byte_order"].kept == "as stated" and rows["byte_order"].found.startswith("codes from")
    # What samples alone never decide is listed, too.
    for check in ("adc_start", "doppler_sign", "left_and_right"):
        assert rows[check].kept == "as stated, undecided" and rows[check].found.startswith("undecided: ")
    assert all(finding.kept is None for finding in hybridsim.check(recording).findings if finding.about != "integrity")


def test_a_point_peaks_at_its_range_and_velocity(recording: hybridsim.Recording) -> None:
    radar = recording.radar
    wavelength, bins = radar.derived["wavelength_m"], 10
    loop, sample = np.arange(radar.loops_per_frame), np.arange(radar.samples_per_chirp)
    turns = np.add.outer(4 / radar.loops_per_frame * loop, bins / radar.samples_per_chirp * sample)
    samples = np.broadcast_to(np.exp(2j * np.pi * turns), radar.shape).astype(np.complex64)
    maps = hybridsim.heatmaps(samples, radar)
    assert set(maps) == {
        "range_doppler",
        "range_doppler_moving",
        "range_azimuth",
        "time_doppler",
        "time_range",
        "time_azimuth",
    }
    found = maps["range_doppler"]
    assert found.values.shape == (len(found.rows.values), len(found.columns.values)) == (16, 32)
    row, column = np.unravel_index(found.values.argmax(), found.values.shape)
    assert found.values[row, column] == pytest.approx(0.0, abs=1e-4)
    assert (found.rows.unit, found.columns.unit) == ("m/s", "m")
    assert found.columns.values[column] == pytest.approx(bins * radar.derived["range_resolution_m"])
    velocity = 4 / radar.loops_per_frame * wavelength / (2 * radar.derived["loop_period_s"])
    assert found.rows.values[row] == pytest.approx(velocity)


def test_heatmaps_of_a_recording_are_those_of_its_samples(recording: hybridsim.Recording) -> None:
    of_array = hybridsim.heatmaps(recording.samples([1, 2]), recording.radar, db=False)
    for name, found in hybridsim.heatmaps(recording, frames=[1, 2], db=False).items():
        assert np.array_equal(found.values, of_array[name].values)
    of_folder = hybridsim.heatmaps(recording.folder, frames=[1, 2], db=False)
    assert set(of_folder) == set(of_array)
    assert all(np.array_equal(of_folder[name].values, of_array[name].values) for name in of_array)
    assert set(hybridsim.heatmaps(str(recording.folder))) == set(of_array)
    with pytest.raises(hybridsim.Error, match="nowhere"):
        hybridsim.heatmaps("nowhere")
    with pytest.raises(ValueError, match="expected frame x tx x rx x loop x sample"):
        hybridsim.heatmaps(recording.samples()[0], recording.radar)
    with pytest.raises(hybridsim.Error, match="unknown variant `flat`"):
        hybridsim.heatmaps(recording, range_window="flat")


def test_training_tells_how_far_it_is_and_leaves_a_run(
    config: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    heard: list[hybridsim.Progress] = []
    run = hybridsim.train(config, out="run", set=["training.epochs=2"], device="flex", progress=heard.append)
    assert run.epochs == 2 and (run.folder / "report.md").is_file() and (run.best / "checkpoint.toml").is_file()
    assert [now.epoch["epoch"] for now in heard if now.epoch] == [0, 1]
    training = [now for now in heard if now.what == "training"]
    assert training[-1].done == training[-1].of > 0
    assert {now.what for now in heard} == {"recording", "training"}
    assert len(run.history) == 2 and list(run.scores)
    with pytest.raises(hybridsim.Error, match="already holds a run"):
        hybridsim.train(config, out="run", progress=False)


def test_simulated_samples_are_those_that_are_written(run: hybridsim.Run, tmp_path: Path) -> None:
    asked = dict(action="lunge", frames=2, device="flex", progress=False)
    samples = hybridsim.simulate(run.best, **asked)
    made = hybridsim.simulate(run.best, out=tmp_path / "made", **asked)
    assert samples.dtype == np.complex64 and samples.shape == made.radar.shape and samples.shape[0] == 2
    assert np.array_equal(samples, made.samples())
    assert made.labels == {"action": "lunge"} and (tmp_path / "made" / "range_doppler.png").is_file()


def test_the_parts_of_a_simulation_add_up(run: hybridsim.Run) -> None:
    asked = dict(action="lunge", frames=1, device="flex", progress=False)
    whole = hybridsim.simulate(run.best, **asked)
    parts = sum(hybridsim.simulate(run.best, only=part, **asked) for part in ("direct", "indirect", "noise"))
    assert np.allclose(whole, parts, atol=1e-4 * np.abs(whole).max())


def test_a_recording_is_simulated_again(run: hybridsim.Run, recording: hybridsim.Recording) -> None:
    samples = hybridsim.simulate(run.best, recording=recording, frames=2, device="flex", progress=False)
    assert samples.shape[0] == 2
    with pytest.raises(hybridsim.Error, match="the motion lasts 5 frames"):
        hybridsim.simulate(run.best, recording=recording, frames=6, device="flex", progress=False)
    with pytest.raises(hybridsim.Error, match="expected one of motion, action and recording"):
        hybridsim.simulate(run.best, progress=False)


def test_a_diagnosis_says_what_its_report_says(recording: hybridsim.Recording, tmp_path: Path) -> None:
    settings = {"diagnosis.epochs": 0, "diagnosis.limits": False}
    report = hybridsim.diagnose(recording, out=tmp_path / "why", set=settings, progress=False)
    assert report.data == json.loads(report.json.read_text()) and report.verdict == report.data["verdict"]
    assert report.html.is_file() and report.checkpoint is None
    assert report.sentence and isinstance(report.effects, list)


def test_settings_are_numbers_of_numpy_and_paths_too(tmp_path: Path) -> None:
    given = {"training.epochs": np.int64(3), "data.recordings": [tmp_path], "loss.weight": np.float32(0.5), "a": np.arange(2)}
    assert hybridsim._types.sets(given) == [
        "training.epochs=3",
        f'data.recordings=["{tmp_path}"]',
        "loss.weight=0.5",
        "a=[0, 1]",
    ]
    with pytest.raises(hybridsim.Error, match="of type `object`"):
        hybridsim._types.sets({"a": object()})


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"distance_m": 2.0}, "--distance"),
        ({"raise_m": 0.5}, "--raise"),
        ({"turn_deg": 90.0}, "--turn"),
        ({"body": "body.npz"}, "--body"),
        ({"up": "z"}, "no motion's file"),
        ({"clean": True, "only": "noise"}, "--clean"),
        ({"frames": 0}, "frames"),
    ],
)
def test_what_would_change_nothing_is_refused(recording: hybridsim.Recording, given: dict[str, Any], said: str) -> None:
    with pytest.raises(hybridsim.Error, match=said):
        hybridsim.simulate(ROOT / "models" / "quickstart", recording=recording, progress=False, **given)
