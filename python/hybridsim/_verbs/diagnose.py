from __future__ import annotations

import json
import os
from pathlib import Path

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import Report, Settings, StrPath, path, sets


def diagnose(
    recording: Recording | StrPath,
    *,
    out: StrPath = "diagnosis",
    checkpoint: StrPath | None = None,
    config: StrPath | None = None,
    set: Settings = (),
    device: str = "auto",
    as_stated: bool = False,
    progress: Watcher = True,
) -> Report:
    """Finds out why a recording and the simulator disagree: what physics was left out, where, how large and how sure.

    Args:
        recording: a recording or its folder.
        out: folder for ``report.html``, ``report.json`` and, where a simulator was trained, its checkpoint with the effects.
        checkpoint: a simulator trained on such recordings, in place of one trained now.
        config: a TOML file with ``[diagnosis]``, ``[simulator]`` and ``[training]``.
        set: changes of settings, such as ``{"diagnosis.epochs": 0}`` (train no simulator) or ``{"diagnosis.limits": False}``.
        device: ``flex``, ``wgpu``, ``cuda:0`` or ``auto``.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Raises:
        hybridsim.Error: a recording or checkpoint that cannot be read, or cannot be meant.
    """
    folder = recording.folder if isinstance(recording, Recording) else recording
    with Notifier(progress) as notify:
        sentence, report = _hybridsim.diagnose(
            os.fspath(folder), os.fspath(out), path(checkpoint), path(config), sets(set), device, as_stated, notify
        )
    kept = Path(out) / "simulator" / "with" / "best"
    return Report(
        sentence, json.loads(report), Path(out) / "report.html", Path(out) / "report.json", kept if kept.is_dir() else None
    )
