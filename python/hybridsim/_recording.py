"""Recordings as arrays."""

from __future__ import annotations

import json
import operator
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, SupportsIndex

import numpy as np
from numpy.typing import NDArray

from . import _hybridsim
from ._types import Poses, Radar, StrPath

Frames = SupportsIndex | slice | Iterable[int]


class Recording:
    """An open recording folder. Samples stay on the disk until they are asked for.

    Attributes:
        folder: where it lies.
        radar: its radar.
        room: distances to the boundaries in metres (``left_m``, ``right_m``, ``front_m``, ``back_m``, ``floor_m``,
            ``ceiling_m``), as far as they are known; ``None``: a room of unknown size.
        labels: such as ``{"action": "walk", "subject": "s1"}``.
        notes: what had to be fitted or could not be used.
        number_type: NumPy's name of the stored numbers, such as ``"int16"``.
    """

    folder: Path
    radar: Radar
    room: dict[str, float] | None
    labels: dict[str, str]
    notes: list[str]
    number_type: str

    def __init__(self, path: StrPath) -> None:
        self._native = _hybridsim.read(os.fspath(path))
        about: dict[str, Any] = json.loads(self._native.about())
        self.folder = Path(about["folder"])
        self.radar = Radar._from(about["radar"])
        self.room, self.labels, self.notes = about["room"], about["labels"], about["notes"]
        self.number_type = about["number_type"]
        self._samples_file = Path(about["samples_file"])

    def __reduce__(self) -> tuple[object, ...]:
        # Workers of a DataLoader open it again.
        return (Recording, (str(self.folder.absolute()),))

    def __len__(self) -> int:
        """Frames."""
        return self.radar.frames

    def __repr__(self) -> str:
        shape = " x ".join(map(str, self.radar.shape))
        return f"Recording({str(self.folder)!r}, frames x tx x rx x loops x samples = {shape}, labels={self.labels})"

    def samples(self, frames: Frames = slice(None)) -> NDArray[Any]:
        """IF samples in the units of the file (ADC codes, or whatever its floats are).

        Args:
            frames: a slice or frame numbers; all by default. One number gives an array of one frame.

        Returns:
            ``[frame, tx, rx, loop, sample]``, complex64; float32 of a receiver without quadrature.

        Raises:
            hybridsim.Error: samples that cannot be read, or are NaN or infinite.
            IndexError: a frame beyond the last.
        """
        numbers = self._numbers(frames)
        return array(self._native.samples(numbers)).reshape(len(numbers), *self.radar.shape[1:])

    def frame(self, index: int) -> NDArray[Any]:
        """The IF samples of one frame, ``[tx, rx, loop, sample]``; as :meth:`samples`."""
        return self.samples(index)[0]  # type: ignore[no-any-return]

    def raw(self) -> NDArray[Any]:
        """The samples as they are stored, mapped from the file without a copy and read-only.

        Returns:
            ``[frame, tx, rx, loop, sample]``, or ``[frame, tx, rx, loop, sample, iq]`` where real numbers hold both parts, such
            as int16 codes of a quadrature receiver.
        """
        stored: NDArray[Any] = np.load(self._samples_file, mmap_mode="r")
        return stored

    @property
    def has_codes(self) -> bool:
        """Whether the file holds integer ADC codes."""
        return self._native.has_codes()

    @property
    def poses(self) -> Poses | None:
        """How the person moves; ``None`` where nobody was tracked."""
        found = self._native.poses()
        if found is None:
            return None
        times, rotations, translations, vertices, count = found
        return Poses(
            array(times),
            None if rotations is None else array(rotations).reshape(-1, count, 3),
            None if translations is None else array(translations).reshape(-1, 3),
            None if vertices is None else array(vertices).reshape(-1, count, 3),
        )

    def _numbers(self, frames: Frames) -> list[int]:
        count = self.radar.frames
        if isinstance(frames, slice):
            return list(range(count)[frames])
        if isinstance(frames, SupportsIndex):
            frames = [operator.index(frames)]
        numbers = [operator.index(frame) for frame in frames]
        for number in numbers:
            if not -count <= number < count:
                raise IndexError(f"frame {number} of a recording of {count} frames")
        return [number % count for number in numbers]


def read(path: StrPath) -> Recording:
    """Opens a recording folder, or its ``recording.toml``.

    Raises:
        hybridsim.Error: a folder that is no recording, or a file in it that is not what it must be; the message names file,
            field, what was found and what was expected.
    """
    return Recording(path)


def array(numbers: _hybridsim.Numbers) -> NDArray[Any]:
    """An array over memory of the library, without a copy."""
    return np.frombuffer(memoryview(numbers), dtype=numbers.dtype)
