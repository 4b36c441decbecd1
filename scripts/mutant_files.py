"""Files of a result folder spoilt whatever they say: cut off, with bits flipped, or others in their place."""

from __future__ import annotations

import io
import os
import random
import shutil
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np

FILES = ("task.yaml", "hand.urdf", "object.urdf", "scene.xml", "motion.npz", "motion.csv", "result.json")
_LARGE = 50_000_000  # bytes, which no mutation reads


def read(path: Path) -> bytes:
    """The content of a file; nothing of what is no common file, or too large to be held."""
    return path.read_bytes() if path.is_file() and path.stat().st_size < _LARGE else b""


def truncated(folder: Path, source: random.Random) -> str:
    """End a file early, and return which and where."""
    path = folder / source.choice(FILES)
    content = read(path)
    length = source.randrange(len(content) + 1)
    _write(path, content[:length])
    return f"{path.name} ends after {length} bytes"


def flipped(folder: Path, source: random.Random) -> str:
    """Flip bits of a file, and return of which and how many."""
    path = folder / source.choice(FILES)
    content = bytearray(read(path))
    for _ in range(count := source.choice((1, 1, 2, 8))):
        if content:
            content[source.randrange(len(content))] ^= 1 << source.randrange(8)
    _write(path, bytes(content))
    return f"{path.name} has {count} bits flipped"


def _write(path: Path, content: bytes) -> None:
    if path.is_dir():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)
    path.write_bytes(content)


def foreign(folder: Path, source: random.Random) -> str:
    """Put something else in a file's place, and return what."""
    name = source.choice(FILES)
    path, other = folder / name, folder / source.choice(FILES)
    special = _SPECIAL if name != "motion.npz" else (*_SPECIAL, "a bomb", "many members")
    chosen = source.choice((*_contents(b"", b"", b"", other.name), *special))
    if chosen in (made := _contents(read(path), read(other), source.randbytes(3000), other.name)):
        _write(path, made[chosen]())
    elif chosen in ("a bomb", "many members"):
        _write(path, _bomb() if chosen == "a bomb" else _archive({f"a{i}": b"" for i in range(20_000)}))
    else:
        _make(path, chosen)
    return f"{name} is {chosen}"


def _make(path: Path, what: str) -> None:
    """Put what is no common file in a file's place."""
    _write(path, b"")
    path.unlink()
    if what == "a folder":
        path.mkdir()
    elif what == "a pipe":
        os.mkfifo(path)
    elif what in (links := {"zeros without end": "/dev/zero", "a link to nothing": "nothing"}):
        path.symlink_to(links[what])
    elif what == "four gigabytes":
        path.touch()
        os.truncate(path, 4 << 30)


_SPECIAL = ("a folder", "missing", "a pipe", "zeros without end", "a link to nothing", "four gigabytes")


def _contents(own: bytes, other: bytes, noise: bytes, name: str) -> dict[str, Callable[[], bytes]]:
    """What a file may hold instead, by what to call it."""
    laughs = "".join(f'<!ENTITY a{i} "{f"&a{i - 1};" * 10}">' for i in range(1, 10))
    return {
        "nothing": lambda: b"",
        "noise": lambda: noise,
        "zeros": lambda: bytes(5000),
        "a picture": lambda: b"\x89PNG\r\n\x1a\n" + noise,
        name: lambda: other,
        "UTF-16": lambda: own.decode("utf-8", "replace").encode("utf-16"),
        "a byte order mark": lambda: b"\xef\xbb\xbf" + own,
        "Latin-1": lambda: "é".encode("latin-1") + own,
        "an unknown encoding": lambda: b'<?xml version="1.0" encoding="klingon"?>' + own,
        "a wide encoding": lambda: b'<?xml version="1.0" encoding="utf-32"?>' + own,
        "brackets": lambda: b"[" * 200_000,
        "braces": lambda: b'{"a":' * 200_000,
        "elements": lambda: b"<robot>" * 100_000,
        "an entity": lambda: b'<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot>&e;</robot>',
        "laughter": lambda: f'<!DOCTYPE r [<!ENTITY a0 "ha">{laughs}]><mujoco>&a9;</mujoco>'.encode(),
        "30 MB of words": lambda: b"word " * 6_000_000,
        "7 MB of lists": lambda: b"[" + b"[]," * 2_500_000 + b"[]]",
        "a million bodies": lambda: b"<mujoco><worldbody>" + b"<body/>" * 1_000_000 + b"</worldbody></mujoco>",
    }


@cache
def _bomb() -> bytes:
    """A megabyte that unpacks to more than one gigabyte."""
    return _archive({"time": npy_header("<f8", (150_000_000,)) + bytes(1_200_000_000)})


def _archive(members: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return file.getvalue()


def npy_header(kind: str, shape: tuple[int, ...]) -> bytes:
    """What an array of a type and a shape begins with in its file."""
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": kind, "fortran_order": False, "shape": shape})
    return file.getvalue()
