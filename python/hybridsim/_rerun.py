"""A recording as a scene of rerun: room, body, points and maps over time. Needs rerun-sdk, which ``import hybridsim`` does not import."""

from __future__ import annotations

import importlib
import json
import os
import shutil
import tempfile
import zipfile
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ._errors import Error, FileError

TARGET = "rerun"
PARTS = ("body", "points", "maps")
"""The exports that a scene is drawn from."""
TIMELINE = "recording"
DEPTH_DB = 60.0
"""Below the recording's strongest cell a map is black."""
OPEN_M = 10.0
"""Where a side without a boundary is drawn."""


def library() -> ModuleType:
    try:
        return importlib.import_module("rerun")
    except ImportError as error:
        raise Error("the target `rerun` needs rerun-sdk, found none", 'pip install "./python[rerun]", or rerun-sdk') from error


class Scenes:
    """A folder of scenes that appears whole or not at all."""

    def __init__(self, recordings: list[Path], out: Path) -> None:
        self._rerun = library()
        self._out = out
        self.recordings = {recording.resolve().name: recording for recording in recordings}
        if len(self.recordings) < len(recordings):
            raise Error("two recordings of one name", "rename one of the folders, or export them one by one")
        # As the library's own folders: a link counts as what it leads to, hidden names as nothing.
        if out.is_symlink():
            if not out.exists():
                raise Error(f"{out}: is a link that leads nowhere", "make the folder that it leads to, or choose another one")
            self._out = out = out.resolve()
        if out.exists() and (not out.is_dir() or any(not path.name.startswith(".") for path in out.iterdir())):
            raise Error(f"{out}: exists already and is not an empty folder", "choose another folder, or remove this one first")

    def __enter__(self) -> Scenes:
        # A folder that is there is filled and stays what it is: a mount point cannot be replaced.
        self._fills = self._out.is_dir()
        above = self._out if self._fills else self._out.parent
        try:
            above.mkdir(parents=True, exist_ok=True)
            self._work = tempfile.TemporaryDirectory(prefix=f".{self._out.name}.", dir=above)
        except OSError as error:
            raise self._unwritable(error) from error
        self._made = Path(self._work.name) / "made"
        self._made.mkdir()
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        try:
            if kind is None:
                self._publish()
        except OSError as error:
            raise self._unwritable(error) from error
        finally:
            self._work.cleanup()

    def _publish(self) -> None:
        if not self._fills:
            self._made.replace(self._out)
            return
        moved: list[Path] = []
        try:
            for path in sorted(self._made.iterdir()):
                moved.append(path.replace(self._out / path.name))
        except OSError:
            for path in moved:
                path.unlink()
            raise

    def _unwritable(self, error: OSError) -> FileError:
        return FileError(f"{self._out}: cannot be written: {error}", None, str(self._out), error.errno)

    def parts(self, name: str) -> dict[str, Path]:
        """Folders for the exports of a recording."""
        folder = Path(self._work.name) / "parts" / name
        folder.mkdir(parents=True, exist_ok=True)
        return {part: folder / part for part in PARTS}

    def draw(self, name: str) -> None:
        """Writes ``NAME.rrd`` from the exports of a recording, and removes them."""
        stream = self._rerun.RecordingStream("hybridsim", recording_id=name)
        stream.save(os.fspath(self._made / f"{name}.rrd"))
        try:
            stream.log("world", self._rerun.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
            for part, folder in self.parts(name).items():
                path = folder / f"{name}_{part}.npz"
                with np.load(path) as archive:
                    {"body": _body, "points": _points, "maps": _maps}[part](self._rerun, stream, archive, path)
        finally:
            # Brings the file to its end.
            stream.disconnect()
        shutil.rmtree(Path(self._work.name) / "parts" / name)


def _at(rr: Any, archive: Any) -> list[Any]:
    return [rr.TimeColumn(TIMELINE, duration=archive["time_s"])]


def _body(rr: Any, stream: Any, archive: Any, _: Path) -> None:
    if "room" in archive:
        room = {name: far for name, far in json.loads(str(archive["room"])).items() if far is not None}
        low = [-room.get(name, OPEN_M) for name in ("left_m", "back_m", "floor_m")]
        high = [room.get(name, OPEN_M) for name in ("right_m", "front_m", "ceiling_m")]
        stream.log("world/room", rr.Boxes3D(mins=[low], sizes=[np.subtract(high, low)]), static=True)
    if "vertices" in archive:
        vertices = archive["vertices"]
        stream.log("world/body", rr.Mesh3D.from_fields(triangle_indices=archive["faces"]), static=True)
        columns = rr.Mesh3D.columns(vertex_positions=vertices.reshape(-1, 3))
        lengths = np.full(len(vertices), vertices.shape[1])
        stream.send_columns("world/body", _at(rr, archive), columns.partition(lengths))


def _points(rr: Any, stream: Any, archive: Any, _: Path) -> None:
    """Receding points red, approaching ones blue, and larger the more they stand out."""
    places = np.stack([archive[f"{axis}_m"] for axis in "xyz"], axis=-1)
    velocity, snr_db = archive["velocity_m_s"], archive["snr_db"]
    fastest = max(np.abs(velocity).max(initial=0.0), 1e-9)
    red, blue = np.clip(velocity / fastest, 0, 1), np.clip(-velocity / fastest, 0, 1)
    colours = (255 * np.stack([red, np.full_like(red, 0.3), blue], axis=-1)).astype(np.uint8)
    lengths = np.bincount(archive["frame"], minlength=len(archive["time_s"]))
    columns = rr.Points3D.columns(positions=places, colors=colours, radii=0.01 + 0.001 * snr_db)
    stream.send_columns("world/points", _at(rr, archive), columns.partition(lengths))


def _maps(rr: Any, stream: Any, archive: Any, path: Path) -> None:
    """The strongest cell over the other axes, of the farthest range and velocity at the top."""
    name = "power_db" if "power_db" in archive else "power"
    # Frames of [doppler, elevation, azimuth, range], one in memory at a time.
    seen = [(power.max(axis=(1, 2)), power.max(axis=(0, 1)).T) for power in _frames(path, name)]
    for entity, images in zip(("velocity_by_range", "range_by_azimuth"), map(np.stack, zip(*seen)), strict=True):
        level_db = images if name == "power_db" else 10 * np.log10(np.maximum(images, np.finfo(np.float32).tiny))
        grey = 255 * np.clip((level_db - level_db.max() + DEPTH_DB) / DEPTH_DB, 0, 1)
        pixels = grey.astype(np.uint8)[:, ::-1]
        height, width = pixels.shape[1:]
        kind = rr.components.ImageFormat(width=width, height=height, color_model="L", channel_datatype="U8")
        stream.log(f"maps/{entity}", rr.Image.from_fields(format=kind), static=True)
        columns = rr.Image.columns(buffer=pixels.reshape(len(pixels), -1))
        stream.send_columns(f"maps/{entity}", _at(rr, archive), columns)


def _frames(path: Path, name: str) -> Iterator[NDArray[Any]]:
    """An archive's array along its first axis, which may be larger than memory."""
    with zipfile.ZipFile(path) as archive, archive.open(f"{name}.npy") as file:
        layout: Any = np.lib.format
        layout.read_magic(file)
        shape, _, dtype = layout.read_array_header_1_0(file)
        size = int(np.prod(shape[1:])) * dtype.itemsize
        for _ in range(shape[0]):
            yield np.frombuffer(file.read(size), dtype).reshape(shape[1:])
