"""What handeye raises."""

from __future__ import annotations


class Error(Exception):
    """Whatever goes wrong in handeye. The message names the place, what was found, and what would do."""


class UnusableInput(Error, ValueError):
    """Input or arguments are unusable: a file, a rig, a recording, a shape, an option (exit status 2 of the command).

    ``file``, ``line`` and ``column`` (from 1) say where, in mistakes inside a file; ``None`` otherwise.
    """

    def __init__(
        self, message: str, file: str | None = None, line: int | None = None, column: int | None = None
    ) -> None:
        super().__init__(message)
        self.file = file
        self.line = line
        self.column = column

    def __reduce__(self) -> tuple[type[UnusableInput], tuple[str, str | None, int | None, int | None]]:
        return type(self), (str(self), self.file, self.line, self.column)


class NotDone(Error, RuntimeError):
    """The work could not be done, such as for want of data; the message says what is missing (exit status 1 of the command)."""
