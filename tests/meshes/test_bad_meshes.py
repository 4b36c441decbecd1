"""Bad meshes and odd ones: each mended, with a sentence for it, or refused in one message."""

from __future__ import annotations

import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.errors import MeshError
from casadi_hands.meshes import Mesh, mend, read, read_mesh
from tests.meshes.solids import (
    angle,
    ascii_stl,
    ball,
    binary_stl,
    box,
    inverted,
    joined,
    obj,
    subdivided,
    without,
)

CUBE = 0.04**3
Content = bytes | str


def mended(folder: Path, name: str, content: Content) -> tuple[Mesh, tuple[str, ...]]:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return mend(read_mesh(path))


def moved(mesh: Mesh, by: tuple[float, float, float]) -> Mesh:
    return Mesh(mesh.vertices + by, mesh.faces)


def turned(mesh: Mesh, *faces: int) -> Mesh:
    changed = mesh.faces.copy()
    changed[list(faces)] = changed[list(faces), ::-1]
    return Mesh(mesh.vertices, changed)


def moebius() -> Mesh:
    """A strip of 16 quads with a half twist."""
    rims = []
    for a in np.arange(16) * np.pi / 8:
        way = np.array([np.cos(a) * np.cos(a / 2), np.sin(a) * np.cos(a / 2), np.sin(a / 2)])
        middle = 0.04 * np.array([np.cos(a), np.sin(a), 0])
        rims += [middle - 0.01 * way, middle + 0.01 * way]
    faces = []
    for k in range(16):
        a, b = 2 * k, 2 * k + 1
        c, d = (2 * k + 2, 2 * k + 3) if k < 15 else (1, 0)
        faces += [[a, c, b], [b, c, d]]
    return Mesh(np.array(rims), np.array(faces))


def with_vertex(mesh: Mesh, which: int, value: float) -> Mesh:
    vertices = mesh.vertices.copy()
    vertices[which, 1] = value
    return Mesh(vertices, mesh.faces)


def bent_into_itself() -> Mesh:
    """A bar bent round by 1.3 turns: its ends pass through each other."""
    bar = subdivided(box((0.1, 0.02, 0.02)), 4).vertices
    angles, radius = bar[:, 0] / 0.1 * 1.3 * 2 * np.pi, 0.05 + bar[:, 1]
    faces = subdivided(box((0.1, 0.02, 0.02)), 4).faces
    return Mesh(np.column_stack([radius * np.cos(angles), radius * np.sin(angles), bar[:, 2]]), faces)


def fins() -> Mesh:
    """A cube with a third face at one of its edges."""
    cube = box()
    return Mesh(np.vstack([cube.vertices, [0, 0, 0.1]]), np.vstack([cube.faces, [4, 5, 8]]))


QUADS = "".join(
    [
        *(f"v {x} {y} {z}\n" for z in (0, 0.04) for y in (0, 0.04) for x in (0, 0.04)),
        "f 1 3 4 2\nf 5 6 8 7\nf 1 2 6 5\nf 3 7 8 4\nf 1 5 7 3\nf 2 4 8 6\n",
    ]
)
NEGATIVE = re.sub(r"(?m)^f .*$", lambda f: "f " + " ".join(str(int(n) - 9) for n in f[0].split()[1:]), QUADS)
PRISM = "".join(
    [
        *(f"v {x} {y} {z}\n" for z in (0, 0.04) for x, y in angle().vertices[:6, :2]),
        "f 6 5 4 3 2 1\nf 7 8 9 10 11 12\n",
        *(f"f {k + 1} {(k + 1) % 6 + 1} {(k + 1) % 6 + 7} {k + 7}\n" for k in range(6)),
    ]
)
TEXTURED = QUADS.replace("f 1 3 4 2", "vt 0 0\nvn 0 0 1\nmtllib ../../etc/passwd\nusemtl x\nf 1/1/1 3//1 4/1 \\\n 2")

