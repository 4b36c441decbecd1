"""The script that replays with harder friction: the files' own is hard enough, and softer friction is seen to creep."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path

import creep
import pytest

from casadi_hands.verify import replay
from tests.verify.fixture import carried


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("result")
    carried(path / "task").write(path / "result")
    return path / "result"


def test_harder_friction_changes_nothing_and_softer_does(folder: Path) -> None:
    own = replay(folder)
    soft, usual, hard = (creep.with_friction(folder, *each) for each in ((1, 0), (100, 20), (1000, 200)))
    assert asdict(usual) == asdict(own)
    assert hard.position_max == pytest.approx(own.position_max, abs=2e-5)
    assert hard.angle_max == pytest.approx(own.angle_max, abs=0.05)
    assert soft.position_max > own.position_max + 2e-4
