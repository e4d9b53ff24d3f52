"""Work on many machines: each function gives an engine, Dask, one task for each unit of the work.

>>> from dask.distributed import Client
>>> with Client("tcp://scheduler:8786") as client:
...     hybridsim.distributed.site(client, "configs/site.toml", "/shared/site")

Workers and the caller see the same files under the same paths. A unit's result appears there whole or not at all; a unit whose worker
died is done again, by whichever worker the engine finds, and comes out the same. Units that are done are kept, so that a run that was
ended goes on. Each worker's process has as many threads as its worker, unless ``RAYON_NUM_THREADS`` says otherwise.
"""

from __future__ import annotations

import os
import time
import warnings
from collections.abc import Callable, Iterable, Mapping
from typing import TYPE_CHECKING, Any

from . import _hybridsim
from . import challenge as _challenge
from ._errors import BusyError, Note
from ._progress import Notifier
from ._recording import Recording
from ._types import Settings, StrPath, sets
from ._verbs import reproduce as _reproduce
from ._verbs import site as _site
from ._verbs.train import train

if TYPE_CHECKING:
    from distributed import Client, Future

WAIT_S = 1.0
"""Between two looks at whether another process has let go of a unit: units take seconds to hours."""


def site(
    client: Client, config: StrPath, out: StrPath, *, set: Settings = (), as_stated: bool = False
) -> list[Recording]:
    """:func:`hybridsim.site`; a unit is a sequence with its second take. All are looked at before the first is recorded."""
    paths = _absolute(config, out)
    how: dict[str, Any] = {"set": sets(set), "as_stated": as_stated}
    with Notifier(False) as notify:
        count = len(_hybridsim.site_look(*paths, sets(set), as_stated, notify))
    units = [_submit(client, _site.site, *paths, shard=shard, **how) for shard in _shards(count)]
    return _submit(client, _site.site, *paths, after=units, **how).result()  # type: ignore[no-any-return]


def challenge(
    client: Client,
    config: StrPath,
    out: StrPath,
    *,
    seed: str | None = None,
    set: Settings = (),
    diagnosis: Settings = (),
    device: str = "auto",
    limit_s: float = _challenge.LIMIT_S,
) -> dict[str, Any]:
    """:func:`hybridsim.challenge.seal` into ``out/challenge``, :func:`~hybridsim.challenge.run` into ``out/answers`` and
    :func:`~hybridsim.challenge.score` into ``out/score``, whose score is returned. A unit is a case that is sealed, or answered. ``set``
    changes settings of the challenge, ``diagnosis`` those of the diagnoses."""
    config, out = _absolute(config, out)
    sealed, answers = os.path.join(out, "challenge"), os.path.join(out, "answers")
    count = int(_patiently(lambda: _hybridsim.challenge_begin(config, sealed, seed, sets(set))))
    if not os.path.exists(os.path.join(sealed, "commitment.json")):
        seal: dict[str, Any] = {"set": sets(set)}
        units = [_submit(client, _challenge.seal, config, sealed, shard=shard, commit=False, **seal) for shard in _shards(count)]
        _submit(client, _challenge.seal, config, sealed, after=units, **seal).result()
    how: dict[str, Any] = {"set": sets(diagnosis), "device": device, "limit_s": limit_s}
    units = [_submit(client, _challenge.run, sealed, answers, shard=shard, **how) for shard in _shards(count)]
    _submit(client, _challenge.run, sealed, answers, after=units, **how).result()
    score = os.path.join(out, "score")
    return _submit(client, _challenge.score, sealed, answers, out=score).result()  # type: ignore[no-any-return]


def reproduce(
    client: Client,
    config: StrPath,
    out: StrPath,
    *,
    set: Settings = (),
    device: str = "auto",
    as_stated: bool = False,
) -> dict[str, Any]:
    """:func:`hybridsim.reproduce`; a unit is a stage once all that it needs is done, or of a site that it records a sequence."""
    paths = _absolute(config, out)
    how: dict[str, Any] = {"set": sets(set), "device": device, "as_stated": as_stated}
    units: list[Future[Any]] = []
    for stage in _reproduce.stages(*paths, progress=False, **how):
        one = {"stage": stage.folder, **how}
        after = [units[parent] for parent in stage.parents]
        if stage.pieces > 1:
            shards = _shards(stage.pieces)
            after = [_submit(client, _reproduce.reproduce, *paths, shard=shard, after=after, **one) for shard in shards]
        units.append(_submit(client, _reproduce.reproduce, *paths, after=after, **one))
    return _submit(client, _reproduce.reproduce, *paths, after=units, **how).result()  # type: ignore[no-any-return]


def sweep(
    client: Client,
    function: Callable[..., Any],
    settings: Mapping[str, Settings],
    *arguments: Any,
    **more: Any,
) -> dict[str, Any]:
    """Calls ``function(*arguments, out=FOLDER, set=SETTINGS, **more)`` for each pair of ``settings``; a unit is a call.

    Args:
        function: :func:`hybridsim.train`, whose units go on after their last whole epoch, or :func:`hybridsim.diagnose`; another one if
            it can be called again for a folder in which it was ended, or has finished, and takes ``progress``.
        settings: such as ``{"runs/slow": {"training.learning_rate": 1e-3}, "runs/fast": {"training.learning_rate": 1e-2}}``.
        arguments, more: the same for all; paths among them absolute, unless all workers were started in the same folder.

    Returns:
        What the calls return, by folder.
    """
    if function is train:
        more = {"go_on": True, **more}
    units = {
        out: _submit(client, function, *arguments, out=os.path.abspath(out), set=sets(one), **more) for out, one in settings.items()
    }
    return {out: unit.result() for out, unit in units.items()}


def _absolute(config: StrPath, out: StrPath) -> tuple[str, str]:
    return os.path.abspath(config), os.path.abspath(out)


def _shards(count: int) -> list[tuple[int, int]]:
    return [(number, count) for number in range(1, count + 1)]


def _submit(
    client: Client, function: Callable[..., Any], *arguments: Any, after: Iterable[Future[Any]] = (), **settings: Any
) -> Future[Any]:
    # Not pure: whether it is done is seen on the disk.
    return client.submit(_unit, function, arguments, settings, list(after), pure=False)


def _unit(function: Callable[..., Any], arguments: tuple[Any, ...], settings: dict[str, Any], _after: list[Any]) -> Any:
    """Does a unit in a worker."""
    from distributed import get_worker

    os.environ.setdefault("RAYON_NUM_THREADS", str(get_worker().state.nthreads))
    return _patiently(lambda: function(*arguments, progress=False, **settings))


def _patiently(work: Callable[[], Any]) -> Any:
    """Waits for another process that holds what this one needs: it lives, though the engine may have lost sight of it."""
    while True:
        try:
            return work()
        except BusyError as busy:
            warnings.warn(f"{busy}; waiting for it", Note, stacklevel=2)
            time.sleep(WAIT_S)
