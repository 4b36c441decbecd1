"""One good result, falsified in many ways: the audit certifies none and names the thing each time."""

from __future__ import annotations

import os
import re
import shutil
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.export.table import motion_table
from casadi_hands.task import load_task, task_to_yaml
from casadi_hands.verify.audit import audit, audit_files
from casadi_hands.verify.reading.folder import read_folder
from tests.verify.falsified_files import DISAGREEMENTS
from tests.verify.falsified_hand import HAND_AGAINST_TASK, HIDDEN
from tests.verify.falsified_motion import DISTURBANCES, NO_NUMBERS, TORSION
from tests.verify.falsified_scene import IN_THE_SCENE
from tests.verify.falsify import (
    DISTURBED,
    HAND,
    LINK,
    SCENE,
    THING,
    Falsify,
    added,
    arrays,
    edited,
    refusal,
    removed,
    reordered,
    task,
    text,
)
from tests.verify.fixture import Scene, carried

MORE = """
perturbations: [{from: 0.45, to: 0.85, force: [0.1, 0, -0.3]}, {from: 1.22, to: 1.28, torque: [0, 0, 0.002]}]
ground: {height: 0, touches: [0, 0, -0.05]}
"""


@pytest.fixture(scope="module")
def scene(tmp_path_factory: pytest.TempPathFactory) -> Scene:
    return carried(tmp_path_factory.mktemp("task"), MORE)


@pytest.fixture(scope="module")
def good(scene: Scene, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = scene.write(tmp_path_factory.mktemp("good"))
    (folder / "motion.csv").write_text(motion_table(read_folder(folder).motion))
    return folder


@pytest.fixture
def bad(good: Path, tmp_path: Path) -> Path:
    return shutil.copytree(good, tmp_path / "bad")


def test_the_good_result_is_certified(good: Path) -> None:
    assert audit(good, replays=0).reasons == []


CASES = {
    f"{kind}: {name}": case
    for kind, cases in {
        "disturbances": DISTURBANCES,
        "torsion": TORSION,
        "hand against task": HAND_AGAINST_TASK,
        "hidden": HIDDEN,
        "no numbers": NO_NUMBERS,
        "disagreement": DISAGREEMENTS,
        "scene": IN_THE_SCENE,
    }.items()
    for name, case in cases.items()
}


def test_there_are_many() -> None:
    assert len(CASES) >= 120


@pytest.mark.parametrize("name", CASES)
def test_falsified_results_are_refused_and_the_thing_is_named(bad: Path, name: str) -> None:
    falsify, named = CASES[name]
    falsify(bad)
    said = refusal(bad)
    if name == "disagreement: a later certificate":
        said = "\n".join(audit(bad, replays=0).reasons)
    assert said, "certified"
    assert re.search(named, said), said


@pytest.mark.parametrize("gravity", [(0.0, 0.0, -9.81), (0.0, 0.0, 0.0)])
@pytest.mark.parametrize("start", ["thrown", "spun"])
def test_an_object_that_no_hand_touches_is_not_certified(
    scene: Scene, tmp_path: Path, gravity: tuple[float, float, float], start: str
) -> None:
    """Where it falls from, it comes back to, or turns once, all by itself and exactly."""
    time = scene.motion.time
    rise = np.outer(time * (time[-1] - time), [0, 0, 0.5 * 9.81]) if any(gravity) else np.outer(time, [0, 0, 0.1])
    turn = Rotation.from_rotvec(np.outer(time, [0, 0, np.pi if start == "spun" else 0.0]))
    where, still = np.array([0.3, 0, 0.28]) + rise, np.array([0.0, 0.0, 0.2])
    goals = (
        scene.task.motion[0].model_copy(update={"position": tuple(where[0].tolist())}),
        scene.task.motion[2].model_copy(update={"position": tuple(where[-1].tolist())}),
    )
    task = scene.task.model_copy(update={"motion": goals, "gravity": gravity, "perturbations": ()})
    motion = replace(
        scene.motion,
        object_position=where,
        object_orientation=turn.as_quat(scalar_first=True),
        base_position=np.tile(still, (len(time), 1)),
        base_orientation=np.tile(scene.motion.base_orientation[0], (len(time), 1)),
        contact_active=np.zeros_like(scene.motion.contact_active),
        contact_force=np.zeros_like(scene.motion.contact_force),
        contact_moment=np.zeros_like(scene.motion.contact_force),
        **dict.fromkeys(DISTURBED),
    )
    found = audit_files(replace(scene, task=task, motion=motion).write(tmp_path))
    assert [name for name, figure in found.figures.items() if not figure.holds] == ["rest"]
    assert re.search(r"the object (starts|ends) with .*; a motion starts and ends at rest", found.reasons[0])


@pytest.mark.parametrize(
    "vary",
    [
        edited(HAND, LINK, lambda e, p: e.insert(0, ElementTree.Comment("the proximal one"))),
        edited(HAND, ".//limit", lambda e, p: reordered(e), every=True),
        edited(SCENE, ".//geom", lambda e, p: reordered(e), every=True),
        edited(HAND, ".", lambda e, p: e.__setitem__(slice(None), sorted(e, key=lambda child: child.tag))),
        edited(SCENE, "worldbody//geom", lambda e, p: e.set("rgba", "1 0 0 1"), every=True),
        added(SCENE, "worldbody", "<camera name='above' pos='0 0 1'/>"),
        removed(SCENE, "statistic"),
        text("result.json", "{", '{"comment": "an entry more", ', 1),
        arrays(more=np.arange(3)),
        lambda folder: (folder / "motion.csv").unlink(),
        lambda folder: (folder / "notes.txt").write_text("of the reader"),
        task("actuator: {torque: 0.5, speed: 5.0, stiffness: 1.0}\n", ""),
    ],
)
def test_what_says_the_same_stays_certified(bad: Path, vary: Falsify) -> None:
    vary(bad)
    assert refusal(bad) == ""


@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "link to nothing"])
def test_a_table_that_is_no_file_is_not_passed_over(bad: Path, kind: str) -> None:
    table = bad / "motion.csv"
    table.unlink()
    if kind == "pipe":
        os.mkfifo(table)
    elif kind == "folder":
        table.mkdir()
    else:
        table.symlink_to("/dev/zero" if kind == "device" else "nowhere")
    assert "motion.csv" in refusal(bad)


