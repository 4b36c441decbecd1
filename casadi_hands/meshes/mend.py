"""What is wrong with a mesh: mended where there is no doubt about what was meant, else refused."""

from __future__ import annotations

from typing import Any

import numpy as np

from casadi_hands.errors import MeshError
from casadi_hands.meshes.extra import needed
from casadi_hands.meshes.mesh import Mesh
from casadi_hands.meshes.polygons import triangulated
from casadi_hands.meshes.topology import distinct_rows, edges_of, loops, pieces, with_one_winding
from casadi_hands.meshes.winding import overlapped, winding_numbers

MOST_FACES, DECIMATED = 50_000, 20_000
"""Above the first, a mesh is brought down to the second."""
_MERGED = 1e-7  # of the size: STL has no more digits
_HOLE = 0.1  # of the size: larger ones may be meant
_FLAT = 1e-7  # of the size, cubed
_MOST_PIECES = 200
_CLOSED = "a closed surface; let your CAD program export a solid"


def mend(mesh: Mesh) -> tuple[Mesh, tuple[str, ...]]:
    """Make of a mesh the closed surface of a solid.

    Vertices are merged, faces without area or given twice dropped, all faces turned outward, small holes closed, solids
    that overlap united, and very fine meshes made coarser.

    Args:
        mesh: m.

    Returns:
        The mesh, and what was done to it, a sentence each.

    Raises:
        MeshError: it is not clear what solid it should be.
    """
    notes: list[str] = []
    mesh = _sides_agree(_without_doubles(_merged(mesh), notes), notes)
    mesh = _outward(_with_holes_closed(mesh, notes), notes)
    mesh = _coarse_enough(mesh, notes)
    return _united(mesh, notes), tuple(notes)


def _merged(mesh: Mesh) -> Mesh:
    """Vertices at one place made one, and those of no face dropped."""
    used, faces = np.unique(mesh.faces, return_inverse=True)
    points, faces = mesh.vertices[used], faces.reshape(-1, 3)
    cell = max(_MERGED * Mesh(points, faces).size, 1e-300)
    kept, place = distinct_rows(np.round(points / cell).astype(np.int64))
    return Mesh(points[kept], place[faces])


def _without_doubles(mesh: Mesh, notes: list[str]) -> Mesh:
    """No face with a corner twice, and none given twice."""
    ordered = np.sort(mesh.faces, axis=1)
    proper = (ordered[:, 0] < ordered[:, 1]) & (ordered[:, 1] < ordered[:, 2])
    faces = mesh.faces[proper][distinct_rows(ordered[proper])[0]] if proper.any() else mesh.faces[:0]
    if not proper.all():
        notes.append(f"dropped {_count(int((~proper).sum()), 'face')} without area")
    if len(faces) < proper.sum():
        notes.append(f"dropped {_count(int(proper.sum()) - len(faces), 'face')} given twice")
    if len(faces) < 3:
        raise MeshError(f"a mesh of {_count(len(faces), 'face')}", "four faces and more, around a solid")
    return Mesh(mesh.vertices, faces)


def _sides_agree(mesh: Mesh, notes: list[str]) -> Mesh:
    faces, turned = with_one_winding(mesh.faces)
    if turned < 0:
        raise MeshError("a surface with one side only, as a Möbius strip has", "the surface of a solid")
    if turned:
        neighbours = "its neighbours" if turned == 1 else "their neighbours"
        notes.append(f"turned {_count(turned, 'face')} that looked another way than {neighbours}")
    return Mesh(mesh.vertices, faces)


def _with_holes_closed(mesh: Mesh, notes: list[str]) -> Mesh:
    edges = edges_of(mesh.faces)
    loose, sides = edges.balance != 0, edges.sides
    if crowded := int((loose & (sides > 2)).sum()):
        raise MeshError(f"{_count(crowded, 'edge')} at which three or more faces meet", _CLOSED)
    if not loose.any():
        return mesh
    ends, backward = edges.ends[loose], edges.balance[loose] > 0
    around = loops(np.where(backward[:, None], ends[:, ::-1], ends))
    widths = [float(np.linalg.norm(np.ptp(mesh.vertices[loop], axis=0))) for loop in around]
    most = _HOLE * mesh.size
    known = {tuple(sorted(face)) for face in mesh.faces.tolist()} if around else set()
    if any(_is_open(loop, width > most, known) for loop, width in zip(around, widths, strict=True)):
        wide = f"{_count(len(around), 'hole')}, the largest {1e3 * max(widths):.3g} mm across"
        raise MeshError(f"an open surface: {wide}", f"{_CLOSED} (holes of up to {1e3 * most:.3g} mm are closed)")
    patches = [np.array(loop)[triangulated(mesh.vertices[loop])] for loop in around]
    notes.append(f"closed {_count(len(around), 'hole')}, the largest {1e3 * max(widths):.3g} mm across")
    closed = Mesh(mesh.vertices, np.vstack([mesh.faces, *patches]))
    if edges_of(closed.faces).balance.any():
        raise MeshError(f"an open surface: {_count(len(around), 'hole')} that cannot be closed", _CLOSED)
    return closed


