"""From a file to a mesh."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import numpy as np

from casadi_hands.errors import MeshError
from casadi_hands.meshes.mesh import Mesh
from casadi_hands.meshes.obj import read_obj
from casadi_hands.meshes.stl import read_stl

READERS = {".stl": read_stl, ".obj": read_obj}
"""By the end of a file's name, in lower case."""
LARGEST = 200_000_000  # bytes
MOST_FACES = 2_000_000


def read_mesh(path: str | Path) -> Mesh:
    """Read a mesh as it stands in a file.

    Args:
        path: an STL file, ASCII or binary, or an OBJ file.

    Returns:
        The mesh, in the file's unit, with whatever is wrong with it: see `mend`.

    Raises:
        MeshError: there is no such file, it is none of these, or larger than is read.
    """
    path = Path(path)
    reader = READERS.get(path.suffix.lower())
    if reader is None:
        raise MeshError(f"{path.name!r}", f"a file named *{' or *'.join(READERS)}; other formats are not read")
    mesh = reader(_content(path))
    if not len(mesh.faces):
        raise MeshError("a file without faces", "a mesh of triangles that bound a solid")
    if len(mesh.faces) > MOST_FACES:
        raise MeshError(f"{len(mesh.faces)} faces", f"at most {MOST_FACES}; export a coarser one")
    unfit = int((~np.isfinite(mesh.vertices)).any(axis=1).sum())
    if unfit:
        raise MeshError(f"{unfit} of {len(mesh.vertices)} vertices that are not finite numbers", "finite coordinates")
    return mesh


def _content(path: Path) -> bytes:
    """The bytes of a regular file; nothing else is waited for or read."""
    try:
        file = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except FileNotFoundError:
        raise MeshError(f"{str(path)!r}, which is not there", "the path of an STL or OBJ file") from None
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise MeshError(f"{str(path)!r}, which cannot be read ({why})", "the path of an STL or OBJ file") from None
    try:
        status = os.fstat(file)
        if not stat.S_ISREG(status.st_mode):
            what = "is a folder" if stat.S_ISDIR(status.st_mode) else "is no regular file"
            raise MeshError(f"{str(path)!r}, which {what}", "the path of an STL or OBJ file")
        if not status.st_size:
            raise MeshError("an empty file", "an STL or OBJ file")
        if status.st_size > LARGEST:
            given = f"a file of {status.st_size / 1e6:.0f} MB"
            raise MeshError(given, f"at most {LARGEST / 1e6:.0f} MB; export a coarser mesh, or a binary STL")
        with os.fdopen(file, "rb", closefd=False) as opened:
            return opened.read(LARGEST + 1)
    finally:
        os.close(file)
