"""Recordings for PyTorch. Importing this module imports torch; ``import hybridsim`` alone does not."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch.utils.data import Dataset

from ._windows import Windows


class RecordingDataset(Windows, Dataset[tuple[Any, int]]):
    """:class:`hybridsim.Windows` as a ``torch.utils.data.Dataset``: arrays become tensors without a copy.

    Samples are ``[frame, tx, rx, loop, sample]``, complex64 (float32 without quadrature), or what ``transform`` makes of them. A
    recording opens again in each worker of a ``DataLoader``; its samples stay on the disk until a window is asked for.
    """

    def _item(self, index: int) -> tuple[Any, int]:
        value, number = super()._item(index)
        return (torch.from_numpy(value) if isinstance(value, np.ndarray) else value), number
