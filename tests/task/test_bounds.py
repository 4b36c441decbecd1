"""What a task file may not have, whatever it means, and what it may."""

from __future__ import annotations

import math
import re
import time

import pytest

from casadi_hands.cli.task_summary import check_summary
from casadi_hands.errors import TaskError
from casadi_hands.task import parse_task, task_to_yaml
from casadi_hands.task.bounds import COUNTS, RANGES, bound
from casadi_hands.task.structure import walk
from casadi_hands.task.task import Task

HEAD = """\
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [0, 0, 0.18]}]
fingers: {thumb: {touches: [0.03, 0, 0]}, index: {touches: [-0.03, 0, 0]}}
"""


def message(text: str) -> str:
    started = time.process_time()
    with pytest.raises(TaskError) as caught:
        parse_task(text, "wrong.yaml")
    assert time.process_time() - started < 5
    assert len(str(caught.value).encode()) < 2000
    return str(caught.value)


def bomb(levels: int, width: int = 9) -> str:
    lines = [f"a0: &a0 [{', '.join('1' * width)}]\n"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * width)}]\n" for i in range(1, levels)]
    return "".join(lines) + HEAD


MASS = "mass: 0.1"
# What is replaced in HEAD, by what, and what the message says in full after its `wrong.yaml:LINE: `.
REFUSED = {
    "aliases of aliases": ("object:", bomb(9) + "x:", "more than 20,000 values; a task file needs some hundred"),
    "an alias in what it names": (
        "object:",
        "x: &a {<<: *a}\nobject:",
        "x.<<: given an alias of what it stands in; allowed: aliases of what is written elsewhere",
    ),
    "a number to be merged": (
        "object:",
        "x: {<<: 3}\nobject:",
        "x.<<: given 3; allowed: a mapping, or a list of mappings, to be merged",
    ),
    "20,000 spheres": (
        "shapes: [",
        "shapes: [" + "{sphere: {center: [0, 0, 0], radius: 0.03}}, " * 20_000,
        "more than 20,000 values; a task file needs some hundred",
    ),
    "1,000 spheres": (
        "shapes: [",
        "shapes: [" + "{sphere: {center: [0, 0, 0], radius: 0.03}}, " * 1000,
        "object.shapes: given 1,001 of them; allowed: at most 100",
    ),
    "1,000 fingers": (
        "{thumb:",
        "{" + "".join(f"f{i}: {{touches: [0, 0.03, 0]}}, " for i in range(1000)) + "thumb:",
        "fingers: given 1,002 of them; allowed: at most 20",
    ),
    "1,000 goals": (
        "motion: [",
        "motion: [" + "{at: 0, position: [0, 0, 0.2]}, " * 1000,
        "motion: given 1,002 of them; allowed: at most 200",
    ),
    "a billion steps a second": (
        "object:",
        "time_step: 1e-9\nobject:",
        "time_step: given 1e-09; allowed: at least 0.0001 s",
    ),
    "10,000 samples": (
        "object:",
        "time_step: 0.0002\nobject:",
        "time_step: given 2 s in steps of 0.0002 s, 1e+04 samples; allowed: a motion of at most 3000 samples, "
        "duration / time_step",
    ),
    "an hour": (
        "at: 2,",
        "at: 3600,",
        "motion[1].at: given 3600 s in steps of 0.1 s, 3.6e+04 samples; allowed: a motion of at most 3000 samples, "
        "duration / time_step",
    ),
    "an integer that is none": (
        MASS,
        "mass: !!int abc",
        "object.mass: given !!int 'abc'; allowed: a value that fits its tag, or one without a tag",
    ),
    "an empty integer": (
        MASS,
        "mass: !!int ''",
        "object.mass: given !!int ''; allowed: a value that fits its tag, ...",
    ),
    "a float that is none": (MASS, "mass: !!float x", "object.mass: given !!float 'x'; allowed: ..."),
    "a boolean that is none": (MASS, "mass: !!bool x", "object.mass: given !!bool 'x'; allowed: ..."),
    "an unknown tag": (MASS, "mass: !foo 3", "object.mass: given !foo 3; allowed: values without a tag"),
    "the tag of a list": (
        MASS,
        "mass: !!seq {a: 1}",
        "object.mass: given the tag !!seq; allowed: values without a tag",
    ),
    "4,300 digits": (
        MASS,
        f"mass: {'1' * 4300}",
        "object.mass: given 1111111111111111111111111111...11111111111111111111111111111; allowed: a number of at most "
        "400 digits",
    ),
    "a list for a name": (
        "object:",
        "? [1, 2]\n: 3\nobject:",
        "task: given a list for a name; allowed: names of fields",
    ),
    "a radius beyond the stars": (
        "radius: 0.03",
        "radius: 1e200",
        "object.shapes[0].sphere.radius: given 1e+200; allowed: at most 100000 m in size",
    ),
    "an electron": (MASS, "mass: 1e-30", "object.mass: given 1e-30; allowed: at least 1e-06 kg"),
    "a contact beyond the stars": (
        "[0.03, 0, 0]",
        "[1e200, 0, 0]",
        "fingers.thumb.touches[0]: given 1e+200; allowed: at most 100000 m in size",
    ),
    "a region beyond the stars": (
        "[0.03, 0, 0]",
        "{near: [0.03, 0, 0], within: 1e200}",
        "fingers.thumb.touches.within: given 1e+200; allowed: at most 100000 m in size",
    ),
    "gravity of a dwarf star": (
        "object:",
        "gravity: [0, 0, -1e5]\nobject:",
        "gravity[2]: given -100000.0; allowed: at most 20000 m/s² in size",
    ),
    "a direction that rounds to none": (
        "facing: [0, 0, -1]",
        "facing: [0, 0, -1e-200]",
        "palm.facing: given [0, 0, -1e-200]; allowed: a direction with a number of at least 1e-100",
    ),
    "a name that moves the cursor": (
        "object:",
        'name: "\\e[31mred"\nobject:',
        "name: given '\\x1b[31mred'; allowed: text without control characters",
    ),
    "a name with a NUL": ("object:", 'name: "a\\0"\nobject:', "name: given 'a\\x00'; allowed: text without ..."),
    "a name that is written backwards": (
        "object:",
        'name: "\\u202eab"\nobject:',
        "name: given '\\u202eab'; allowed: ...",
    ),
    "half a character": ("object:", 'about: "\\ud800"\nobject:', "about: given '\\ud800'; allowed: text without ..."),
    "a name of two lines": (
        "object:",
        'name: "a\\nb"\nobject:',
        "name: given 'a\\nb'; allowed: text in a line, without tabs",
    ),
    "a long name": (
        "object:",
        f"name: {'x' * 300}\nobject:",
        "name: given 'xxx..., 300 characters; allowed: at most 200 characters",
    ),
    "an unknown field with an escape": ("object:", '"\\e[2J": 1\nobject:', "task: given '\\x1b[2J'; allowed: ..."),
    "an old YAML": ("object:", "%YAML 1.1\n---\nobject:", "given YAML 1.1; a task file is YAML 1.2"),
    "no character": (
        "object:",
        '"\\U00110000": 1\nobject:',
        "...not YAML: chr() arg not in range(0x110000); mend that line or the one before",
    ),
    "contacts that the surface brings together": (
        "[-0.03, 0, 0]",
        "[0.0305, 0.00001, 0]",
        "fingers.index.touches: given [0.0305, 1e-05, 0.0]; allowed: a point whose nearest one on the surface, ..., is "
        "not that of thumb",
    ),
}


