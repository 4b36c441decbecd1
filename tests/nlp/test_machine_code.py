"""Compiled kernels: the numbers of the interpreted ones, compiled once, and a way out where that cannot be."""

from __future__ import annotations

import hashlib
import inspect
import logging
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from casadi import SX, Function

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.nlp import Kernel, derivatives, machine_code
from casadi_hands.nlp.derivatives import kernel_functions
from casadi_hands.nlp.machine_code import cache_folder, compiler
from casadi_hands.stages.object_motion.kernels import dynamics
from casadi_hands.stages.refine import finger_kernels

Array = np.ndarray
ROOT = Path(__file__).parents[2]


class Compiler:
    """A compiler that counts what it compiles and takes its time."""

    def __init__(self, folder: Path) -> None:
        self.path, self.calls = folder / "counting-cc", folder / "calls"
        self.call_itself("one", 0.3)

    def call_itself(self, version: str, seconds: float) -> None:
        real = next(path for name in ("cc", "gcc", "clang") if (path := shutil.which(name)))
        lines = [
            "#!/bin/sh",
            f'[ "$1" = --version ] && echo "{version}" && exit',
            f'echo "$@" >> {self.calls}',
            f"sleep {seconds}",
            f'exec {real} "$@"',
        ]
        self.path.write_text("\n".join(lines) + "\n")
        self.path.chmod(0o755)

    @property
    def count(self) -> int:
        return len(self.calls.read_text().splitlines()) if self.calls.exists() else 0


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache of this test's own, and a process that has seen and said nothing yet."""
    monkeypatch.setenv("CASADI_HANDS_CACHE", str(tmp_path / "cache"))
    monkeypatch.setattr(machine_code, "_reported", set())
    monkeypatch.setattr(machine_code, "_given_up", set())
    forget()
    yield tmp_path / "cache"
    forget()


def forget() -> None:
    compiler.cache_clear()
    machine_code._toolchain.cache_clear()


@pytest.fixture
def counting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Compiler:
    counting = Compiler(tmp_path)
    monkeypatch.setenv("CC", str(counting.path))
    return counting


def wave(shift: float = 0.0) -> dict[str, Function]:
    x = SX.sym("x", 3)
    return {
        "first": Function("first", [x], [ca.sin(x) * ca.sqrt(ca.sumsqr(x)) + shift]),
        "second": Function("second", [x], [ca.fmax(x, 0.1), ca.if_else(x[0] > 0, ca.exp(x[1]), x[2] / x[0])]),
    }


def compiled(name: str, functions: dict[str, Function]) -> dict[str, Function]:
    """Some functions under a kernel's name."""
    content = "".join(function.serialize() for function in functions.values())
    return machine_code.compiled([machine_code.Source(name, content, list(functions), lambda: functions)])[0]


def numbers(functions: dict[str, Function], x: Array) -> Array:
    return np.asarray(functions["first"](x)).ravel()


def refuse(*_: object) -> dict[str, Function]:
    raise AssertionError("written again")


def is_compiled(functions: dict[str, Function]) -> bool:
    return not any(function.is_a("SXFunction") for function in functions.values())


def suffixes(cache: Path) -> list[str]:
    return sorted(path.suffix for path in cache.iterdir())


def kernels() -> list[Kernel]:
    return [
        dynamics(2),
        finger_kernels.contact(2, Capsule, True),
        finger_kernels.rolling(1, Sphere),
        finger_kernels.fingers_apart(1, 2),
    ]


