"""Corners of polytopes in the files of a result folder."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path, PurePosixPath

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from casadi_hands.errors import DesignError
from casadi_hands.problem.stored import LARGEST_NUMBER, read_text

MOST = 10_000
"""Corners of one polytope."""


def read_points(path: Path, name: str) -> np.ndarray:
    """Return the vertices (V, 3), m, of an OBJ file that another file names, in the folder that is in.

    Args:
        path: of the file that names it.
        name: relative, as it stands there.

    Raises:
        DesignError: it is elsewhere, missing, too large, or holds no polytope.
    """
    file = file_within(path, name)
    (vertices,) = read_rows(file, {"v": float})
    return hull_points(file, vertices.ravel())


def read_rows(file: Path, kinds: Mapping[str, type]) -> list[np.ndarray]:
    """Return the numbers of an OBJ file's lines of some kinds, an array each.

    Args:
        file: OBJ.
        kinds: type of the numbers by the word that such lines begin with.

    Raises:
        DesignError: they are no numbers, or rows of a kind are not equally long.
    """
    lines = [line.split() for line in read_text(file).splitlines()]
    try:
        return [
            np.array([[kind(word) for word in line[1:]] for line in lines if line and line[0] == first], kind)
            for first, kind in kinds.items()
        ]
    except (ValueError, OverflowError) as error:
        raise DesignError(f"{file}: not a mesh: {error}") from None


def file_within(path: Path, name: str) -> Path:
    """Return the OBJ file that another file names, in the folder that is in.

    Args:
        path: of the file that names it.
        name: relative, as it stands there.

    Raises:
        DesignError: it is elsewhere, or no OBJ file.
    """
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or ".." in parts or ":" in name or not name.endswith(".obj"):
        raise DesignError(f"{path}: mesh '{name[:60]}' is no .obj file within the folder")
    file = path.parent.joinpath(*parts)
    if not file.resolve().is_relative_to(path.parent.resolve()):
        raise DesignError(f"{path}: mesh '{name[:60]}' leads out of the folder")
    return file


def hull_points(path: Path, flat: np.ndarray) -> np.ndarray:
    """Return points (P, 3), m, of their coordinates in one row.

    Raises:
        DesignError: they are not threes of finite numbers, are too many, or lie in one plane.
    """
    if not 12 <= flat.size <= 3 * MOST or flat.size % 3 or not np.all(np.abs(flat) < LARGEST_NUMBER):
        raise DesignError(f"{path}: a polytope has 4 to {MOST} corners of three finite numbers each")
    points = flat.reshape(-1, 3)
    try:
        ConvexHull(points)
    except QhullError:
        raise DesignError(f"{path}: the corners of a polytope lie in one plane") from None
    return points
