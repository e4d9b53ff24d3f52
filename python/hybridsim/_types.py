"""What verbs take and return."""

from __future__ import annotations

import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import _hybridsim
from ._errors import Error

StrPath = str | os.PathLike[str]

Settings = Mapping[str, Any] | Iterable[str]
"""Changes of single settings: ``{"training.epochs": 10}``, or ``["training.epochs=10"]``."""


Shard = tuple[int, int]
"""A part of some work: its number, from 1, and how many there are."""

WHOLE: Shard = (1, 1)
"""All of it."""


def plain(value: Any) -> Any:
    """What JSON has for a number of NumPy or a path."""
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise Error(f"a setting is of type `{type(value).__name__}`, expected a number, a text, a path, a switch, or a list of these")


def sets(settings: Settings) -> list[str]:
    """Settings as the command line's ``--set`` has them."""
    if isinstance(settings, Mapping):
        # JSON of numbers, texts, switches and lists is TOML, too.
        return [f"{key}={json.dumps(value, default=plain)}" for key, value in settings.items()]
    if isinstance(settings, str):
        return [settings]
    return list(settings)


def path(given: StrPath | None) -> str | None:
    """A path as text."""
    return None if given is None else os.fspath(given)


def paths(given: StrPath | Iterable[StrPath]) -> list[str]:
    """One path or several."""
    if isinstance(given, (str, os.PathLike)):
        return [os.fspath(given)]
    return [os.fspath(one) for one in given]


@dataclass(frozen=True)
class Radar:
    """An FMCW radar with time-division transmitters. Every name carries its unit.

    Frame of reference: origin at the radar, x right, y boresight, z up, metres.

    Attributes:
        start_frequency_hz: at the start of the ramp.
        slope_hz_per_s: of the chirp; negative for a falling one.
        sample_rate_hz: of the ADC.
        samples_per_chirp: samples of one chirp.
        loops_per_frame: chirps per transmitter in a frame.
        adc_start_s: from the start of the ramp to the first sample.
        chirp_period_s: from ramp start to ramp start.
        frame_period_s: from frame start to frame start.
        frames: frames of the recording.
        tx_m, rx_m: antenna positions ``[antenna][xyz]``, transmitters in firing order.
        sampling: ``"complex"`` (quadrature receiver) or ``"real"``.
        position_m: the antennas' reference.
        full_scale_codes: the ADC's rail, where it is known.
        derived: what follows from the settings: ``wavelength_m``, ``bandwidth_hz``, ``range_resolution_m``, ``max_range_m``,
            ``velocity_resolution_mps``, ``max_velocity_mps``, ``loop_period_s``.
    """

    start_frequency_hz: float
    slope_hz_per_s: float
    sample_rate_hz: float
    samples_per_chirp: int
    loops_per_frame: int
    adc_start_s: float
    chirp_period_s: float
    frame_period_s: float
    frames: int
    tx_m: list[list[float]]
    rx_m: list[list[float]]
    sampling: str = "complex"
    position_m: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    full_scale_codes: float | None = None
    derived: dict[str, float] = field(default_factory=dict, compare=False)

    def __post_init__(self) -> None:
        if not self.derived:
            derived = json.loads(_hybridsim.radar(self._json()))["derived"]
            object.__setattr__(self, "derived", derived)

    @property
    def shape(self) -> tuple[int, int, int, int, int]:
        """``(frame, tx, rx, loop, sample)`` of a recording."""
        return (self.frames, len(self.tx_m), len(self.rx_m), self.loops_per_frame, self.samples_per_chirp)

    @classmethod
    def _from(cls, about: Mapping[str, Any]) -> Radar:
        return cls(**about["settings"], derived=dict(about["derived"]))

    @classmethod
    def _parse(cls, text: str) -> Radar:
        return cls._from(json.loads(text))

    def _json(self) -> str:
        settings = asdict(self)
        del settings["derived"]
        return json.dumps({key: value for key, value in settings.items() if value is not None}, default=plain)


class Poses(NamedTuple):
    """How a recording's person moves.

    Attributes:
        times_s: ``[pose]``, seconds after the first chirp.
        rotations: ``[pose, joint, 3]``, axis-angle, radians, SMPL's joints; ``None`` for a sequence of meshes.
        translations: ``[pose, xyz]``, metres, in the motion's frame (y up); ``None`` for a sequence of meshes.
        vertices: ``[pose, vertex, xyz]``, metres, radar frame; ``None`` for a skinned body.
    """

    times_s: NDArray[np.float64]
    rotations: NDArray[np.float64] | None
    translations: NDArray[np.float64] | None
    vertices: NDArray[np.float64] | None


