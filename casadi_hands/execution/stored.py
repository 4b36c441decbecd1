"""Values as bytes and back, bit for bit, by a format that can hold data and nothing that runs.

A zip file as NumPy writes them: the content of all arrays, end to end, and a tree of all else in JSON. Objects are the
package's own data classes and named tuples, made anew of their fields; what was one object in several places is one
again.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from typing import Any

import numpy as np

_PACKAGE = __name__.partition(".")[0]
_TREE, _CONTENT = "tree", "content"
_KINDS = "biufcSU"  # of NumPy's types: numbers, truth, and words
_LARGEST = 2**30  # bytes, unpacked: a solve's units have millions at most


class NotStoredError(ValueError):
    """Bytes that are not a stored value, or one that this version does not know."""


def pack(value: Any) -> bytes:
    """A value as bytes.

    Args:
        value: of numbers, strings, arrays, lists, tuples, dictionaries, and data classes and named tuples of this
            package.

    Raises:
        TypeError: it holds something else.
    """
    packer = _Packer()
    root = packer.add(value)
    tree = json.dumps([root, packer.nodes]).encode()
    file = io.BytesIO()
    # With an array each, reading takes twice as long.
    parts = {_TREE: tree, _CONTENT: b"".join(packer.content)}
    np.savez(file, **{name: np.frombuffer(data, np.uint8) for name, data in parts.items()})  # type: ignore[arg-type]
    return file.getvalue()


def unpack(data: bytes) -> Any:
    """The value that was packed.

    Raises:
        NotStoredError: it cannot be read.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            if sum(entry.file_size for entry in archive.infolist()) > _LARGEST:
                raise ValueError("it is too large")
        with np.load(io.BytesIO(data), allow_pickle=False) as file:
            tree, content = file[_TREE].tobytes(), file[_CONTENT].tobytes()
        root, nodes = json.loads(tree)
        return _Unpacker(nodes, content).value(root)
    except (
        OSError,
        EOFError,
        ValueError,
        LookupError,
        TypeError,
        AttributeError,
        ImportError,
        RecursionError,
        MemoryError,
        zipfile.BadZipFile,
    ) as error:
        raise NotStoredError(f"not a stored value: {error}") from error


class _Packer:
    """Nodes of a tree: plain values stand where they are, all else is in a table, by its number."""

    def __init__(self) -> None:
        self.nodes: list[Any] = []
        self.content: list[bytes] = []
        self._length = 0
        self._known: dict[int, int] = {}
        self._alive: list[Any] = []  # while it is packed: the numbers of objects are used again

    def add(self, value: Any) -> Any:
        """The value, or ``[number]`` of its node."""
        if value is None or type(value) in (bool, int, float, str):
            return value
        if id(value) not in self._known:
            node = self._node(value)
            self._known[id(value)] = len(self.nodes)
            self._alive.append(value)
            self.nodes.append(node)
        return [self._known[id(value)]]

    def _node(self, value: Any) -> list[Any]:
        kind = type(value)
        if kind is np.ndarray and value.dtype.kind in _KINDS:
            return ["array", *self._array(value)]
        if isinstance(value, np.generic) and value.dtype.kind in _KINDS:
            return ["scalar", *self._array(np.asarray(value))]
        if kind in (list, tuple):
            return [kind.__name__, [self.add(item) for item in value]]
        if kind.__module__.partition(".")[0] == _PACKAGE:
            named = _named(kind)
            name = [named.__module__, named.__qualname__]
            if is_dataclass(value):
                entries = {item.name: self.add(getattr(value, item.name)) for item in fields(value) if item.init}
                return ["object", name, entries]
            if isinstance(value, tuple) and hasattr(value, "_fields"):
                return ["object", name, {n: self.add(v) for n, v in zip(value._fields, value, strict=True)}]
        if isinstance(value, Mapping):
            return ["dict", [[self.add(key), self.add(item)] for key, item in value.items()]]
        raise TypeError(f"{kind.__module__}.{kind.__qualname__} cannot be stored")

    def _array(self, array: np.ndarray) -> list[Any]:
        """Type, place and shape of an array's content, in the order of its axes in memory, and that order."""
        order = sorted(range(array.ndim), key=lambda axis: -abs(array.strides[axis]))
        stored, place = array.transpose(order), self._length
        self.content.append(stored.tobytes())
        self._length += array.nbytes
        return [array.dtype.str, place, stored.shape, order]


class _Unpacker:
    def __init__(self, nodes: list[Any], content: bytes) -> None:
        self._nodes, self._content = nodes, content
        self._made: list[Any] = []

    def value(self, root: Any) -> Any:
        # A node comes after those that it holds.
        for node in self._nodes:
            self._made.append(self._object(node))
        return self._item(root)

    def _item(self, item: Any) -> Any:
        if not isinstance(item, list):
            return item
        (number,) = item
        return self._made[number]

    def _object(self, node: list[Any]) -> Any:
        match node:
            case ["array" | "scalar" as kind, str(name), place, shape, order]:
                dtype = np.dtype(name)
                if dtype.kind not in _KINDS or not dtype.itemsize or place < 0:
                    raise ValueError(f"an array of {name[:40]} at {place}")
                stored = np.ndarray(shape, dtype, self._content, place).copy()  # its own, as all arrays are
                array = stored.transpose(np.argsort(order)) if len(order) > 1 else stored
                return array if kind == "array" else array[()]
            case ["list", items]:
                return [self._item(item) for item in items]
            case ["tuple", items]:
                return tuple(self._item(item) for item in items)
            case ["dict", items]:
                return {self._item(key): self._item(item) for key, item in items}
            case ["object", [module, name], entries]:
                return _data_class(module, name)(**{key: self._item(item) for key, item in entries.items()})
        raise ValueError(f"an unknown kind of value: {str(node)[:40]}")


def _named(kind: type) -> type:
    """The class, or where it was made by one that its module names, from whose fields it is made anew, that one."""
    for each in kind.__mro__:
        if getattr(import_module(each.__module__), each.__qualname__, None) is each:
            break
    return each


def _data_class(module: str, name: str) -> type:
    """A class of this package that holds data."""
    if module.partition(".")[0] != _PACKAGE:
        raise ValueError(f"{module} is not of this package")
    found = getattr(import_module(module), name)
    if isinstance(found, type) and (is_dataclass(found) or (issubclass(found, tuple) and hasattr(found, "_fields"))):
        return found
    raise ValueError(f"{module}.{name} holds no data")
