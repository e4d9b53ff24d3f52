"""The library's side. Use :mod:`hybridsim`, which has types and docs."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from numpy import float32
from numpy.typing import NDArray
from typing_extensions import Buffer

Tell = Callable[[str, str, int], object]
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
def recordings_in(folder: str) -> list[Path]: ...
def record(config: str, out: str, sets: list[str], as_stated: bool, tell: Tell) -> None: ...
def site(config: str, out: str, sets: list[str], as_stated: bool, tell: Tell) -> None: ...
def import_(*arguments: Any) -> list[str]: ...
def check(path: str, as_stated: bool, tell: Tell) -> str: ...
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
    frames: int | None,
    clean: bool,
    only: str | None,
    without_effects: bool,
    without: list[str],
    out: str | None,
    device_name: str,
    as_stated: bool,
    tell: Tell,
) -> tuple[str, Numbers | None]: ...
def train(
    config: str | None,
    resume: str | None,
    out: str | None,
    sets: list[str],
    device: str,
    as_stated: bool,
    tell: Tell,
) -> str: ...
def diagnose(
    recording: str,
    out: str,
    checkpoint: str | None,
    config: str | None,
    sets: list[str],
    device: str,
    as_stated: bool,
    tell: Tell,
) -> tuple[str, str]: ...
def align(recording: str, out: str, lag_s: float, frames: int, apply: bool, tell: Tell) -> str: ...
def export(
    sources: list[str],
    target: str,
    out: str,
    board: str | None,
    split_by: str | None,
    sets: list[str],
    tell: Tell,
) -> tuple[int, int]: ...
def abandon() -> None: ...
