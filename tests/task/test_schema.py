"""The JSON Schema takes what the program takes, and refuses what is wrong with fields, kinds and sizes."""

from __future__ import annotations

import json
from contextlib import suppress
from pathlib import Path
from typing import Any

import jsonschema
import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task import parse_task, task_to_yaml
from casadi_hands.task.schema import SCHEMA_FILE, schema_line, schema_text, task_schema
from casadi_hands.task.structure import walk
from casadi_hands.task.task import Task
from casadi_hands.task.yamlfile import TaskFile
from tests.task.test_bounds import EXTREME, HEAD
from tests.task.test_bounds import REFUSED as BEYOND
from tests.task.test_refusals import DRAWING, FINGERS, GOOD, SPOILT
from tests.task.test_region import NAMED, REGIONS
from tests.task.test_region import REFUSED as COUNTED
from tests.task.test_task_mesh import REFUSED as WITH_MESHES
from tests.task.test_task_mesh import TASK as MESH

ROOT = Path(__file__).parents[2]
PROBLEMS = sorted((ROOT / "problems").rglob("*.yaml"))
SCHEMA = jsonschema.Draft7Validator(task_schema())


def without(text: str, more: str) -> str:
    """A task without the lines that say what others say of the same field."""
    field = more.partition(":")[0]
    return "".join(line for line in text.splitlines(keepends=True) if not line.startswith(f"{field}:"))


WRONG = {
    **{f"refusal: {name}": GOOD.replace(old, new, 1) for name, (old, new, _) in SPOILT.items()},
    **{f"bound: {name}": HEAD.replace(old, new, 1) for name, (old, new, _) in BEYOND.items()},
    **{f"fingers: {name}": GOOD.replace(FINGERS, f"{given}\n") for name, (given, _) in COUNTED.items()},
    **{f"region: {name}": NAMED.replace("[0, 0.02, -0.01]", given) for name, (given, _) in REGIONS.items()},
    **{f"mesh: {name}": MESH.replace(old, new, 1) for name, (old, new, _) in WITH_MESHES.items()},
    **{
        f"other: {more}": without(HEAD, more) + more
        for more in (
            "hand: {material: wood}",
            "hand: {material: {density: 1000, stiffness: 2.0e9}}",
            "hand: {safety_factor: 0.5}",
            "hand: {drive: near}",
            "hand: {drive: {servo: SG91}}",
            "hand: {drive: {motor: SG90}}",
            "motors: many",
            "motors: 1.5",
            "motors: 0",
            "motors: true",
            "ground: nothing",
            "palm: anywhere",
            "palm: {auto: false}",
            "palm: {auto: 1}",
            "palm: {auto: true, position: [0, 0, 0.3]}",
            "palm: {auto: true, motion: [{at: 1, position: [0, 0, 0.3]}]}",
            "palm: {facing: [1, 0, 0]}",
            "keep_out: [{name: shelf}]",
            "keep_out: [{box: {center: [0, 0, 1], size: [0, 1, 1]}}]",
            "keep_out: {box: {center: [0, 0, 1], size: [1, 1, 1]}}",
            "fingers: 9",
            "fingers: many",
            "fingers: {count: 0}",
        )
    },
}
# What needs more than one field's own kind and size to be seen, and what JSON has no word for (a NaN).
LEFT_TO_CHECK = """
    not a number; up along facing; centre of mass outside; inertia not symmetric; inertia not positive;
    inertia of no body; contact off the object; contact inside another shape; two contacts in one place;
    one finger against gravity; late first goal; goals out of order; goals too close; goal after the end;
    drawing without a tool; tool without drawing; quaternion with its real part last; lengths in millimetres;
    mass in grams; turn too long; turn too long in all; object inside the palm; goal inside a fixed palm;
    object below the ground; palm below the ground; waypoints out of order; perturbation backwards;
    perturbation after the end; lengths reversed; hinge too short for its links; hinge as long as the shortest link;
    fingertip thinner than links; fingertip too thick for its link;
    joint limits reversed; joint limits too wide; angles of axes reversed;
    angles of axes beyond across; angle of axes below along;
    10,000 samples; an hour; a direction that rounds to none; contacts that the surface brings together;
    in millimetres; no such file; edges too round; another format;
    a shape without that name; no distance; no point; nor not on it;
    off the object; one against gravity; the wrong way round
"""


def data(text: str) -> dict[str, Any]:
    return TaskFile(text, "task").data


