"""Kernels as machine code: C from CasADi, a C compiler, and a cache on disk that is checked before it is used.

Beside each library lies a record of its content. A library that does not match its record is never mapped: a
truncated one would end the process with SIGBUS, which Python cannot catch. Interpreted kernels give the same
numbers, several times slower; they serve where nothing can be compiled or kept.

A library runs as the user's own code, so one is loaded only from a folder that nobody else can write. Where the cache
is none, kernels are compiled into a private folder, which is removed at the end.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import logging
import multiprocessing
import os
import platform
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import casadi as ca
from casadi import Function

from casadi_hands.cache import cache_folder
from casadi_hands.nlp.own_files import private_folder, why_not_own, why_not_own_folder
from casadi_hands.nlp.patience import end_all, run

log = logging.getLogger(__name__)
# No contraction of a*b+c: a compiled kernel rounds as the interpreted one does.
_FLAGS = ("-fPIC", "-shared", "-ffp-contract=off")
_OPTIMISED = ("-O1", "-Og")  # the second beyond so many instructions: more takes longer than it will ever save
_LARGE = 20_000
_reported: set[type[Exception]] = set()
_given_up: set[str] = set()
PATIENCE, VERSION_PATIENCE = 300.0, 30.0
"""s that a compiler may take for a kernel, the largest of which takes some ten, and to say which it is."""


@cache
def compiler() -> str | None:
    """Path of the C compiler: ``$CC``, cc, gcc or clang; None where there is none."""
    names = [os.environ.get("CC", ""), "cc", "gcc", "clang"]
    found = next((path for name in names if name and (path := shutil.which(name))), None)
    if found is None:
        # Once is enough: workers' parents need kernels, too.
        level = logging.WARNING if multiprocessing.parent_process() is None else logging.INFO
        log.log(level, "no C compiler found: kernels are interpreted, which is several times slower")
    return found


@dataclass(frozen=True)
class Source:
    """Functions of a kernel that are to be compiled.

    Attributes:
        name: of the kernel, for the log.
        content: all that decides what the functions compute.
        roles: their names.
        write: gives them by role, each with its role as CasADi name; not called where a library is kept.
    """

    name: str
    content: str
    roles: Sequence[str]
    write: Callable[[], dict[str, Function]]


def compiled(sources: Sequence[Source]) -> list[dict[str, Function]]:
    """Functions of each source as machine code, or as they are written where they cannot be compiled, kept or loaded.

    What is in the cache is loaded; the rest is compiled side by side, with a compiler for each processor.
    """
    c_compiler = compiler()
    if c_compiler is None:
        return [source.write() for source in sources]
    # Threads only wait for compilers: CasADi's symbols are not made for several at once.
    threads = ThreadPoolExecutor(_processors())
    try:
        begun = [_begun(source, c_compiler, threads) for source in sources]
        return [finish() for finish in begun]
    finally:
        # At once where the user interrupts; else nothing is left to wait for.
        end_all()
        threads.shutdown(wait=False, cancel_futures=True)


def _processors() -> int:
    """How many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _begun(source: Source, c_compiler: str, threads: ThreadPoolExecutor) -> Callable[[], dict[str, Function]]:
    """Load a source's library or start to compile it; what is returned gives its functions."""
    try:
        library = _own_folder() / f"{_key(source.content, c_compiler)}.so"
        if _intact(library):
            loaded = _load(source, library)
            return lambda: loaded
    except (OSError, RuntimeError, subprocess.SubprocessError) as error:
        _report(source.name, error)
        return source.write
    functions = source.write()
    large = sum(function.n_instructions() for function in functions.values()) > _LARGE
    command = (c_compiler, _OPTIMISED[large], *_FLAGS)
    made = threads.submit(_make, source.name, _c_code(functions), library, command)

    def finish() -> dict[str, Function]:
        try:
            made.result()
            return _load(source, library)
        except (OSError, subprocess.SubprocessError, RuntimeError) as error:
            _report(source.name, error)
            return functions

    return finish


def _own_folder() -> Path:
    """The cache's folder where it is the user's alone, else a private one, for the processes that this one starts too.

    Raises:
        OSError: it cannot be made.
        RuntimeError: the user has no home folder.
    """
    folder = cache_folder()
    folder.mkdir(mode=0o700, parents=True, exist_ok=True)
    if why := why_not_own_folder(folder):
        private = private_folder()
        os.environ["CASADI_HANDS_CACHE"] = str(private)
        log.warning("the cache of compiled kernels is not used, and kernels are compiled anew for this once: %s", why)
        return private
    return folder


def _load(source: Source, library: Path) -> dict[str, Function]:
    return {role: ca.external(role, str(library)) for role in source.roles}


def _make(name: str, c_code: str, library: Path, command: tuple[str, ...]) -> None:
    with _locked(library.with_suffix(".lock")):
        _build_unless_intact(name, c_code, library, command)


