from __future__ import annotations

import json
import os

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import Check, Finding, Radar, StrPath


def check(recording: Recording | StrPath, *, as_stated: bool = False, progress: Watcher = False) -> Check:
    """Looks whether a recording keeps the radar's rules, whether it can be, and whether its samples are whole.

    Nothing of this is raised: it is in the findings. Every frame is read once.

    Args:
        recording: a recording or its folder.
        as_stated: what cannot be passes, and later checks look, too.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Raises:
        hybridsim.Error: a recording that cannot be read.
    """
    folder = recording.folder if isinstance(recording, Recording) else recording
    with Notifier(progress) as notify:
        about = json.loads(_hybridsim.check(os.fspath(folder), as_stated, notify))
    findings = [Finding(**finding) for finding in about["findings"]]
    return Check(findings, about["notes"], Radar._from(about["radar"]))
