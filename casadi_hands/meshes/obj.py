"""Wavefront OBJ: vertices and faces; nothing else of it is read, and no other file that it names."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.errors import MeshError
from casadi_hands.meshes.mesh import Mesh
from casadi_hands.meshes.polygons import quads_cut, triangulated

_MOST_CORNERS = 2000


def read_obj(content: bytes) -> Mesh:
    """The faces of an OBJ file, polygons cut into triangles.

    Args:
        content: of the file.

    Raises:
        MeshError: it is no OBJ file, or a line of it is not as it must be.
    """
    points: list[tuple[float, ...]] = []
    faces: list[list[int]] = []
    lines: list[int] = []
    continued = ""
    for number, line in enumerate(content.decode("utf-8", "replace").splitlines(), start=1):
        if line.endswith("\\"):
            continued += line[:-1] + " "
            continue
        words = (continued + line).split("#", 1)[0].split()
        continued = ""
        if not words:
            continue
        if words[0] == "v":
            points.append(_point(words[1:], number))
        elif words[0] == "f":
            faces.append(_face(words[1:], number, len(points)))
            lines.append(number)
    if not points and not faces:
        raise MeshError("a file without vertices (`v x y z`) and faces (`f 1 2 3`)", "an OBJ file of triangles")
    for face, number in zip(faces, lines, strict=True):
        if max(face) >= len(points):
            raise MeshError(f"vertex {max(face) + 1} in a face at line {number}", f"1 to {len(points)}")
    vertices = np.array(points, dtype=np.float64).reshape(-1, 3)
    return Mesh(vertices, _triangles(vertices, faces))


def _point(words: list[str], number: int) -> tuple[float, ...]:
    try:
        x, y, z = (float(word) for word in words[:3])
    except ValueError:
        raise MeshError(f"`v {' '.join(words)[:40]}` at line {number}", "`v` and three numbers") from None
    return x, y, z


def _face(words: list[str], number: int, count: int) -> list[int]:
    """Numbers of vertices from 0; those that are negative in the file count back from the last one before it."""
    given = f"`f {' '.join(words)[:40]}` at line {number}"
    try:
        numbers = [int(word.split("/", 1)[0]) for word in words]
    except ValueError:
        raise MeshError(given, "`f` and numbers of vertices") from None
    if not 3 <= len(numbers) <= _MOST_CORNERS:
        raise MeshError(f"a face of {len(numbers)} corners at line {number}", f"3 to {_MOST_CORNERS}")
    if any(n == 0 or n < -count for n in numbers):
        raise MeshError(given, f"vertices from 1, or from -{count} to -1, counted back from here")
    return [n - 1 if n > 0 else count + n for n in numbers]


def _triangles(vertices: NDArray[np.float64], faces: list[list[int]]) -> NDArray[np.int64]:
    by_corners: dict[int, list[list[int]]] = {}
    for face in faces:
        by_corners.setdefault(len(face), []).append(face)
    cut = [np.array(by_corners.pop(3, []), dtype=np.int64).reshape(-1, 3)]
    cut.append(quads_cut(vertices, np.array(by_corners.pop(4, []), dtype=np.int64).reshape(-1, 4)))
    for _, polygons in sorted(by_corners.items()):
        cut += [np.array(polygon)[triangulated(vertices[polygon])] for polygon in polygons]
    return np.vstack(cut)
