"""Parts of meshes kept on disk: only what this user wrote is read, and nothing of it is run."""

from __future__ import annotations

import contextlib
import hashlib
import os
import stat
import tempfile
import zipfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from casadi_hands.cache import cache_folder

Arrays = dict[str, NDArray[Any]]


def key_of(*content: object) -> str:
    """A name for what follows from some arrays, numbers and words."""
    digest = hashlib.sha256()
    for each in content:
        part = each.tobytes() if isinstance(each, np.ndarray) else repr(each).encode()
        digest.update(f"{len(part)}:".encode() + part)
    return digest.hexdigest()


def load(key: str) -> Arrays | None:
    """The arrays kept under a name; None where there are none, or where they are not this user's or not whole."""
    try:
        path = _path(key)
        with path.open("rb") as file:
            status = os.fstat(file.fileno())
            if hasattr(os, "getuid") and (
                status.st_uid != os.getuid() or status.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
            ):
                return None
            with np.load(file, allow_pickle=False) as archive:
                found = {name: archive[name] for name in archive.files}
    except (OSError, RuntimeError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error):
        return None
    return found if str(found.pop("key", "")) == key else None


def keep(key: str, arrays: Arrays) -> None:
    """Keep arrays under a name where that is possible; whoever reads meanwhile finds all or nothing."""
    with contextlib.suppress(OSError, RuntimeError):
        path, everything = _path(key), dict[str, Any](arrays, key=np.array(key))
        for folder in (cache_folder(), path.parent):  # kernels are kept where nobody else can write
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        handle, name = tempfile.mkstemp(dir=path.parent)
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, **everything)
            Path(name).replace(path)
        except BaseException:
            Path(name).unlink(missing_ok=True)
            raise


def _path(key: str) -> Path:
    return cache_folder() / "meshes" / f"{key}.npz"
