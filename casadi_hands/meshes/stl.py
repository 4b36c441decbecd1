"""STL, ASCII and binary."""

from __future__ import annotations

import re

import numpy as np
from numpy.typing import NDArray

from casadi_hands.errors import MeshError
from casadi_hands.meshes.mesh import Mesh

_HEADER = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"^[ \t]*vertex[ \t]+(\S+)[ \t]+(\S+)[ \t]+(\S+)[ \t]*\r?$", re.IGNORECASE | re.MULTILINE)
_WORDS = [
    re.compile(rb"^[ \t]*" + word + rb"\b", re.IGNORECASE | re.MULTILINE) for word in (b"vertex", b"facet", b"endloop")
]
_END = re.compile(rb"^[ \t]*endsolid\b", re.IGNORECASE | re.MULTILINE)


def read_stl(content: bytes) -> Mesh:
    """The triangles of an STL file, each with corners of its own.

    Args:
        content: of the file.

    Raises:
        MeshError: it is no STL file, or not a whole one.
    """
    count = int.from_bytes(content[80:_HEADER], "little") if len(content) >= _HEADER else -1
    if count >= 0 and len(content) == _HEADER + _FACET.itemsize * count:
        return _soup(np.frombuffer(content, _FACET, offset=_HEADER)["corners"].reshape(-1, 3))
    if content[:512].lstrip()[:5].lower() == b"solid" and (
        _WORDS[0].search(content) or count < 0 or b"\0" not in content
    ):
        return _ascii(content)
    if count < 0 or b"\0" not in content:
        raise MeshError("a file that is not STL", "STL, ASCII (it begins with `solid`) or binary")
    due = _HEADER + _FACET.itemsize * count
    given = f"a binary STL of {len(content)} bytes that says it has {count} triangles, which take {due} bytes"
    raise MeshError(given, "a whole file; export it again")


def _ascii(content: bytes) -> Mesh:
    found = _VERTEX.findall(content)
    words, facets, loops = (len(word.findall(content)) for word in _WORDS)
    if len(found) != words or not words == 3 * facets == 3 * loops or not _END.search(content):
        given = (
            f"an ASCII STL of {facets} facets, {loops} of them whole, and {words} vertices, {len(found)} of them whole"
        )
        raise MeshError(
            given, "three vertices of three numbers in each facet, `endsolid` in the end; is the file whole?"
        )
    try:
        return _soup(np.array(found, dtype="S").astype(np.float64).reshape(-1, 3))
    except ValueError:
        raise MeshError(f"`vertex {_unread(found)}`", "`vertex` and three numbers") from None


def _unread(found: list[tuple[bytes, ...]]) -> str:
    """The first vertex that is not of numbers."""
    for words in found:
        try:
            _ = [float(word) for word in words]
        except ValueError:
            return b" ".join(words).decode("utf-8", "replace")[:40]
    return ""


def _soup(points: NDArray[np.generic]) -> Mesh:
    return Mesh(points.astype(np.float64), np.arange(len(points), dtype=np.int64).reshape(-1, 3))