def _is_open(loop: list[int], wide: bool, faces: set[tuple[int, ...]]) -> bool:
    """Whether a hole may be meant: it is wide and no missing triangle, or all that there is about it is one."""
    return len(loop) < 3 or (tuple(sorted(loop)) in faces if len(loop) == 3 else wide)


def _outward(mesh: Mesh, notes: list[str]) -> Mesh:
    """Every piece outward, but for those within another one that bound a cavity; none without volume."""
    piece = pieces(mesh.faces, len(mesh.vertices))
    count = int(piece.max()) + 1
    if count > _MOST_PIECES:
        raise MeshError(f"a mesh of {count} separate pieces", f"at most {_MOST_PIECES}; {_CLOSED}")
    parts = [Mesh(mesh.vertices, mesh.faces[piece == k]) for k in range(count)]
    volumes = np.array([part.volume for part in parts])
    solid = np.abs(volumes) > _FLAT * mesh.size**3
    if not solid.any():
        raise MeshError("a surface that encloses nothing: it is flat or folded onto itself", "a solid with a volume")
    if not solid.all():
        notes.append(f"dropped {_count(int((~solid).sum()), 'piece')} without volume")
    parts, volumes = [part for part, kept in zip(parts, solid, strict=True) if kept], volumes[solid]
    sign = -1.0 if volumes.sum() < 0 else 1.0
    turn = np.array([sign * v < 0 and not _is_cavity(k, parts, sign) for k, v in enumerate(volumes)]) ^ (sign < 0)
    if turn.any():
        notes.append(
            "turned the surface inside out" if turn.all() else f"turned {_count(int(turn.sum()), 'piece')} inside out"
        )
    faces = [part.faces[:, ::-1] if t else part.faces for part, t in zip(parts, turn, strict=True)]
    return _merged(Mesh(mesh.vertices, np.vstack(faces)))


def _is_cavity(which: int, parts: list[Mesh], sign: float) -> bool:
    """Whether a piece lies within the others, whose faces look outward where the sign is positive."""
    others = [part.faces for k, part in enumerate(parts) if k != which]
    if not others:
        return False
    corner = parts[which].corners[0, :1]
    return bool(sign * winding_numbers(Mesh(parts[which].vertices, np.vstack(others)), corner)[0] > 0.5)


def _coarse_enough(mesh: Mesh, notes: list[str]) -> Mesh:
    if len(mesh.faces) <= MOST_FACES:
        return mesh
    simplify = needed("fast_simplification", f"a mesh of {len(mesh.faces)} faces").simplify
    points, faces = simplify(mesh.vertices.astype(np.float32), mesh.faces.astype(np.int32), target_count=DECIMATED)
    coarse = _without_doubles(_merged(Mesh(points.astype(np.float64), faces.astype(np.int64))), [])
    lost = abs(coarse.volume / mesh.volume - 1)
    if edges_of(coarse.faces).balance.any() or lost > 0.01:
        raise MeshError(
            f"{len(mesh.faces)} faces, which cannot be made fewer", f"at most {MOST_FACES}; export a coarser mesh"
        )
    notes.append(f"made {len(coarse.faces)} faces of {len(mesh.faces)}, which changed the volume by {lost:.2g} of it")
    return coarse


def _united(mesh: Mesh, notes: list[str]) -> Mesh:
    share = overlapped(mesh)
    if not share:
        return mesh
    piece = pieces(mesh.faces, len(mesh.vertices))
    given = f"a surface that crosses itself: {share:.2g} of it lies within the solid"
    allowed = "a surface that bounds one solid; unite its parts in your CAD program"
    if piece.max() == 0:
        raise MeshError(given, allowed)
    library = needed("manifold3d", "a mesh of solids that overlap")
    parts = [_merged(Mesh(mesh.vertices, mesh.faces[piece == k])) for k in range(int(piece.max()) + 1)]
    solids = [(part.volume > 0, _manifold(library, part)) for part in parts]
    whole = library.Manifold.batch_boolean([solid for out, solid in solids if out], library.OpType.Add)
    for out, solid in solids:
        whole = whole if out else whole - solid
    made = whole.to_mesh64()
    points = np.asarray(made.vert_properties, dtype=np.float64)[:, :3]
    united = _merged(Mesh(points, np.asarray(made.tri_verts, dtype=np.int64)))
    if not len(united.faces) or edges_of(united.faces).balance.any() or overlapped(united):
        raise MeshError(given, allowed)
    notes.append(f"united {len(parts)} pieces that overlap")
    return united


def _manifold(library: Any, part: Mesh) -> Any:
    faces = part.faces if part.volume > 0 else part.faces[:, ::-1]
    return library.Manifold(library.Mesh64(part.vertices, faces.astype(np.uint64)))


def _count(number: int, of: str) -> str:
    return f"{number} {of}{'s' * (number != 1)}"
