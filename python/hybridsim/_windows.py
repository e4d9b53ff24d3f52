"""Windows of frames over many recordings, with their classes: what a classifier is trained on."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any, overload

from numpy.typing import NDArray

from . import _hybridsim
from ._errors import Error
from ._recording import Recording
from ._types import StrPath


class Windows(Sequence[tuple[Any, int]]):
    """Pairs of samples and class, in the order of the recordings and of time.

    Args:
        source: a site's folder, a folder of recordings, a recording's folder, or several of them.
        window: frames of a window; whole recordings by default.
        hop: frames from window to window; ``window`` by default.
        transform: of the samples ``[frame, tx, rx, loop, sample]`` (complex64, float32 without quadrature) of a window.
        label: the label that is the class, or a function of a recording that gives it.
        classes: names of the classes in the order of their numbers; by default those that are found, sorted. Give a training
            set's to its test set.
        where: which recordings take part.

    Attributes:
        classes: names of the classes.
        recordings: the recordings that take part.

    Raises:
        hybridsim.Error: no recordings, one without the label or too short for a window, a class that is not known.
    """

    def __init__(
        self,
        source: StrPath | Iterable[StrPath],
        window: int | None = None,
        hop: int | None = None,
        transform: Callable[[NDArray[Any]], Any] | None = None,
        label: str | Callable[[Recording], str] = "action",
        classes: Sequence[str] | None = None,
        where: Callable[[Recording], bool] | None = None,
    ) -> None:
        for name, value in (("window", window), ("hop", hop)):
            if value is not None and value < 1:
                raise Error(f"`{name}` is {value}, expected 1 or more frames")
        found = [Recording(folder) for folder in folders(source)]
        self.recordings = [recording for recording in found if where is None or where(recording)]
        if not self.recordings:
            raise Error(f"none of {len(found)} recordings takes part", "see `where`")
        self.transform = transform
        names = [_label(recording, label) for recording in self.recordings]
        self.classes: list[str] = list(classes) if classes is not None else sorted(set(names))
        for recording, name in zip(self.recordings, names, strict=True):
            if name not in self.classes:
                raise Error(f"{recording.folder}: class `{name}`, expected one of {', '.join(self.classes)}")
        self._items: list[tuple[int, int, int, int]] = []
        for index, (recording, name) in enumerate(zip(self.recordings, names, strict=True)):
            length = len(recording) if window is None else window
            if length > len(recording):
                raise Error(f"{recording.folder}: {len(recording)} frames, expected at least a window of {length}")
            for start in range(0, len(recording) - length + 1, hop or length):
                self._items.append((index, start, length, self.classes.index(name)))

    def __len__(self) -> int:
        return len(self._items)

    @overload
    def __getitem__(self, index: int) -> tuple[Any, int]: ...
    @overload
    def __getitem__(self, index: slice) -> list[tuple[Any, int]]: ...
    def __getitem__(self, index: int | slice) -> tuple[Any, int] | list[tuple[Any, int]]:
        if isinstance(index, slice):
            return [self._item(each) for each in range(*index.indices(len(self)))]
        return self._item(index)

    def _item(self, index: int) -> tuple[Any, int]:
        recording, start, length, number = self._items[index]
        samples = self.recordings[recording].samples(slice(start, start + length))
        return (samples if self.transform is None else self.transform(samples)), number

    @property
    def targets(self) -> list[int]:
        """The class of every window."""
        return [number for *_, number in self._items]


def folders(source: StrPath | Iterable[StrPath]) -> list[Path]:
    """The recordings' folders."""
    if not isinstance(source, (str, os.PathLike)):
        return [folder for one in source for folder in folders(one)]
    path = Path(source)
    if (path / "recording.toml").is_file():
        return [path]
    if (path / "recordings").is_dir():
        path = path / "recordings"
    found = [Path(folder) for folder in _hybridsim.recordings_in(os.fspath(path))]
    if not found:
        raise Error(f"{path}: no recordings in it", "give a site, a folder of recordings, or a recording")
    return found


def _label(recording: Recording, label: str | Callable[[Recording], str]) -> str:
    if callable(label):
        return str(label(recording))
    if label not in recording.labels:
        known = ", ".join(recording.labels) or "none"
        raise Error(f"{recording.folder / 'recording.toml'}: `labels.{label}` is missing, expected a class", f"it has: {known}")
    return recording.labels[label]
