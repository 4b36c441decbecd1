"""The text of a file that may be anything."""

from __future__ import annotations

import codecs
import os
import stat
from pathlib import Path

from casadi_hands.errors import TaskError
from casadi_hands.task.shown import escaped

LARGEST = 1_000_000
"""Bytes of a task file; those in problems/ have a thousandth of it."""
_LONGEST_NAME = 250
_ANOTHER = "give the path of a task file that you may read"
_KINDS = {
    stat.S_IFIFO: "a pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def file_name(path: Path) -> str:
    """A path as messages print it."""
    return escaped(str(path), _LONGEST_NAME)


def read(path: Path) -> str:
    """Text of a file, with line feeds between lines.

    Raises:
        TaskError: there is none, it is too large, or it is not text.
    """
    name = file_name(path)
    return decode(_bytes(path, name), name)


def decode(data: bytes, name: str) -> str:
    """Text of a file's content, with line feeds between lines.

    Args:
        data: content.
        name: of the file, for messages.

    Raises:
        TaskError: it is too large, or not text.
    """
    if len(data) > LARGEST:
        raise TaskError(f"{name}: given a file of more than {LARGEST:,} bytes; a task file has some thousand")
    # Of a text in UTF-16 or UTF-32 the first characters, which are Latin ones, have zeros beside them.
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) or data[:4].count(0) > 1:
        raise TaskError(f"{name}: given a text in UTF-16 or UTF-32; a task file is YAML in UTF-8")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise TaskError(f"{name}: not a text file; a task file is YAML in UTF-8") from None
    return text.replace("\r\n", "\n").replace("\r", "\n")


def _bytes(path: Path, name: str) -> bytes:
    """Content of a file, at most one byte more than is allowed."""
    try:
        # Opening a pipe would wait for somebody to write to it.
        descriptor = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise TaskError(f"{name}: no such file; give the path of a task file") from None
    except (OSError, ValueError) as error:  # ValueError: a path with a NUL
        raise TaskError(f"{name}: cannot be read: {getattr(error, 'strerror', None) or error}; {_ANOTHER}") from None
    try:
        mode = os.fstat(descriptor).st_mode
        if stat.S_ISDIR(mode):
            raise TaskError(f"{name}: is a directory; give the path of a task file in it")
        if not stat.S_ISREG(mode):
            kind = _KINDS.get(stat.S_IFMT(mode), "something else")
            raise TaskError(f"{name}: is {kind}; give the path of a task file")
        with os.fdopen(descriptor, "rb", closefd=False) as file:
            return file.read(LARGEST + 1)
    except OSError as error:
        raise TaskError(f"{name}: cannot be read: {error.strerror}; {_ANOTHER}") from None
    finally:
        os.close(descriptor)
