"""How far work is, for whoever watches."""

from __future__ import annotations

import json
import sys
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from ._errors import Note


@dataclass(frozen=True)
class Progress:
    """A moment of some work.

    Attributes:
        what: such as ``"training"``.
        done: steps that are done, of ``of``.
        of: steps in all; 0 where nobody knows.
        text: what was just done, in words; empty where nothing is to be said.
        epoch: numbers of the epoch that training just finished (``training_loss`` and ``validation_loss`` in dB², ...).
    """

    what: str
    done: int
    of: int
    text: str = ""
    epoch: dict[str, Any] | None = None


Watcher = bool | Callable[[Progress], object]
"""``True`` shows progress on standard error, ``False`` is silent, a function is called with every :class:`Progress`."""


class Notifier:
    """Turns what a verb says into :class:`Progress` and warnings. Called in the thread that called the verb."""

    def __init__(self, watcher: Watcher) -> None:
        self._watch: Callable[[Progress], object] | None
        self._bar = Bar() if watcher is True else None
        if watcher is True:
            self._watch = self._bar
        else:
            self._watch = watcher if callable(watcher) else None
        self._what, self._done, self._of = "", 0, 0

    def __enter__(self) -> Notifier:
        return self

    def __exit__(self, *_: object) -> None:
        if self._bar is not None:
            self._bar.close()

    def __call__(self, kind: str, text: str, number: int) -> None:
        if kind == "note":
            # This method, the verb, its caller.
            warnings.warn(text, Note, stacklevel=3)
            return
        said, epoch = "", None
        if kind == "begun":
            self._what, self._done, self._of = text, 0, number
        elif kind == "done":
            self._done = number
        elif kind == "epoch":
            epoch = json.loads(text)
            said = f"epoch {epoch['epoch'] + 1}: loss {epoch['training_loss']:.2f} dB²"
            if epoch["validation_loss"] is not None:
                said += f", held out {epoch['validation_loss']:.2f} dB²"
        else:
            said = text
        if self._watch is not None:
            self._watch(Progress(self._what, self._done, self._of, said, epoch))


class Bar:
    """One line on standard error that is written over; a line per message where lines cannot be."""

    WIDTH = 30

    def __init__(self) -> None:
        # A notebook's standard error is no terminal, but obeys a carriage return.
        self._over = sys.stderr.isatty() or "ipykernel" in sys.modules
        self._length = 0
        self._said = ""

    def __call__(self, now: Progress) -> None:
        if not self._over:
            if now.text:
                print(now.text, file=sys.stderr)
            return
        self._said = now.text or self._said
        share = min(now.done / now.of, 1.0) if now.of else 0.0
        full = round(self.WIDTH * share)
        line = f"{now.what} [{'=' * full}{' ' * (self.WIDTH - full)}] {now.done}/{now.of}  {self._said}"
        self._write(line[:110])

    def _write(self, line: str) -> None:
        print("\r" + line.ljust(self._length), end="", file=sys.stderr, flush=True)
        self._length = len(line)

    def close(self) -> None:
        """Leaves the line."""
        if self._over and self._length:
            print(file=sys.stderr)
            self._length = 0
