"""The report of a result folder, made anew from its other files."""

from __future__ import annotations

from pathlib import Path

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.export.moving import replace_file
from casadi_hands.export.report.alternatives import read_alternatives
from casadi_hands.export.report.page import REPORT, write_report


def report_folder(directory: Path) -> Path:
    """Write the report of a result folder, with its alternatives where it has some.

    Args:
        directory: what `casadi-hands solve` wrote.

    Returns:
        The report's path.

    Raises:
        DesignError: the folder cannot be read or written.
    """
    path = directory / REPORT
    try:
        design, seeds = Design.load(directory), read_alternatives(directory)
        replace_file(path, lambda made: write_report(design, made, seeds))
    except OSError as error:
        raise DesignError(f"{path}: cannot be written: {error}") from error
    return path
