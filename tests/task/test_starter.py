"""What `casadi-hands new` writes is a task that a hand may do, whatever is asked for."""

from __future__ import annotations

import math
from typing import Any

import jsonschema
import numpy as np
import pytest
import yaml

from casadi_hands.diagnosis.impossible import findings
from casadi_hands.errors import TaskError
from casadi_hands.problem.si import build_model
from casadi_hands.task import parse_task
from casadi_hands.task.loader import parse_questioned
from casadi_hands.task.schema import schema_line, task_schema
from casadi_hands.task.starter import MOTIONS, SIZES, USUAL, Idea, starter

SIZED = {"sphere": [(20,), (150,)], "capsule": [(50, 20), (120, 12)], "cylinder": [(66, 101)], "box": [(30, 200, 90)]}


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shape", SIZES)
def test_nothing_speaks_against_what_is_written(shape: str, motion: str) -> None:
    schema = jsonschema.Draft7Validator(task_schema())
    for size in [(), *SIZED[shape]]:
        for table in {False, motion in ("lift", "turn")}:
            idea = Idea("first try", shape=shape, size=size, motion=motion, table=table)
            text = starter(idea)
            task, questions = parse_questioned(text)
            assert (questions, findings(task, build_model(task))) == ([], [])
            assert (task.name, len(task.fingers), task.ground is not None) == ("first try", 3, table)
            assert schema.is_valid(yaml.safe_load(text))


def test_numbers_are_those_asked_for() -> None:
    text = starter(Idea("pill", shape="capsule", size=(50, 20), mass=30, motion="turn", amount=55, fingers=4))
    task = parse_task(text)
    assert task.object.mass == 0.03
    lower, upper = task.object.bounding_box
    assert upper - lower == pytest.approx([0.02, 0.05, 0.02])
    assert [goal.rotation.degrees for goal in task.motion] == [0, 55, 0]
    assert list(task.fingers) == ["thumb", "index", "middle", "ring"]
    assert text.splitlines()[0] == schema_line()


def test_a_mass_that_nobody_says_is_that_of_something_half_as_heavy_as_water() -> None:
    assert Idea("ball", shape="sphere", size=(60,)).kilograms == pytest.approx(
        500 * 4 / 3 * math.pi * 0.03**3, rel=0.05
    )
    task = parse_task(starter(Idea("brick", shape="box", size=(40, 60, 50))))
    assert task.object.mass == pytest.approx(500 * 0.04 * 0.06 * 0.05, rel=0.05)


def test_what_lies_on_a_table_touches_it() -> None:
    for shape in SIZES:
        task = parse_task(starter(Idea("x", shape=shape, motion="lift", amount=20, table=True)))
        first, last = (goal.position for goal in task.motion)
        assert first is not None
        assert last is not None
        assert first[2] + task.object.bounding_box[0][2] == pytest.approx(0, abs=1e-6)
        assert np.subtract(last, first) == pytest.approx([0, 0, 0.02])


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({"shape": "cone"}, "shape: given cone; allowed: sphere, capsule, cylinder, box"),
        ({"motion": "throw"}, "motion: given throw; allowed: lift, carry, turn, tilt"),
        ({"shape": "box", "size": (1, 2)}, "size: given 1 2; allowed: width, length, height of the box, mm, above 0"),
        ({"size": (30, 40)}, "size: given a capsule 30 mm long; allowed: its diameter and more"),
        ({"mass": -3.0}, "mass: given -3; allowed: a number greater than 0"),
        ({"fingers": 6}, "fingers: given 6; allowed: 2 to 5"),
        ({"motion": "tilt", "table": True}, "table: given with tilt; allowed: with lift or turn"),
    ],
)
def test_what_makes_no_task_is_refused(given: dict[str, Any], message: str) -> None:
    with pytest.raises(TaskError) as refused:
        Idea("x", **given)
    assert str(refused.value) == message


def test_fingertips_need_room() -> None:
    with pytest.raises(TaskError, match=r"^fingers: given 5 on 90 mm; allowed: a longer object, or fewer fingers$"):
        starter(Idea("x", fingers=5))
    assert len(parse_task(starter(Idea("x", size=(300, 40), fingers=5))).fingers) == 5


@pytest.mark.parametrize(
    "name", ["a: b", "#1", "it's", "true", "null", "3", "-", "- a", " a ", "two-words_and more", "ümlaut"]
)
def test_any_name_is_the_task_s(name: str) -> None:
    assert parse_task(starter(Idea(name))).name == name


def test_every_shape_has_its_usual_size() -> None:
    assert {shape: len(size) for shape, size in USUAL.items()} == {shape: len(names) for shape, names in SIZES.items()}
