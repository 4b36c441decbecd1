"""What an object is made of as meshes in two tones, so that its rotation can be seen."""

from __future__ import annotations

from typing import Any

import numpy as np
from meshcat.geometry import Mesh, Sphere, TriangularMeshGeometry, pack_numpy_array

from casadi_hands.export.page.robot import Shape

Color = tuple[float, float, float]

# A three.js cylinder stands along y.
UPRIGHT_CYLINDER = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
_STEPS = 10  # mesh cells along each side of a patch; a patch spans a quarter turn
_DIGITS = 4  # to which normals are equal, and middles of faces between octants


def shift(offset: np.ndarray) -> np.ndarray:
    """Pose (4, 4) that moves by an offset (3,)."""
    pose = np.eye(4)
    pose[:3, 3] = offset
    return pose


def paint(color: Color) -> int:
    """A colour, RGB in 0..1, as three.js takes it."""
    red, green, blue = (round(255 * part) for part in color)
    return red << 16 | green << 8 | blue


class FineSphere(Sphere):  # type: ignore[misc]
    """Meshcat's sphere with an outline that looks round."""

    def lower(self, object_data: dict[str, Any]) -> dict[str, Any]:
        """The geometry as three.js reads it."""
        return {**super().lower(object_data), "widthSegments": 48, "heightSegments": 24}


class LayeredMesh(Mesh):  # type: ignore[misc]
    """A mesh with a place in the order of drawing.

    Args:
        geometry: any of meshcat's.
        material: any of meshcat's.
        layer: transparent meshes are drawn from the lowest layer to the highest.
    """

    def __init__(self, geometry: Any, material: Any, layer: int) -> None:
        """Keep the layer beside what meshcat keeps."""
        super().__init__(geometry, material)
        self.layer = layer

    def lower(self) -> dict[str, Any]:
        """The mesh as three.js reads it."""
        data: dict[str, Any] = super().lower()
        data["object"]["renderOrder"] = self.layer
        return data


