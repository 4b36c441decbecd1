"""Corners of polytopes in the files of a result folder."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from casadi_hands.errors import DesignError
from casadi_hands.verify.reading.markup import LARGEST

MOST = 10_000
"""Corners of one polytope."""
_LARGEST_FILE = 1 << 22  # bytes


def read_points(path: Path, name: str) -> np.ndarray:
    """Return the vertices (V, 3), m, of an OBJ file that another file names, in the folder that is in.

    Args:
        path: of the file that names it.
        name: relative, as it stands there.

    Raises:
        DesignError: it is elsewhere, missing, too large, or holds no polytope.
    """
    parts = PurePosixPath(name).parts
    if not parts or name.startswith("/") or ".." in parts or ":" in name or not name.endswith(".obj"):
        raise DesignError(f"{path}: mesh '{name[:60]}' is no .obj file within the folder")
    file = path.parent.joinpath(*parts)
    if not file.resolve().is_relative_to(path.parent.resolve()):
        raise DesignError(f"{path}: mesh '{name[:60]}' leads out of the folder")
    try:
        if file.stat().st_size > _LARGEST_FILE:
            raise DesignError(f"{file}: larger than {_LARGEST_FILE >> 20} MB")
        lines = [line.split() for line in file.read_text(encoding="utf-8").splitlines()]
        rows = [[float(word) for word in line[1:]] for line in lines if line and line[0] == "v"]
        return hull_points(file, np.array(rows, float).ravel())
    except FileNotFoundError:
        raise DesignError(f"{file}: missing") from None
    except (OSError, ValueError) as error:
        raise DesignError(f"{file}: not a mesh: {error}") from None


def hull_points(path: Path, flat: np.ndarray) -> np.ndarray:
    """Return points (P, 3), m, of their coordinates in one row.

    Raises:
        DesignError: they are not threes of finite numbers, are too many, or lie in one plane.
    """
    if not 12 <= flat.size <= 3 * MOST or flat.size % 3 or not np.all(np.abs(flat) < LARGEST):
        raise DesignError(f"{path}: a polytope has 4 to {MOST} corners of three finite numbers each")
    points = flat.reshape(-1, 3)
    try:
        ConvexHull(points)
    except QhullError:
        raise DesignError(f"{path}: the corners of a polytope lie in one plane") from None
    return points
