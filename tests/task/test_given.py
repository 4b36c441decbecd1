"""Tasks from mappings, and tasks with changes: checked, and with defaults, as files that say the same."""

from __future__ import annotations

import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from casadi_hands.errors import TaskError
from casadi_hands.task import Task, load_task, parse_task, task_to_yaml
from casadi_hands.task.yamlfile import TaskFile
from tests.task.test_refusals import GOOD, SPOILT

PROBLEMS = sorted((Path(__file__).parents[2] / "problems").glob("*.yaml"))
HEAVY_END = GOOD.replace("mass: 0.1", "mass: 0.1\n  center_of_mass: [0, 0, 0.01]")


def fields(text: str) -> dict[str, Any]:
    return TaskFile(text, "task").data


@pytest.mark.parametrize("path", PROBLEMS[::4], ids=lambda path: path.stem)
def test_a_mapping_is_the_task_of_a_file_that_says_the_same(path: Path) -> None:
    assert load_task(fields(path.read_text())) == load_task(path)


def test_arrays_and_tuples_are_lists() -> None:
    given = fields(GOOD)
    given["palm"]["position"] = np.array([0, 0, 0.3])
    given["object"]["mass"] = np.float64(0.1)
    given["fingers"]["thumb"]["touches"] = (0, 0.02, -0.01)
    given["search"] = {"seed": np.int64(3)}
    task = load_task(given)
    assert task == parse_task(GOOD + "search: {seed: 3}")
    given["palm"]["position"][2] = 9  # the task is its own
    assert task.changed().palm.position == (0, 0, 0.3)


@pytest.mark.parametrize("kind", ["negative mass", "misspelt field", "missing section", "vector too short"])
def test_wrong_mappings_get_the_messages_of_files_without_lines(kind: str) -> None:
    old, new, told = SPOILT[kind]
    with pytest.raises(TaskError) as refused:
        load_task(fields(GOOD.replace(old, new, 1)))
    text = told.partition(": ")[2]
    pattern = "task: " + ".*".join(re.escape(part) for part in text.split("..."))
    assert re.fullmatch(pattern, str(refused.value))


@pytest.mark.parametrize("value", [object(), {1, 2}, b"heavy", "a\x1b[2J", 1j])
def test_what_no_file_can_give_is_refused(value: Any) -> None:
    with pytest.raises(TaskError, match=r"^task: object\.mass: given .*; allowed: mappings, lists, arrays, numbers"):
        load_task({**fields(GOOD), "object": {"mass": value}})


def test_a_mapping_in_itself_is_refused() -> None:
    given: dict[str, Any] = fields(GOOD)
    given["object"]["shapes"] = given
    with pytest.raises(TaskError, match="nested too deeply"):
        load_task(given)


@pytest.mark.parametrize("text", [GOOD, HEAVY_END], ids=["as given", "in another frame"])
@pytest.mark.parametrize(
    ("changes", "same"),
    [
        ({"friction": 0.4}, "friction: 0.4"),
        ({"actuator": {"stiffness": 2}}, "actuator: {stiffness: 2}"),
        ({"hand": {"bend": 0}, "ground": {"height": 0.1}}, "hand: {bend: 0}\nground: {height: 0.1}"),
        ({"search": {"seed": 4}}, "search: {seed: 4}"),
    ],
)
def test_a_changed_task_is_that_of_a_file_with_the_change(changes: dict[str, Any], same: str, text: str) -> None:
    assert parse_task(text).changed(**changes) == parse_task(f"{text}\n{same}\n")


def test_defaults_follow_what_is_changed() -> None:
    task = parse_task(GOOD + "ground: {}\n")
    changed = task.changed(friction=0.4, actuator={"stiffness": 2})
    assert task.ground is not None
    assert changed.ground is not None
    assert (task.ground.friction, changed.ground.friction) == (0.5, 0.4)
    assert changed.fingertip.torsion == pytest.approx(0.8 * task.fingertip.torsion)
    assert (task.limits.least_stiffness, changed.limits.least_stiffness) == (1, 2)


def test_what_is_not_named_stays_and_none_takes_away() -> None:
    task = parse_task(GOOD + "hand: {bend: 0, link_radius: 0.009}\n")
    changed = task.changed(hand={"link_radius": 0.007}, fingers={"ring": {"touches": [0, 0.02, 0.03]}})
    assert (changed.hand.bend, changed.hand.link_radius) == (0, 0.007)
    assert list(changed.fingers) == ["thumb", "index", "ring"]
    again = changed.changed(hand=None, fingers={"ring": None})
    assert again == parse_task(GOOD)


def test_changes_are_checked() -> None:
    with pytest.raises(TaskError) as refused:
        parse_task(GOOD).changed(friction=-1, hurry=2)
    assert str(refused.value).splitlines()[0].startswith("task: ")
    assert "friction: given -1; allowed: a number greater than 0" in str(refused.value)
    assert "hurry: given an unknown field" in str(refused.value)


def test_copies_keep_what_was_given_or_all_that_follows() -> None:
    task = parse_task(HEAVY_END + "ground: {}\n")
    seeded = task.model_copy(update={"search": task.search.model_copy(update={"seed": 7})})
    changed = seeded.changed(friction=0.4)
    assert (changed.search.seed, changed.friction) == (7, 0.4)
    assert changed == parse_task(HEAVY_END + "ground: {}\nsearch: {seed: 7}\nfriction: 0.4\n")
    still = task.model_copy(update={"fingers": dict(list(task.fingers.items()))})
    assert still.changed() == task


def test_what_was_given_is_no_part_of_a_task() -> None:
    task = parse_task(GOOD)
    assert parse_task(task_to_yaml(task)) == task
    assert pickle.loads(pickle.dumps(task)) == task
    assert pickle.loads(pickle.dumps(task)).changed(friction=0.4) == task.changed(friction=0.4)
    bare = Task.model_validate(yaml.safe_load(GOOD))
    with pytest.raises(TaskError, match="that load_task gave"):
        bare.changed(friction=0.4)


def test_meshes_are_looked_for_where_the_file_was() -> None:
    path = PROBLEMS[0].parent / "objects" / "mug.yaml"
    assert load_task(path).changed(friction=0.9).object == load_task(path).object
