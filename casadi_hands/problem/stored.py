"""Files of a result folder, which may be anybody's: read within bounds, as text, JSON and arrays, and run never."""

from __future__ import annotations

import io
import json
import math
import stat
import struct
import zipfile
import zlib
from collections.abc import Collection
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.task import Task

LARGEST_TEXT = 8 << 20
"""Bytes of a text; that of a hand of eight fingers and thirty joints takes less than one million."""
LARGEST_ARRAYS = 32 << 20
"""Bytes of a motion, packed and unpacked; that of ten thousand samples of such a hand takes less."""
LARGEST_NUMBER = 1e9
"""No number of a hand, in SI units, is larger."""

_LARGEST_DIRECTORY = 1 << 16
_LONGEST_WORD = 200
_DENSEST = 8
"""Times as many samples as the task's time step asks for: intervals are halved where something happens between them."""


def most_samples(task: Task) -> int:
    """How many samples a motion of this task can have at most.

    Args:
        task: whose time step says how many it has at least.
    """
    keyframes = (task.keyframes_between + 1) * (len(task.motion) + 2 * len(task.perturbations) + 1)
    return _DENSEST * (math.ceil(task.duration / task.time_step) + keyframes + 1)


def check_samples(path: Path, samples: int, task: Task) -> None:
    """Refuse a motion that would take minutes to read.

    Raises:
        DesignError: it has more samples than any of this task.
    """
    if samples > (most := most_samples(task)):
        raise DesignError(f"{path}: has {samples} samples; a motion of this task has at most {most}")


def read_bytes(path: Path, most: int) -> bytes:
    """Return a file's content.

    Raises:
        DesignError: it is missing, no file (a pipe, a device, a folder), cannot be read, or has more
            than ``most`` bytes.
    """
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise DesignError(f"{path}: is no file")
        with path.open("rb") as file:
            content = file.read(most + 1)
    except FileNotFoundError:
        raise DesignError(f"{path}: missing") from None
    except (OSError, ValueError) as error:
        raise DesignError(f"{path}: cannot be read: {error}") from None
    if len(content) > most:
        raise DesignError(f"{path}: larger than {most >> 20} MB, which none of a hand is")
    return content


def read_text(path: Path) -> str:
    """Return a text file's content, without the mark of its encoding that some editors begin it with.

    Raises:
        DesignError: as `read_bytes`, or it is not UTF-8.
    """
    try:
        return read_bytes(path, LARGEST_TEXT).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise DesignError(f"{path}: not text in UTF-8: {error.reason} at byte {error.start}") from None


def read_json(path: Path) -> Any:
    """Return what a JSON file holds.

    Raises:
        DesignError: as `read_text`, or it is not JSON, gives a name twice, or holds a number that is not finite or half
            a character.
    """

    def constant(word: str) -> float:
        raise ValueError(f"it holds {word}, not a finite number")

    def once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
        found: dict[str, Any] = {}
        for name, value in pairs:
            if name in found:
                raise ValueError(f"it gives '{name[:60]}' twice; one would shadow the other")
            found[name] = value
        return found

    def finite(word: str) -> float:
        value = float(word)
        return value if math.isfinite(value) else constant(word[:20])

    text = read_text(path)
    try:
        value = json.loads(text, parse_constant=constant, parse_float=finite, object_pairs_hook=once)
        json.dumps(value, ensure_ascii=False).encode("utf-8")
    except (ValueError, RecursionError, MemoryError) as error:
        raise DesignError(f"{path}: cannot be read: {error}") from None
    return value


def read_arrays(path: Path, names: Collection[str]) -> dict[str, np.ndarray]:
    """Return the arrays of a NumPy archive that have these names; what each claims to be is looked at first.

    Raises:
        DesignError: as `read_bytes`, or it is not such an archive, holds a name twice, is large unpacked, or an array
            is of anything but numbers, truth and printable words.
    """
    content = read_bytes(path, LARGEST_ARRAYS)
    try:
        # The directory is at the end, and its size is stated in the record behind it.
        end = content.rfind(b"PK\x05\x06", max(0, len(content) - (1 << 16) - 22))
        if end < 0:
            raise DesignError(f"{path}: not a NumPy archive: it is no zip file, or its end is missing")
        if struct.unpack_from("<I", content, end + 12)[0] > _LARGEST_DIRECTORY:
            raise DesignError(f"{path}: holds more files than any motion")
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            entries = archive.infolist()
            given = [entry.filename.removesuffix(".npy") for entry in entries]
            if twice := sorted({name for name in given if given.count(name) > 1}):
                raise DesignError(f"{path}: holds {', '.join(twice)} twice; one would shadow the other")
            if sum(entry.file_size for entry in entries) > LARGEST_ARRAYS:
                raise DesignError(f"{path}: unpacked it takes more than {LARGEST_ARRAYS >> 20} MB; no motion does")
            return {
                name: _array(path, name, _unpacked(path, archive, entry))
                for name, entry in zip(given, entries, strict=True)
                if name in names
            }
    # What zipfile and NumPy raise on what is none of theirs.
    except (
        *(OSError, ValueError, KeyError, EOFError, MemoryError, RuntimeError, OverflowError, SyntaxError, TypeError),
        *(zipfile.BadZipFile, zlib.error, struct.error),
    ) as error:
        raise DesignError(f"{path}: not a NumPy archive: {error}") from None


def _unpacked(path: Path, archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bytes:
    # The others unpack whatever there is at once, whatever their entry states.
    if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise DesignError(f"{path}: {entry.filename} is packed in a way that NumPy does not pack")
    with archive.open(entry) as file:
        content = file.read(entry.file_size + 1)
        return content + file.read(1)  # which checks the sum


def _array(path: Path, name: str, content: bytes) -> np.ndarray:
    """Return an array; its header is compared with its length before memory is asked for.

    Raises:
        DesignError: it holds anything but numbers, truth or words, or not as many as it says.
    """
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    if version not in ((1, 0), (2, 0)):
        raise DesignError(f"{path}: {name} is of a version of NumPy's format that it needs for no plain array")
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, kind = read_header(file)
    if kind.kind not in "bfiuU" or kind.names is not None:
        raise DesignError(f"{path}: {name} holds {str(kind)[:60]}, not real numbers, truth or words")
    count, size = math.prod(shape), len(content) - file.tell()
    if min(shape, default=0) < 0 or count * kind.itemsize != size or count > len(content):
        raise DesignError(f"{path}: {name} says that it has the shape {str(shape)[:60]}, and holds {size} bytes")
    if kind.kind == "U" and kind.itemsize > 4 * _LONGEST_WORD:
        raise DesignError(f"{path}: {name} holds words of more than {_LONGEST_WORD} letters")
    array = np.asarray(np.lib.format.read_array(io.BytesIO(content), allow_pickle=False))
    if kind.kind == "U" and not all(str(word).isprintable() for word in array.flat):
        raise DesignError(f"{path}: {name} holds a word with control characters")
    return array
