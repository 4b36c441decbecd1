"""Servos in result folders: masses by Pinocchio, what the audit finds wrong, and where they are in the way."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.errors import DesignError
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.inertia import body_inertials
from casadi_hands.task.servos import SERVOS, Drive
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.reading.folder import read_folder
from tests.verify.fixture import Scene, carried


def with_servo(scene: Scene, name: str) -> Scene:
    drive = Drive(servo=name)
    task = scene.task.model_copy(update={"hand": scene.task.hand.model_copy(update={"drive": drive})})
    return replace(scene, task=task, hand=replace(scene.hand, servo=name))


def written(scene: Scene, directory: Path) -> Path:
    folder = scene.write(directory)
    (folder / "hand.urdf").write_text(hand_urdf(scene.hand))
    return folder


@pytest.fixture(scope="module")
def held(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("held"))


def skewed(hand: Hand) -> Hand:
    """The hand with axes that stand askew, along a link and across it."""
    axes = [(0.6, 0.0, 0.8), (0.0, 0.0, 1.0), (0.48, 0.6, 0.64)]
    fingers = [
        replace(finger, links=(finger.links[0], replace(finger.links[1], axis=axis)))
        for finger, axis in zip(hand.fingers, axes, strict=True)
    ]
    return replace(hand, fingers=tuple(fingers))


@pytest.mark.parametrize("name", ["SG90", "STS3215"])
def test_bodies_have_the_mass_of_their_servos(held: Scene, name: str) -> None:
    servo, hand = SERVOS[name], replace(skewed(held.hand), servo=name)
    found, bare = body_inertials(hand), body_inertials(replace(hand, servo=None))
    assert set(found) == {"palm", *(f"finger{i}_link{j}" for i in range(3) for j in range(2))}
    for i, finger in enumerate(hand.fingers):
        last = f"finger{i}_link1"
        assert np.array_equal(found[last].inertia, bare[last].inertia)
        own = bare[f"finger{i}_link0"]
        axis = np.array(finger.links[1].axis)
        # The shaft along the axis, the longest side as upright as it may be: Gram and Schmidt, by QR.
        upright = np.array([0.0, 0.0, 1.0]) if abs(axis[2]) < 1 else np.array([1.0, 0.0, 0.0])
        turn = np.linalg.qr(np.column_stack([axis, upright, np.cross(axis, upright)]))[0]
        turn[:, 2] *= np.linalg.det(turn)
        place = pin.SE3(turn, np.array([0.0, 0.0, finger.links[0].length]))
        case = place.act(pin.Inertia.FromBox(servo.mass, *servo.size))
        due = pin.Inertia(own.mass, own.center, own.inertia) + case
        assert found[f"finger{i}_link0"].mass == pytest.approx(due.mass)
        assert found[f"finger{i}_link0"].center == pytest.approx(due.lever)
        assert found[f"finger{i}_link0"].inertia == pytest.approx(due.inertia, rel=1e-9, abs=1e-12)
    assert found["palm"].mass == pytest.approx(bare["palm"].mass + 3 * servo.mass)


@pytest.mark.parametrize("skew", [False, True])
def test_the_files_agree_on_servos(held: Scene, tmp_path: Path, skew: bool) -> None:
    scene = with_servo(held, "SG90")
    if skew:  # of which only what the files say of the hand is asked
        scene = replace(scene, hand=skewed(scene.hand))
    found = audit_files(written(scene, tmp_path / "result"))
    assert (
        found.problems == () if not skew else not any("servo" in each or "inertia" in each for each in found.problems)
    )
    assert found.certified or skew, found.reasons


def test_bearings_bear_the_weight_of_servos(held: Scene, tmp_path: Path) -> None:
    heavy, light = (
        audit_files(written(scene, tmp_path / name)).figures["bearing_force"].value
        for name, scene in (("heavy", with_servo(held, "MG90S")), ("light", held))
    )
    assert heavy != pytest.approx(light, abs=1e-3)
    assert abs(heavy - light) <= SERVOS["MG90S"].mass * 9.81 + 1e-9


def text(file: str, pattern: str, new: str) -> Callable[[Path], None]:
    def change(folder: Path) -> None:
        old = (folder / file).read_text()
        changed = re.sub(pattern, new, old, count=1)
        assert changed != old
        (folder / file).write_text(changed)

    return change


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (text("hand.urdf", r'<box size="[^"]*"', '<box size="0.01 0.01 0.01"'), r"no SG90 stands on it in hand\.urdf"),
        (text("hand.urdf", r"<box size=\"(\S+) [^\"]*\"", r'<box size="\1 -1 1"'), r"a side of its box is -1 m"),
        (text("hand.urdf", r"<visual>(?:(?!<visual>).)*<box.*?</visual>", ""), r"servos in it, not"),
        (text("task.yaml", "servo: SG90", "servo: MG90S"), r"result\.json says SG90, the task MG90S"),
        (text("result.json", r', "servo": "SG90"', ""), r"servo: result\.json says none, the task SG90"),
        (text("hand.urdf", r'(name="finger0_link0".*?<mass value=")[^"]*', r"\g<1>0.01"), r"density and its servos"),
    ],
)
def test_wrong_servos_are_named(held: Scene, tmp_path: Path, change: Callable[[Path], None], words: str) -> None:
    folder = written(with_servo(held, "SG90"), tmp_path / "result")
    joined = "".join(line.strip() for line in (folder / "hand.urdf").read_text().splitlines())
    (folder / "hand.urdf").write_text(joined)
    change(folder)
    try:
        said = "\n".join(audit_files(folder).reasons)
    except DesignError as error:
        said = str(error)
    assert re.search(words, said), said


def test_a_servo_in_the_way_is_named(held: Scene, tmp_path: Path) -> None:
    folder = read_folder(written(with_servo(held, "STS3215"), tmp_path / "result"))
    figure = audit_files(folder.path).figures["penetration"]
    assert not figure.holds
    assert "the servo of joint finger" in figure.text
