"""What tests of the commands share: files of tasks; and no made-up solve is remembered with those that took time."""

from __future__ import annotations

from pathlib import Path

import pytest

from casadi_hands.cli import history
from tests.export.example import TASK
from tests.test_pipeline import BALL


@pytest.fixture(autouse=True)
def record(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path_factory.mktemp("record") / "solves.jsonl"
    monkeypatch.setattr(history, "_file", lambda: path)
    return path


@pytest.fixture
def task_file(tmp_path: Path) -> Path:
    path = tmp_path / "carry.yaml"
    path.write_text(TASK)
    return path


@pytest.fixture
def ball_file(tmp_path: Path) -> Path:
    path = tmp_path / "ball.yaml"
    path.write_text(BALL)
    return path
