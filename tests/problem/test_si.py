"""What is written of a solved hand: where it stands, its motors, and its forces when it is disturbed."""

from __future__ import annotations

from dataclasses import replace
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.outcome import whole_hand_motion
from casadi_hands.problem.si import build_model, hand_of, joint_loads
from casadi_hands.problem.units import round_off
from casadi_hands.task import Task, parse_task
from tests.stages.example import PinFinger, everything, everything_text, with_tips
from tests.stages.refining import MadeUp, carrying, sketching

KINDS = ("effort", "velocity")


@pytest.fixture(scope="module")
def made_up() -> MadeUp:
    return carrying()


def written(made_up: MadeUp) -> tuple[WholeHand, Motion]:
    """The result of the made-up values, with the fingers as they start, and the motion that it is written as."""
    hand = made_up.refined(made_up.solution()).hand
    hand = replace(hand, fingers=made_up.start.fingers, angles=made_up.start.angles)
    return hand, whole_hand_motion(made_up.model, hand)


def test_forces_under_perturbations_are_kept_where_the_object_is_disturbed(made_up: MadeUp) -> None:
    hand, motion = written(made_up)
    model, units = made_up.model, made_up.model.units
    # The task pushes from 0.3 s to 0.9 s, and more from 0.5 s to 0.7 s.
    time = motion.time
    pushed = (time > 0.3 - 1e-9) & (time < 0.9 + 1e-9)
    twice = (time > 0.5 - 1e-9) & (time < 0.7 + 1e-9)
    expected = pushed[:, None] * np.array([0.3, 0, -0.5]) + twice[:, None] * np.array([0, 0.2, 0])
    assert motion.external_force_disturbed is not None
    assert motion.external_torque_disturbed is not None
    assert motion.contact_force_disturbed is not None
    np.testing.assert_allclose(motion.external_force_disturbed, expected, atol=1e-12)
    np.testing.assert_allclose(motion.external_torque_disturbed, pushed[:, None] * [0, 0.004, 0], atol=1e-12)
    assert not motion.external_force.any()
    np.testing.assert_array_equal(motion.contact_force_disturbed[~pushed], motion.contact_force[~pushed])
    forces = made_up.values["force_disturbed"].reshape(pushed.sum(), 3, 3)
    reference = Rotation.from_quat(model.reference, scalar_first=True)
    for s, force in zip(np.flatnonzero(pushed), forces, strict=True):
        turn = Rotation.from_rotvec(hand.vector[s]) * reference
        np.testing.assert_allclose(motion.contact_force_disturbed[s], turn.apply(force) * units.force, atol=1e-9)


def test_a_task_without_perturbations_has_no_disturbed_forces() -> None:
    hand, motion = written(sketching())
    assert hand.disturbed is None
    assert motion.contact_force_disturbed is None
    assert motion.external_force_disturbed is None
    assert motion.external_torque_disturbed is None


def free_task(text: str) -> Task:
    """A task that names no motors."""
    return parse_task("\n".join(line for line in text.splitlines() if not line.startswith("actuator")))


def test_loads_are_those_of_numeric_pinocchio_of_disturbed_forces_and_of_torsion_too(made_up: MadeUp) -> None:
    hand, _ = written(made_up)
    model = made_up.model
    assert hand.disturbed is not None
    assert hand.torsion is not None
    assert np.abs(hand.torsion).max() > 0.01
    torsion = hand.torsion
    reference = Rotation.from_quat(model.reference, scalar_first=True)
    palms = Rotation.from_quat(hand.palm_quaternion, scalar_first=True)
    largest = {"force": 0.0, "disturbed": 0.0}
    for finger, contact, angles in zip(hand.fingers, hand.contacts, hand.angles, strict=True):
        numeric = PinFinger(finger, model.link_radius)
        for s, row in enumerate(angles):
            turn = palms[s].inv() * Rotation.from_rotvec(hand.vector[s]) * reference
            point = palms[s].inv().apply(hand.position[s] - hand.palm_position[s]) + turn.apply(hand.point[s, contact])
            chain, link = numeric.chain(row)
            jacobian = numeric.jacobian(row, link.T @ (point - chain[-2]))
            normal = model.touched[contact].outward(hand.point[s, contact])
            moment = turn.apply(model.torsion * torsion[s, contact] * normal)
            steps = 1e-5 * np.eye(len(row))
            turned = [numeric.chain(row + step)[1] @ numeric.chain(row - step)[1].T for step in steps]
            twisted = np.array([Rotation.from_matrix(each).as_rotvec() / 2e-5 for each in turned]) @ moment
            for name in largest:
                torque = np.abs(jacobian.T @ turn.apply(getattr(hand, name)[s, contact]) + twisted).max()
                largest[name] = max(largest[name], float(torque))
    torque, speed = joint_loads(model, hand)
    assert torque == pytest.approx(max(largest.values()) * model.units.torque, rel=1e-6)
    # Without the disturbed ones the load is that of the plan; here it is smaller.
    assert largest["force"] < largest["disturbed"]
    calm, _ = joint_loads(model, replace(hand, disturbed=None))
    assert calm == pytest.approx(largest["force"] * model.units.torque, rel=1e-6)
    steps = np.diff(model.schedule.samples)
    assert speed == pytest.approx(max(np.abs(np.diff(a, axis=0).T / steps).max() for a in hand.angles))


