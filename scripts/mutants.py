"""Result folders as they come from a bad disk, another program or somebody who means ill: one mutation each."""

from __future__ import annotations

import hashlib
import io
import json
import os
import random
import re
import shutil
import zipfile
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np

FILES = ("task.yaml", "hand.urdf", "object.urdf", "scene.xml", "motion.npz", "motion.csv", "result.json")
_LARGE = 50_000_000  # bytes, which no mutation reads
_XML = ("hand.urdf", "object.urdf", "scene.xml")
_WORDS = (
    *("", "0", "-1", "1e-9", "1e9", "1e308", "1e999", "nan", "inf", "-inf", "null", "true", "0x10", "1_000", "１", "½"),
    *("1 2", "0 0 0", "0 0 0 0", "1,5", "palm", "world", "ground", "object", "finger0_link1", "finger9_link9"),
    *("finger-1_link0", "continuous", "prismatic", "fixed", "floating", "mesh", "sdf", "hfield", "../../../etc/passwd"),
    *("\x1b[2J", "a" * 100_000, "9" * 5000, "\u202e", "!!python/object:os.system", "&a [*a]", "{", "- - -"),
)
_VALUES: tuple[Any, ...] = (
    *(None, True, False, 0, -1, 3, 10**30, -1e308, 1e-320, 0.5, "", "palm", "x" * 100_000, "\x1b[2J\x00", [], {}, [[]]),
    *([None], [1, 2], [[1, 2, 3]] * 3, {"value": None}, {"value": "a", "limit": [], "holds": 3}, ["a"] * 5, [1e400]),
)
_ELEMENTS = (
    "<include file='/etc/passwd'/>",
    "<asset><mesh name='m' file='../../../etc/passwd'/></asset>",
    "<asset><texture name='t' type='2d' file='/dev/zero'/></asset>",
    "<size memory='900G'/>",
    "<option timestep='1e-9' iterations='2000000000'/>",
    "<visual><geometry><mesh filename='file:///etc/passwd'/></geometry></visual>",
    "<replicate count='100000000'><geom size='1'/></replicate>",
    "<extension><plugin plugin='mujoco.sensor.touch_grid'/></extension>",
    "<joint name='finger0_joint0' type='continuous'><parent link='palm'/><child link='palm'/></joint>",
    "<link name='palm'/>",
    "<body name='object'/>",
    "<geom type='mesh' mesh='m'/>",
)
_TIMESTEPS = ("0", "-0.001", "1e-9", "nan", "1e-5", "1e-4", "0.1", "inf", "")


def mutate(folder: Path, source: random.Random) -> str:
    """Spoil one thing in a folder, sometimes two, and return what.

    Args:
        folder: a copy of a result folder.
        source: of chance; equal ones spoil equally.
    """
    done = [source.choices(_KINDS, _CHANCES)[0](folder, source) for _ in range(source.choice((1, 1, 1, 1, 2)))]
    if source.random() < 0.5:
        done += _rehash(folder)
    return "; ".join(done)


def _rehash(folder: Path) -> list[str]:
    """State the hash of ``task.yaml`` as it is now, as somebody would who means ill."""
    try:
        record = json.loads(_read(folder / "result.json"))
        record["task_hash"] = hashlib.sha256(_read(folder / "task.yaml")).hexdigest()
        (folder / "result.json").write_text(json.dumps(record))
    except (OSError, ValueError, TypeError, RecursionError):
        return []
    return ["its hash is right"]


def _read(path: Path) -> bytes:
    return path.read_bytes() if path.is_file() and path.stat().st_size < _LARGE else b""


def _truncated(folder: Path, source: random.Random) -> str:
    path = folder / source.choice(FILES)
    content = _read(path)
    length = source.randrange(len(content) + 1)
    _write(path, content[:length])
    return f"{path.name} ends after {length} bytes"


def _flipped(folder: Path, source: random.Random) -> str:
    path = folder / source.choice(FILES)
    content = bytearray(_read(path))
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


def _foreign(folder: Path, source: random.Random) -> str:
    name = source.choice(FILES)
    path, other = folder / name, folder / source.choice(FILES)
    special = _SPECIAL if name != "motion.npz" else (*_SPECIAL, "a bomb", "many members")
    chosen = source.choice((*_contents(b"", b"", b"", other.name), *special))
    if chosen in (made := _contents(_read(path), _read(other), source.randbytes(3000), other.name)):
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
    return _archive({"time": _header("<f8", (150_000_000,)) + bytes(1_200_000_000)})