# Name of the file, its content, the volume of what it is mended to, and what is said of it.
MENDED: dict[str, tuple[str, Content, float, tuple[str, ...]]] = {
    "binary": ("part.stl", binary_stl(box()), CUBE, ()),
    "ascii": ("part.stl", ascii_stl(box()), CUBE, ()),
    "ascii, Windows' line ends": ("part.stl", ascii_stl(box()).replace("\n", "\r\n"), CUBE, ()),
    "ascii, upper case": ("part.STL", ascii_stl(box()).upper(), CUBE, ()),
    "ascii, no name": ("part.stl", ascii_stl(box(), ""), CUBE, ()),
    "ascii, two solids apart": ("part.stl", ascii_stl(box()) + ascii_stl(moved(box(), (0.1, 0, 0))), 2 * CUBE, ()),
    "binary that begins with solid": ("part.stl", binary_stl(box(), header=b"solid of CAD"), CUBE, ()),
    "name with spaces and signs": ("ein Würfel (1) – 'neu'; $x.stl", binary_stl(box()), CUBE, ()),
    "obj": ("part.obj", obj(box()), CUBE, ()),
    "obj, upper case": ("PART.OBJ", obj(box()), CUBE, ()),
    "obj of quads": ("part.obj", QUADS, CUBE, ()),
    "obj of negative numbers": ("part.obj", NEGATIVE, CUBE, ()),
    "obj of concave polygons": ("part.obj", PRISM, angle().volume, ()),
    "obj with textures and a library that is not opened": ("part.obj", TEXTURED, CUBE, ()),
    "obj with colours": ("part.obj", re.sub(r"(?m)^(v .*)$", r"\1 1 0.5 0", QUADS), CUBE, ()),
    "vertices of no face": ("part.obj", "v 9 9 9\n" + NEGATIVE, CUBE, ()),
    "inside out": ("part.stl", binary_stl(inverted(box())), CUBE, ("turned the surface inside out",)),
    "one face turned": (
        "part.stl",
        binary_stl(turned(box(), 3)),
        CUBE,
        ("turned 1 face that looked another way than its neighbours",),
    ),
    "five faces turned": (
        "part.stl",
        binary_stl(turned(box(), 0, 3, 5, 8, 9)),
        CUBE,
        ("turned 5 faces that looked another way than their neighbours",),
    ),
    "most faces turned": (
        "part.stl",
        binary_stl(turned(box(), *range(9))),
        CUBE,
        ("turned 3 faces that looked another way than their neighbours", "turned the surface inside out"),
    ),
    "a face twice": (
        "part.stl",
        binary_stl(joined(box(), Mesh(box().vertices, box().faces[:1]))),
        CUBE,
        ("dropped 1 face given twice",),
    ),
    "all faces twice": ("part.stl", binary_stl(joined(box(), box())), CUBE, ("dropped 12 faces given twice",)),
    "a face of two corners": (
        "part.obj",
        obj(Mesh(box().vertices, np.vstack([box().faces, [0, 0, 1]]))),
        CUBE,
        ("dropped 1 face without area",),
    ),
    "a missing triangle": (
        "part.stl",
        binary_stl(without(box(), 7)),
        CUBE,
        ("closed 1 hole, the largest 56.6 mm across",),
    ),
    "two missing triangles": (
        "part.stl",
        binary_stl(without(box(), 0, 7)),
        CUBE,
        ("closed 2 holes, the largest 56.6 mm across",),
    ),
    "a small hole": (
        "part.stl",
        binary_stl(without(subdivided(box(), 5), 5, 6, 7)),
        CUBE,
        ("closed 1 hole, the largest 3.54 mm across",),
    ),
    "gaps of rounding": (
        "part.stl",
        binary_stl(
            Mesh(
                box().vertices[box().faces].reshape(-1, 3) + 1e-10 * np.arange(36)[:, None] % 3e-10,
                np.arange(36).reshape(-1, 3),
            )
        ),
        CUBE,
        (),
    ),
    "a cavity": ("part.stl", binary_stl(joined(box(), inverted(box((0.02, 0.02, 0.02))))), 7 / 8 * CUBE, ()),
    "a cavity, all inside out": (
        "part.stl",
        binary_stl(joined(inverted(box()), box((0.02, 0.02, 0.02)))),
        7 / 8 * CUBE,
        ("turned the surface inside out",),
    ),
    "one of two solids inside out": (
        "part.stl",
        binary_stl(joined(box(), inverted(box(center=(0.1, 0, 0))))),
        2 * CUBE,
        ("turned 1 piece inside out",),
    ),
    "the larger of two solids inside out": (
        "part.stl",
        binary_stl(joined(box((0.02, 0.02, 0.02)), inverted(box(center=(0.1, 0, 0))))),
        9 / 8 * CUBE,
        ("turned 1 piece inside out",),
    ),
    "a solid within a solid": (
        "part.stl",
        binary_stl(joined(box(), box((0.02, 0.02, 0.02)))),
        CUBE,
        ("united 2 pieces that overlap",),
    ),
    "two solids that overlap": (
        "part.stl",
        binary_stl(joined(box(), box(center=(0.02, 0.005, 0.005)))),
        2 * CUBE - 0.02 * 0.035**2,
        ("united 2 pieces that overlap",),
    ),
    "cubes that share an edge": ("part.stl", binary_stl(joined(box(), box(center=(0.04, 0.04, 0)))), 2 * CUBE, ()),
    "a loose sheet beside a solid": (
        "part.obj",
        obj(
            joined(
                box(),
                Mesh(
                    np.array([[0.1, 0, 0], [0.11, 0, 0], [0.1, 0.01, 0], [0.11, 0.01, 0]]),
                    np.array([[0, 1, 2], [1, 3, 2], [0, 2, 3], [0, 3, 1]]),
                ),
            )
        ),
        CUBE,
        ("dropped 1 piece without volume",),
    ),
}