@pytest.mark.parametrize("kind", REFUSED)
def test_refused(kind: str) -> None:
    old, new, expected = REFUSED[kind]
    assert old in HEAD
    found = message(HEAD.replace(old, new, 1))
    pattern = r"wrong\.yaml(:\d+)?: " + ".*".join(re.escape(part) for part in expected.split("..."))
    assert re.fullmatch(pattern, found), found


def test_ten_megabytes_of_comment() -> None:
    assert (
        message(f"# {'x' * 10**7}\n{HEAD}")
        == f"wrong.yaml: given {10**7 + 3 + len(HEAD):,} characters; a task file has some thousand"
    )


def test_a_thousand_mistakes_are_one_message_that_can_be_read() -> None:
    found = message(HEAD + "".join(f"x{i}: 1\n" for i in range(1000)))
    lines = found.split("\n")
    assert lines[0].startswith("wrong.yaml:5: x0: given an unknown field")
    assert lines[-1] == f"... and {1000 - len(lines) + 1} more"


def test_an_accepted_task_is_one_again_when_it_is_written() -> None:
    """The longest link follows from the distance of the goals."""
    far = HEAD.replace("position: [0, 0, 0.18]", "position: [0, 0, -99999.99]")
    assert "palm.position: given a palm 1e+05 m from its object" in message(far)
    task = parse_task(HEAD.replace("position: [0, 0, 0.18]", "position: [0, 0, 0.01]"))
    assert parse_task(task_to_yaml(task)) == task


