"""What a kind of export is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from casadi_hands.export.targets.source import Source


class Target(NamedTuple):
    """One kind of export.

    Attributes:
        write: writes a design to a path, and returns what it wrote.
        default: where, within the folder ``export`` of the result folder, unless told otherwise.
    """

    write: Callable[[Source, Path], Path]
    default: str
