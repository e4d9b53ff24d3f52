from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Literal, overload

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording
from .._types import Settings, StrPath, paths, sets


@overload
def import_(
    sources: StrPath | Iterable[StrPath],
    out: StrPath,
    *,
    config: StrPath | Iterable[StrPath] = (),
    board: str | None = None,
    layout: str | None = None,
    variable: str | None = None,
    preset: str | None = None,
    profile: int | None = None,
    subframe: int | None = None,
    tx: int | None = None,
    labels: Mapping[str, str] | None = None,
    set: Settings = (),
    as_stated: bool = False,
    progress: Watcher = True,
) -> Recording: ...


@overload
def import_(
    sources: StrPath | Iterable[StrPath],
    out: StrPath,
    *,
    config: StrPath | Iterable[StrPath] = (),
    board: str | None = None,
    layout: str | None = None,
    variable: str | None = None,
    preset: str | None = None,
    profile: Literal["all"],
    subframe: int | None = None,
    tx: int | None = None,
    labels: Mapping[str, str] | None = None,
    set: Settings = (),
    as_stated: bool = False,
    progress: Watcher = True,
) -> list[Recording]: ...


def import_(
    sources: StrPath | Iterable[StrPath],
    out: StrPath,
    *,
    config: StrPath | Iterable[StrPath] = (),
    board: str | None = None,
    layout: str | None = None,
    variable: str | None = None,
    preset: str | None = None,
    profile: int | Literal["all"] | None = None,
    subframe: int | None = None,
    tx: int | None = None,
    labels: Mapping[str, str] | None = None,
    set: Settings = (),
    as_stated: bool = False,
    progress: Watcher = True,
) -> Recording | list[Recording]:
    """Turns a capture of a radar board into a recording.

    Args:
        sources: ``.bin`` files of one DCA1000 capture, in whatever order, or their folder; a ``.setup.json``, which names its files; the
            folder of a cascade, of roverd or of the Infineon SDK; or an array (``.npy``, ``.npz``, ``.mat``, ``.h5``, ``.hdf5``, or
            ``.bin`` with ``layout``). Several arrays, or a folder of them, whose layout has no ``frame`` are a frame each, in the order of
            the numbers in their names.
        out: folder of the recording, which must not exist yet, or be empty. It appears when it is complete.
        config: what describes the radar: ``.mmwave.json``, ``.setup.json`` or ``.cfg`` of TI; TOML with ``[radar]`` or ColoRadar's
            ``.txt`` for arrays.
        board: whose antenna positions are then known, such as ``"IWR6843ISK"``.
        layout: the order of an array's axes, outer to inner, of frame, tx, rx, loop, chirp, antenna, sample, lane, iq; such as
            ``"frame chirp rx sample"``. ``chirp`` is loops and transmitters together in the order of firing, ``antenna`` transmitters and
            receivers together, receivers inner, ``lane`` the two samples that go out side by side (I I Q Q is ``"sample iq lane"``). Of a
            ``.bin`` that holds no 16-bit words it ends in the type of the numbers: float32, float64, complex64 or complex128.
        variable: which array of a container (``.npz``, ``.mat``, HDF5), such as ``"data.adc"``, or ``"RE,IM"`` for two of real numbers;
            without it, the only one with as many axes as ``layout`` names.
        preset: a public data set by its name, whose layout and radar are then known.
        profile: which chirp profile, where a frame has several; ``"all"``: a recording of each, ``out/profile0`` and so on, all or
            none.
        subframe: which subframe of an advanced frame.
        tx: keep the chirps of one transmitter alone.
        labels: such as ``{"action": "walk"}``.
        set: corrects what the files say, such as ``{"radar.frame_period_s": 0.05}``.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        The recording; what was assumed comes first in its notes, and as warnings of the class :class:`hybridsim.Note`. Of
        ``profile="all"`` a list, in the order of the profiles.

    Raises:
        hybridsim.Error: a source of no known kind, a description that is missing or does not fit the samples.
    """
    with Notifier(progress) as notify:
        made = _hybridsim.import_(
            paths(sources),
            os.fspath(out),
            paths(config),
            board,
            layout,
            variable,
            preset,
            None if profile is None else str(profile),
            subframe,
            tx,
            dict(labels or {}),
            sets(set),
            as_stated,
            notify,
        )
    recordings = []
    for name, notes in made:
        recordings.append(Recording(Path(out) / name))
        recordings[-1].notes = notes
    return recordings if profile == "all" else recordings[0]
