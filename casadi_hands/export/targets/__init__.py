"""A design for other programs: each target writes a file or a folder that they read as it is."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

from casadi_hands.errors import HandsError
from casadi_hands.export.targets.files import write_csv, write_urdf
from casadi_hands.export.targets.ros2 import write_ros2
from casadi_hands.export.targets.source import Source
from casadi_hands.export.targets.usd import write_usd


class Target(NamedTuple):
    """One kind of export.

    Attributes:
        write: writes a design to a path, and returns what it wrote.
        default: where, within the folder ``export`` of the result folder, unless told otherwise.
    """

    write: Callable[[Source, Path], Path]
    default: str


TARGETS = {
    "csv": Target(write_csv, "motion.csv"),
    "ros2": Target(write_ros2, "ros2"),
    "urdf": Target(write_urdf, "hand.urdf"),
    "usd": Target(write_usd, "usd"),
}


def export_design(directory: str | Path, target: str, out: str | Path | None = None) -> Path:
    """Write a design for another program.

    Args:
        directory: a result folder.
        target: a name in `TARGETS`.
        out: the file (``csv``, ``urdf``) or the folder (``ros2``, ``usd``) to write; by default it is in
            ``directory/export``. An earlier export there is replaced.

    Returns:
        what was written: the file or the folder.

    Raises:
        DesignError: the folder is missing, incomplete or of an earlier version.
        HandsError: there is no such target, what it needs is not installed, or its place holds something else.
    """
    if target not in TARGETS:
        raise HandsError(f"there is no export to {target!r}; there are {', '.join(TARGETS)}")
    kind = TARGETS[target]
    place = Path(out) if out is not None else Path(directory) / "export" / kind.default
    return kind.write(Source.read(Path(directory)), place)
