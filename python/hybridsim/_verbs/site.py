from __future__ import annotations

import os

from .. import _hybridsim
from .._progress import Teller, Watcher
from .._recording import Recording
from .._types import Settings, StrPath, sets


def site(
    config: StrPath, out: StrPath, *, set: Settings = (), as_stated: bool = False, progress: Watcher = True
) -> list[Recording]:
    """Records a site: several subjects and actions in one room, by one board.

    Args:
        config: a site's TOML file, such as ``configs/site_smoke.toml``.
        out: folder of the site; recordings that are there already are kept, so that a run that was ended goes on.
        set: changes of settings, such as ``{"repetitions": 2}``.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        The recordings in ``out/recordings``, labelled ``subject``, ``action`` and ``repetition``.

    Raises:
        hybridsim.Error: settings that cannot be a site; a recording that was made with others.
    """
    with Teller(progress) as tell:
        _hybridsim.site(os.fspath(config), os.fspath(out), sets(set), as_stated, tell)
    return [Recording(folder) for folder in _hybridsim.recordings_in(os.path.join(out, "recordings"))]