def _archive(members: dict[str, bytes]) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in members.items():
            archive.writestr(f"{name}.npy", content)
    return file.getvalue()


def _header(kind: str, shape: tuple[int, ...]) -> bytes:
    file = io.BytesIO()
    np.lib.format.write_array_header_1_0(file, {"descr": kind, "fortran_order": False, "shape": shape})
    return file.getvalue()


def _json(folder: Path, source: random.Random) -> str:
    path = folder / "result.json"
    try:
        record = json.loads(_read(path))
    except (ValueError, RecursionError):
        return "result.json was spoilt"
    where, place = _any_place(record, source)
    if place is None:
        return "result.json is no object"
    holder, key = place
    how = source.choice(("set", "set", "set", "delete", "word", "deep"))
    if how == "delete":
        del holder[key]
    elif how == "deep":
        value: Any = holder[key]
        for _ in range(source.choice((1, 3, 300))):
            value = [value]
        holder[key] = value
    elif how == "set":
        holder[key] = source.choice(_VALUES)
    else:
        holder[key] = "@@"
    text = json.dumps(record)
    word = source.choice(("NaN", "-Infinity", "1e999", "9" * 5000, "01", "+1", "'a'", '"\\ud800"', "0x1", "[" * 5000))
    path.write_text(text.replace('"@@"', word))
    what = word[:20] if how == "word" else repr(holder[key])[:40] if how == "set" else how
    return f"result.json {where} {how} {what}"


def _any_place(record: Any, source: random.Random) -> tuple[str, tuple[Any, Any] | None]:
    """A place in nested lists and dictionaries; the upper ones are as likely as all below them."""
    value, where, place = record, "", None
    while isinstance(value, dict | list) and value:
        key = source.choice(list(value)) if isinstance(value, dict) else source.randrange(len(value))
        place, where, value = (value, key), f"{where}.{key}", value[key]
        if source.random() < 0.25:
            break
    return where[1:60], place


def _xml(folder: Path, source: random.Random) -> str:
    path = folder / source.choice(_XML)
    try:
        root = ElementTree.fromstring(_read(path).decode())
    except (ValueError, ElementTree.ParseError):
        return f"{path.name} was spoilt"
    element = source.choice(list(root.iter()))
    parents = {child: parent for parent in root.iter() for child in parent}
    how = source.choice(("set", "set", "set", "unset", "drop", "double", "rename", "add", "step", "deep"))
    what = f"<{element.tag} {element.get('name', '')}>"
    if how in ("set", "unset") and element.attrib:
        name = source.choice(list(element.attrib))
        what += f" {name}"
        if how == "unset":
            del element.attrib[name]
        else:
            words = element.attrib[name].split()
            if len(words) > 1 and source.random() < 0.5:
                words[source.randrange(len(words))] = source.choice(_WORDS)
                element.set(name, " ".join(words))
            else:
                element.set(name, source.choice(_WORDS))
            what += f"={element.get(name, '')[:40]!r}"
    elif how == "step" and (option := root.find("option")) is not None:
        option.set("timestep", source.choice(_TIMESTEPS))
        what = f"timestep={option.get('timestep')!r}"
    elif how == "add":
        word = source.choice(_ELEMENTS)
        element.insert(source.randrange(len(element) + 1), ElementTree.fromstring(word))
        what += f" {word}"
    elif how == "rename":
        element.tag = source.choice(("include", "mesh", "composite", "plugin", "body", "geom", "link", "joint", "x:y"))
    elif how == "deep":
        for _ in range(source.choice((10, 200))):
            inner = ElementTree.Element(element.tag, element.attrib)
            inner.extend(list(element))
            element[:] = [inner]
    elif element in parents:
        parents[element].remove(element) if how == "drop" else parents[element].append(element)
    path.write_bytes(re.sub(rb"&#(27|0);", b"", ElementTree.tostring(root)))
    return f"{path.name} {how} {what}"


