"""What the files of a result folder say, spoilt: values of JSON, elements of XML, arrays, and lines of text."""

from __future__ import annotations

import io
import json
import random
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
from mutant_files import npy_header, read

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


def json_value(folder: Path, source: random.Random) -> str:
    """Change a value of ``result.json``, and return which and how."""
    path = folder / "result.json"
    try:
        record = json.loads(read(path))
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


def xml_element(folder: Path, source: random.Random) -> str:
    """Change an element of a hand, an object or a scene, and return which and how."""
    path = folder / source.choice(_XML)
    try:
        root = ElementTree.fromstring(read(path).decode())
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


def npz_array(folder: Path, source: random.Random) -> str:
    """Change an array of ``motion.npz``, and return which and how."""
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
            "huge header": npy_header("<f8", (10**12, 3)),
            "wide words": npy_header("<U100000000", (3,)),
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
            for member, content in (raw or {name: npy_header("<f8", (0,))}).items():
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


def text_line(folder: Path, source: random.Random) -> str:
    """Change a value or a line of a text, and return which and how."""
    path = folder / source.choice(("task.yaml", "motion.csv"))
    lines = read(path).decode("utf-8", "replace").split("\n")
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
