"""Kernels as machine code: C from CasADi, a C compiler, and a cache on disk keyed by content.

Interpreted kernels give the same numbers, several times slower; they serve where there is no compiler.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import logging
import os
import shutil
import subprocess
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import casadi as ca
from casadi import Function

log = logging.getLogger(__name__)
# No contraction of a*b+c: a compiled kernel rounds as the interpreted one does.
_FLAGS = ("-fPIC", "-shared", "-ffp-contract=off")
_LARGE = 20_000  # instructions beyond which optimising takes longer than it will ever save


@cache
def compiler() -> str | None:
    """Path of the C compiler: ``$CC``, cc, gcc or clang; None where there is none."""
    names = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    found = next((path for name in names if name and (path := shutil.which(name))), None)
    if found is None:
        log.warning("no C compiler found: kernels are interpreted, which is several times slower")
    return found


def cache_folder() -> Path:
    """Where compiled kernels are kept: ``$CASADI_HANDS_CACHE``, else the user's cache folder."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    folder = Path(os.environ.get("CASADI_HANDS_CACHE") or Path(base) / "casadi-hands")
    folder.mkdir(parents=True, exist_ok=True)
    return folder


def compiled(name: str, functions: dict[str, Function]) -> dict[str, Function]:
    """The same functions as machine code, or as they are where they cannot be compiled.

    Args:
        name: of the kernel, for the log.
        functions: by role; each with a CasADi name of its own.
    """
    if compiler() is None:
        return functions
    content = "\n".join(function.serialize() for function in functions.values())
    flags = ("-O0" if sum(f.n_instructions() for f in functions.values()) > _LARGE else "-O1", *_FLAGS)
    key = hashlib.sha256("|".join((content, ca.CasadiMeta.version(), *flags)).encode()).hexdigest()[:24]
    try:
        library = cache_folder() / f"{key}.so"
        if not library.exists():
            with _locked(library.with_suffix(".lock")):
                if not library.exists():
                    _build(functions, library, flags)
        return {role: ca.external(function.name(), str(library)) for role, function in functions.items()}
    except (OSError, subprocess.SubprocessError, RuntimeError) as error:
        log.warning("kernel '%s' is interpreted, it could not be compiled: %s", name, error)
        return functions


def _build(functions: dict[str, Function], library: Path, flags: tuple[str, ...]) -> None:
    """Write C, compile it, and put the library in place in one step."""
    with tempfile.TemporaryDirectory(dir=library.parent) as scratch:
        generator = ca.CodeGenerator("kernel.c")
        for function in functions.values():
            generator.add(function)
        generator.generate(scratch + os.sep)
        built = Path(scratch) / "kernel.so"
        command = [str(compiler()), *flags, "kernel.c", "-o", built.name, "-lm"]
        subprocess.run(command, cwd=scratch, check=True, capture_output=True)
        built.replace(library)


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock that other processes wait for."""
    with path.open("w") as handle:
        fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    path.unlink(missing_ok=True)
