"""The script that bisects the stiffness at which a replay loses the object, on replays with a known answer."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
import stiffness

from casadi_hands.verify import Perturbation

SUPPLIED = 2.0  # N·m/rad


@pytest.mark.parametrize(
    ("threshold", "bracket"), [(0.37, "found"), (0.05, "found"), (0.0, "never"), (1e9, "always"), (5.0, "found")]
)
@pytest.mark.parametrize("how", ["dropped", "whirled"])
def test_the_stiffness_below_which_the_object_is_lost_is_found(
    monkeypatch: pytest.MonkeyPatch, threshold: float, bracket: str, how: str
) -> None:
    class Player:
        """Loses the object with motors softer than the threshold."""

        folder = SimpleNamespace(task=SimpleNamespace(actuator=SimpleNamespace(stiffness=SUPPLIED)))

        def __init__(self, path: Path) -> None:
            assert path == Path("folder")

        def play(self, change: Perturbation) -> Any:
            assert change == Perturbation(stiffness=change.stiffness)
            lost = change.stiffness * SUPPLIED < threshold
            whirled = how == "whirled" and threshold < SUPPLIED
            return SimpleNamespace(dropped=lost and not whirled, angle_max=3.0 + 50.0 * (lost and whirled))

    monkeypatch.setattr(stiffness, "Player", Player)
    found, which = stiffness.lost_below(Path("folder"))
    assert which == bracket
    if bracket == "found":
        assert found == pytest.approx(threshold, rel=0.025)
