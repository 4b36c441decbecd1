"""What all tests share."""

import os
import sys
import zlib
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

# MuJoCo reads this once, as it is imported: without a screen only EGL draws.
if sys.platform == "linux" and "DISPLAY" not in os.environ:
    os.environ.setdefault("MUJOCO_GL", "egl")


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Of several processes (``pytest -n 2 --dist loadgroup``) one has all tests with a browser, which draws slowly."""
    for item in items:
        if item.get_closest_marker("browser"):
            item.add_marker(pytest.mark.xdist_group("browser"))


@pytest.fixture
def rng(request: pytest.FixtureRequest) -> np.random.Generator:
    """Random numbers of a test's own: the same in every run, whichever tests ran before it."""
    return np.random.default_rng(zlib.crc32(request.node.nodeid.encode()))


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    """A browser without a screen, for tests that are marked to need one."""
    from tests.export.browser import Browser

    with Browser() as found:
        yield found


@pytest.fixture(scope="module")
def interpreted() -> Iterator[None]:
    """No compiler, for modules that build large problems and hardly evaluate them: to compile those takes a minute."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("casadi_hands.nlp.machine_code.compiler", lambda: None)
        yield
