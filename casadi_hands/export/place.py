"""Folders that are written beside and moved into place, by one process at a time.

Beside a folder ``NAME`` stands ``.NAME.solve`` while somebody works for it: with a lock, which the kernel frees when
the process ends, with what is being written, and with whatever else its owner keeps there. Where no folder can be made
beside it (a mount point, a parent that is read-only), it stands within as ``.solve``.
"""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import shutil
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from itertools import count
from pathlib import Path

from casadi_hands.errors import ELSEWHERE, DesignError
from casadi_hands.export.moving import clear_away, exchange, move_files, to_disk

_LOCK, _NEXT = "lock", "next-"
_LONGEST = 200  # bytes of a folder's name that are in that of the one beside it
_NO_LOCKS = {errno.ENOLCK, errno.ENOSYS, errno.EOPNOTSUPP}
_owned: dict[Path, Path] = {}
_numbers = count()


def resolved(directory: Path) -> Path:
    """The folder itself, whatever links lead to it.

    Raises:
        DesignError: no folder can have this name.
    """
    try:
        found = directory.resolve()
        if os.path.lexists(found) and not found.is_dir():
            raise DesignError(f"{shown(directory)}: cannot write the design here: it is a file", ELSEWHERE)
        with suppress(FileNotFoundError):
            found.stat()
    except (OSError, RuntimeError, ValueError) as error:
        raise DesignError(f"{shown(directory)}: cannot write the design here: {_why(error)}", ELSEWHERE) from error
    return found


def beside(directory: Path) -> Path:
    """Where one works for a folder: beside it, or within it where nothing can be made beside it."""
    if directory.is_dir() and (os.path.ismount(directory) or not os.access(directory.parent, os.W_OK)):
        return directory / ".solve"
    name = directory.name
    if len(name.encode()) > _LONGEST:
        name = f"{name[:40]}-{hashlib.sha256(name.encode()).hexdigest()[:16]}"
    return directory.parent / f".{name}.solve"


@contextmanager
def owned(directory: Path) -> Iterator[Path]:
    """Be the only process that writes a folder, and have a place beside it, which is removed unless it is used.

    Leftovers of a process that was killed while it wrote are cleared away. A process that owns a folder may own it
    again.

    Args:
        directory: need not exist.

    Yields:
        The place: a folder.

    Raises:
        DesignError: another process writes it, or it cannot be written.
    """
    directory = resolved(directory)
    if directory in _owned:
        yield _owned[directory]
        return
    place = beside(directory)
    try:
        lock = _locked(directory, place)
    except OSError as error:
        raise DesignError(f"{shown(directory)}: cannot write the design here: {_why(error)}", ELSEWHERE) from error
    _owned[directory] = place
    try:
        _clear(place, directory)
        yield place
    finally:
        del _owned[directory]
        _release(place)
        os.close(lock)


def leave_owned(keep: Callable[[Path], None]) -> None:
    """Clear away what this process was writing, because it ends at once.

    Args:
        keep: told of each place of a folder that is owned; decides what stays in it.
    """
    for directory, place in _owned.items():
        with suppress(OSError):
            _clear(place, directory)
            keep(place)
            _release(place)


def _locked(directory: Path, place: Path) -> int:
    """The file that is locked, open."""
    if directory.is_dir() and not os.access(directory, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES))
    while True:
        place.mkdir(parents=True, exist_ok=True)
        file = os.open(place / _LOCK, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            # Who has just left may have removed it.
            if os.path.samestat(os.fstat(file), os.stat(place / _LOCK)):
                os.ftruncate(file, 0)
                os.write(file, f"{os.getpid()}\n".encode())
                return file
        except BlockingIOError:
            with suppress(OSError):
                other = os.read(file, 20).decode(errors="replace").strip()
            os.close(file)
            who = f" (process {other})" if other.isdigit() else ""
            raise DesignError(
                f"{directory}: another solve{who} is writing here; wait for it, or give another folder (--out)",
                "",
            ) from None
        except FileNotFoundError:
            pass
        except OSError as error:
            if error.errno in _NO_LOCKS:  # as some file systems of networks have none
                return file
            os.close(file)
            raise
        os.close(file)


def _clear(place: Path, directory: Path) -> None:
    """Clear away what a process that was killed was writing."""
    for each in place.iterdir():
        if each.name.startswith(_NEXT):
            clear_away(each, directory)


def _release(place: Path) -> None:
    """Remove the place if nothing else is in it."""
    with suppress(OSError):
        if {each.name for each in place.iterdir()} == {_LOCK}:
            (place / _LOCK).unlink()
            place.rmdir()


def replace_folder(directory: Path, write: Callable[[Path], object]) -> None:
    """Write a design's files so that whoever reads them finds all of the old ones or all of the new ones.

    Where the file system cannot exchange folders, there is a moment without ``result.json``: with nothing complete.

    Args:
        directory: made if it does not exist.
        write: writes the new files into the folder that it is given.

    Raises:
        DesignError: another process writes there.
        OSError: it cannot be written; it is as it was then.
    """
    directory = resolved(directory)
    with owned(directory) as place:
        made = place / f"{_NEXT}{next(_numbers)}"
        made.mkdir()
        try:
            write(made)
            for each in made.rglob("*"):
                if each.is_file():
                    to_disk(each)
            if not directory.exists():
                os.rename(made, directory)
                return
            shutil.copymode(directory, made)
            try:
                if place.parent == directory:
                    raise OSError(errno.EINVAL, os.strerror(errno.EINVAL))
                exchange(made, directory)
            except OSError:
                move_files(made, directory)
        finally:
            clear_away(made, directory)


def shown(directory: Path) -> str:
    """A path for a message, long ones cut short."""
    text = str(directory)
    return text if len(text) <= 120 else f"{text[:60]}…{text[-40:]}"


def _why(error: Exception) -> str:
    """What the system says, without the path, which may be long."""
    return (isinstance(error, OSError) and error.strerror) or str(error)