def _npz(folder: Path, source: random.Random) -> str:
    path = folder / "motion.npz"
    try:
        with np.load(path) as file:
            arrays = {name: file[name] for name in file.files}
    except Exception:
        return "motion.npz was spoilt"
    name = source.choice(list(arrays))
    how = source.choice(list(_ARRAYS))
    raw: dict[str, bytes] = {}
    if how in ("huge header", "wide words", "lying header"):
        header = {
            "huge header": _header("<f8", (10**12, 3)),
            "wide words": _header("<U100000000", (3,)),
            "lying header": b"\x93NUMPY\x01\x00\x76\x00{'descr': '<f8', 'fortran_order': False, 'shape': (-1, 3)}",
        }[how]
        del arrays[name]
        raw[name] = header + bytes(64)
    elif how == "longer":
        arrays = {n: np.repeat(a, 400, axis=0) if len(a) == len(arrays["time"]) else a for n, a in arrays.items()}
        arrays["time"] = np.linspace(0, 1, len(arrays["time"]))
    else:
        try:
            changed = _ARRAYS[how](arrays[name].copy(), source)
        except (ValueError, TypeError, IndexError):
            changed = np.zeros(3)
        if changed is None:
            del arrays[name]
        else:
            arrays[name] = changed
    file_ = io.BytesIO()
    np.savez(file_, **arrays)
    if raw or how == "twice":
        with zipfile.ZipFile(file_, "a") as archive:
            for member, content in (raw or {name: _header("<f8", (0,))}).items():
                archive.writestr(f"{member}.npy", content)
    path.write_bytes(file_.getvalue())
    return f"motion.npz {name} {how}"


def _one(array: np.ndarray, source: random.Random, value: Any) -> np.ndarray:
    array.flat[source.randrange(array.size)] = value
    return array


_ARRAYS: dict[str, Callable[[np.ndarray, random.Random], np.ndarray | None]] = {
    "missing": lambda a, _: None,
    "objects": lambda a, _: a.astype(object),
    "complex": lambda a, _: a.astype(complex),
    "words": lambda a, _: a.astype(str),
    "bytes": lambda a, _: a.astype(bytes),
    "whole numbers": lambda a, _: a.astype(np.int8),
    "huge whole numbers": lambda a, _: np.full(a.shape, 2**63, np.uint64),
    "small floats": lambda a, _: a.astype(np.float16),
    "long floats": lambda a, _: a.astype(np.longdouble),
    "truth": lambda a, _: a.astype(bool),
    "dates": lambda a, _: np.zeros(a.shape, "M8[s]"),
    "records": lambda a, _: np.zeros(a.shape, [("x", "f8"), ("y", "i4")]),
    "big endian": lambda a, _: a.astype(a.dtype.newbyteorder(">")),
    "columns first": lambda a, _: np.asfortranarray(a),
    "transposed": lambda a, _: a.T,
    "flat": lambda a, _: a.ravel(),
    "empty": lambda a, _: a[:0],
    "a scalar": lambda a, _: a.flat[0],
    "deeper": lambda a, _: a[None],
    "shorter": lambda a, _: a[:-1],
    "one": lambda a, _: a[:1],
    "no columns": lambda a, _: a.reshape(len(a), -1)[:, :0],
    "nan": lambda a, s: _one(a, s, np.nan),
    "inf": lambda a, s: _one(a, s, -np.inf),
    "1e300": lambda a, s: _one(a, s, 1e300),
    "1e8": lambda a, s: _one(a, s, 1e8),
    "another number": lambda a, s: _one(a, s, s.uniform(-2, 2)),
    "another word": lambda a, s: _one(a.astype("U20"), s, s.choice(_WORDS)),
    "a little more": lambda a, s: _one(a, s, a.flat[0] + 1e-3),
    "zero": lambda a, _: np.zeros_like(a),
    "reversed": lambda a, _: a[::-1],
    "long words": lambda a, _: np.array(["w" * 200_000] * len(a)),
    **dict.fromkeys(("huge header", "wide words", "lying header", "twice", "longer"), lambda a, _: a),
}


def _lines(folder: Path, source: random.Random) -> str:
    """One value, or one line, of a text."""
    path = folder / source.choice(("task.yaml", "motion.csv"))
    lines = _read(path).decode("utf-8", "replace").split("\n")
    at, word = source.randrange(len(lines)), source.choice(_WORDS)
    how = source.choice(("value", "value", "drop", "double", "indent"))
    if how == "drop":
        del lines[at]
    elif how == "double":
        lines.insert(at, lines[at])
    elif how == "indent":
        lines[at] = f"  {lines[at]}"
    else:
        lines[at] = re.sub(r"(?<=[:,] )[^,]*|(?<=,)[^,]*|(?<=- ).*", lambda _: word, lines[at], count=1)
    path.write_text("\n".join(lines), encoding="utf-8", errors="replace")
    return f"{path.name}:{at + 1} {how} {word[:40]!r}"


_KINDS = (_truncated, _flipped, _foreign, _json, _xml, _npz, _lines)
_CHANCES = (10, 15, 10, 20, 25, 20, 10)
