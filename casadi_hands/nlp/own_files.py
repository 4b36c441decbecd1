"""Files that run as code when they are loaded: whether they are the user's own, so that nobody else chose what runs."""

from __future__ import annotations

import os
import shutil
import stat
import tempfile
from multiprocessing import util
from pathlib import Path

_OTHERS = stat.S_IWGRP | stat.S_IWOTH


def why_not_own(path: Path) -> str:
    """Say why a file or a folder is not the user's alone; empty where it is.

    Args:
        path: a link is not followed, since it is whose it is, and what it leads to may be anybody's.

    Raises:
        OSError: there is nothing, or it cannot be looked at.
    """
    found = path.lstat()
    if stat.S_ISLNK(found.st_mode):
        return f"{path} is a link"
    if found.st_uid != os.geteuid():
        return f"{path} belongs to another user"
    if found.st_mode & _OTHERS:
        return f"others can write {path} (chmod go-w)"
    return ""


def why_not_own_folder(folder: Path) -> str:
    """Say why a folder is not the user's alone, or could be exchanged by others; empty where neither.

    Args:
        folder: absolute; links on the way to it are followed.

    Raises:
        OSError: there is none.
    """
    real = folder.resolve(strict=True)
    if why := why_not_own(real):
        return why
    for above in real.parents:
        mode = above.stat().st_mode
        if mode & stat.S_IWOTH and not mode & stat.S_ISVTX:
            return f"all can write {above}"
    return ""


def private_folder() -> Path:
    """Make a folder that only the user can read and write; it is removed when this process ends."""
    folder = Path(tempfile.mkdtemp(prefix="casadi-hands-"))
    # Which, unlike atexit, also holds in processes that a pool has started; of this one alone, not of its forks.
    util.Finalize(None, _remove, (folder, os.getpid()), exitpriority=0)
    return folder


def _remove(folder: Path, owner: int) -> None:
    if os.getpid() == owner:
        shutil.rmtree(folder, ignore_errors=True)
