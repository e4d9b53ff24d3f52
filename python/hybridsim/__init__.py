"""HybridSim: a differentiable simulator of mmWave radar recordings of moving people, and a diagnosis that says why it disagrees
with a recording.

The functions are the verbs of the command line, on arrays and folders. Errors are :class:`Error`, in the same words; what was
assumed is a warning of the class :class:`Note`. While a verb works, other Python threads run, and Ctrl-C raises
``KeyboardInterrupt`` and leaves nothing half-written.

>>> import hybridsim
>>> recording = hybridsim.read("runs/capture")
>>> recording.samples(slice(0, 8)).shape  # [frame, tx, rx, loop, sample]
"""

from __future__ import annotations

import atexit
import os
import tempfile
from typing import Any

from . import _hybridsim, challenge, distributed
from ._errors import BusyError, Error, FileError, MissingFileError, Note
from ._progress import Progress
from ._recording import Recording, read
from ._types import Axis, Check, Finding, Heatmap, Poses, Radar, Report, Run, Stage
from ._verbs.align import align
from ._verbs.check import check
from ._verbs.diagnose import diagnose
from ._verbs.export import export
from ._verbs.heatmaps import heatmaps
from ._verbs.import_ import import_
from ._verbs.record import record
from ._verbs.reproduce import reproduce, stages
from ._verbs.simulate import simulate
from ._verbs.site import site
from ._verbs.train import train
from ._windows import Windows

# Graphics libraries complain on standard error when they look for adapters without it.
os.environ.setdefault("XDG_RUNTIME_DIR", tempfile.gettempdir())

__all__ = [
    "Axis",
    "BusyError",
    "Check",
    "Error",
    "FileError",
    "Finding",
    "Heatmap",
    "MissingFileError",
    "Note",
    "Poses",
    "Progress",
    "Radar",
    "Recording",
    "Report",
    "Run",
    "Stage",
    "Windows",
    "align",
    "challenge",
    "check",
    "diagnose",
    "distributed",
    "export",
    "heatmaps",
    "import_",
    "read",
    "record",
    "reproduce",
    "simulate",
    "site",
    "stages",
    "train",
]

_hybridsim.is_library(_hybridsim.__file__)
# Work that Ctrl-C has left may not have come to its next step.
atexit.register(_hybridsim.abandon)


def __getattr__(name: str) -> Any:
    # torch is large, and not everybody has it.
    if name == "torch":
        import importlib

        return importlib.import_module(".torch", __name__)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
