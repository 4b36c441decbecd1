"""Convex parts whose union is a mesh."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from casadi_hands.errors import MeshError
from casadi_hands.meshes.error import union_error
from casadi_hands.meshes.extra import needed
from casadi_hands.meshes.hull import MOST_VERTICES, hull, reduced
from casadi_hands.meshes.kept import keep, key_of, load
from casadi_hands.meshes.mesh import Mesh

_VERSION = 2  # of what is kept
_CONVEX = 0.01  # share of the volume, and of the size, by which a hull may be more than its mesh
_REDUCED = 1e-3  # of the size
_VERTICES = 96  # of few parts together
_ROUNDED = 1e-4  # of the size: what coacd may move vertices by
_LONGEST = 600.0  # s
# A process of its own, for a library that cannot be interrupted and, on a mesh that it does not like, ends its process.
_CUT = """
import sys, numpy as np, coacd
coacd.set_log_level("off")
given = np.load(sys.argv[1])
parts = coacd.run_coacd(coacd.Mesh(given["vertices"], given["faces"]), threshold=float(given["threshold"]),
    max_convex_hull=int(given["parts"]), real_metric=True, preprocess_mode="off", seed=0)
np.savez(sys.argv[2], *[vertices for vertices, _ in parts])
"""


@dataclass(frozen=True, eq=False)
class Decomposition:
    """Convex parts that stand for a mesh.

    Attributes:
        parts: closed convex meshes of few vertices: at most 32 each, or 96 together, m.
        missing: the most by which the mesh stands out of their union, m, sampled.
        added: the most by which their union stands out of the mesh, m, sampled.
    """

    parts: tuple[Mesh, ...]
    missing: float
    added: float

    @property
    def error(self) -> float:
        """The largest distance between the union's surface and the mesh's, m."""
        return max(self.missing, self.added)

    def __str__(self) -> str:
        """A sentence, lengths in mm."""
        return told(len(self.parts), self.missing, self.added)


def told(parts: int, missing: float, added: float) -> str:
    """How many convex parts there are and how far they are from their mesh, see `Decomposition`, in mm."""
    out, over = (f"up to {round(1e3 * length, 2):g} mm" for length in (missing, added))
    return (
        f"1 convex part, which leaves out {out} and adds {over}"
        if parts == 1
        else (f"{parts} convex parts, which leave out {out} and add {over}")
    )


def convex_parts(mesh: Mesh, parts: int, threshold: float = 0.02) -> Decomposition:
    """Cut a solid into convex parts with few vertices; a convex one is one part.

    By coacd (Wei et al. 2022), which always gives the same parts for the same mesh. They are kept on disk, by the
    content of the mesh and all settings.

    Args:
        mesh: closed, m.
        parts: how many there may be.
        threshold: concavity that a part may have, of the mesh's longest side.

    Raises:
        MeshError: coacd is not installed, or cannot do it.
    """
    vertices, faces = np.ascontiguousarray(mesh.vertices, "<f8"), np.ascontiguousarray(mesh.faces, "<i8")
    key = key_of(_VERSION, vertices, faces, parts, threshold, MOST_VERTICES, _VERTICES, _CONVEX, _REDUCED)
    found = _loaded(key)
    if found is None:
        found = _made(mesh, parts, threshold)
        stored = {f"part{k}": part.vertices for k, part in enumerate(found.parts)}
        keep(key, {**stored, "error": np.array([found.missing, found.added])})
    return found


def _loaded(key: str) -> Decomposition | None:
    kept = load(key)
    if kept is None:
        return None
    missing, added = kept.pop("error")
    return Decomposition(tuple(hull(kept[f"part{k}"]) for k in range(len(kept))), float(missing), float(added))


def _made(mesh: Mesh, most: int, threshold: float) -> Decomposition:
    whole = hull(mesh.vertices)
    convex = whole.volume - mesh.volume <= _CONVEX * mesh.volume
    if most == 1 or (convex and union_error(mesh, [whole])[1] <= _CONVEX * mesh.size):
        return _reduced(mesh, [mesh.vertices])
    return _reduced(mesh, _cut(mesh, most, threshold * float(np.ptp(mesh.vertices, axis=0).max())))


def _reduced(mesh: Mesh, clouds: Sequence[NDArray[np.float64]]) -> Decomposition:
    most = max(MOST_VERTICES, _VERTICES // len(clouds))
    parts = tuple(reduced(cloud, _REDUCED * mesh.size, most)[0] for cloud in clouds)
    return Decomposition(parts, *union_error(mesh, parts))


def _cut(mesh: Mesh, parts: int, threshold: float) -> list[NDArray[np.float64]]:
    """Vertices (V, 3) of each part, as coacd finds them."""
    needed("coacd", "a mesh that is not convex")
    with tempfile.TemporaryDirectory() as folder:
        given, made = Path(folder) / "given.npz", Path(folder) / "made.npz"
        np.savez(given, vertices=mesh.vertices, faces=mesh.faces, parts=parts, threshold=threshold)
        command = [sys.executable, "-c", _CUT, str(given), str(made)]
        try:
            subprocess.run(command, check=True, capture_output=True, timeout=_LONGEST)
            with np.load(made) as archive:
                clouds = [archive[name] for name in archive.files]
        except subprocess.TimeoutExpired:
            allowed = f"a mesh that can be in {_LONGEST:g} s; give it fewer faces"
            raise MeshError(
                f"a mesh of {len(mesh.faces)} faces that coacd has not cut into convex parts", allowed
            ) from None
        except (subprocess.CalledProcessError, OSError) as error:
            said = getattr(error, "stderr", b"") or b""
            last = said.decode(errors="replace").strip().splitlines()[-1:] or [str(error)]
            raise MeshError(
                f"a mesh that coacd cannot cut into convex parts ({last[0][:120]})", "a simpler mesh"
            ) from None
    size = mesh.size
    solid = [
        cloud for cloud in clouds if len(cloud) >= 4 and np.linalg.svd(cloud - cloud.mean(axis=0))[1][2] > 1e-6 * size
    ]
    if not solid:
        raise MeshError("a mesh of which coacd makes no convex parts", "a simpler mesh")
    return [_snapped(cloud, mesh) for cloud in solid]


def _snapped(points: NDArray[np.float64], mesh: Mesh) -> NDArray[np.float64]:
    """Points (N, 3) that are vertices of a mesh but for coacd's rounding, put back there."""
    apart, nearest = KDTree(mesh.vertices).query(points)
    return np.where((apart < _ROUNDED * mesh.size)[:, None], mesh.vertices[nearest], points)
