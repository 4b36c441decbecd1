"""What a message shows of what was given: escaped, and short."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

LONGEST_MESSAGE = 1900
"""Bytes in UTF-8."""
_LONGEST_LINE = 900  # characters
_LONGEST_VALUE = 60

# Control characters but line feed and tab, separators of lines, what turns the direction of writing (and so what a
# terminal shows), lone surrogates, and what XML cannot hold.
_UNPRINTABLE = re.compile("[\0-\x08\x0b-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069\ud800-\udfff\ufffe\uffff]")


def unprintable(text: str) -> re.Match[str] | None:
    """The first character that no text of a task file may have."""
    return _UNPRINTABLE.search(text)


def printable(text: str) -> str:
    """The text with such characters, and breaks of lines, replaced by ``_``."""
    return _UNPRINTABLE.sub("_", text).replace("\n", "_").replace("\t", "_")


def escaped(text: str, longest: int = _LONGEST_VALUE) -> str:
    """The text with what cannot be printed as Python writes it, and its middle left out where it is long."""
    return shortened("".join(c if c.isprintable() else c.encode("unicode_escape").decode() for c in text), longest)


def shortened(text: str, longest: int) -> str:
    """The text, or its beginning and end."""
    if len(text) <= longest:
        return text
    head = (longest - 3) // 2
    return f"{text[:head]}...{text[head + 3 - longest :]}"


def shown(value: Any) -> str:
    """A value of a task file as a message shows it."""
    if value is None:
        return "nothing"
    if isinstance(value, dict):
        names = [escaped(str(name)) for name in list(value)[:_LONGEST_VALUE]]
        return "a mapping" + (f" of {shortened(', '.join(names), 3 * _LONGEST_VALUE)}" if names else " without fields")
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list | tuple | str | int | float):
        text = repr(value)
        return text if len(text) <= _LONGEST_VALUE else f"{text[: _LONGEST_VALUE - 3]}..."
    return type(value).__name__


def joined(lines: Iterable[str], more: int = 0) -> str:
    """As many of the lines as make a message that can be read, and how many there are besides.

    Args:
        lines: one for each thing that is wrong.
        more: things that have no line.
    """
    kept: list[str] = []
    left = LONGEST_MESSAGE
    for line in (shortened(line, _LONGEST_LINE) for line in lines):
        left -= len(line.encode(errors="replace")) + 1
        if left < 0 and kept:
            more += 1
        else:
            kept.append(line)
    return "\n".join([*kept, *([f"... and {more} more"] if more else [])])
