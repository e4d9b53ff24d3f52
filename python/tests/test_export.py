"""Every target of `export`, opened by the program that it is for, or by what reads its format."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hybridsim
from hybridsim import _rerun

pytestmark = pytest.mark.filterwarnings("ignore::hybridsim.Note")
Exported = Callable[..., Path]


@pytest.fixture
def exported(recording: hybridsim.Recording, tmp_path: Path) -> Exported:
    def export(to: str, **more: Any) -> Path:
        return hybridsim.export(recording, to, tmp_path / to, progress=False, **more)

    return export


def test_npz_holds_samples_axes_and_body(exported: Exported, recording: hybridsim.Recording) -> None:
    archive = np.load(exported("npz") / "recording.npz")
    assert np.array_equal(archive["samples"], recording.samples())
    axes = json.loads(str(archive["axes"]))
    assert axes["samples"]["axes"] == ["frame", "tx", "rx", "loop", "sample"]
    assert all(len(entry["axes"]) == archive[name].ndim for name, entry in axes.items())
    assert json.loads(str(archive["room"])) == {key: value for key, value in (recording.room or {}).items() if value}
    assert np.allclose(archive["range_m"][1], recording.radar.derived["range_resolution_m"])
    assert archive["vertices"].shape[0] == recording.radar.frames and archive["faces"].max() < archive["vertices"].shape[1]


def test_body_is_that_of_npz(exported: Exported) -> None:
    body, whole = np.load(exported("body") / "recording_body.npz"), np.load(exported("npz") / "recording.npz")
    for name in ("time_s", "vertices", "faces", "room"):
        assert np.array_equal(body[name], whole[name]), name
    assert "samples" not in body


def test_hdf5_is_read_by_h5py(exported: Exported, recording: hybridsim.Recording) -> None:
    h5py = pytest.importorskip("h5py", reason="needs h5py: pip install h5py")
    with h5py.File(exported("hdf5") / "recording.h5") as file:
        assert np.array_equal(file["samples"][:], recording.samples())
        assert file["range_m"].attrs["unit"] == b"m"
        assert json.loads(file.attrs["radar"])["slope_hz_per_s"] == recording.radar.slope_hz_per_s


def test_dca1000_and_rover_come_back(exported: Exported, recording: hybridsim.Recording, tmp_path: Path) -> None:
    capture = exported("dca1000")
    described = json.loads((capture / "recording.mmwave.json").read_text())
    assert described["mmWaveDevices"][0]["rfConfig"]["rlFrameCfg_t"]["numFrames"] == recording.radar.frames
    for name, source in (("capture", capture / "recording.setup.json"), ("trace", exported("rover") / "recording")):
        back = hybridsim.import_(source, tmp_path / name, as_stated=True, progress=False)
        assert np.array_equal(back.samples(), recording.samples()), name


def test_maps_peak_where_the_body_is(exported: Exported) -> None:
    maps = np.load(exported("maps", set={"maps.remove_static": True}) / "recording_maps.npz")
    shape = [len(maps[key]) for key in ("time_s", "velocity_m_s", "elevation_deg", "azimuth_deg", "range_m")]
    assert list(maps["power_db"].shape) == shape
    distance_m = np.linalg.norm(np.load(exported("npz") / "recording.npz")["vertices"], axis=-1)
    peak = maps["range_m"][maps["power_db"].max(axis=(0, 1, 2, 3)).argmax()]
    assert distance_m.min() - 0.2 <= peak <= distance_m.max() + 0.2


def test_points_are_the_same_in_both_files(exported: Exported) -> None:
    out = exported("points")
    points = np.load(out / "recording_points.npz")
    assert len(points["frame"]) > 0 and np.all(points["snr_db"] > 0)
    files = sorted((out / "recording_points").glob("*.ply"))
    assert len(files) == len(points["time_s"])
    for frame, file in enumerate(files):
        head = file.read_bytes().partition(b"end_header\n")[0].decode()
        assert head.startswith("ply\n") and f"element vertex {np.sum(points['frame'] == frame)}\n" in head
    plyfile = pytest.importorskip("plyfile", reason="needs plyfile: pip install plyfile")
    for frame, file in enumerate(files):
        vertex = plyfile.PlyData.read(file)["vertex"]
        assert np.allclose(vertex["y"], points["y_m"][points["frame"] == frame], atol=1e-5)


def test_a_site_becomes_shards_with_splits(site: Path, tmp_path: Path) -> None:
    out = hybridsim.export(site, "npz", tmp_path / "set", split_by="subject", progress=False)
    lines = (out / "labels.csv").read_text().splitlines()
    assert len(lines) == 1 + 6 and lines[0].startswith("recording,split,frames,duration_s")
    assert all(("test" in line) == ("s3" in line.split(",")) for line in lines[1:])
    assert len(list(out.glob("*/*.npz"))) == 6 and "Data set card" in (out / "card.md").read_text()


def test_a_scene_of_rerun_is_read_back(exported: Exported, recording: hybridsim.Recording) -> None:
    chunk = pytest.importorskip("rerun.chunk", reason="needs a rerun-sdk that reads: pip install rerun-sdk==0.41.0")
    out = exported("rerun")
    assert [path.name for path in out.iterdir()] == ["recording.rrd"] and len(list(out.parent.iterdir())) == 1
    seen: dict[str, Any] = {}
    for part in chunk.RrdReader(out / "recording.rrd").stream().to_chunks():
        table = part.to_record_batch()
        for name in table.schema.names:
            if ":" in name or name == "recording":
                seen[f"{part.entity_path} {name}"] = table.column(name)
    times = seen["/world/body recording"].cast("int64").to_numpy()
    assert np.allclose(np.diff(times), recording.radar.frame_period_s * 1e9)
    body, frame = np.load(exported("body") / "recording_body.npz"), recording.radar.frames - 1
    assert np.array_equal(seen["/world/body Mesh3D:vertex_positions"][frame].as_py(), body["vertices"][frame])
    assert np.array_equal(seen["/world/body Mesh3D:triangle_indices"][0].as_py(), body["faces"])
    points = np.load(exported("points") / "recording_points.npz")
    counts = [len(places.as_py()) for places in seen["/world/points Points3D:positions"]]
    assert counts == np.bincount(points["frame"], minlength=frame + 1).tolist()
    maps = np.load(exported("maps") / "recording_maps.npz")["power_db"]
    grey = np.array(seen["/maps/range_by_azimuth Image:buffer"][frame].as_py()).ravel()
    # Farthest ranges at the top; a step of grey is 60 dB / 255.
    wanted = maps[frame].max(axis=(0, 1)).T[::-1].ravel()
    assert grey.size == wanted.size and grey.max() > 0 and wanted[grey.argmax()] >= wanted.max() - 60 / 255
    assert {"/world/room Boxes3D:half_sizes", "/maps/velocity_by_range Image:buffer"} <= set(seen)


def test_every_recording_has_a_scene(site: Path, tmp_path: Path) -> None:
    pytest.importorskip("rerun", reason="needs rerun-sdk: pip install rerun-sdk")
    first, second, *_ = sorted((site / "recordings").iterdir())
    (tmp_path / "out").mkdir()
    out = hybridsim.export([first, second], "rerun", tmp_path / "out", progress=False)
    assert sorted(path.stem for path in out.iterdir()) == [first.name, second.name]
    with pytest.raises(hybridsim.Error, match="exists already and is not an empty folder"):
        hybridsim.export(first, "rerun", out, progress=False)
    with pytest.raises(hybridsim.Error, match="unknown key `maps.scales`"):
        hybridsim.export(first, "rerun", tmp_path / "none", set={"maps.scales": "db"}, progress=False)
    assert [path.name for path in tmp_path.iterdir()] == ["out"], "all or nothing"


def test_scenes_are_put_where_the_library_puts_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(_rerun, "library", lambda: None)
    real, link, file = tmp_path / "real", tmp_path / "link", tmp_path / "file"
    real.mkdir()
    (real / ".keep").write_text("")
    link.symlink_to("real")
    file.write_text("")
    number = real.stat().st_ino

    def put(out: Path, fails: bool = False) -> None:
        with _rerun.Scenes([], out) as scenes:
            (scenes._made / "a.rrd").write_text("scene")
            if fails:
                raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        put(link, fails=True)
    assert [path.name for path in real.iterdir()] == [".keep"]
    put(link)
    assert sorted(path.name for path in real.iterdir()) == [".keep", "a.rrd"]
    assert link.is_symlink() and real.stat().st_ino == number, "filled where it is"
    put(tmp_path / "new" / "below")
    assert [path.name for path in (tmp_path / "new").rglob("*")] == ["below", "a.rrd"]
    for full in (link, file):
        with pytest.raises(hybridsim.Error, match=f"{full.resolve().name}: exists already and is not an empty folder\n") as caught:
            put(full)
        assert caught.value.hint == "choose another folder, or remove this one first"
    (tmp_path / "nowhere").symlink_to("nothing")
    with pytest.raises(hybridsim.Error, match="nowhere: is a link that leads nowhere\n"):
        put(tmp_path / "nowhere")


def test_a_scene_is_refused_where_it_cannot_be(
    recording: hybridsim.Recording, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(hybridsim.Error, match="`split_by` is subject, expected none with the target `rerun`"):
        hybridsim.export(recording, "rerun", tmp_path / "out", split_by="subject")
    monkeypatch.setitem(sys.modules, "rerun", None)
    with pytest.raises(hybridsim.Error, match="the target `rerun` needs rerun-sdk") as caught:
        hybridsim.export(recording, "rerun", tmp_path / "out")
    assert caught.value.hint is not None and "pip install" in caught.value.hint
    assert not list(tmp_path.iterdir())
    with pytest.raises(hybridsim.Error, match="no target `mat`, known are npz, hdf5, dca1000, rover, maps, points, body"):
        hybridsim.export(recording, "mat", tmp_path / "out")
