"""What a solver may fail with, and in which words."""

from __future__ import annotations

import re

_MOST = 300  # characters of somebody else's words
# As CasADi begins what it raises: where in its sources, and for which of its functions.
_PLACE = re.compile(
    r"""(?:\bat |\bin )?["'(\[]?(?<![\w)/\\])(?:\.{3}|~|[A-Za-z]:)?[/\\][^\s:'"()\]]+(?::\d+)*["')\]]?:?"""
)
_FILE = re.compile(r"\b[\w./\\-]+\.(?:cpp|cc|hpp|h|c|py|f|so)\b(?:\.\d+)*(?::\d+)*:?")
_FUNCTION = re.compile(r"Error in [\w:]+(?: for '[^']*')?(?: \[\w+\])?(?: at\b)?:?")
_ASSERTION = re.compile(r'Assertion "[^"]*" failed:')
_STACK = re.compile(r"(?m)^\s*(?:Traceback \(most recent call last\)|The above exception was).*$|^\s*File .*$")


class SolverError(RuntimeError):
    """IPOPT, or the linear solver in it, broke off with an error of its own; from another start it may not."""


def words_of(error: BaseException) -> str:
    """What a library says of an error, on one line, without where in its sources it says so.

    Args:
        error: of CasADi, IPOPT, MuJoCo or the like.
    """
    text = str(error)
    for pattern in (_STACK, _PLACE, _FILE, _FUNCTION, _ASSERTION):
        text = pattern.sub(" ", text)
    text = " ".join(text.split()).strip(" :;,.")
    if not text:
        return f"it gives no reason ({type(error).__name__})"
    return text if len(text) <= _MOST else f"{text[: _MOST - 3]}..."
