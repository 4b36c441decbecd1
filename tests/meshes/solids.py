"""Solids to test with, and files of them."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from casadi_hands.meshes import Mesh

CUBE_FACES = np.array(
    [
        [0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4],
        [2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5],
    ]
)  # fmt: skip


def box(size: tuple[float, float, float] = (0.04, 0.04, 0.04), center: tuple[float, float, float] = (0, 0, 0)) -> Mesh:
    """A box, m; vertices counted with x fastest."""
    signs = np.array([[x, y, z] for z in (-0.5, 0.5) for y in (-0.5, 0.5) for x in (-0.5, 0.5)])
    return Mesh(signs * size + center, CUBE_FACES.copy())


def joined(*meshes: Mesh) -> Mesh:
    """Meshes as one, vertices not merged."""
    starts = np.cumsum([0, *[len(mesh.vertices) for mesh in meshes]])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts[:-1], strict=True)]
    return Mesh(np.vstack([mesh.vertices for mesh in meshes]), np.vstack(faces))


def inverted(mesh: Mesh) -> Mesh:
    """The same surface, looking inward."""
    return Mesh(mesh.vertices, mesh.faces[:, ::-1])


def ball(radius: float = 0.02, rings: int = 24) -> Mesh:
    """A sphere of triangles between circles of latitude, poles included."""
    heights, around = np.linspace(0, np.pi, rings + 1)[1:-1], np.linspace(0, 2 * np.pi, 2 * rings, endpoint=False)
    grid = [[np.sin(h) * np.cos(a), np.sin(h) * np.sin(a), np.cos(h)] for h in heights for a in around]
    count, width = len(grid), 2 * rings
    faces = []
    for k in range(width):
        after = (k + 1) % width
        faces.append([count, k, after])
        faces.append([count + 1, count - width + after, count - width + k])
        for r in range(rings - 2):
            a, b, c, d = r * width + k, r * width + after, (r + 1) * width + k, (r + 1) * width + after
            faces += [[a, c, b], [b, c, d]]
    return Mesh(radius * np.array([*grid, [0, 0, 1], [0, 0, -1]]), np.array(faces))


def angle(size: float = 0.04, thick: float = 0.01) -> Mesh:
    """An L: two arms of one length, thickness and depth, extruded along z."""
    outline = np.array([[0, 0], [size, 0], [size, thick], [thick, thick], [thick, size], [0, size]])
    vertices = np.vstack([np.column_stack([outline, np.full(6, z)]) for z in (0.0, size)])
    cap = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]])
    sides = [[[k, (k + 1) % 6, k + 6], [(k + 1) % 6, (k + 1) % 6 + 6, k + 6]] for k in range(6)]
    return Mesh(vertices, np.vstack([cap[:, ::-1], cap + 6, *np.array(sides)]))


def binary_stl(mesh: Mesh, count: int | None = None, header: bytes = b"made by a test") -> bytes:
    """As binary STL, which may say a count of its own."""
    facets = np.zeros(len(mesh.faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["corners"] = mesh.corners
    said = len(mesh.faces) if count is None else count
    return header.ljust(80) + said.to_bytes(4, "little") + facets.tobytes()


def ascii_stl(mesh: Mesh, name: str = "part") -> str:
    """As ASCII STL."""
    lines = [f"solid {name}"]
    for corners in mesh.corners:
        lines += ["  facet normal 0 0 0", "    outer loop"]
        lines += [f"      vertex {x:.9g} {y:.9g} {z:.9g}" for x, y, z in corners]
        lines += ["    endloop", "  endfacet"]
    return "\n".join([*lines, f"endsolid {name}", ""])


def obj(mesh: Mesh) -> str:
    """As OBJ."""
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in mesh.faces + 1), ""])


def without(mesh: Mesh, *faces: int) -> Mesh:
    """A mesh with some of its faces taken out."""
    return Mesh(mesh.vertices, np.delete(mesh.faces, faces, axis=0))


def subdivided(mesh: Mesh, times: int) -> Mesh:
    """Each face cut into four, some times."""
    vertices, faces = mesh.vertices, mesh.faces
    for _ in range(times):
        corners = vertices[faces]
        middles = (corners + np.roll(corners, -1, axis=1)) / 2
        points: NDArray[np.float64] = np.concatenate([corners, middles], axis=1).reshape(-1, 3)
        start = 6 * np.arange(len(faces))[:, None, None]
        faces = (start + np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])).reshape(-1, 3)
        vertices, number = np.unique(np.round(points, 12), axis=0, return_inverse=True)
        faces = number.ravel()[faces]
    return Mesh(vertices, faces)
