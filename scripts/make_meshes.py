"""Make the meshes of problems/objects, a hammer, a mug and a toy brick, and print what they are as convex parts."""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import manifold3d
import numpy as np
from numpy.typing import NDArray

from casadi_hands.meshes import Mesh, convex_parts, mend, read_mesh, scaled

FOLDER = Path(__file__).parents[1] / "problems" / "objects"
MILLIMETRE = 0.001
Solid = Any  # manifold3d has no types


def hammer() -> Solid:
    """A head with a bevelled face and a claw's wedge on an eight-sided handle, 200 mm long; along z, head up."""
    handle = prism(8, 12.5, 170.0).scale([1.0, 0.8, 1.0])
    head = hull([box([56, 26, 26]), box([66, 20, 20])]).translate([0, 0, 183])
    claw = hull([box([1, 26, 26]).translate([-28, 0, 183]), box([1, 26, 4]).translate([-55, 0, 176])])
    return handle + head + claw


def mug() -> Solid:
    """A cup 80 mm high and wide with walls of 4 mm, and a handle of square section; the middle of its foot at zero."""
    cup = prism(32, 40.0, 80.0) - prism(32, 36.0, 80.0).translate([0, 0, 5])
    bar = [box([5, 12, 40]).translate([66, 0, 40]), box([30, 12, 5]).translate([53.5, 0, 58])]
    bar.append(box([30, 12, 5]).translate([53.5, 0, 22]))
    return cup + (manifold3d.Manifold.batch_boolean(bar, manifold3d.OpType.Add) - prism(32, 38.0, 80.0))


def toy_brick() -> Solid:
    """A brick of 4 × 2 studs, 31.8 × 15.8 × 9.6 mm and studs of 1.7 mm; the middle of its lower face at zero."""
    brick = box([31.8, 15.8, 9.6]).translate([0, 0, 4.8])
    for x in (-12.0, -4.0, 4.0, 12.0):
        for y in (-4.0, 4.0):
            brick += prism(12, 2.4, 2.2).translate([x, y, 9.1])
    return brick


def box(size: list[float]) -> Solid:
    """A box about the origin, mm."""
    return manifold3d.Manifold.cube(size, True)


def prism(sides: int, radius: float, height: float) -> Solid:
    """A regular prism that stands on the origin, mm."""
    return manifold3d.Manifold.cylinder(height, radius, radius, sides)


def hull(solids: list[Solid]) -> Solid:
    """The convex hull of some solids."""
    return manifold3d.Manifold.batch_hull(solids)


def triangles(solid: Solid) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """Vertices (V, 3) and faces (F, 3) of a solid, in an order of their own."""
    made = solid.to_mesh64()
    points, faces = np.round(np.asarray(made.vert_properties)[:, :3], 4), np.asarray(made.tri_verts, dtype=np.int64)
    vertices, number = np.unique(points + 0.0, axis=0, return_inverse=True)
    faces = number.ravel()[faces]
    faces = np.array([np.roll(face, -int(face.argmin())) for face in faces])
    return vertices, faces[np.lexsort(faces.T[::-1])]


def stl(solid: Solid, name: str) -> bytes:
    """A binary STL."""
    vertices, faces = triangles(solid)
    corners = vertices[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    facets = np.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    facets["normal"] = normals / np.linalg.norm(normals, axis=1, keepdims=True)
    facets["corners"] = corners
    return f"{name}, mm".encode().ljust(80) + len(faces).to_bytes(4, "little") + facets.tobytes()


def obj(solid: Solid, name: str) -> bytes:
    """An OBJ."""
    vertices, faces = triangles(solid)
    lines = [f"# {name}, mm", *(f"v {x:g} {y:g} {z:g}" for x, y, z in vertices)]
    return "\n".join([*lines, *(f"f {a} {b} {c}" for a, b, c in faces + 1), ""]).encode()


FILES = {
    "hammer.stl": (stl, hammer, 16),
    "mug.stl": (stl, mug, 16),
    "toy_brick.obj": (obj, toy_brick, 16),
}
"""How each file is written, of what, and how many convex parts it is cut into."""


def main() -> None:
    """Write the files and print a line for each."""
    ArgumentParser(description=__doc__).parse_args()
    FOLDER.mkdir(exist_ok=True)
    for name, (write, make, most) in FILES.items():
        content = write(make(), name.split(".")[0].replace("_", " "))
        (FOLDER / name).write_bytes(content)
        mesh, notes = mend(scaled(read_mesh(FOLDER / name), MILLIMETRE))
        print(f"{name}: {len(content) / 1e3:.1f} kB, {summary(mesh, notes, most)}", flush=True)


def summary(mesh: Mesh, notes: tuple[str, ...], most: int) -> str:
    """What a mesh is as a solid and as convex parts."""
    found = convex_parts(mesh, most)
    corners = [len(part.vertices) for part in found.parts]
    size = " × ".join(f"{1e3 * side:.4g}" for side in np.ptp(mesh.vertices, axis=0))
    solid = f"{len(mesh.faces)} faces, {size} mm, {1e6 * mesh.volume:.4g} cm³"
    return "; ".join([solid, f"{found} ({max(corners)} vertices at most, {sum(corners)} together)", *notes])


if __name__ == "__main__":
    main()