class Axis(NamedTuple):
    """One axis of a heatmap.

    Attributes:
        name: such as ``"range"``.
        unit: such as ``"m"``.
        values: of every row or column.
    """

    name: str
    unit: str
    values: NDArray[np.float64]


@dataclass(frozen=True)
class Heatmap:
    """A picture's worth of numbers.

    Attributes:
        title: for people.
        values: ``[row, column]``, dB or linear power. 0 dB is a path of amplitude 1 in the middle of a cell.
        rows, columns: the axes.
    """

    title: str
    values: NDArray[np.float64]
    rows: Axis
    columns: Axis


@dataclass(frozen=True)
class Finding:
    """What one check says about a recording.

    Attributes:
        about: ``"radar"`` (its rules), ``"plausibility"`` (whether the scene can be) or ``"integrity"`` (whether the samples are
            whole).
        check: which rule, field or test.
        expected, found: in words.
        ok: whether it passed. Of plausibility, what is odd but may be meant passes.
        hint: what can be done about it.
        frames: damaged frames; empty where nothing is damaged, or all are.
        p_value: bound on the chance that a whole recording looks like this; ``None`` where nothing was found.
        file: the file it is about, of plausibility.
        kept: of integrity what becomes of the statement: ``"as stated"``, ``"as stated, undecided"`` (the samples cannot say) or
            ``"questioned"`` (they contradict it).
    """

    about: str
    check: str
    expected: str
    found: str
    ok: bool
    hint: str | None = None
    frames: list[int] = field(default_factory=list)
    p_value: float | None = None
    file: str | None = None
    kept: str | None = None


@dataclass(frozen=True)
class Check:
    """What all checks say about a recording.

    Attributes:
        ok: whether all passed.
        findings: one by one.
        notes: what had to be fitted when it was read.
        radar: its radar.
    """

    findings: list[Finding]
    notes: list[str]
    radar: Radar

    @property
    def ok(self) -> bool:
        return all(finding.ok for finding in self.findings)


@dataclass(frozen=True)
class Run:
    """A training run that is done.

    Attributes:
        folder: holds config.toml, metrics.json, report.md, pictures, and the checkpoints.
        epochs: that were trained.
        best_epoch: counted from 1.
        history: numbers of every epoch, whose ``epoch`` counts from 0; losses in the unit of ``loss.scale``: nats a cell by
            default, dB² for ``"db"``.
        scores: of the best checkpoint on held-out frames, by recording folder.
    """

    folder: Path
    epochs: int
    best_epoch: int
    history: list[dict[str, Any]]
    scores: dict[str, Any]

    @property
    def best(self) -> Path:
        """The checkpoint of the best epoch, for :func:`hybridsim.simulate`."""
        return self.folder / "best"

    @property
    def last(self) -> Path:
        """The checkpoint of the last epoch."""
        return self.folder / "last"


@dataclass(frozen=True)
class Stage:
    """A stage of a reproduction.

    Attributes:
        folder: its name and the hash of all that it depends on; where its results are, below ``out/stages``.
        parents: the stages that must be done before, by their places in the list.
        pieces: into how many parts it can be divided; a stage that records a site into its sequences.
        seconds: how long it took; ``None`` while it is to be done.
    """

    folder: str
    parents: list[int]
    pieces: int
    seconds: float | None


@dataclass(frozen=True)
class Report:
    """The answer of a diagnosis.

    Attributes:
        sentence: what the report begins with.
        data: ``report.json``.
        html: the page for people.
        json: the file for programs.
        checkpoint: the simulator with the effects that were found; ``None`` where none was kept.
    """

    sentence: str
    data: dict[str, Any]
    html: Path
    json: Path
    checkpoint: Path | None

    @property
    def verdict(self) -> str:
        """``explained``, ``partly_explained``, ``unexplained``, ``no_mismatch``, ``undecided`` or ``damaged``."""
        return str(self.data["verdict"])

    @property
    def effects(self) -> list[dict[str, Any]]:
        """The effects that were found, with probability, parameters, 90 % intervals and evidence."""
        return list(self.data["effects"])