def test_a_trusted_task_judges_and_says_what_the_folder_says_otherwise(good: Path, bad: Path, tmp_path: Path) -> None:
    trusted = tmp_path / "trusted.yaml"
    shutil.copy(good / "task.yaml", trusted)
    assert audit(bad, task=trusted, replays=0).reasons == []
    task("  slip: 0.0002", "  slip: 0.005")(bad)
    found = audit(bad, task=trusted, replays=0)
    assert found.certified
    assert "limits.slip: 5 mm in the folder's task, 0.2 mm by default (looser)" in found.notes
    assert f"limits.slip: 5 mm in the folder's task, 0.2 mm in {trusted}, which is what counts" in found.notes
    assert found.figures["slip"].limit == 0.0002
    assert "limits.slip: 5 mm in the folder's task, 0.2 mm by default (looser)" in audit(bad, replays=0).notes
    task("density: 1240.0", "density: 1000.0")(bad)
    found = audit(bad, task=trusted, replays=0)
    assert f"task.yaml is not {trusted}: hand.density (1000.0, there 1240.0)" in found.problems


def test_of_a_trusted_task_the_order_of_fingers_says_nothing(good: Path, tmp_path: Path) -> None:
    """Though links are numbered by the folder's own."""
    trusted = tmp_path / "trusted.yaml"
    written = load_task(good / "task.yaml")
    names = list(written.fingers)
    reversed_ = {name: written.fingers[name] for name in reversed(names)}
    trusted.write_text(task_to_yaml(written.model_copy(update={"fingers": reversed_})), encoding="utf-8")
    assert list(load_task(trusted).fingers) == names[::-1] != names
    assert audit(good, task=trusted, replays=0).reasons == []


def test_a_file_may_begin_with_the_mark_of_its_encoding(good: Path, bad: Path) -> None:
    for name in ("result.json", "scene.xml", "hand.urdf"):
        (bad / name).write_bytes(b"\xef\xbb\xbf" + (good / name).read_bytes())
    assert audit(bad, replays=0).reasons == []


def test_solids_are_compared_both_ways(tmp_path: Path) -> None:
    """A task may have one shape twice: a scene that has it once has room for another."""
    twice = carried(tmp_path / "task")
    shapes = twice.task.object.shapes
    twice = replace(
        twice,
        task=twice.task.model_copy(
            update={"object": twice.task.object.model_copy(update={"shapes": (*shapes, *shapes)})}
        ),
    )
    folder = twice.write(tmp_path / "twice")
    assert not any("solids of the object" in reason for reason in audit_files(folder).reasons)
    edited(SCENE, f"{THING}/geom", lambda e, p: e.set("size", "0.001"))(folder)
    assert any("solids of the object" in reason for reason in audit_files(folder).reasons)


def test_a_trusted_task_is_the_users_own_words(good: Path, scene: Scene, tmp_path: Path) -> None:
    short = tmp_path / "short.yaml"
    lines = (good / "task.yaml").read_text().split("weights:")[0].splitlines()
    short.write_text("\n".join(line for line in lines if not line.startswith(("about", "duration", "time_step"))))
    assert audit(good, task=short, replays=0).problems == ()
