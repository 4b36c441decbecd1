"""Compiled kernels: the numbers of the interpreted ones, compiled once, and a way out where that cannot be."""

from __future__ import annotations

import logging
import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from casadi import SX, Function

from casadi_hands.nlp import Kernel
from casadi_hands.nlp.assembly import kernel_functions
from casadi_hands.nlp.machine_code import cache_folder, compiled, compiler
from casadi_hands.stages import exact_kernels

Array = np.ndarray
ROOT = Path(__file__).parents[2]
needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler here"
)


class Compiler:
    """A compiler that counts how often it is called and takes its time."""

    def __init__(self, folder: Path) -> None:
        self.path, self.calls = folder / "counting-cc", folder / "calls"
        real = next(path for name in ("cc", "gcc", "clang") if (path := shutil.which(name)))
        self.path.write_text(f'#!/bin/sh\necho "$@" >> {self.calls}\nsleep 0.3\nexec {real} "$@"\n')
        self.path.chmod(0o755)

    @property
    def count(self) -> int:
        return len(self.calls.read_text().splitlines()) if self.calls.exists() else 0


@pytest.fixture(autouse=True)
def cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """An empty cache of this test's own."""
    monkeypatch.setenv("CASADI_HANDS_CACHE", str(tmp_path / "cache"))
    compiler.cache_clear()
    yield tmp_path / "cache"
    compiler.cache_clear()


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


def numbers(functions: dict[str, Function], x: Array) -> Array:
    return np.asarray(functions["first"](x)).ravel()


def is_compiled(functions: dict[str, Function]) -> bool:
    return not any(function.is_a("SXFunction") for function in functions.values())


def kernels() -> list[Kernel]:
    return [
        exact_kernels.physics(),
        exact_kernels.contact(2, 0, True),
        exact_kernels.rolling(1, 1),
        exact_kernels.fingers_apart(1, 2, "a"),
    ]


@needs_compiler
@pytest.mark.parametrize("kernel", kernels(), ids=lambda kernel: kernel.name)
def test_machine_code_gives_the_very_numbers_of_the_interpreter(
    kernel: Kernel, monkeypatch: pytest.MonkeyPatch
) -> None:
    terms = list(kernel.terms)
    fast = kernel_functions(kernel, terms)
    monkeypatch.setattr("casadi_hands.nlp.machine_code.compiler", lambda: None)
    slow = kernel_functions(kernel, terms)
    rng = np.random.default_rng(3)
    for role in ("value", "gradient", "jacobian", "hessian"):
        one, other = getattr(fast, role), getattr(slow, role)
        assert is_compiled({role: one})
        assert not is_compiled({role: other})
        for _ in range(20):
            inputs = [rng.uniform(0.2, 0.9, one.size_in(i)) for i in range(one.n_in())]
            for a, b in zip(one.call(inputs), other.call(inputs), strict=True):
                assert np.isfinite(np.asarray(a)).all()
                np.testing.assert_array_equal(np.asarray(a), np.asarray(b))


@needs_compiler
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


@needs_compiler
def test_nothing_but_libraries_stays_in_the_cache(cache: Path) -> None:
    compiled("wave", wave())
    assert [path.suffix for path in cache.iterdir()] == [".so"]


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
    (record,) = caplog.records
    assert record.getMessage().startswith("kernel 'wave' is interpreted, it could not be compiled: ")
    assert not list(cache.glob("*.so"))


@needs_compiler
def test_a_broken_library_does_no_harm(cache: Path, caplog: pytest.LogCaptureFixture) -> None:
    compiled("wave", wave())
    (library,) = cache.glob("*.so")
    # In its place, not in the file that this process has loaded.
    library.unlink()
    library.write_bytes(b"not a library")
    x = np.array([0.3, -0.2, 0.9])
    with caplog.at_level(logging.WARNING):
        functions = compiled("wave", wave())
    np.testing.assert_allclose(numbers(functions, x), np.sin(x) * np.linalg.norm(x), rtol=1e-15)
    assert is_compiled(functions) or "kernel 'wave' is interpreted" in caplog.text


def test_a_cache_that_cannot_be_written_leaves_the_interpreter(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("CASADI_HANDS_CACHE", str(tmp_path / "file" / "cache"))
    functions = wave()
    with caplog.at_level(logging.WARNING):
        assert compiled("wave", functions) == functions
    assert "no C compiler" in caplog.text or "kernel 'wave' is interpreted" in caplog.text


def test_where_the_cache_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert cache_folder() == tmp_path / "cache"
    monkeypatch.delenv("CASADI_HANDS_CACHE")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    assert cache_folder() == tmp_path / "user" / "casadi-hands"
    monkeypatch.delenv("XDG_CACHE_HOME")
    monkeypatch.setenv("HOME", str(tmp_path / "home"))
    assert cache_folder() == tmp_path / "home" / ".cache" / "casadi-hands"
    assert cache_folder().is_dir()


@needs_compiler
def test_processes_that_want_the_same_kernel_at_once_compile_it_once(counting: Compiler, cache: Path) -> None:
    code = (
        "from tests.nlp.test_machine_code import compiled, is_compiled, wave\n"
        "functions = compiled('wave', wave())\n"
        "print(is_compiled(functions), functions['first']([0.3, -0.2, 0.9]))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    running = [
        subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True, env=environment, cwd=ROOT)
        for _ in range(2)
    ]
    words = [process.communicate(timeout=120)[0] for process in running]
    assert [process.returncode for process in running] == [0, 0]
    assert words[0] == words[1]
    assert words[0].startswith("True ")
    assert counting.count == 1
    assert [path.suffix for path in cache.iterdir()] == [".so"]
