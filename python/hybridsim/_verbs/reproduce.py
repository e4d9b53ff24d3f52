from __future__ import annotations

import json
import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._types import WHOLE, Settings, Shard, Stage, StrPath, sets


def stages(
    config: StrPath,
    out: StrPath,
    *,
    set: Settings = (),
    device: str = "auto",
    as_stated: bool = False,
    progress: Watcher = True,
) -> list[Stage]:
    """Lists the stages of a reproduction in an order in which they can be done, and does none of them.

    Args:
        config, out, set, device, as_stated, progress: as of :func:`reproduce`.

    Raises:
        hybridsim.Error: settings that cannot work, sites that cannot be.
    """
    with Notifier(progress) as notify:
        listed = _hybridsim.stages(os.fspath(config), os.fspath(out), sets(set), device, as_stated, notify)
    return [Stage(*one) for one in listed]


def reproduce(
    config: StrPath,
    out: StrPath,
    *,
    stages: Iterable[str] = (),
    stage: str | None = None,
    shard: Shard = WHOLE,
    jobs: int = 1,
    set: Settings = (),
    device: str = "auto",
    as_stated: bool = False,
    progress: Watcher = True,
) -> dict[str, Any] | None:
    """Reproduces the paper's experiments, from nothing to tables. What is done already is kept.

    Args:
        config: a TOML file such as ``configs/reproduce_smoke.toml``.
        out: folder for ``results.md``, ``results.json``, pictures, and ``stages``.
        stages: only the stages whose names begin so, and what they need.
        stage: only this one, the ``folder`` of one of :func:`hybridsim.stages`, whose parents are done. Other processes may do other
            stages at the same time; the results are the same in any order and place.
        shard: of ``stage`` only part ``i`` of ``n``, as ``(i, n)`` with ``i`` from 1 and ``n`` at most its ``pieces``; doing the stage
            later finds them done.
        jobs: stages done side by side, each with its share of the cores.
        set: changes of settings, such as ``{"training.epochs": 3}``.
        device: ``flex``, ``wgpu``, ``cuda:0``, ``auto``, or several with commas between.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        ``results.json``; ``None`` of some stages.

    Raises:
        ValueError: ``jobs`` below 1.
        hybridsim.Error: settings that cannot work, sites that cannot be, a stage whose parents are not done.
        hybridsim.BusyError: another process does the same stage, or all of it.
    """
    if jobs < 1:
        raise ValueError(f"jobs={jobs}: at least 1")
    asked = os.fspath(config), os.fspath(out)
    with Notifier(progress) as notify:
        if stage is not None:
            _hybridsim.reproduce_stage(*asked, stage, shard, sets(set), device, notify)
            return None
        some, more = list(stages), "".join(f", {one!r}" for one in sets(set))
        command = f"hybridsim.reproduce({asked[0]!r}, set=[{more[2:]}], device={device!r})"
        _hybridsim.reproduce(*asked, some, jobs, sets(set), command, device, as_stated, notify)
    return None if some else dict(json.loads((Path(out) / "results.json").read_text()))