def test_every_bound_is_one_of_a_field() -> None:
    paths = [path for path, _, _ in walk(Task)]
    for end in RANGES:
        assert any(f".{path}".endswith(f".{end}") for path in paths), end
    assert set(COUNTS) <= set(paths)


def test_a_finger_has_no_bound_of_how_many_fingers_there_are() -> None:
    names = [f"s{i}" for i in range(COUNTS["fingers"] + 1)]
    assert bound({"fingers": {"thumb": {"touches": {"on": names}}}}) == []


def test_what_the_schema_judges_is_left_to_it() -> None:
    for value in (0, -1, math.inf, math.nan, True, None, "heavy", [1]):
        assert bound({"object": {"mass": value}}) == []


def ring(count: int, radius: float) -> str:
    angles = [2 * math.pi * each / count for each in range(count)]
    points = [
        f"f{i}: {{touches: [{radius * math.cos(a):.9f}, {radius * math.sin(a):.9f}, 0]}}" for i, a in enumerate(angles)
    ]
    return f"fingers: {{{', '.join(points)}}}\n"


def scaled(size: float, mass: float) -> str:
    return f"""\
object: {{mass: {mass}, shapes: [{{sphere: {{center: [0, 0, 0], radius: {size / 2}}}}}]}}
palm: {{position: [0, 0, {2 * size}], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, 0]}}, {{at: 2, position: [0, 0, {0.1 * size}]}}]
{ring(3, size / 2)}"""


FINGERS = HEAD[HEAD.index("fingers:") :]
BALLS = ", ".join(f"{{sphere: {{center: [0, 0, {0.0001 * i:.4f}], radius: 0.03}}}}" for i in range(30))
EXTREME = {
    "1 mm": scaled(0.001, 1e-6),
    "1 m": scaled(1.0, 50.0),
    "1 g": HEAD.replace("mass: 0.1", "mass: 0.001"),
    "50 kg": scaled(0.2, 50.0),
    "little friction": HEAD + "friction: 0.05\n",
    "much friction": HEAD + "friction: 2\n",
    "half a second": HEAD.replace("at: 2,", "at: 0.5,"),
    "a minute": HEAD.replace("at: 2,", "at: 60,"),
    "one finger": HEAD.replace(FINGERS, ring(1, 0.03)) + "gravity: [0, 0, 0]\n",
    "eight fingers": HEAD.replace(FINGERS, ring(8, 0.03)),
    "30 primitives": HEAD.replace("{sphere: {center: [0, 0, 0], radius: 0.03}}", BALLS),
    "goals that are the start": HEAD.replace("[0, 0, 0.18]", "[0, 0, 0.2]"),
    "299 degrees": HEAD.replace("[0, 0, 0.18]", "[0, 0, 0.18], rotation: {axis: [0, 0, 1], degrees: 299}"),
    "all limits 0": HEAD
    + f"limits: {{{', '.join(f'{name}: 0' for name in Task.model_fields['limits'].annotation.model_fields)}}}\n",
    "joints of a thousandth of a degree": HEAD + "hand: {joint_limits: [-0.001, 0.001]}\n",
    "motors of a thousandth of a newton metre": HEAD + "actuator: {torque: 0.001}\n",
}


@pytest.mark.parametrize("kind", EXTREME)
def test_extreme_tasks_are_tasks(kind: str) -> None:
    text = EXTREME[kind]
    task = parse_task(text)
    check_summary(task)
    again = parse_task(task_to_yaml(task))
    assert again == task
