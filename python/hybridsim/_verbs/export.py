from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from .. import _hybridsim, _rerun
from .._errors import Error
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import Settings, StrPath, sets
from .._windows import folders


def export(
    sources: Recording | StrPath | Sequence[Recording | StrPath],
    to: str,
    out: StrPath,
    *,
    board: str | None = None,
    split_by: str | None = None,
    set: Settings = (),
    progress: Watcher = True,
) -> Path:
    """Writes recordings in the layouts of others.

    Args:
        sources: a recording, its folder, a folder of recordings or of a site; or several of them.
        to: ``npz``, ``hdf5``, ``dca1000``, ``rover``, ``maps``, ``points``, ``body``, or ``rerun``: for each recording ``NAME.rrd``,
            which rerun shows: room, body, points and maps over time (needs rerun-sdk).
        out: folder for the files; must be new or empty. They appear together or not at all.
        board: the board that is imitated, such as ``IWR6843ISK``: its lanes, and its numbers of the transmitters.
        split_by: a label, such as ``subject``, by whose values recordings are divided into train, validation and test.
        set: changes of settings, such as ``{"points.false_alarm_rate": 1e-4}``.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        ``out``.

    Raises:
        hybridsim.Error: a recording that cannot be read, or that the layout cannot hold; unknown settings, boards or labels.
    """
    several = [sources] if isinstance(sources, (Recording, str, os.PathLike)) else list(sources)
    paths = [os.fspath(source.folder if isinstance(source, Recording) else source) for source in several]
    if to == _rerun.TARGET and split_by is not None:
        raise Error(f"`split_by` is {split_by}, expected none with the target `rerun`", "leave it out")
    with Notifier(progress) as notify:
        if to != _rerun.TARGET:
            _hybridsim.export(paths, to, os.fspath(out), board, split_by, sets(set), notify)
            return Path(out)
        with _rerun.Scenes(folders(paths), Path(out)) as scenes:
            for name, recording in scenes.recordings.items():
                for part, folder in scenes.parts(name).items():
                    _hybridsim.export([os.fspath(recording)], part, os.fspath(folder), board, None, sets(set), notify)
                scenes.draw(name)
    return Path(out)
