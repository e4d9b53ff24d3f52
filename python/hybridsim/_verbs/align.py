from __future__ import annotations

import json
import os
from typing import Any

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import StrPath


def align(
    recording: Recording | StrPath,
    *,
    out: StrPath = "align",
    lag_s: float = 2.0,
    frames: int = 64,
    apply: bool = False,
    progress: Watcher = True,
) -> dict[str, Any]:
    """Finds where a recording's body is in the radar's frame, and when its motion starts.

    Args:
        recording: a recording with a body and its motion, or its folder.
        out: folder for ``align.json``, ``motion.toml`` and ``align.png``.
        lag_s: largest error of ``motion.start_s`` that is tried, to either side, s.
        frames: most frames that are looked at, from the beginning.
        apply: write the placement into the recording's ``recording.toml``, where one placement explains the recording.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        ``align.json``: ``verdict`` (``aligned``, ``ambiguous`` or ``cannot_tell``), ``sentence``, the estimates with 90 % intervals
        (s, degrees, m), alternatives and notes.

    Raises:
        hybridsim.Error: a recording without a body, with falling chirps, or with damaged samples.
    """
    folder = recording.folder if isinstance(recording, Recording) else recording
    with Notifier(progress) as notify:
        result: dict[str, Any] = json.loads(
            _hybridsim.align(os.fspath(folder), os.fspath(out), lag_s, frames, apply, notify)
        )
    return result
