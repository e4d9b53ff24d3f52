from __future__ import annotations

import os

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import WHOLE, Settings, Shard, StrPath, sets


def site(
    config: StrPath,
    out: StrPath,
    *,
    shard: Shard = WHOLE,
    set: Settings = (),
    as_stated: bool = False,
    progress: Watcher = True,
) -> list[Recording]:
    """Records a site: several subjects and actions in one room, by one board.

    Args:
        config: a site's TOML file, such as ``configs/site_smoke.toml``.
        out: folder of the site; recordings that are there already are kept, so that a run that was ended goes on.
        shard: only part ``i`` of ``n``, as ``(i, n)`` with ``i`` from 1. Parts may be recorded at the same time.
        set: changes of settings, such as ``{"repetitions": 2}``.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        The recordings of the part in ``out/recordings``, labelled ``subject``, ``action`` and ``repetition``, by name.

    Raises:
        hybridsim.Error: settings that cannot be a site; a recording that was made with others.
        hybridsim.BusyError: another process records the same part, or all of it.
    """
    with Notifier(progress) as notify:
        folders = _hybridsim.site(os.fspath(config), os.fspath(out), shard, sets(set), as_stated, notify)
    return [Recording(folder) for folder in sorted(folders)]