OPEN_CUBE = without(box(), 2, 3)
# Name of the file, its content, and the message; `...` stands for anything.
REFUSED: dict[str, tuple[str, Content, str]] = {
    "empty": ("part.stl", b"", "given an empty file; allowed: an STL or OBJ file"),
    "empty obj": ("part.obj", b"", "given an empty file; allowed: an STL or OBJ file"),
    "a text file": ("part.stl", "Dear reader,\n", "given a file that is not STL; allowed: STL, ASCII (it begins ..."),
    "a long text file": (
        "part.stl",
        "Dear reader,\n" * 99,
        "given a file that is not STL; allowed: STL, ASCII (it ...",
    ),
    "a text file as obj": ("part.obj", "Dear reader,\n", "given a file without vertices (`v x y z`) and faces (`f ..."),
    "a picture as stl": (
        "part.stl",
        b"\x89PNG\r\n\x1a\n" + bytes(200),
        "given a binary STL of 208 bytes that says it ...",
    ),
    "a picture as obj": ("part.obj", b"\x89PNG\r\n\x1a\n" + bytes(200), "given a file without vertices ..."),
    "another format": (
        "part.step",
        b"ISO-10303-21;",
        "given 'part.step'; allowed: a file named *.stl or *.obj; other ...",
    ),
    "no ending": ("part", binary_stl(box()), "given 'part'; allowed: a file named *.stl or *.obj; other formats ..."),
    "a web page": ("part.stl", "<!DOCTYPE html><html></html>", "given a file that is not STL; ..."),
    "solid of nothing": (
        "part.stl",
        "solid\nendsolid\n",
        "given a file without faces; allowed: a mesh of triangles ...",
    ),
    "binary of nothing": ("part.stl", bytes(84), "given a file without faces; allowed: a mesh of triangles that ..."),
    "obj without faces": ("part.obj", "v 0 0 0\n", "given a file without faces; allowed: a mesh of triangles that ..."),
    "obj without vertices": ("part.obj", "f 1 2 3\n", "given vertex 3 in a face at line 1; allowed: 1 to 0"),
    "count too high": (
        "part.stl",
        binary_stl(box(), 13),
        "given a binary STL of 684 bytes that says it has 13 triangles, which take 734 bytes; allowed: a whole ...",
    ),
    "count too low": (
        "part.stl",
        binary_stl(box(), 11),
        "given a binary STL of 684 bytes that says it has 11 triangles, which take 634 bytes; allowed: a whole ...",
    ),
    "count of millions": (
        "part.stl",
        binary_stl(box(), 2**32 - 1),
        "given a binary STL of 684 bytes that says it has 4294967295 ...",
    ),
    "binary cut off": ("part.stl", binary_stl(box())[:-20], "given a binary STL of 664 bytes that says it has 12 ..."),
    "ascii cut off": (
        "part.stl",
        ascii_stl(box())[:-150],
        "given an ASCII STL of 12 facets, 11 of them whole, and 33 vertices, 33 of them whole; allowed: three ...",
    ),
    "ascii without its end": (
        "part.stl",
        ascii_stl(box()).replace("endsolid part", ""),
        "given an ASCII STL of 12 facets, 12 of them whole, ...",
    ),
    "ascii with a word": (
        "part.stl",
        ascii_stl(box()).replace("vertex 0.02", "vertex 0,02", 1),
        "given `vertex 0,02 -0.02 -0.02`; allowed: `vertex` and three numbers",
    ),
    "ascii of two numbers": (
        "part.stl",
        ascii_stl(box()).replace("vertex 0.02", "vertex", 1),
        "given an ASCII STL of 12 facets, 12 of them whole, and 36 vertices, 35 of them whole; allowed: ...",
    ),
    "NaN in ascii": (
        "part.stl",
        ascii_stl(with_vertex(box(), 1, np.nan)),
        "given ... of 36 vertices that are not finite numbers; allowed: finite coordinates",
    ),
    "NaN in binary": (
        "part.stl",
        binary_stl(with_vertex(box(), 1, np.nan)),
        "given 5 of 36 vertices that are not finite numbers; ...",
    ),
    "infinity in obj": (
        "part.obj",
        obj(with_vertex(box(), 1, np.inf)),
        "given 1 of 8 vertices that are not finite numbers; allowed: ...",
    ),
    "obj with a word": ("part.obj", "v 0 0 zero\n", "given `v 0 0 zero` at line 1; allowed: `v` and three numbers"),
    "obj in a plane": ("part.obj", "v 0 0\nv 1 0\n", "given `v 0 0` at line 1; allowed: `v` and three numbers"),
    "obj from zero": ("part.obj", QUADS.replace("f 1 3 4 2", "f 0 2 3 1"), "given `f 0 2 3 1` at line 9; allowed: ..."),
    "obj beyond the end": (
        "part.obj",
        QUADS.replace("f 1 3", "f 1 33"),
        "given vertex 33 in a face at line 9; allowed: 1 to 8",
    ),
    "obj before the start": (
        "part.obj",
        QUADS.replace("f 1 3", "f 1 -33"),
        "given `f 1 -33 4 2` at line 9; allowed: ... -8 to -1...",
    ),
    "obj of two corners": ("part.obj", QUADS + "f 1 2\n", "given a face of 2 corners at line 15; allowed: 3 to 2000"),
    "obj of too many corners": (
        "part.obj",
        QUADS + f"f{' 1' * 3000}\n",
        "given a face of 3000 corners at line 15; allowed: 3 to 2000",
    ),
    "obj with names for numbers": (
        "part.obj",
        QUADS + "f a b c\n",
        "given `f a b c` at line 15; allowed: `f` and numbers ...",
    ),
    "a single triangle": (
        "part.obj",
        "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
        "given a mesh of 1 face; allowed: four faces and more, around a solid",
    ),
    "faces of no area only": (
        "part.obj",
        "v 0 0 0\nv 1 0 0\nf 1 2 2\n",
        "given a mesh of 0 faces; allowed: four faces ...",
    ),
    "all at one point": (
        "part.stl",
        binary_stl(box((0.0, 0.0, 0.0))),
        "given a mesh of 0 faces; allowed: four faces ...",
    ),
    "flat": (
        "part.obj",
        obj(box((0.04, 0.04, 0.0))),
        "given a mesh of 2 faces; allowed: four faces and more, around a solid",
    ),
    "almost flat": (
        "part.obj",
        obj(box((0.04, 0.04, 1e-8))),
        "given a surface that encloses nothing: it is flat or folded onto ...",
    ),
    "a needle": (
        "part.obj",
        obj(box((0.04, 1e-6, 1e-6))),
        "given a surface that encloses nothing: it is flat or folded onto ...",
    ),
    "a box without lid": (
        "part.stl",
        binary_stl(OPEN_CUBE),
        "given an open surface: 1 hole, the largest 56.6 mm across; allowed: a closed surface; let your CAD ...",
    ),
    "a tube": (
        "part.stl",
        binary_stl(without(box(), 0, 1, 2, 3)),
        "given an open surface: 2 holes, the largest 56.6 ...",
    ),
    "a sheet": (
        "part.stl",
        binary_stl(Mesh(subdivided(box(), 2).vertices, subdivided(box(), 2).faces[:32])),
        "given an open ...",
    ),
    "half a ball": (
        "part.stl",
        binary_stl(Mesh(ball().vertices, ball().faces[ball().corners[:, :, 2].min(axis=1) > -1e-6])),
        "given an open surface: 1 hole, the largest 56.6 mm across; ...",
    ),
    "a Möbius strip": (
        "part.stl",
        binary_stl(moebius()),
        "given a surface with one side only, as a Möbius strip has; ...",
    ),
    "a fin at an edge": (
        "part.obj",
        obj(fins()),
        "given 1 edge at which three or more faces meet; allowed: a closed ...",
    ),
    "a surface through itself": (
        "part.stl",
        binary_stl(bent_into_itself()),
        "given a surface that crosses itself: 0... of it ...",
    ),
    "a soup of tetrahedra": (
        "part.stl",
        binary_stl(joined(*(box((1e-3,) * 3, (2e-3 * k, 0, 0)) for k in range(201)))),
        "given a mesh of 201 separate pieces; allowed: at most 200; a closed surface; let your CAD program ...",
    ),
    "a soup of triangles": (
        "part.stl",
        binary_stl(Mesh(np.random.default_rng(0).uniform(-0.1, 0.1, (60, 3)), np.arange(60).reshape(-1, 3))),
        "given an open surface: 20 holes, the largest ... mm across; allowed: a closed surface; ...",
    ),
}


