"""The errors this package raises on purpose; each message is written for the person who reads it."""

from __future__ import annotations

LONGEST_MESSAGE = 1900
"""Characters; what is longer than a screen nobody reads."""
MADE_ANEW = "give a folder as `casadi-hands solve TASK` wrote it; solve the task again where this one was changed"
ELSEWHERE = "give another folder, which you may write to"
"""What to do about a folder that cannot be read, and one that cannot be written."""


class HandsError(Exception):
    """Root of every error this package raises on purpose; its message is of bounded length and can be printed."""

    def __init__(self, message: object = "") -> None:
        super().__init__(printable(str(message)))


def words_of(error: BaseException) -> str:
    """All that an error says: its message and the notes behind it, a line each."""
    return "\n".join([str(error), *getattr(error, "__notes__", ())])


def printable(text: str) -> str:
    """Text with what would command a terminal escaped, and its middle left out where it is too long."""
    text = "".join(c if c.isprintable() or c == "\n" else repr(c)[1:-1] for c in text[: 20 * LONGEST_MESSAGE])
    if len(text) <= LONGEST_MESSAGE:
        return text
    half = LONGEST_MESSAGE // 2 - 10
    return f"{text[:half]} […] {text[-half:]}"


class TaskError(HandsError):
    """A task file cannot be used; the message names file, line, field, what was given and what is allowed."""


class DesignError(HandsError):
    """A result folder is missing, incomplete or of another format.

    What to do stands in a note behind the message, as tracebacks and the command line show it.
    """

    def __init__(self, message: object = "", step: str = MADE_ANEW) -> None:
        """Message, and what to do; an empty step where the message says that itself."""
        super().__init__(message)
        if step:
            self.add_note(step)


class SolveError(HandsError):
    """A task cannot be solved; the message says why in the user's terms."""


class KinematicsError(HandsError):
    """The compiled kinematics extension is missing or was built against another CasADi."""


class MeshError(HandsError):
    """A mesh cannot be used; the message says what was given and what is allowed.

    Attributes:
        given: what the file holds, in the user's terms.
        allowed: what would do.
    """

    def __init__(self, given: str, allowed: str) -> None:
        """Both halves of the message."""
        super().__init__(f"given {given}; allowed: {allowed}")
        self.given, self.allowed = given, allowed

    def __reduce__(self) -> tuple[type[MeshError], tuple[str, str]]:
        """As it was made: processes send it to each other."""
        return MeshError, (self.given, self.allowed)
