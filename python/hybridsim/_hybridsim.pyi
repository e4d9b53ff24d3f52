"""The library's side. Use :mod:`hybridsim`, which has types and docs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy import float32
from numpy.typing import NDArray
from typing_extensions import Buffer

Notify = Callable[[str, str, int], object]
Axis = tuple[str, str, "Numbers"]

class Numbers(Buffer):
    @property
    def dtype(self) -> str: ...

class Recording:
    def about(self) -> str: ...
    def samples(self, frames: list[int]) -> Numbers: ...
    def has_codes(self) -> bool: ...
    def poses(self) -> tuple[Numbers, Numbers | None, Numbers | None, Numbers | None, int] | None: ...

def read(path: str) -> Recording: ...
def radar(settings: str) -> str: ...
def recordings_in(folder: str) -> list[Path]: ...
def record(config: str, out: str, sets: list[str], as_stated: bool, notify: Notify) -> None: ...
def site(config: str, out: str, shard: tuple[int, int], sets: list[str], as_stated: bool, notify: Notify) -> list[Path]: ...
def site_look(config: str, out: str, sets: list[str], as_stated: bool, notify: Notify) -> list[Path]: ...
def challenge_begin(config: str, out: str, seed: str | None, sets: list[str]) -> int: ...
def challenge_seal(
    config: str, out: str, seed: str | None, shard: tuple[int, int], committing: bool, sets: list[str], notify: Notify
) -> str | None: ...
def challenge_run(challenge: str, out: str, how: Any, notify: Notify) -> str: ...
def challenge_twins(challenge: str, answers: str, out: str, how: Any, notify: Notify) -> int: ...
def challenge_score(challenge: str, answers: str, twins: str | None, measure: bool, out: str, notify: Notify) -> str: ...
def stages(
    config: str, out: str, sets: list[str], device: str, as_stated: bool, notify: Notify
) -> list[tuple[str, list[int], int, float | None]]: ...
def reproduce(
    config: str,
    out: str,
    beginnings: list[str],
    jobs: int,
    sets: list[str],
    command: str,
    device: str,
    as_stated: bool,
    notify: Notify,
) -> None: ...
def reproduce_stage(
    config: str, out: str, folder: str, shard: tuple[int, int], sets: list[str], device: str, notify: Notify
) -> None: ...
def import_(*arguments: Any) -> list[tuple[str, list[str]]]: ...
def check(path: str, as_stated: bool, notify: Notify) -> str: ...
def heatmaps(radar: str, settings: str, pairs: NDArray[float32], decibels: bool) -> list[tuple[str, str, Axis, Axis, Numbers]]: ...
def simulate(
    checkpoint: str,
    motion: str | None,
    motion_config: str | None,
    up: str | None,
    action: str | None,
    recording: str | None,
    body: str | None,
    distance_m: float | None,
    raise_m: float | None,
    turn_deg: float | None,
    frames: int | None,
    clean: bool,
    only: str | None,
    without_effects: bool,
    without: list[str],
    out: str | None,
    device_name: str,
    as_stated: bool,
    notify: Notify,
) -> tuple[str, Numbers | None]: ...
def train(
    config: str | None,
    resume: str | None,
    out: str | None,
    sets: list[str],
    go_on: bool,
    diagnose: bool,
    device: str,
    as_stated: bool,
    notify: Notify,
) -> str: ...
def diagnose(
    recording: str,
    out: str,
    checkpoint: str | None,
    config: str | None,
    sets: list[str],
    device: str,
    as_stated: bool,
    notify: Notify,
) -> tuple[str, str]: ...
def align(recording: str, out: str, lag_s: float, frames: int, apply: bool, notify: Notify) -> str: ...
def export(
    sources: list[str],
    target: str,
    out: str,
    board: str | None,
    split_by: str | None,
    sets: list[str],
    notify: Notify,
) -> tuple[int, int]: ...
def is_library(file: str) -> None: ...
def abandon() -> None: ...
