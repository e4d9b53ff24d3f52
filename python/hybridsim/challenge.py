"""The proof of :func:`hybridsim.diagnose` on recordings whose truth is locked away: sealed, answered, scored.

>>> hybridsim.challenge.seal("configs/challenge_smoke.toml", "runs/challenge")["root"]  # publish it
>>> hybridsim.challenge.run("runs/challenge", "runs/answers")["sha256"]  # publish it
>>> hybridsim.challenge.score("runs/challenge", "runs/answers")["rows"]
"""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

from . import _hybridsim
from ._progress import Notifier, Watcher
from ._types import WHOLE, Settings, Shard, StrPath, path, sets

LIMIT_S = 900.0
"""Longest time for one case, unless another is given."""


class _How(NamedTuple):
    through: Sequence[str]
    arguments: list[str]
    shard: Shard
    most: int | None
    limit_s: float


def seal(
    config: StrPath,
    out: StrPath,
    *,
    seed: str | None = None,
    shard: Shard = WHOLE,
    commit: bool = True,
    set: Settings = (),
    progress: Watcher = True,
) -> dict[str, Any] | None:
    """Records cases with concealed effects, locks their truths away, and publishes what commits to them.

    Args:
        config: a TOML file such as ``configs/challenge.toml``.
        out: folder of the challenge; cases that are there already are kept.
        seed: secret text that everything is drawn from; drawn by the operating system by default.
        shard: only part ``i`` of ``n``, as ``(i, n)`` with ``i`` from 1. Parts need a seed, unless ``out`` was begun with one.
        commit: ``False`` records the cases of the part and commits to nothing yet: sealing the whole later finds them done.
        set: changes of settings, such as ``{"cases": 30}``.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        The commitment, whose ``root`` is to be published before anybody diagnoses; ``None`` without ``commit``.

    Raises:
        hybridsim.Error: settings that cannot be a challenge; a folder that is committed to, or was begun with another seed.
        hybridsim.BusyError: another process seals the same part, or all of it.
    """
    with Notifier(progress) as notify:
        done = _hybridsim.challenge_seal(os.fspath(config), os.fspath(out), seed, shard, commit, sets(set), notify)
    return None if done is None else dict(json.loads(done))


def run(
    challenge: StrPath,
    out: StrPath,
    *,
    shard: Shard = WHOLE,
    most: int | None = None,
    limit_s: float = LIMIT_S,
    set: Settings = (),
    device: str = "auto",
    progress: Watcher = True,
) -> dict[str, Any]:
    """Has every case diagnosed by a process of its own, which is shown a copy of the case and nothing else.

    Args:
        challenge: folder of the challenge; its sealed part need not be there.
        out: folder for the answers; a case that has one is skipped. A process that fails or takes too long has failed, and that stands:
            who wants it repeated removes its folder.
        shard: only part ``i`` of ``n``, as ``(i, n)`` with ``i`` from 1.
        most: stop after so many cases.
        limit_s: longest time for one case, in seconds.
        set: changes of the diagnosis' settings, such as ``{"diagnosis.epochs": 0}``.
        device: ``flex``, ``wgpu``, ``cuda:0`` or ``auto``.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        ``reports`` and ``failures`` by the cases' names, whether they are ``complete``, and ``sha256``, to be published before the
        truths are opened.

    Raises:
        hybridsim.Error: a challenge that cannot be read.
        hybridsim.BusyError: another process answers the same part, or all of it.
    """
    how = _how(shard, most, limit_s, set, device)
    with Notifier(progress) as notify:
        return dict(json.loads(_hybridsim.challenge_run(os.fspath(challenge), os.fspath(out), how, notify)))


def twins(
    challenge: StrPath,
    answers: StrPath,
    out: StrPath,
    *,
    shard: Shard = WHOLE,
    most: int | None = None,
    limit_s: float = LIMIT_S,
    set: Settings = (),
    device: str = "auto",
    progress: Watcher = True,
) -> int:
    """Diagnoses every scene once more without its effects, for what a perfect diagnosis would be left with; how many now.

    Args:
        answers: folder of the answers, which must be complete: truths are opened.
        out: folder for the twins' reports.

    The others are those of :func:`run`.
    """
    how = _how(shard, most, limit_s, set, device)
    with Notifier(progress) as notify:
        return _hybridsim.challenge_twins(os.fspath(challenge), os.fspath(answers), os.fspath(out), how, notify)


def score(
    challenge: StrPath,
    answers: StrPath,
    *,
    twins: StrPath | None = None,
    measure: bool = False,
    out: StrPath | None = None,
    progress: Watcher = True,
) -> dict[str, Any]:
    """Opens the truths, verifies them, and holds the reports against them.

    Args:
        challenge: folder of the challenge.
        answers: folder of the answers.
        twins: folder of the twins' reports; without it no recovered misfit is given.
        measure: measure anew how strong the effects are.
        out: folder for ``results.md``, ``score.json`` and ``psychometric.png``; ``answers/score`` by default.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        ``score.json``.

    Raises:
        hybridsim.Error: truths or answers that are not what was committed to.
    """
    out = Path(answers) / "score" if out is None else out
    with Notifier(progress) as notify:
        done = _hybridsim.challenge_score(
            os.fspath(challenge), os.fspath(answers), path(twins), measure, os.fspath(out), notify
        )
    return dict(json.loads(done))


def _how(shard: Shard, most: int | None, limit_s: float, set: Settings, device: str) -> _How:
    # `-P`: nothing is imported from where the case lies.
    through = [sys.executable, "-P", "-m", "hybridsim._case"]
    arguments = ["--device", device]
    for one in sets(set):
        arguments += ["--set", one]
    return _How(through, arguments, shard, most, limit_s)