def _report(name: str, error: Exception) -> None:
    """Say why kernels are interpreted: once for each kind of error, since most concern every kernel alike."""
    level = logging.DEBUG if type(error) in _reported else logging.WARNING
    _reported.add(type(error))
    words = str(error)
    if isinstance(error, subprocess.CalledProcessError):
        words = f"{error.cmd[0]} failed: {error.stderr[:300]}"
    if isinstance(error, subprocess.TimeoutExpired):
        words = f"{error.cmd[0]} has not returned for {error.timeout:g} s and is given up"
    words = " ".join(words.split())
    log.log(level, "kernels are interpreted, which is several times slower; '%s': %s", name, words)


def _key(content: str, c_compiler: str) -> str:
    """Name of a library: a hash of all that decides what is in it and whether it can run here."""
    parts = (content, *_FLAGS, *_OPTIMISED, str(_LARGE), _toolchain(c_compiler))
    return hashlib.sha256("|".join(parts).encode()).hexdigest()[:24]


@cache
def _toolchain(c_compiler: str) -> str:
    """The compiler, the CasADi that writes the C, the machine and its C library, each with its version."""
    try:
        version = _run([c_compiler, "--version"], None, VERSION_PATIENCE)
    except subprocess.CalledProcessError as error:
        version = str(error.stdout)
    machine = (sys.platform, platform.machine(), str(sys.maxsize), *platform.libc_ver())
    return "|".join((c_compiler, version, ca.CasadiMeta.version(), ca.CasadiMeta.git_revision(), *machine))


def _record(library: Path, name: str) -> bytes:
    """A library's content and its name in a line, as ``sha256sum`` writes it."""
    return f"{hashlib.sha256(library.read_bytes()).hexdigest()}  {name}\n".encode()


def _intact(library: Path) -> bool:
    """Whether a library is what its record says, and both are the user's alone."""
    try:
        if any(why_not_own(path) for path in (library, library.with_suffix(".sha256"))):
            return False
        return library.with_suffix(".sha256").read_bytes() == _record(library, library.name)
    except OSError:
        return False


def _build_unless_intact(name: str, c_code: str, library: Path, command: tuple[str, ...]) -> None:
    """Build a library, unless another process did while this one waited for the lock."""
    if _intact(library):
        return
    if library.exists():
        how = "is damaged" if not why_not_own(library) else "could be another's"
        log.warning("kernel '%s' is compiled again: its library in the cache %s: %s", name, how, library)
    for left in library.parent.glob(f"{library.stem}-*"):
        # Of a process that was killed while it built.
        shutil.rmtree(left, ignore_errors=True)
    _build(c_code, library, command)


def _c_code(functions: dict[str, Function]) -> str:
    generator = ca.CodeGenerator("kernel.c")
    for function in functions.values():
        generator.add(function)
    return str(generator.dump())


def _build(c_code: str, library: Path, command: tuple[str, ...]) -> None:
    """Write C, compile it, and put the record and the library in place.

    Raises:
        OSError: the folder cannot be written, or the compiler not be started.
        subprocess.CalledProcessError: the compiler failed.
        subprocess.TimeoutExpired: it did not return, now or before.
    """
    with tempfile.TemporaryDirectory(dir=library.parent, prefix=f"{library.stem}-") as scratch:
        source, built, record = (Path(scratch) / f"kernel.{suffix}" for suffix in ("c", "so", "sha256"))
        # CasADi's own writing does not notice a full disk.
        source.write_text(c_code)
        _run([*command, source.name, "-o", built.name, "-lm"], Path(scratch), PATIENCE)
        record.write_bytes(_record(built, library.name))
        for path in (built, record):
            path.chmod(0o600)
        # Each step is atomic, and between the two the library does not match its record.
        record.replace(library.with_suffix(".sha256"))
        built.replace(library)


def _run(command: Sequence[str], folder: Path | None, seconds: float) -> str:
    """Run a compiler, unless it has not returned before; raises as `run`."""
    if command[0] in _given_up:
        raise subprocess.TimeoutExpired(command, seconds)
    try:
        return run(command, folder, seconds)
    except subprocess.TimeoutExpired:
        _given_up.add(command[0])
        raise


@contextlib.contextmanager
def _locked(path: Path) -> Iterator[None]:
    """Hold a lock that other processes wait for; the file is gone afterwards."""
    while True:
        with os.fdopen(os.open(path, os.O_WRONLY | os.O_CREAT | os.O_NOFOLLOW, 0o600), "w") as handle:
            fcntl.flock(handle, fcntl.LOCK_EX)
            # Whoever held it has removed the file: a lock on what has no name keeps nobody out.
            if not _is_open_file(path, handle.fileno()):
                continue
            try:
                yield
            finally:
                path.unlink(missing_ok=True)
            return


def _is_open_file(path: Path, descriptor: int) -> bool:
    """Whether a path still names the file that a descriptor has open."""
    try:
        return os.path.samestat(path.stat(), os.fstat(descriptor))
    except FileNotFoundError:
        return False
