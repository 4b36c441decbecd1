"""What tests of the commands share: no made-up solve gets into the record of those that took their time."""

from __future__ import annotations

from pathlib import Path

import pytest

from casadi_hands.cli import history


@pytest.fixture(autouse=True)
def record(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> Path:
    path = tmp_path_factory.mktemp("record") / "solves.jsonl"
    monkeypatch.setattr(history, "_file", lambda: path)
    return path
