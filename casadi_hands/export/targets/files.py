"""Exports that are one file: the motion as a table, and the hand as URDF fixed to the world."""

from __future__ import annotations

from pathlib import Path

from casadi_hands.errors import HandsError
from casadi_hands.export.table import motion_table
from casadi_hands.export.targets.source import Source
from casadi_hands.export.targets.target import Target


def write_csv(source: Source, out: Path) -> Path:
    """Write the motion as a table, one row for each sample.

    Args:
        source: the design.
        out: the file, or a folder for ``motion.csv``.

    Returns:
        the file.

    Raises:
        HandsError: the file cannot be written.
    """
    return _write(out / "motion.csv" if out.is_dir() else out, motion_table(source.motion))


def write_urdf(source: Source, out: Path) -> Path:
    """Write the hand, its palm fixed to the link ``world`` where it is when the motion starts.

    Args:
        source: the design.
        out: the file, or a folder for ``hand.urdf``.

    Returns:
        the file.

    Raises:
        HandsError: the file cannot be written.
    """
    return _write(out / "hand.urdf" if out.is_dir() else out, source.welded_urdf())


def _write(path: Path, text: str) -> Path:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise HandsError(f"{path}: cannot write the export here: {error}; give another --out") from error
    return path


TARGETS = {"csv": Target(write_csv, "motion.csv"), "urdf": Target(write_urdf, "hand.urdf")}