def test_motors_have_a_reserve_and_the_named_ones_are_the_named_ones(made_up: MadeUp) -> None:
    hand, _ = written(made_up)
    built = hand_of(free_task(everything_text()), made_up.model, hand.fingers, hand.contacts, 0.2, 3.0)
    assert (built.effort, built.velocity) == pytest.approx((0.3, 4.5))
    named = hand_of(everything()[0], made_up.model, hand.fingers, hand.contacts, 0.2, 3.0)
    assert (named.effort, named.velocity) == (0.05, 6)


@pytest.mark.parametrize("scale", [1.0, 10.0])
def test_motors_of_a_motion_that_asks_nothing_of_them_still_turn(made_up: MadeUp, scale: float) -> None:
    task = free_task(everything_text(scale))
    model = build_model(task)
    hand = hand_of(task, model, made_up.start.fingers, made_up.start.contacts, 0.0, 0.0)
    # The object reaches from z = -45 mm to 50 mm, so a hundredth of its weight half as far away.
    assert hand.effort == pytest.approx(0.01 * 0.2 * 9.81 * scale * 0.0475 * scale)
    assert hand.velocity == pytest.approx(0.01)
    limits = [joint.find("limit") for joint in ElementTree.fromstring(hand_urdf(hand)).findall("joint")]
    assert len(limits) == 3
    assert all(float(limit.get(name, "0")) > 0 for limit in limits if limit is not None for name in KINDS)


def test_fingers_stand_on_the_palm_s_face(made_up: MadeUp) -> None:
    task, model = everything()
    hand = hand_of(task, model, made_up.start.fingers, made_up.start.contacts, 1.0, 1.0)
    for built, finger in zip(hand.fingers, made_up.start.fingers, strict=True):
        np.testing.assert_allclose(built.base[:2], finger.base * model.units.length, rtol=1e-12)
        assert built.base[2] == pytest.approx(1.05 * 0.006, rel=1e-12)


@pytest.mark.parametrize(
    ("value", "rounded"), [(5e-324, 0.0), (-1e-310, 0.0), (0.0, 0.0), (1.23456789012345e-300, 1.234567890123e-300)]
)
def test_numbers_of_any_size_are_rounded(value: float, rounded: float) -> None:
    assert round_off(value) == pytest.approx(rounded, rel=1e-14, abs=0.0)
    np.testing.assert_allclose(round_off([value, 1.0]), [rounded, 1.0], rtol=1e-14)


def test_only_last_links_are_as_thick_as_fingertips_and_stand_for_it_where_they_are_first(made_up: MadeUp) -> None:
    text = everything_text().replace("link_length: [0.012", "link_length: [0.02")
    task = parse_task(text + "fingertip: {radius: 0.008}\n")
    model = build_model(task)
    hand = hand_of(task, model, made_up.start.fingers, made_up.start.contacts, 1.0, 1.0)
    assert {len(finger.links) for finger in hand.fingers} == {1, 2}
    hinge = task.hand.hinge_length
    for finger in hand.fingers:
        alone = len(finger.links) == 1
        assert [link.radius for link in finger.links] == pytest.approx([0.006, 0.008][alone:])
        assert [link.hinge for link in finger.links] == pytest.approx([hinge, hinge * 4 / 3][alone:])
        assert finger.base[2] == pytest.approx(1.05 * (0.008 if alone else 0.006))


def test_contacts_are_written_on_the_surface_of_a_thick_tip(made_up: MadeUp) -> None:
    hand, _ = written(made_up)
    model = with_tips(made_up.model)
    motion = whole_hand_motion(model, hand)
    for finger, contact in zip(hand.fingers, hand.contacts, strict=True):
        column = motion.contact_names.index(model.contact_names[contact])
        ends = [[0, 0, model.hinge], [0, 0, finger.lengths[-1]]]
        for point in motion.contact_point_link[:, column] / model.units.length:
            on_axis = np.array([0, 0, np.clip(point[2], ends[0][2], ends[1][2])])
            assert np.linalg.norm(point - on_axis) == pytest.approx(model.tip_radius, abs=1e-6)
