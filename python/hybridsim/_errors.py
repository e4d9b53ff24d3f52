"""Errors, in the words of the command line."""

from __future__ import annotations

import errno


class Error(Exception):
    """What a user can cause: bad input, settings that cannot work, a folder that cannot be written.

    Attributes:
        hint: what can be done about it, or ``None``. Python shows it below the message.
    """

    hint: str | None

    def __init__(self, message: str, hint: str | None = None) -> None:
        super().__init__(message)
        self.message = message
        self.hint = hint
        if hint is not None:
            self.add_note(f"hint: {hint}")

    def __str__(self) -> str:
        return self.message

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (self.message, self.hint))


class FileError(Error, OSError):
    """A file that cannot be read or written, with ``filename`` and ``errno`` as of every ``OSError``."""

    def __init__(
        self, message: str, hint: str | None = None, filename: str | None = None, number: int | None = None
    ) -> None:
        Error.__init__(self, message, hint)
        self.filename = filename
        self.errno = number

    def __reduce__(self) -> tuple[object, ...]:
        return (type(self), (self.message, self.hint, self.filename, self.errno))


class MissingFileError(FileError, FileNotFoundError):
    """A file or folder that is not there."""


class BusyError(Error):
    """Another process works where this one would; whoever waits may go on."""


class Note(UserWarning):
    """What was assumed, or is odd about what was given; the work goes on."""


def make(message: str, hint: str | None, filename: str | None, number: int | None, busy: bool) -> Error:
    """The exception of an error of the library."""
    if filename is None:
        return BusyError(message, hint) if busy else Error(message, hint)
    kind = MissingFileError if number == errno.ENOENT else FileError
    return kind(message, hint, filename, number)
