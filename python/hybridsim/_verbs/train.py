from __future__ import annotations

import json
from pathlib import Path

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._types import Run, Settings, StrPath, path, sets


def train(
    config: StrPath | None = None,
    *,
    out: StrPath | None = None,
    resume: StrPath | None = None,
    go_on: bool = False,
    diagnose: bool = False,
    set: Settings = (),
    device: str = "auto",
    as_stated: bool = False,
    progress: Watcher = True,
) -> Run:
    """Fits the simulator to recordings.

    Args:
        config: the experiment, a TOML file such as ``configs/quickstart.toml``. It names recordings, or has a ``[record]`` section.
        out: run folder; ``runs/<config>``, or the next free name, by default.
        resume: a run folder that was interrupted, in place of a config. Ctrl-C keeps the checkpoint of the last whole epoch.
        go_on: a run of the same settings that is in ``out`` already is continued; of others it is refused.
        diagnose: the first recording is diagnosed, and the simulator is trained with the effects that were found; the diagnosis is in
            ``diagnosis`` in the run folder.
        set: changes of settings, such as ``{"training.epochs": 10}``.
        device: ``flex``, ``wgpu``, ``cuda:0``, ``auto``, or several with commas between.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`, whose ``epoch`` holds the losses.

    Raises:
        hybridsim.Error: settings or recordings that cannot be used; a loss that became NaN.
    """
    with Notifier(progress) as notify:
        about = _hybridsim.train(path(config), path(resume), path(out), sets(set), go_on, diagnose, device, as_stated, notify)
    found = json.loads(about)
    return Run(**{**found, "folder": Path(found["folder"])})