@pytest.mark.parametrize("kernel", kernels(), ids=lambda kernel: kernel.name)
def test_machine_code_gives_the_very_numbers_of_the_interpreter(
    kernel: Kernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("casadi_hands.nlp.derivatives._known", {})
    (fast,) = kernel_functions([kernel])
    assert all(each is fast for each in kernel_functions([kernel, kernel]))
    monkeypatch.setattr("casadi_hands.nlp.derivatives._known", {})
    derivatives._symbols.cache_clear()
    with monkeypatch.context() as patch:
        patch.setattr(derivatives._Symbols, "differentiated", refuse)
        (kept,) = kernel_functions([kernel])
    monkeypatch.setattr("casadi_hands.nlp.machine_code.compiler", lambda: None)
    monkeypatch.setattr("casadi_hands.nlp.derivatives._known", {})
    (slow,) = kernel_functions([kernel])
    for pattern in ("jacobian_pattern", "hessian_pattern"):
        assert getattr(fast, pattern) == getattr(kept, pattern) == getattr(slow, pattern)
    rng = np.random.default_rng(3)
    for role in ("value", "gradient", "jacobian", "hessian"):
        one, other = getattr(kept, role), getattr(slow, role)
        assert is_compiled({role: one})
        assert not is_compiled({role: other})
        for _ in range(20):
            inputs = [rng.uniform(0.2, 0.9, one.size_in(i)) for i in range(one.n_in())]
            for a, b in zip(one.call(inputs), other.call(inputs), strict=True):
                assert np.isfinite(np.asarray(a)).all()
                np.testing.assert_array_equal(np.asarray(a), np.asarray(b))


def test_a_kernel_is_compiled_once(counting: Compiler) -> None:
    assert is_compiled(compiled("wave", wave()))
    assert counting.count == 1
    assert is_compiled(compiled("wave", wave()))
    assert counting.count == 1
    # The key is the content, not the name.
    assert is_compiled(compiled("another name", wave()))
    assert counting.count == 1
    other = compiled("wave", wave(shift=1.0))
    assert counting.count == 2
    x = np.array([0.3, -0.2, 0.9])
    np.testing.assert_allclose(numbers(other, x), np.sin(x) * np.linalg.norm(x) + 1, rtol=1e-15)
    np.testing.assert_allclose(numbers(compiled("wave", wave()), x), np.sin(x) * np.linalg.norm(x))


def test_kernels_in_the_cache_are_not_written_again() -> None:
    compiled("wave", wave())
    content = "".join(function.serialize() for function in wave().values())
    (again,) = machine_code.compiled([machine_code.Source("wave", content, ("first", "second"), refuse)])
    x = np.array([0.3, -0.2, 0.9])
    np.testing.assert_allclose(numbers(again, x), np.sin(x) * np.linalg.norm(x))


@pytest.mark.parametrize("fails", ["compiler", "cache"])
def test_what_cannot_be_compiled_is_written_once(fails: str, monkeypatch: pytest.MonkeyPatch) -> None:
    if fails == "compiler":
        monkeypatch.setenv("CC", str(shutil.which("false")))
    else:
        monkeypatch.setenv("CASADI_HANDS_CACHE", "/proc/cache")
    written: list[dict[str, Function]] = []

    def write() -> dict[str, Function]:
        written.append(wave())
        return written[-1]

    assert machine_code.compiled([machine_code.Source("wave", "wave", ("first", "second"), write)]) == written
    assert len(written) == 1


def test_a_kernel_that_cannot_be_differentiated_is_no_matter_of_the_compiler() -> None:
    def write() -> dict[str, Function]:
        raise RuntimeError("wrong expression")

    with pytest.raises(RuntimeError, match="wrong expression"):
        machine_code.compiled([machine_code.Source("wave", "wave", ("first", "second"), write)])


def test_an_interrupt_starts_no_further_compilers(counting: Compiler, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(machine_code, "_processors", lambda: 1)
    functions = [wave(float(shift)) for shift in range(4)]
    sources = [machine_code.Source("wave", f["first"].serialize(), list(f), lambda f=f: f) for f in functions]

    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(machine_code, "_load", interrupted)
    with pytest.raises(KeyboardInterrupt):
        machine_code.compiled(sources)
    time.sleep(1.5)  # in which the others would have been compiled
    # The first, and what its thread had begun before the interrupt.
    assert 1 <= counting.count <= 2


def test_kernels_differentiated_otherwise_have_another_revision() -> None:
    how = inspect.getsource(derivatives._Symbols.differentiated) + inspect.getsource(derivatives._nonzeros)
    digest = hashlib.sha256(how.encode()).hexdigest()[:16]
    assert (derivatives._REVISION, digest) == ("1", "28c47e2ee9eecb29"), (
        "count derivatives._REVISION up: libraries are kept by it"
    )


def test_kernels_are_compiled_side_by_side(counting: Compiler, monkeypatch: pytest.MonkeyPatch) -> None:
    # Each compiler waits for the other to have begun.
    monkeypatch.setattr(machine_code, "_processors", lambda: 2)
    begun = counting.path.parent / "begun"
    lines = counting.path.read_text().splitlines()
    wait = f"echo . >> {begun}; for i in $(seq 300); do [ $(wc -l < {begun}) = 2 ] && break; sleep 0.1; done"
    together = f"[ $(wc -l < {begun}) = 2 ] || exit 1"
    counting.path.write_text("\n".join([*lines[:-2], wait, together, lines[-1]]) + "\n")
    functions = [wave(shift) for shift in (0.0, 1.0)]
    sources = [machine_code.Source("wave", f["first"].serialize(), list(f), lambda f=f: f) for f in functions]
    assert all(is_compiled(each) for each in machine_code.compiled(sources))


def test_nothing_but_libraries_stays_in_the_cache(cache: Path) -> None:
    compiled("wave", wave())
    assert suffixes(cache) == [".sha256", ".so"]


def test_without_a_compiler_kernels_are_interpreted(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, cache: Path
) -> None:
    monkeypatch.setattr(shutil, "which", lambda name: None)
    functions = wave()
    with caplog.at_level(logging.WARNING):
        assert compiled("wave", functions) == functions
        assert compiled("again", functions) == functions
    # Said once, not for every kernel.
    assert [record.getMessage() for record in caplog.records] == [
        "no C compiler found: kernels are interpreted, which is several times slower"
    ]
    assert not cache.exists()


def test_a_compiler_that_fails_leaves_the_interpreter(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, cache: Path
) -> None:
    monkeypatch.setenv("CC", str(shutil.which("false")))
    functions = wave()
    with caplog.at_level(logging.WARNING):
        assert compiled("wave", functions) == functions
        assert compiled("again", functions) == functions
    (record,) = caplog.records
    message = record.getMessage()
    assert message.startswith(
        f"kernels are interpreted, which is several times slower; 'wave': {shutil.which('false')}"
    )
    assert "\n" not in message
    assert not list(cache.iterdir())


def test_the_compilers_own_words_are_passed_on(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    broken = tmp_path / "broken-cc"
    broken.write_text("#!/bin/sh\necho 'kernel.c:1: fatal error: math.h: none' >&2\necho stopped >&2\nexit 1\n")
    broken.chmod(0o755)
    monkeypatch.setenv("CC", str(broken))
    compiled("wave", wave())
    assert caplog.messages[0].endswith(f"'wave': {broken} failed: kernel.c:1: fatal error: math.h: none stopped")


# Prints of two kernels whether each is compiled, then its numbers.
PROGRAM = f"""
import casadi as ca
from casadi import SX, Function
from casadi_hands.nlp import machine_code
{inspect.getsource(wave)}
{inspect.getsource(compiled)}
for shift in (0.0, 1.0):
    function = compiled("wave", wave(shift))["first"]
    print(not function.is_a("SXFunction"), *function([0.3, -0.2, 0.9]).nonzeros())
"""
ENVIRONMENT = {"PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}


def answers(words: str) -> list[bool]:
    """Of a program's words, whether each kernel was compiled; the numbers have to be right."""
    x = np.array([0.3, -0.2, 0.9])
    lines = [line.split() for line in words.splitlines()]
    for shift, (_, *found) in enumerate(lines):
        np.testing.assert_allclose([float(word) for word in found], np.sin(x) * np.linalg.norm(x) + shift, rtol=1e-14)
    return [line[0] == "True" for line in lines]


def start(program: str = PROGRAM, before: tuple[str, ...] = ()) -> subprocess.Popen[str]:
    """Run a program in a process of its own, so that a signal ends that one."""
    return subprocess.Popen(
        [*before, sys.executable, "-c", program],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        env={**os.environ, **ENVIRONMENT},
        cwd=ROOT,
    )


def swap(library: Path) -> None:
    """Another kernel's library and record under this one's name."""
    compiled("other", wave(2.0))
    (other,) = (path for path in library.parent.glob("*.so") if path != library)
    other.replace(library)
    other.with_suffix(".sha256").replace(library.with_suffix(".sha256"))


def flip(library: Path) -> None:
    """One bit of the code, so that the library still loads."""
    content = bytearray(library.read_bytes())
    content[len(content) // 3] ^= 1
    library.write_bytes(content)


DAMAGES: dict[str, Callable[[Path], object]] = {
    "truncated": lambda library: os.truncate(library, library.stat().st_size // 2),
    "empty": lambda library: os.truncate(library, 0),
    "longer": lambda library: library.open("ab").write(b"\0"),
    "garbage": lambda library: library.write_bytes(b"not a library"),
    "bit": flip,
    "another's": swap,
    "no record": lambda library: library.with_suffix(".sha256").unlink(),
    "truncated record": lambda library: os.truncate(library.with_suffix(".sha256"), 20),
    "garbage record": lambda library: library.with_suffix(".sha256").write_bytes(b"\xff\x00"),
}


@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_library_is_compiled_again(damage: str, cache: Path) -> None:
    compiled("wave", wave())
    (library,) = cache.glob("*.so")
    # A copy in its place: this process has the file itself loaded.
    shutil.copy(library, cache / "copy")
    (cache / "copy").replace(library)
    DAMAGES[damage](library)
    process = start()
    words, log = process.communicate(timeout=60)
    assert process.returncode == 0
    assert answers(words) == [True, True]
    assert log == f"kernel 'wave' is compiled again: its library in the cache is damaged: {library}\n"
    digest = hashlib.sha256(library.read_bytes()).hexdigest()
    assert library.with_suffix(".sha256").read_text() == f"{digest}  {library.name}\n"


def test_a_record_without_its_library_is_no_damage(cache: Path, caplog: pytest.LogCaptureFixture) -> None:
    # What a process leaves that ends between its two steps.
    cache.mkdir()
    compiled("wave", wave())
    next(cache.glob("*.so")).unlink()
    assert is_compiled(compiled("wave", wave()))
    assert suffixes(cache) == [".sha256", ".so"]
    assert not caplog.records


def test_a_process_killed_while_it_builds_leaves_nothing_that_hurts(counting: Compiler, cache: Path) -> None:
    counting.call_itself("one", 30)
    killed = start()
    deadline = time.monotonic() + 30
    while not counting.count and time.monotonic() < deadline:
        time.sleep(0.02)
    killed.kill()
    killed.communicate(timeout=10)
    (folder,) = (path for path in cache.iterdir() if path.is_dir())
    assert (folder / "kernel.c").exists()
    assert not list(cache.glob("*.so"))
    counting.call_itself("one", 0)
    assert is_compiled(compiled("wave", wave()))
    assert suffixes(cache) == [".sha256", ".so"]


def test_the_lock_keeps_all_others_out(tmp_path: Path) -> None:
    # Each holder removes the file, while others wait for the lock of the one that it removed.
    counter = tmp_path / "counter"
    counter.write_text("0")
    program = f"""
from pathlib import Path
from casadi_hands.nlp.machine_code import _locked
counter = Path({str(counter)!r})
for _ in range(300):
    with _locked(counter.with_suffix(".lock")):
        counter.write_text(str(int(counter.read_text()) + 1))
"""
    running = [start(program) for _ in range(4)]
    assert [process.communicate(timeout=60)[1] for process in running] == [""] * 4
    assert counter.read_text() == "1200"
    assert not counter.with_suffix(".lock").exists()


def test_the_lock_is_let_go_when_the_build_fails(tmp_path: Path) -> None:
    lock = tmp_path / "lock"
    for _ in range(2):
        with pytest.raises(OSError, match="full"), machine_code._locked(lock):
            raise OSError("full")
    assert not lock.exists()


@pytest.mark.parametrize("place", ["file/cache", "/proc/cache", "/proc/self/cache"])
def test_a_cache_that_cannot_be_made_leaves_the_interpreter(
    place: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("CASADI_HANDS_CACHE", str(tmp_path / place))
    for shift in (0.0, 1.0):
        functions = wave(shift)
        assert compiled("wave", functions) == functions
    (message,) = caplog.messages
    assert message.startswith("kernels are interpreted, which is several times slower; 'wave': [Errno ")
    assert place in message


def test_without_a_home_kernels_are_interpreted(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    for name in ("CASADI_HANDS_CACHE", "XDG_CACHE_HOME", "HOME"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr("os.getuid", lambda: 2**31 - 7)
    functions = wave()
    assert compiled("wave", functions) == functions
    assert caplog.messages == [
        "kernels are interpreted, which is several times slower; 'wave': Could not determine home directory."
    ]


def mounted(options: str, then: str) -> tuple[str, ...]:
    """A command to put before a program: the cache is a file system of its own, seen by that program alone."""
    before = ("unshare", "--map-root-user", "--mount", "sh", "-c")
    mount = f'mkdir -p "$CASADI_HANDS_CACHE" && mount -t tmpfs -o mode=700,{options} none "$CASADI_HANDS_CACHE"'
    if not shutil.which("unshare") or subprocess.run([*before, mount], capture_output=True).returncode:
        pytest.skip("no file systems may be mounted here")
    return (*before, f'{mount} && {then} && exec "$@"', "sh")


@pytest.mark.parametrize("room", ["4k", "12k"], ids=["for no C", "for the C alone"])
def test_a_full_cache_leaves_the_interpreter(room: str) -> None:
    full = start(before=mounted(f"size={room}", "true"))
    words, log = full.communicate(timeout=60)
    assert full.returncode == 0
    assert answers(words) == [False, False]
    assert log.count("\n") == 1
    assert "No space left on device" in log


def test_a_limit_on_the_size_of_files_leaves_the_interpreter(cache: Path) -> None:
    limited = start("import resource; resource.setrlimit(resource.RLIMIT_FSIZE, (2048, 2048))" + PROGRAM)
    words, log = limited.communicate(timeout=60)
    assert limited.returncode == 0
    assert answers(words) == [False, False]
    assert log.startswith("kernels are interpreted")
    assert log.count("\n") == 1
    assert not list(cache.iterdir())


def test_a_read_only_cache_serves_what_it_has(cache: Path, tmp_path: Path) -> None:
    compiled("wave", wave())
    cache.rename(tmp_path / "full")
    fill = f'cp {tmp_path}/full/* "$CASADI_HANDS_CACHE" && mount -o remount,ro "$CASADI_HANDS_CACHE"'
    process = start(before=mounted("size=1m", fill))
    words, log = process.communicate(timeout=60)
    assert process.returncode == 0
    assert answers(words) == [True, False]
    assert log.startswith("kernels are interpreted, which is several times slower; 'wave': [Errno 30] Read-only")
    assert log.count("\n") == 1


def test_a_cache_named_by_a_relative_path_serves(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("CASADI_HANDS_CACHE", ".")
    assert is_compiled(compiled("wave", wave()))


def test_another_compiler_casadi_or_machine_has_its_own_libraries(
    counting: Compiler, monkeypatch: pytest.MonkeyPatch
) -> None:
    counting.call_itself("one", 0)
    compiled("wave", wave())
    counting.call_itself("two", 0)
    forget()
    compiled("wave", wave())
    assert counting.count == 2
    changes = [
        (ca.CasadiMeta, "version", lambda: "0.0"),
        (ca.CasadiMeta, "git_revision", lambda: "0"),
        (platform, "machine", lambda: "abacus"),
        (platform, "libc_ver", lambda: ("glibc", "2.0")),
        (sys, "maxsize", 2**31 - 1),
    ]
    for count, (owner, name, value) in enumerate(changes, start=3):
        with monkeypatch.context() as patch:
            patch.setattr(owner, name, value)
            forget()
            compiled("wave", wave())
        assert counting.count == count, name
    forget()
    compiled("wave", wave())
    assert counting.count == 2 + len(changes)


def test_where_the_cache_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder() == tmp_path / "cache"
    monkeypatch.delenv("CASADI_HANDS_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    assert cache_folder() == tmp_path / "user" / "casadi-hands"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "casadi-hands"
    assert not cache_folder().exists()


def test_processes_that_want_the_same_kernel_at_once_compile_it_once(counting: Compiler, cache: Path) -> None:
    running = [start() for _ in range(3)]
    words = [process.communicate(timeout=120)[0] for process in running]
    assert [process.returncode for process in running] == [0, 0, 0]
    assert [answers(each) for each in words] == [[True, True]] * 3
    assert counting.count == 2
    assert suffixes(cache) == [".sha256", ".sha256", ".so", ".so"]


def test_what_is_kept_nobody_else_can_write(cache: Path) -> None:
    before = os.umask(0)
    try:
        compiled("wave", wave())
    finally:
        os.umask(before)
    assert [path.stat().st_mode & 0o077 for path in (cache, *cache.iterdir())] == [0, 0, 0]


def closed(folder: Path) -> None:
    folder.chmod(0o770)


def linked(folder: Path) -> None:
    folder.parent.chmod(0o777)


def anothers(folder: Path) -> None:
    os.chown(folder, 12345, -1)


UNTRUSTED: dict[str, tuple[Callable[[Path], None], str]] = {
    "writable by a group": (closed, r"others can write .*cache \(chmod go-w\)"),
    "in a folder that all can write": (linked, "all can write "),
    "another user's": (anothers, "cache belongs to another user"),
}


@pytest.mark.parametrize("how", UNTRUSTED)
def test_a_cache_that_others_can_write_is_not_used(how: str, counting: Compiler, cache: Path) -> None:
    spoil, why = UNTRUSTED[how]
    if how == "another user's" and os.geteuid() != 0:
        pytest.skip("only root can give files away")
    compiled("wave", wave())
    kept = {path.name: path.read_bytes() for path in cache.iterdir()}
    spoil(cache)
    # In a process of its own, at whose end the private folder goes; its child uses the same one.
    program = PROGRAM + "\nimport os, subprocess, sys\nprint(os.environ['CASADI_HANDS_CACHE'], file=sys.stderr)\n"
    child = f"subprocess.run([sys.executable, '-c', {PROGRAM!r}], check=True)"
    process = start(program + child)
    words, log = process.communicate(timeout=120)
    assert process.returncode == 0, log
    said, private = log.splitlines()
    assert re.search(f"^the cache of compiled kernels is not used, .*: .*{why}", said)
    assert Path(private).parent == Path(tempfile.gettempdir())
    assert not Path(private).exists()
    lines = words.splitlines()
    assert answers("\n".join(lines[:2])) == answers("\n".join(lines[2:])) == [True, True]
    assert counting.count == 1 + 2
    assert {path.name: path.read_bytes() for path in cache.iterdir()} == kept


def test_a_library_that_could_be_anothers_is_compiled_again(
    counting: Compiler, cache: Path, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    compiled("wave", wave())
    (library,) = cache.glob("*.so")
    elsewhere = library.rename(tmp_path / "elsewhere.so")
    library.symlink_to(elsewhere)
    kept = elsewhere.read_bytes()
    assert is_compiled(compiled("wave", wave()))
    assert counting.count == 2
    assert not library.is_symlink()
    assert elsewhere.read_bytes() == kept
    library.chmod(0o666)
    assert is_compiled(compiled("wave", wave()))
    assert counting.count == 3
    assert [message.rpartition(":")[0] for message in caplog.messages] == [
        "kernel 'wave' is compiled again: its library in the cache could be another's"
    ] * 2


def test_a_lock_that_leads_elsewhere_is_not_followed(tmp_path: Path) -> None:
    (tmp_path / "precious").write_text("content")
    (tmp_path / "lock").symlink_to(tmp_path / "precious")
    with pytest.raises(OSError, match="lock"), machine_code._locked(tmp_path / "lock"):
        raise AssertionError
    assert (tmp_path / "precious").read_text() == "content"


@pytest.mark.parametrize("where", ["kernel", "version"])
def test_a_compiler_that_never_returns_is_given_up(
    where: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    hanging, pids = tmp_path / "hanging-cc", tmp_path / "pids"
    # As a driver does: what hangs is a child of its own.
    hang = f"sleep 1000 & echo $! $$ >> {pids}; wait"
    lines = ["#!/bin/sh", f'[ "$1" = --version ] && {{ {hang if where == "version" else "echo one"}; exit; }}', hang]
    hanging.write_text("\n".join(lines) + "\n")
    hanging.chmod(0o755)
    monkeypatch.setenv("CC", str(hanging))
    monkeypatch.setattr(machine_code, "PATIENCE", 1.0)
    monkeypatch.setattr(machine_code, "VERSION_PATIENCE", 1.0)
    begun = time.monotonic()
    for shift in range(4):
        functions = wave(float(shift))
        assert compiled("wave", functions) == functions
    assert time.monotonic() - begun < 4.0  # it was tried once
    assert caplog.messages == [
        f"kernels are interpreted, which is several times slower; 'wave': {hanging} has not returned for 1 s and is "
        "given up"
    ]
    assert len(pids.read_text().splitlines()) == 1
    while any(running(int(pid)) for pid in pids.read_text().split()):
        assert time.monotonic() - begun < 30.0
        time.sleep(0.05)


def running(pid: int) -> bool:
    """Whether a process runs; one that has ended and whom nobody has waited for does not."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False