@pytest.mark.parametrize("case", MENDED)
def test_what_is_meant_is_mended(case: str, tmp_path: Path) -> None:
    name, content, volume, notes = MENDED[case]
    mesh, said = mended(tmp_path, name, content)
    assert mesh.volume == pytest.approx(volume, rel=1e-5)
    assert said == notes


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_in_doubt_is_refused(case: str, tmp_path: Path) -> None:
    name, content, message = REFUSED[case]
    with pytest.raises(MeshError) as caught:
        mended(tmp_path, name, content)
    said = str(caught.value)
    assert re.fullmatch(re.escape(message).replace(r"\.\.\.", ".*"), said), said
    assert "\n" not in said


PLACES: dict[str, tuple[Callable[[Path], object], str]] = {
    "nothing there": (lambda path: None, "which is not there"),
    "a folder": (lambda path: path.mkdir(), "which is a folder"),
    "a pipe that nobody writes": (lambda path: os.mkfifo(path), "which is no regular file"),
    "a device": (lambda path: path.symlink_to("/dev/zero"), "which is no regular file"),
    "a link to itself": (lambda path: path.symlink_to(path), "which cannot be read"),
}


@pytest.mark.parametrize("case", PLACES)
def test_only_files_are_read(case: str, tmp_path: Path) -> None:
    make, message = PLACES[case]
    make(tmp_path / "part.stl")
    with pytest.raises(MeshError, match=message):
        read_mesh(tmp_path / "part.stl")


def test_a_name_with_a_zero_is_no_file() -> None:
    with pytest.raises(MeshError, match="cannot be read"):
        read_mesh("a\0b.stl")


def test_large_files_are_not_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "part.stl").write_bytes(binary_stl(box()))
    monkeypatch.setattr(read, "LARGEST", 600)
    with pytest.raises(MeshError, match="at most 0 MB; export a coarser mesh"):
        read_mesh(tmp_path / "part.stl")
    monkeypatch.undo()
    monkeypatch.setattr(read, "MOST_FACES", 11)
    with pytest.raises(MeshError, match="given 12 faces; allowed: at most 11; export a coarser one"):
        read_mesh(tmp_path / "part.stl")


def test_a_fine_mesh_is_made_coarser(tmp_path: Path) -> None:
    pytest.importorskip("fast_simplification")
    fine = subdivided(box(), 7)
    mesh, notes = mended(tmp_path, "part.stl", binary_stl(fine))
    assert len(fine.faces) > 50_000 >= len(mesh.faces)
    assert mesh.volume == pytest.approx(CUBE, rel=1e-4)
    assert notes[0].startswith(f"made {len(mesh.faces)} faces of {len(fine.faces)}, which changed the volume by ")
