from __future__ import annotations

import json
import os
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import _hybridsim
from .._recording import Frames, Recording, array
from .._types import Axis, Heatmap, Radar, StrPath


def heatmaps(
    source: Recording | StrPath | NDArray[Any],
    radar: Radar | None = None,
    *,
    frames: Frames = slice(None),
    range_window: str = "hann",
    doppler_window: str = "hann",
    floor_db: float = -120.0,
    db: bool = True,
) -> dict[str, Heatmap]:
    """Range-Doppler, range-azimuth and their courses over time.

    Args:
        source: a recording or its folder, or samples ``[frame, tx, rx, loop, sample]``, complex64 or float32.
        radar: that the samples are of; of a recording it is known.
        frames: which frames of the source; all by default.
        range_window, doppler_window: ``"hann"``, ``"hamming"`` or ``"rectangular"``.
        floor_db: floor of the logarithm, relative to the strongest cell.
        db: decibels, or linear power.

    Returns:
        By name: ``range_doppler``, ``range_doppler_moving`` (static removed), ``range_azimuth`` of the middle frame
        (``[velocity or azimuth, range]``; m/s, degrees, m), ``time_doppler``, ``time_range`` and ``time_azimuth``
        (``[velocity, range or azimuth, time]``; s), static removed. ``time_doppler`` is a short-time Fourier transform over
        all chirps, the others have a column a frame. Those over time need two frames, those over azimuth two antenna pairs.

    Raises:
        hybridsim.Error: a recording that cannot be read; settings that are none.
        ValueError: samples that are not whole frames of the radar.
    """
    if isinstance(source, (str, os.PathLike)):
        source = Recording(source)
    if isinstance(source, Recording):
        samples, radar = source.samples(frames), source.radar
    elif radar is None:
        raise TypeError("heatmaps: an array needs its radar")
    else:
        samples = source[frames] if isinstance(frames, slice) else source[np.atleast_1d(np.asarray(frames))]
    if samples.ndim != 5 or samples.shape[1:] != radar.shape[1:]:
        found, expected = " x ".join(map(str, samples.shape)), " x ".join(map(str, radar.shape[1:]))
        raise ValueError(f"heatmaps: samples of {found}, expected frame x tx x rx x loop x sample = frames x {expected}")
    pairs = np.ascontiguousarray(samples, np.complex64).view(np.float32).reshape(-1)
    settings = {"range_window": range_window, "doppler_window": doppler_window, "floor_db": floor_db}
    drawn = _hybridsim.heatmaps(radar._json(), json.dumps(settings), pairs, db)
    return {name: _heatmap(title, rows, columns, values) for name, title, rows, columns, values in drawn}


def _heatmap(title: str, rows: _hybridsim.Axis, columns: _hybridsim.Axis, values: _hybridsim.Numbers) -> Heatmap:
    down, along = (Axis(name, unit, array(numbers)) for name, unit, numbers in (rows, columns))
    return Heatmap(title, array(values).reshape(len(down.values), len(along.values)), down, along)