def test_the_file_that_is_installed_is_this_schema() -> None:
    jsonschema.Draft7Validator.check_schema(task_schema())
    found = json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))  # pydantic 2.10 writes 0.0 where others have 0
    assert found == json.loads(schema_text()), "casadi-hands schema > casadi_hands/task/task.schema.json"
    assert found == task_schema()


def test_every_field_is_in_it_with_its_description() -> None:
    text = schema_text()
    for path, field, _ in walk(Task):
        assert json.dumps(field.description, ensure_ascii=False)[1:-2] in text, path


def test_editors_are_told_where_it_is() -> None:
    assert schema_line() == f"# yaml-language-server: $schema={SCHEMA_FILE.as_uri()}"
    assert " " not in SCHEMA_FILE.as_uri()


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_it_takes_every_task_that_is_shipped(path: Path) -> None:
    SCHEMA.validate(data(path.read_text(encoding="utf-8")))


@pytest.mark.parametrize("name", EXTREME)
def test_it_takes_extreme_tasks_and_what_is_written_of_them(name: str) -> None:
    SCHEMA.validate(data(EXTREME[name]))
    SCHEMA.validate(data(task_to_yaml(parse_task(EXTREME[name]))))


@pytest.mark.parametrize(
    "more",
    [
        "ground: none",
        "palm: auto",
        "palm: {auto: true, radius: 0.05, up: [0, 0, 1], facing: [1, 0, 0]}",
        "palm: {auto: true, moves: true, motion: null}",
        "keep_out: [{box: {center: [0, 0, 1], size: [0.1, 0.2, 0.3]}, name: shelf}]",
        "fingers: 3",
        "fingers: auto",
        "fingers: [2, 4]",
        "fingers: {count: [2, 4]}",
        "fingers: {count: 3}",
        "ground: {}",
        "hand: {drive: remote, material: PETG}",
        "hand: {drive: {servo: XL330-M288}}",
        "hand: {material: {density: 1100, stiffness: 1.9e9, strength: 4.6e7}}",
        "motors: fewest",
        "motors: 2",
        "tool: null",
        "duration: 3",
        "weights: {synthesis: {collision: [1, 2, 3]}}",
        "perturbations: [{from: 0.5, to: 1, torque: [0, 0.001, 0]}]",
    ],
)
def test_it_takes_every_way_to_say_a_thing(more: str) -> None:
    text = without(HEAD, more) + more
    parse_task(text)
    SCHEMA.validate(data(text))


@pytest.mark.parametrize(
    "touches",
    ["anywhere", "{}", "{near: [0, 0.02, 0], within: 0.01, on: bar}", "{on: [bar]}", "{not_on: bar}", "{true: bar}"],
)
def test_it_takes_regions(touches: str) -> None:
    text = NAMED.replace("[0, 0.02, -0.01]", touches)
    SCHEMA.validate(data(text))
    SCHEMA.validate(data(task_to_yaml(parse_task(text))))


def test_it_takes_names_of_fingers_in_any_script() -> None:
    for name in ("Daumen_1", "pouce-2", "拇指", "ngón", "٣"):
        text = HEAD.replace("thumb", name)
        parse_task(text)
        SCHEMA.validate(data(text))
    for name in ("a b", "a.b", "ground", "é!"):
        text = HEAD.replace("thumb", f"'{name}'")
        with pytest.raises(TaskError):
            parse_task(text)
        assert not SCHEMA.is_valid(data(text))


def test_refusals_that_it_leaves_to_check_are_known() -> None:
    for text in (GOOD, DRAWING, HEAD, MESH):
        SCHEMA.validate(data(text))
    left = set()
    for name, text in WRONG.items():
        try:
            found = data(text)
        except TaskError:  # no plain data: an editor says so itself
            continue
        if SCHEMA.is_valid(found):
            left.add(name.partition(": ")[2])
    assert left == {" ".join(name.split()) for name in LEFT_TO_CHECK.split(";")}


def test_it_takes_every_mutant_that_is_a_task(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "scripts"))
    from nasty import mutant

    taken = refused = 0
    for number in range(200):
        text = mutant(number)
        if isinstance(text, bytes):
            text = text.decode("utf-8", errors="replace")
        try:
            parse_task(text, folder=ROOT / "problems")
        except TaskError:
            with suppress(TaskError):
                refused += not SCHEMA.is_valid(data(text))
            continue
        SCHEMA.validate(data(text))
        taken += 1
    assert (taken > 10, refused > 30) == (True, True), (taken, refused)