class TonedMesh(TriangularMeshGeometry):  # type: ignore[misc]
    """Triangles with normals and colours of their own.

    Args:
        vertices: (V, 3).
        faces: (T, 3) of them, counterclockwise seen from outside.
        normals: (V, 3).
        color: (V, 3) RGB in 0..1.
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray, normals: np.ndarray, color: np.ndarray) -> None:
        """Keep the normals beside what meshcat keeps."""
        super().__init__(vertices, faces, color)
        self.normals = normals.astype(np.float32)

    def lower(self, object_data: dict[str, Any]) -> dict[str, Any]:
        """The geometry as three.js reads it."""
        data: dict[str, Any] = super().lower(object_data)
        data["data"]["attributes"]["normal"] = pack_numpy_array(self.normals.T)
        return data


def two_toned(shape: Shape) -> TonedMesh:
    """A primitive in its own frame, in its colour and a paler one."""
    red, green, blue = (0.25 * part + 0.75 for part in shape.color)
    tones = (shape.color, (red, green, blue))
    if shape.mesh is not None:
        return faceted(*shape.mesh, tones)
    if shape.sides is not None:
        return patched_box(shape.sides, tones)
    if shape.length is None:
        return patched_sphere(shape.radius, tones)
    return patched_cylinder(shape.radius, shape.length, tones)


def patched_sphere(radius: float, tones: tuple[Color, Color]) -> TonedMesh:
    """A sphere about the origin, its octants alternating in colour."""
    patches, colors = [], []
    for k, (quarter, half) in enumerate(_octants()):
        azimuth, height = _grid(quarter, (0.0, np.pi / 2) if half == 0 else (-np.pi / 2, 0.0))
        normals = np.array([np.cos(height) * np.cos(azimuth), np.cos(height) * np.sin(azimuth), np.sin(height)])
        patches.append((radius * normals, normals))
        colors.append(tones[(k + half) % 2])
    return _joined(patches, colors)


def patched_cylinder(radius: float, length: float, tones: tuple[Color, Color]) -> TonedMesh:
    """A cylinder about the z axis, centred; its colours continue those of spheres at its ends."""
    patches, colors = [], []
    for k, (quarter, half) in enumerate(_octants()):
        azimuth, height = _grid(quarter, (0.0, length / 2) if half == 0 else (-length / 2, 0.0))
        normals = np.array([np.cos(azimuth), np.sin(azimuth), np.zeros_like(azimuth)])
        patches.append((radius * normals + np.array([0.0, 0.0, 1.0])[:, None, None] * height, normals))
        colors.append(tones[(k + half) % 2])
        # A quarter of the face, inwards or outwards so that it is seen from outside.
        azimuth, far = _grid(quarter, (radius, 0.0) if half == 0 else (0.0, radius))
        sign = 1.0 if half == 0 else -1.0
        face = np.array([far * np.cos(azimuth), far * np.sin(azimuth), np.full_like(far, sign * length / 2)])
        patches.append((face, np.stack([0 * far, 0 * far, np.full_like(far, sign)])))
        colors.append(tones[(k + half) % 2])
    return _joined(patches, colors)


def patched_box(sides: tuple[float, float, float], tones: tuple[Color, Color]) -> TonedMesh:
    """A box about the origin, each face in four quarters that alternate in colour, across its edges too."""
    patches, colors = [], []
    half = np.asarray(sides) / 2
    for axis in range(3):
        one, other = (axis + 1) % 3, (axis + 2) % 3
        for sign in (1.0, -1.0):
            for first in (1.0, -1.0):
                for second in (1.0, -1.0):
                    # From the middle outwards or inwards so that it is seen from outside.
                    outwards = first * second * sign > 0
                    a, b = _grid((0.0, first * half[one]), (0.0, second * half[other]))
                    points, normals = np.zeros((3, *a.shape)), np.zeros((3, *a.shape))
                    points[axis], points[one], points[other], normals[axis] = sign * half[axis], a, b, sign
                    if not outwards:
                        points = points.transpose(0, 2, 1)
                    patches.append((points, normals))
                    colors.append(tones[int(outwards)])
    return _joined(patches, colors)


def faceted(vertices: np.ndarray, triangles: np.ndarray, tones: tuple[Color, Color]) -> TonedMesh:
    """A convex mesh of flat faces, each in the colour of the octant about the origin that its middle is in.

    Args:
        vertices: (V, 3).
        triangles: (T, 3) of them, counterclockwise seen from outside.
        tones: RGB in 0..1.
    """
    corners = vertices[triangles]
    across = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    area = np.linalg.norm(across, axis=1, keepdims=True)
    normals = across / np.maximum(area, 1e-300)
    # Of what is convex, triangles with one normal are of one face.
    face = np.unique(np.round(normals, _DIGITS) + 0.0, axis=0, return_inverse=True)[1].ravel()
    moments = np.zeros((len(triangles), 3))
    np.add.at(moments, face, area * corners.mean(axis=1))
    # A middle between octants counts to one of them whatever rounding makes of it.
    signs = np.where(np.round(moments / np.abs(moments).max(), _DIGITS) < 0, -1, 1)
    odd = np.prod(signs, axis=1, keepdims=True)[face] > 0
    return TonedMesh(
        corners.reshape(-1, 3),
        np.arange(3 * len(triangles)).reshape(-1, 3),
        np.repeat(normals, 3, axis=0),
        np.repeat(np.where(odd, tones[0], tones[1]), 3, axis=0),
    )


def _joined(patches: list[tuple[np.ndarray, np.ndarray]], colors: list[Color]) -> TonedMesh:
    """A mesh of patches of one colour each.

    Args:
        patches: for each patch the points (3, n, n) of a grid, and there the normals (3, n, n) of the smooth surface.
        colors: RGB in 0..1 for each patch.
    """
    cells = _cells(patches[0][0].shape[1])
    count = patches[0][0][0].size
    return TonedMesh(
        np.vstack([points.reshape(3, -1).T for points, _ in patches]),
        np.vstack([cells + k * count for k in range(len(patches))]),
        np.vstack([normals.reshape(3, -1).T for _, normals in patches]),
        np.vstack([np.tile(color, (count, 1)) for color in colors]),
    )


def _octants() -> list[tuple[tuple[float, float], int]]:
    """Azimuth range (rad) and half (0 upper, 1 lower) of the eight patches, the four upper first."""
    quarters = [(k * np.pi / 2, (k + 1) * np.pi / 2) for k in range(4)]
    return [(quarter, half) for half in (0, 1) for quarter in quarters]


def _grid(first: tuple[float, float], second: tuple[float, float]) -> tuple[np.ndarray, np.ndarray]:
    """Two coordinates over a patch, each (n, n), n = steps + 1."""
    one, two = np.meshgrid(np.linspace(*first, _STEPS + 1), np.linspace(*second, _STEPS + 1), indexing="ij")
    return one, two


def _cells(side: int) -> np.ndarray:
    """Triangles (2(n-1)², 3) of a grid of n x n points numbered row by row, counterclockwise seen from outside."""
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    lower = np.stack([corner, corner + side, corner + side + 1], axis=1)
    upper = np.stack([corner, corner + side + 1, corner + 1], axis=1)
    return np.vstack([lower, upper])
