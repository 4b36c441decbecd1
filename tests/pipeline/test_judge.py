"""Which status a design earns, on made-up audits."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest

from casadi_hands.pipeline import judge
from casadi_hands.pipeline.judge import Judge
from casadi_hands.verify.report import Audit, Figure
from tests.diagnosis.test_holding import still, upright

SLIPS = Figure("slip", 0.003, 0.0002, "m", "contact 'left' slips {value}")


@pytest.mark.parametrize(
    ("missed", "limit", "status"),
    [
        (0.0004, 0.0005, "feasible"),
        (0.00058, 0.0005, "feasible"),  # a fiftieth of half the object's extent of 3 cm
        (0.00062, 0.0005, "failed"),
        (0.003, 0.0005, "failed"),
        (0.003, 0.005, "feasible"),  # within what this task's own limit allows
        (0.006, 0.005, "failed"),
        (float("inf"), 0.005, "failed"),
    ],
)
def test_a_motion_is_one_within_the_task_s_limits_or_nearly(
    missed: float, limit: float, status: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    goal = Figure("goal_position", missed, limit, "m", "the object is {value} away from goal 2")
    verdict = Audit("ball", {"goal_position": goal, "slip": SLIPS}, ())
    monkeypatch.setattr(judge, "audit_files", lambda _: verdict)
    judged = Judge(*still(0.5)).judge(upright(0.0)[1], ())
    assert judged.status == status
    assert "contact 'left' slips 3 mm" in judged.reason
    certain = Audit("ball", {"goal_position": Figure("goal_position", 0.0, limit, "m", "")}, ())
    monkeypatch.setattr(judge, "audit_files", lambda _: certain)
    assert Judge(*still(0.5)).judge(upright(0.0)[1], ()).status == "certified"


def test_a_hand_and_its_motion_are_audited_once(monkeypatch: pytest.MonkeyPatch) -> None:
    verdict = Audit("ball", {"slip": SLIPS}, ())
    audits: list[object] = []
    monkeypatch.setattr(judge, "audit_files", lambda folder: audits.append(folder) or verdict)
    judges, design = Judge(*still(0.5)), upright(0.0)[1]
    judged = judges.judge(design, ())
    assert judges.audited(judged) == verdict
    assert len(audits) == 1
    judges.audited(upright(0.0)[1])
    assert len(audits) == 2


@pytest.mark.parametrize("share", [0.5, 0.95])
def test_motors_that_give_nearly_all_they_have_are_named_where_the_object_is_dropped(
    monkeypatch: pytest.MonkeyPatch, share: float
) -> None:
    dropped = Figure("replay_dropped", 1.0, 0.05, "share", "all replays drop it")
    tried = SimpleNamespace(
        figures=lambda: [dropped],
        record=lambda: {"engine": "mujoco"},
        dropped_before=lambda: "in MuJoCo the object is dropped before goal 2 at 1 s",
    )
    monkeypatch.setattr(judge, "run_replays", lambda *_, **__: tried)
    torque = {"value": share, "limit": 1.0, "holds": True, "unit": "share"}
    design = replace(upright(0.0)[1], status="certified", certificate={"torque": torque})
    reason = Judge(*still(0.5)).replayed(design).reason
    assert "dropped before goal 2 at 1 s, with nothing perturbed" in reason
    assert ("as planned the motors already give 95 % of their torque" in reason) == (share > 0.8)
    assert ("stronger motors (actuator.torque)" in reason) == (share > 0.8)


def test_what_mujoco_does_not_take_is_feasible_and_says_why() -> None:
    """Links of a tenth of a millimetre have less inertia than MuJoCo moves."""
    design = upright(0.0)[1]
    assert design.hand is not None
    fingers = tuple(
        replace(finger, links=tuple(replace(link, length=2e-4, radius=5e-5, hinge=1e-4) for link in finger.links))
        for finger in design.hand.fingers
    )
    tiny = replace(design, status="certified", hand=replace(design.hand, fingers=fingers))
    judged = Judge(*still(0.5)).replayed(tiny)
    assert judged.status == "feasible"
    assert judged.reason.startswith("it cannot be replayed, as MuJoCo says: ")
    assert "inertia" in judged.reason
    assert "scene.xml" not in judged.reason
    assert Judge(*still(0.5)).replayed(replace(tiny, status="failed", reason="why")).reason == "why"
