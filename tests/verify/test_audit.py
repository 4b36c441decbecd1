"""The audit passes a result that is right and names what is wrong with one that is not."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.errors import DesignError
from casadi_hands.task import task_to_yaml
from casadi_hands.verify import audit, run_replays
from casadi_hands.verify.report import Audit
from tests.verify.fixture import SPHERE, Scene, carried, object_urdf, plain, read_task


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"))


def test_a_good_result_is_certified(good: Scene, tmp_path: Path) -> None:
    found = audit(good.write(tmp_path / "good"))
    assert found.certified, found.reasons
    assert found.reasons == []
    assert found.figures["residual"].value < 1e-7
    assert found.figures["gap"].value < 1e-12
    assert found.figures["slip"].value < 5e-5
    assert found.figures["friction_excess"].value < -0.5


def test_certificate_is_json(good: Scene, tmp_path: Path) -> None:
    found = audit(good.write(tmp_path / "good"))
    certificate = json.loads(json.dumps(found.as_certificate(), allow_nan=False))
    limits = good.task.limits.model_dump()
    # Of hands whose joints share motors, and of objects on joints.
    assert limits.keys() - certificate.keys() == {"coupling", "attachment_shortfall"}
    assert all(entry["holds"] for entry in certificate.values())


def test_replays_that_are_stated_are_those_that_are_played(good: Scene, tmp_path: Path) -> None:
    played = run_replays(good.write(tmp_path / "played"))
    figures = {figure.name: figure for figure in played.figures()}
    record, certificate = played.record(), Audit("", figures, ()).as_certificate()
    stated = replace(good, changes={"replays": [record], "certificate": certificate})
    assert audit(stated.write(tmp_path / "stated")).reasons == []
    goals = [{"mm": 0.0, "degrees": 0.0}, *record["goals"][1:]]
    goals[-1] = {"mm": 99.0, "degrees": record["goals"][-1]["degrees"]}
    falsified = {**record, "dropped_as_planned": True, "dropped": 20, "goals": goals}
    certificate["replay_position"] = {**certificate["replay_position"], "value": 0.05, "limit": 1.0}
    certificate["replay_angle"] = {**certificate["replay_angle"], "value": None}
    certificate["replay_dropped"] = {**certificate["replay_dropped"], "unit": "m"}
    stated = replace(good, changes={"replays": [falsified], "certificate": certificate})
    reasons = "\n".join(audit(stated.write(tmp_path / "falsified")).reasons)
    for words in (
        "certificate: result.json says replay_position is 50 mm, the files give",
        "certificate: the limit of replay_position in result.json is not the task's",
        "certificate: result.json states no number for replay_angle",
        "certificate: result.json has replay_dropped in other units than the task",
        "replays: result.json says otherwise, but the hand holds the object as planned",
        f"replays: result.json says 20 of {record['of']} drop the object, {record['dropped']} do",
        f"replays: result.json says 99 mm off goal {len(goals)}, it is ",
    ):
        assert words in reasons, reasons
    # A task that is trusted says nothing of replays: these are the folder's all the same.
    trusted = tmp_path / "falsified" / "task.yaml"
    assert "99 mm off goal" in "\n".join(audit(tmp_path / "falsified", task=trusted).reasons)


def _force_scaled(scene: Scene) -> Scene:
    return scene.moved(contact_force=1.02 * scene.motion.contact_force)


def _contact_moved(scene: Scene) -> Scene:
    points = scene.motion.contact_point_object.copy()
    points[:, 1, 2] += 1e-3
    return scene.moved(contact_point_object=points)


def _joint_shifted(scene: Scene) -> Scene:
    angles = scene.motion.joint_angles.copy()
    angles[7, 3] += np.deg2rad(1.0)
    return scene.moved(joint_angles=angles)


def _normal_flipped(scene: Scene) -> Scene:
    points = scene.motion.contact_point_link.copy()
    length = scene.hand.fingers[2].links[1].length
    points[:, 2] = np.array([0, 0, 2 * length]) - points[:, 2]
    return scene.moved(contact_point_link=points)


def _force_flipped(scene: Scene) -> Scene:
    force = scene.motion.contact_force.copy()
    force[4, 0] *= -1.0
    return scene.moved(contact_force=force)


def _contacts_swapped(scene: Scene) -> Scene:
    one, two, three = scene.motion.contact_link
    return scene.moved(contact_link=(two, one, three))


def _forces_swapped(scene: Scene) -> Scene:
    return scene.moved(contact_force=scene.motion.contact_force[:, [1, 0, 2]])


def _time_stretched(scene: Scene) -> Scene:
    return scene.moved(time=1.05 * scene.motion.time)


def _link_shortened(scene: Scene) -> Scene:
    first = scene.hand.fingers[0]
    links = (replace(first.links[0], length=first.links[0].length - 1e-3), first.links[1])
    return replace(scene, hand=replace(scene.hand, fingers=(replace(first, links=links), *scene.hand.fingers[1:])))


def _quaternion_not_unit(scene: Scene) -> Scene:
    return scene.moved(object_orientation=1.001 * scene.motion.object_orientation)


def _goal_text(scene: Scene, directory: Path) -> Scene:
    moved = scene.task.motion[1].model_copy(
        update={"position": tuple((np.array(scene.task.motion[1].position) + np.array([0, 0, 1e-3])).tolist())}
    )
    task = scene.task.model_copy(update={"motion": (scene.task.motion[0], moved, scene.task.motion[2])})
    return replace(scene, task=read_task(directory, task_to_yaml(task)))


@pytest.mark.parametrize(
    ("tamper", "figures", "words"),
    [
        (_force_scaled, {"residual", "residual_between"}, "nothing exerts"),
        (_contact_moved, {"gap", "residual"}, "contact 'two' is at two places"),
        (_joint_shifted, {"gap"}, "finger 'two' (link 1)"),
        (_normal_flipped, {"gap"}, "contact 'three' is at two places 12 mm apart"),
        (_force_flipped, {"pull"}, "contact 'one' at 0.4 s"),
        (_contacts_swapped, {"structure", "gap"}, "contact 'one' is on finger 'two' (link 1), not on its own finger"),
        (_forces_swapped, {"residual", "pull"}, "nothing exerts"),
        (_time_stretched, {"structure", "residual"}, "time: samples are up to 0.105 s apart"),
        (_link_shortened, {"gap"}, "finger 'one' (link 1)"),
        (_quaternion_not_unit, {"structure"}, "object_orientation: the quaternion at"),
    ],
)
def test_tampering_is_named(
    good: Scene, tmp_path: Path, tamper: Callable[[Scene], Scene], figures: set[str], words: str
) -> None:
    found = audit(tamper(good).write(tmp_path / "bad"))
    assert not found.certified
    assert figures <= {name for name, figure in found.figures.items() if not figure.holds}
    assert any(words in reason for reason in found.reasons), found.reasons


def test_what_moves_the_object_at_a_sample_is_of_the_intervals_that_meet_there(good: Scene, tmp_path: Path) -> None:
    force = good.motion.contact_force.copy()
    force[4] *= 1.001
    residual = audit(good.moved(contact_force=force).write(tmp_path / "bad")).figures["residual"]
    assert residual.by_interval is not None
    assert residual.by_interval.shape == (len(force) - 1,)
    assert residual.by_interval.max() == residual.by_interval[3] == residual.by_interval[4] == residual.value
    far = np.delete(residual.by_interval, [2, 3, 4, 5])
    assert far.max() < 1e-3 * residual.value


def test_goals_moved_in_the_task_are_missed(good: Scene, tmp_path: Path) -> None:
    found = audit(_goal_text(good, tmp_path).write(tmp_path / "bad"))
    assert found.figures["goal_position"].value == pytest.approx(1e-3, rel=1e-6)
    assert found.reasons == ["the object is 1 mm from goal 2 at 1 s; limit 0.5 mm"]


def test_goals_moved_in_the_result_are_named(good: Scene, tmp_path: Path) -> None:
    folder = good.write(tmp_path / "bad")
    record = json.loads((folder / "result.json").read_text())
    record["goals"][1]["position"][0] += 0.01
    (folder / "result.json").write_text(json.dumps(record))
    assert audit(folder).reasons == ["goals: goal 2 of result.json is not that of task.yaml"]


def test_mass_changed_in_one_file_is_named(good: Scene, tmp_path: Path) -> None:
    folder = good.write(tmp_path / "bad")
    heavier = good.task.model_copy(update={"object": good.task.object.model_copy(update={"mass": 0.11})})
    (folder / "object.urdf").write_text(object_urdf(heavier))
    found = audit(folder)
    assert "mass: object.urdf says 0.11 kg, task.yaml says 0.1 kg" in found.reasons
    assert not found.figures["residual"].holds


def test_mass_changed_everywhere_leaves_a_residual(good: Scene, tmp_path: Path) -> None:
    heavier = good.task.model_copy(update={"object": good.task.object.model_copy(update={"mass": 0.11})})
    found = audit(replace(good, task=heavier).write(tmp_path / "bad"))
    assert found.figures["structure"].holds
    # The forces of 0.1 kg carry 10/11 of 0.11 kg: one eleventh of the weight is missing, and more where it accelerates.
    assert 0.09 < found.figures["residual"].value < 0.12


def test_link_shortened_in_the_urdf_alone_is_named(good: Scene, tmp_path: Path) -> None:
    folder = _link_shortened(good).write(tmp_path / "bad")
    whole = json.loads((good.write(tmp_path / "good") / "result.json").read_text())
    (folder / "result.json").write_text(json.dumps(whole))
    assert any("finger 'one' (link 0): hand.urdf has a capsule of" in reason for reason in audit(folder).reasons)


def test_help_from_nowhere_is_named(good: Scene, tmp_path: Path) -> None:
    helped = good.moved(external_force=np.full((21, 3), 0.01))
    assert any(
        "the object is helped by what the task does not state" in r for r in audit(helped.write(tmp_path)).reasons
    )


@pytest.mark.parametrize(
    ("name", "change", "message"),
    [
        ("contact_force", lambda a: a[:, :2], r"contact_force has shape \(21, 2, 3\), not \(21, 3, 3\)"),
        ("time", lambda a: a[::-1], "three increasing samples"),
        ("joint_angles", lambda a: a * np.nan, "joint_angles holds a number that is not finite"),
        ("joint_names", lambda a: a[::-1] + "x", "are not the joints of hand.urdf"),
        ("contact_link", lambda a: a + "x", "no link of hand.urdf"),
        ("base_orientation", lambda a: 0 * a, "zero quaternion"),
    ],
)
def test_unreadable_motion_is_refused(
    good: Scene, tmp_path: Path, name: str, change: Callable[[np.ndarray], np.ndarray], message: str
) -> None:
    folder = good.write(tmp_path / "bad")
    with np.load(folder / "motion.npz") as file:
        arrays = dict(file)
    array = arrays[name]
    arrays[name] = np.char.add(array, "x") if array.dtype.kind == "U" else change(array)
    np.savez(folder / "motion.npz", **arrays)
    with pytest.raises(DesignError, match=message):
        audit(folder)


def test_a_hand_of_one_joint_is_audited(tmp_path: Path) -> None:
    text = SPHERE.replace(", right: {touches: [0.03, 0, 0]}", "") + "gravity: [0, 0, 0]\n"
    force = np.tile([0.1, 0.0, 0.0], (11, 1, 1))
    scene = plain(
        read_task(tmp_path, text),
        np.linspace(0.0, 1.0, 11),
        contact_active=np.ones((11, 1), dtype=bool),
        contact_force=force,
        contact_point_object=np.tile([-0.03, 0.0, 0.0], (11, 1, 1)),
    )
    found = audit(scene.write(tmp_path / "result"))
    assert scene.hand.degrees_of_freedom == 1
    assert not found.figures["residual"].holds
    assert not found.figures["gap"].holds
    assert found.problems == ()


@pytest.mark.parametrize("name", ["task.yaml", "hand.urdf", "object.urdf", "motion.npz", "result.json"])
def test_missing_file_is_named(good: Scene, tmp_path: Path, name: str) -> None:
    folder = good.write(tmp_path / "bad")
    (folder / name).unlink()
    with pytest.raises(DesignError, match=name):
        audit(folder)
