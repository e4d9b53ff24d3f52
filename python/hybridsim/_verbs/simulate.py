from __future__ import annotations

import os
from collections.abc import Iterable
from pathlib import Path
from typing import Any, overload

from numpy.typing import NDArray

from .. import _hybridsim
from .._progress import Notifier, Watcher
from .._recording import Recording, array
from .._types import Radar, StrPath, path


@overload
def simulate(
    checkpoint: StrPath,
    *,
    motion: StrPath | None = ...,
    motion_config: StrPath | None = ...,
    up: str | None = ...,
    action: str | None = ...,
    recording: Recording | StrPath | None = ...,
    body: StrPath | None = ...,
    distance_m: float | None = ...,
    raise_m: float | None = ...,
    turn_deg: float | None = ...,
    frames: int | None = ...,
    clean: bool = ...,
    only: str | None = ...,
    without_effects: bool | Iterable[str] = ...,
    out: StrPath,
    device: str = ...,
    as_stated: bool = ...,
    progress: Watcher = ...,
) -> Recording: ...


@overload
def simulate(
    checkpoint: StrPath,
    *,
    motion: StrPath | None = ...,
    motion_config: StrPath | None = ...,
    up: str | None = ...,
    action: str | None = ...,
    recording: Recording | StrPath | None = ...,
    body: StrPath | None = ...,
    distance_m: float | None = ...,
    raise_m: float | None = ...,
    turn_deg: float | None = ...,
    frames: int | None = ...,
    clean: bool = ...,
    only: str | None = ...,
    without_effects: bool | Iterable[str] = ...,
    out: None = ...,
    device: str = ...,
    as_stated: bool = ...,
    progress: Watcher = ...,
) -> NDArray[Any]: ...


def simulate(
    checkpoint: StrPath,
    *,
    motion: StrPath | None = None,
    motion_config: StrPath | None = None,
    up: str | None = None,
    action: str | None = None,
    recording: Recording | StrPath | None = None,
    body: StrPath | None = None,
    distance_m: float | None = None,
    raise_m: float | None = None,
    turn_deg: float | None = None,
    frames: int | None = None,
    clean: bool = False,
    only: str | None = None,
    without_effects: bool | Iterable[str] = False,
    out: StrPath | None = None,
    device: str = "auto",
    as_stated: bool = False,
    progress: Watcher = True,
) -> Recording | NDArray[Any]:
    """Simulates a motion at a trained site.

    Args:
        checkpoint: a checkpoint folder, such as ``run.best`` or ``models/quickstart``.
        motion: BVH, or npz in AMASS layout.
        motion_config: how to read the motion, a TOML file (docs/motion.md).
        up: up axis of the motion's file: x, y, z, -x, -y or -z; recognised by default.
        action: one of the embedded actions, such as ``"walk_back_forth"``, in place of a motion.
        recording: a recording whose motion is simulated again, in place of a motion.
        body: the body that moves, npz in SMPL layout; the embedded person by default.
        distance_m: of the motion's origin in front of the radar; the training person's place by default.
        raise_m: how much higher than its file says the motion is, such as 1.0 where that is in the frame of a camera 1 m above the floor.
        turn_deg: about the vertical through the middle of the motion's path, counter-clockwise seen from above; without it who faces +z
            in the file (y up; -y where z is up) faces the radar.
        frames: as many as the motion lasts, but at most 24, by default.
        clean: leave out the learned noise.
        only: ``"direct"``, ``"indirect"`` or ``"noise"``: one part of the signal; the three add up to the whole.
        without_effects: leave out all effects beyond the plain simulator, or these.
        out: folder for a recording (``out/recording``) and pictures; without it the samples are returned and nothing is written.
        device: ``flex``, ``wgpu``, ``cuda:0`` or ``auto``.
        as_stated: take what is stated, however implausible.
        progress: ``True``, ``False``, or a function of :class:`hybridsim.Progress`.

    Returns:
        The recording; without ``out`` the IF samples ``[frame, tx, rx, loop, sample]``, complex64 (float32 without quadrature),
        in the units of the recordings that were trained on.

    Raises:
        hybridsim.Error: a checkpoint, motion, body or recording that cannot be read, or cannot be meant.
    """
    if isinstance(recording, Recording):
        recording = recording.folder
    every = without_effects is True
    if isinstance(without_effects, str):
        without_effects = [without_effects]
    without = [] if isinstance(without_effects, bool) else list(without_effects)
    with Notifier(progress) as notify:
        about, numbers = _hybridsim.simulate(
            os.fspath(checkpoint),
            path(motion),
            path(motion_config),
            up,
            action,
            path(recording),
            path(body),
            distance_m,
            raise_m,
            turn_deg,
            frames,
            clean,
            only,
            every,
            without,
            path(out),
            device,
            as_stated,
            notify,
        )
    if out is not None:
        return Recording(Path(out) / "recording")
    assert numbers is not None
    return array(numbers).reshape(Radar._parse(about).shape)
