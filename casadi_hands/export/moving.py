"""A design's files: moved into the place of others together, or one by one."""

from __future__ import annotations

import ctypes
import errno
import os
import shutil
import sys
from collections.abc import Callable
from pathlib import Path

from casadi_hands.export.meshes import FOLDER

LAST = "result.json"
"""The file that makes a folder complete."""

FILES = (
    "task.yaml",
    "hand.urdf",
    "object.urdf",
    "scene.xml",
    "motion.npz",
    "motion.csv",
    "placement.json",
    LAST,
    "viewer.html",
    "report.html",
)
"""A design's files; whatever else is in its folder stays there."""

_MESHES = "object*.obj"
_AT_FDCWD = -100
_EXCHANGE = 2  # RENAME_EXCHANGE of Linux, RENAME_SWAP of macOS


def replace_file(path: Path, write: Callable[[Path], object]) -> None:
    """Write one file so that whoever reads it finds the old one or the new one, whole, with the rights it had.

    Args:
        path: the file.
        write: writes the new one to the path that it is given.

    Raises:
        OSError: it cannot be written; the old one stays.
    """
    made = path.with_name(f".{path.name}.{os.getpid()}")
    try:
        write(made)
        if path.exists():
            shutil.copymode(path, made)
        to_disk(made)
        os.replace(made, path)
    finally:
        made.unlink(missing_ok=True)


def remove_files(directory: Path) -> None:
    """Remove a design's files from a folder, and the meshes that it has of the object.

    Raises:
        OSError: they cannot be removed.
    """
    for name in (LAST, *FILES):
        (directory / name).unlink(missing_ok=True)
    meshes = directory / FOLDER
    if meshes.is_dir():
        for path in meshes.glob(_MESHES):
            path.unlink()
        if not any(meshes.iterdir()):
            meshes.rmdir()


def clear_away(made: Path, directory: Path) -> None:
    """Remove a folder that was being written, or the old one that was exchanged for it.

    Args:
        made: the folder.
        directory: where what is not of a design goes, if it is not there yet.
    """
    if not made.is_dir():
        made.unlink(missing_ok=True)
        return
    remove_files(made)
    if directory.is_dir():
        _move_into(made, directory)
    shutil.rmtree(made, ignore_errors=True)


def _move_into(source: Path, target: Path) -> None:
    """Move what is in one folder into another that has none of that name; folders that both have, likewise."""
    for each in source.iterdir():
        there = target / each.name
        if not os.path.lexists(there):
            os.rename(each, there)
        elif each.is_dir() and there.is_dir() and not there.is_symlink():
            _move_into(each, there)


def move_files(made: Path, directory: Path) -> None:
    """Move files one by one, the one that makes the folder complete last."""
    (directory / LAST).unlink(missing_ok=True)
    remove_files(directory)
    last = made.with_name(f"{made.name}.{LAST}")
    os.rename(made / LAST, last)
    _move_into(made, directory)
    os.rename(last, directory / LAST)


def exchange(one: Path, other: Path) -> None:
    """Let two folders change places in one step.

    Raises:
        OSError: the file system or the kernel cannot.
    """
    libc = ctypes.CDLL(None, use_errno=True)
    paths = os.fsencode(one), os.fsencode(other)
    try:
        if sys.platform == "darwin":
            failed = libc.renamex_np(*paths, ctypes.c_uint(_EXCHANGE))
        else:
            failed = libc.renameat2(_AT_FDCWD, paths[0], _AT_FDCWD, paths[1], ctypes.c_uint(_EXCHANGE))
    except AttributeError as error:
        raise OSError(errno.ENOSYS, os.strerror(errno.ENOSYS)) from error
    if failed:
        number = ctypes.get_errno()
        raise OSError(number, os.strerror(number))


def to_disk(file: Path) -> None:
    """Have a file written out: some file systems say only then that there is no room."""
    with file.open("rb") as opened:
        os.fsync(opened.fileno())
