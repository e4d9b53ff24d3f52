from __future__ import annotations

import os

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import Settings, StrPath, sets


def record(
    config: StrPath, out: StrPath, *, set: Settings = (), as_stated: bool = False, progress: Watcher = True
) -> Recording:
    """Makes a recording of a person in a room, in a world that shares nothing with the simulator.

    Args:
        config: a TOML file with a ``[record]`` section.
        out: folder of the recording, which must not exist yet, or be empty. It appears when it is complete.
        set: changes of settings, such as ``{"record.frames": 8}``.
        as_stated: take radar, body, motion and place as they are stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Raises:
        hybridsim.Error: settings that describe no world, or one that cannot be.
    """
    with Notifier(progress) as notify:
        _hybridsim.record(os.fspath(config), os.fspath(out), sets(set), as_stated, notify)
    return Recording(out)
