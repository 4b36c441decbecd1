"""Finished units of work, kept as they are finished: what was stopped goes on from there.

A solve asks for the same units in the same order each time. One that goes on gets those that are kept, and comes to the
same end bit for bit: what a unit gives is always what was kept of it.
"""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any, TypeVar

from casadi_hands.errors import SolveError
from casadi_hands.execution.stored import NotStoredError, pack, unpack

Result = TypeVar("Result")


class Journal:
    """The units of one solve.

    Args:
        folder: of their files, made when there is one to be kept; None to keep nothing.
    """

    def __init__(self, folder: Path | None = None) -> None:
        self.folder = folder
        self._sections = 0

    def once(self, name: str, work: Callable[[], Result]) -> Result:
        """What ``work`` gives, or gave.

        Args:
            name: of the unit; what was kept under another is not taken for it.
            work: is called unless its result is kept.

        Raises:
            SolveError: the result cannot be kept.
        """
        section = self.section(name)
        if section.has(0):
            kept: Result = section.get(0)
            return kept
        return section.put(0, work())

    def section(self, name: str) -> Section:
        """The next section of units, which may be finished in any order."""
        self._sections += 1
        return Section(self, self._sections, name)

    def forget(self) -> None:
        """Remove what is kept."""
        if self.folder is not None:
            shutil.rmtree(self.folder, ignore_errors=True)


class Section:
    """Units of one kind: see `Journal.section`."""

    def __init__(self, journal: Journal, number: int, name: str) -> None:
        self._journal, self._number, self._name = journal, number, name
        self._read: dict[int, Any] = {}

    def has(self, index: int) -> bool:
        """Whether a unit is kept."""
        if (path := self._path(index)) is None:
            return False
        try:
            name, value = unpack(path.read_bytes())
        except (OSError, NotStoredError, TypeError, ValueError):
            return False
        if name != self._name:
            return False
        self._read[index] = value
        return True

    def get(self, index: int) -> Any:
        """What a unit gave, after `has` said so."""
        return self._read.pop(index)

    def put(self, index: int, result: Result) -> Result:
        """Keep what a unit gave.

        Returns:
            what is kept of it, so that arrays lie in memory as they will when it is read.

        Raises:
            SolveError: it cannot be written.
        """
        if (path := self._path(index)) is None:
            return result
        data, part = pack((self._name, result)), path.with_suffix(".part")
        try:
            path.parent.mkdir(exist_ok=True)
            part.write_bytes(data)
            os.replace(part, path)
        except OSError as error:
            with suppress(OSError):
                part.unlink()
            raise SolveError(
                f"{path.parent}: cannot write what is finished here: {error.strerror or error}; give another folder"
            ) from error
        kept: tuple[str, Result] = unpack(data)
        return kept[1]

    def _path(self, index: int) -> Path | None:
        folder = self._journal.folder
        return None if folder is None else folder / f"{self._number:03d}-{index:03d}.npz"
