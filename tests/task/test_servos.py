"""Servos in the joints: what a task may name, and the motors that follow."""

import math

import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task import parse_task, task_to_yaml
from casadi_hands.task.hand import USUAL_STIFFNESS
from casadi_hands.task.servos import SERVOS

TEXT = """\
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [0, 0, 0.2]}]
fingers: {thumb: {touches: [0.03, 0, 0]}, index: {touches: [-0.03, 0, 0]}}
"""


@pytest.mark.parametrize("name", SERVOS)
def test_motors_and_links_follow_the_servo_and_it_survives_saving(name: str) -> None:
    task, servo = parse_task(TEXT + f"hand: {{drive: {{servo: {name}}}}}"), SERVOS[name]
    assert task.hand.drive.motor is servo
    assert (task.actuator.torque, task.actuator.speed) == (servo.continuous, servo.speed)
    assert task.actuator.stiffness == (servo.stiffness or USUAL_STIFFNESS)
    assert task.limits.least_stiffness == task.actuator.stiffness
    assert task.hand.link_length[0] == pytest.approx(max(3 * task.hand.link_radius, math.dist((0, 0, 0), servo.size)))
    assert parse_task(task_to_yaml(task)) == task


@pytest.mark.parametrize("given", ["", "hand: {drive: remote}\n"])
def test_remote_motors_are_free(given: str) -> None:
    task = parse_task(TEXT + given)
    assert task.hand.drive.motor is None
    assert task.actuator.torque is None
    assert task.hand.link_length[0] == 3 * task.hand.link_radius
    assert "drive: remote" in task_to_yaml(task)
    assert parse_task(task_to_yaml(task)) == task


def test_motors_of_the_task_s_own_stay() -> None:
    task = parse_task(TEXT + "hand: {drive: {servo: SG90}, link_length: [0.02, 0.1]}\nactuator: {torque: 0.1}")
    assert (task.actuator.torque, task.actuator.speed) == (0.1, SERVOS["SG90"].speed)
    assert task.hand.link_length == (0.02, 0.1)


def test_the_library_is_what_makers_say() -> None:
    """Kilogram-force centimetres, turns a minute, and that a motor's speed falls evenly to its stall torque."""
    for servo in SERVOS.values():
        assert 0.15 < servo.continuous / servo.stall < 0.4
        assert servo.speed / servo.no_load + servo.continuous / servo.stall == pytest.approx(1)
        # Servos' cases are filled with plastic, copper and steel.
        assert 800 < servo.mass / math.prod(servo.size) < 2000
    assert SERVOS["STS3215"].stall == pytest.approx(30 * 9.81 / 100, rel=1e-2)
    assert SERVOS["SG90"].stall == pytest.approx(1.8 * 9.81 / 100, rel=5e-3)
    assert SERVOS["XL330-M288"].no_load == pytest.approx(103 * 2 * math.pi / 60)


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("near", "task:5: hand.drive: given 'near'; allowed: remote, or {servo: NAME}"),
        ("{servo: SG91}", "task:5: hand.drive.servo: given 'SG91'; allowed: one of SG90, MG90S, XL330-M077, "),
        ("{motor: SG90}", "hand.drive.motor"),
    ],
)
def test_what_is_no_drive_is_refused(given: str, words: str) -> None:
    with pytest.raises(TaskError) as refused:
        parse_task(TEXT + f"hand: {{drive: {given}}}")
    assert words in str(refused.value)


@pytest.mark.parametrize("given", ["fewest", "2"])
def test_servos_in_the_joints_are_motors_of_their_own(given: str) -> None:
    """A joint whose servo is in it shares no other: nothing pulls at it but that servo."""
    with pytest.raises(TaskError) as refused:
        parse_task(TEXT + f"hand: {{drive: {{servo: SG90}}}}\nmotors: {given}")
    says = f"task:6: motors: given {given if given == '2' else repr(given)}; allowed: independent with hand.drive.servo"
    assert str(refused.value).startswith(says)
    assert "\n" not in str(refused.value)
    assert parse_task(TEXT + "hand: {drive: {servo: SG90}}\nmotors: independent").motors == "independent"
    assert str(parse_task(TEXT + f"motors: {given}").motors) == given


@pytest.mark.parametrize("given", ["many", "1.5", "0", "true"])
def test_what_is_no_number_of_motors_is_refused_once(given: str) -> None:
    with pytest.raises(TaskError) as refused:
        parse_task(TEXT + f"motors: {given}")
    assert str(refused.value).endswith("; allowed: independent, fewest, or a whole number of at least 1")
    assert str(refused.value).startswith("task:5: motors: given ")
