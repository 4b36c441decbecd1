"""The words for friction, motors and the audit's figures, with their numbers."""

from __future__ import annotations

from dataclasses import replace

import pytest

from casadi_hands.diagnosis import figures as words
from casadi_hands.diagnosis.figures import friction_reason, missed_figures, speed_reason, torque_reason
from casadi_hands.diagnosis.holding import MOST_NORMAL_FORCE
from casadi_hands.problem.motors import joint_motors
from casadi_hands.task.hand import Actuator
from casadi_hands.verify import Perturbation, Replay, Replays
from casadi_hands.verify.replays.replay import GoalError
from casadi_hands.verify.report import Audit, Figure
from tests.diagnosis.test_holding import WEIGHT, jerked, still, upright
from tests.export.example import example_design


def test_enough_friction_gives_no_reason() -> None:
    assert friction_reason(*still(0.5 / MOST_NORMAL_FORCE + 0.01)) is None


def test_little_friction_is_told_with_the_grip_it_takes_and_what_would_do() -> None:
    reason = friction_reason(*still(0.04))
    assert reason is not None
    assert reason.what == (
        "at goal 1 (0 s) the contacts hold the object with friction 0.04 only if they press with 12.5 weights and more"
    )
    assert reason.advice.startswith("friction of 0.25 or more, with which 2 weights would do, or contacts that")
    assert reason.root


def test_a_grasp_that_cannot_hold_is_told_with_what_is_missing() -> None:
    model, floating = still(0.5, right=(0, 0, 1))
    floating.point[:, 0] = [0, 0, 1]
    reason = friction_reason(model, floating)
    assert reason is not None
    assert reason.what == (
        "at goal 1 (0 s) the contacts cannot hold the object with friction 0.5: a force of 1.00 weights is missing"
    )
    assert reason.advice == "contacts that surround the object better or oppose each other"


def test_a_missing_torque_is_told_in_its_unit() -> None:
    # The ball is jerked about the line through both contacts, about which they can make no torque.
    model, floating = still(0.5)
    torque = jerked(model, floating)
    reason = friction_reason(model, floating)
    assert reason is not None
    assert reason.what.endswith(f" friction 0.5: a torque of {1e3 * torque:.3g} mN·m is missing")


def test_weak_motors_are_named_with_joint_time_given_and_needed() -> None:
    model, design = upright(0.0)
    weak = design.task.model_copy(update={"actuator": Actuator(torque=0.01, speed=1)})
    reason = torque_reason(model, replace(design, task=weak))
    assert reason is not None
    assert "_joint0 of finger '" in reason.what
    assert f" needs {WEIGHT * 0.09:.3g} N·m at " in reason.what
    assert reason.what.endswith("and the motors give 0.01 N·m")
    strong = design.task.model_copy(update={"actuator": Actuator(torque=WEIGHT * 0.0901, speed=1)})
    assert torque_reason(model, replace(design, task=strong)) is None
    assert torque_reason(model, design) is None


def test_slow_motors_are_named_with_joint_time_given_and_needed() -> None:
    model, design = upright(0.0)
    assert design.motion is not None
    angles = design.motion.joint_angles.copy()
    angles[3:, 3] = 0.25  # within 0.1 s
    moved = replace(design, motion=replace(design.motion, joint_angles=angles))
    slow = design.task.model_copy(update={"actuator": Actuator(torque=1, speed=2)})
    reason = speed_reason(model, replace(moved, task=slow))
    assert reason is not None
    assert reason.what == (
        "joint finger1_joint1 of finger 'right' turns with 2.5 rad/s at 0.2 s (between goals 1 and 2) in the motion "
        "found, and the motors give 2 rad/s"
    )
    fast = design.task.model_copy(update={"actuator": Actuator(torque=1, speed=2.6)})
    assert speed_reason(model, replace(moved, task=fast)) is None
    assert speed_reason(model, moved) is None


def test_missed_figures_are_told_with_limit_advice_and_the_motors_own_units() -> None:
    _, design = upright(0.0)
    task = design.task.model_copy(update={"actuator": Actuator(torque=0.02, speed=2)})
    figures = [
        Figure("structure", 1.0, 0.0, "", "{value} disagreements"),
        Figure("gap", 1e-5, 5e-5, "m", "fine"),
        Figure("slip", 0.003, 0.0002, "m", "contact 'left' slips {value}"),
        Figure("torque", 1.5, 1.0, "share", "{value} of the actuator's torque in joint finger1_joint0 at 0.3 s"),
        Figure("speed", 2.0, 1.0, "share", "{value} of the actuator's speed in joint finger0_joint1 of finger 'left'"),
    ]
    verdict = Audit("x", {figure.name: figure for figure in figures}, ("mass: files disagree",))
    missed = dict(missed_figures(replace(design, task=task), verdict))
    assert list(missed) == ["structure", "slip", "torque", "speed"]
    assert missed["structure"].what == "mass: files disagree"
    assert missed["slip"].what == "contact 'left' slips 3 mm, where the limit is 0.2 mm"
    assert missed["torque"].what == (
        "150 % of the actuator's torque in joint finger1_joint0 of finger 'right' at 0.3 s, 0.03 N·m of 0.02 N·m, "
        "where the limit is 100 %"
    )
    assert missed["speed"].what.count("of finger 'left'") == 1
    assert "4 rad/s of 2 rad/s" in missed["speed"].what
    assert all(reason.advice for reason in missed.values())


def test_every_figure_of_the_audit_has_its_own_advice() -> None:
    from casadi_hands.task.limits import Limits

    assert set(words._ADVICE) == {*Limits.model_fields, "structure", "rest", "residual_disturbed", "motors"}


@pytest.mark.parametrize("friction", [0.04, 0.08])
def test_the_friction_advised_does(friction: float) -> None:
    reason = friction_reason(*still(friction))
    assert reason is not None
    advised = float(reason.advice.split()[2])
    assert friction_reason(*still(advised * 1.01)) is None


def test_the_first_motors_that_bring_the_hand_to_every_goal_are_named(monkeypatch: pytest.MonkeyPatch) -> None:
    design = example_design()
    assert design.hand is not None

    def seen(millimetres: float, dropped: bool = False) -> Replays:
        goals = tuple(GoalError(1e-3 * millimetres, 1.0) for _ in design.task.motion)
        nominal = Replay(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, dropped, (), Perturbation(), goals)
        return Replays("mujoco", design.task, 1e-3, 0, nominal, {})

    tried = [
        (Perturbation(effort=2.0, squeeze=2.0), seen(9.0)),
        (Perturbation(effort=3.0, squeeze=3.0), seen(1.0, dropped=True)),
        (Perturbation(effort=4.0, stiffness=4.0), seen(1.0)),
    ]
    monkeypatch.setattr(words, "stronger_motors", lambda directory: iter(tried))
    stiffest = max(motor.stiffness for motor in joint_motors(design.task, design.hand))
    assert words.motor_remedy("folder", design) == (
        f"In the same replay with motors of {4 * design.hand.effort:.3g} N·m (actuator.torque) and up to "
        f"{4 * stiffest:.3g} N·m/rad, this hand reaches every goal"
    )
    del tried[2]
    assert words.motor_remedy("folder", design) is None
