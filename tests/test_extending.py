"""The examples of docs/extending.md, run on a copy of the package: they work, and touch the files that they name."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
TEXT = (ROOT / "docs" / "extending.md").read_text(encoding="utf-8")
_EDIT = re.compile(
    r"^(?:In|A new file) `(?P<file>[^`]+)`(?:, after `(?P<after>[^`]+)`)?(?:, add)?:\n\n```python\n(?P<code>.*?)```",
    re.DOTALL | re.MULTILINE,
)
_CHANGE = re.compile(r"and there `(?P<before>[^`]+)` becomes\s+`(?P<after>[^`]+)`")


def section(title: str) -> str:
    """The text below a heading."""
    return TEXT.split(f"\n## {title}\n")[1].split("\n## ")[0]


@pytest.fixture
def copy(tmp_path: Path) -> Path:
    """A folder with a copy of the package."""
    ignored = shutil.ignore_patterns("__pycache__", "src")
    shutil.copytree(ROOT / "casadi_hands", tmp_path / "casadi_hands", ignore=ignored)
    for built in ("_built_with.py", "_extension*.so"):
        for file in _built(built):
            shutil.copy(file, tmp_path / "casadi_hands" / "kinematics")
    return tmp_path


def _built(pattern: str) -> list[Path]:
    import casadi_hands.kinematics._extension as extension

    return list(Path(str(extension.__file__)).parent.glob(pattern))


def apply(title: str, copy: Path) -> set[str]:
    """Do what a section says; the files that it touches."""
    touched = set()
    for edit in _EDIT.finditer(section(title)):
        path = copy / edit["file"]
        text = path.read_text(encoding="utf-8") if path.exists() else ""
        if edit["after"]:
            assert text.count(edit["after"] + "\n") == 1, edit["after"]
            text = text.replace(edit["after"] + "\n", edit["after"] + "\n" + edit["code"])
        else:
            text += "\n" + edit["code"]
        for change in _CHANGE.finditer(section(title)):
            text = text.replace(change["before"], change["after"])
        path.write_text(text, encoding="utf-8")
        touched.add(edit["file"])
    return touched


# An editable installation finds the package by a hook of its own, before any folder.
UNHOOKED = (
    "import sys\n"
    "sys.meta_path[:] = [each for each in sys.meta_path if not type(each).__module__.startswith('_editable')]\n"
)


def run(copy: Path, code: str) -> str:
    """What a program prints that uses the copy."""
    done = subprocess.run(
        [sys.executable, "-c", UNHOOKED + code],
        cwd=copy,
        env={**os.environ, "PYTHONPATH": f"{copy}:{ROOT}"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


REFINED = """
import casadi_hands, numpy as np
assert casadi_hands.__file__.startswith({where!r})
from casadi_hands.problem.si import build_model
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.task import load_task
model = build_model(load_task({task!r}))
stage = RefineStage(model, (0,), (2,), np.ones((len(model.schedule.samples), model.contacts), bool))
"""


def refined(copy: Path) -> str:
    task = ROOT / "problems" / "small_ball_outward.yaml"
    return REFINED.format(where=str(copy), task=str(task))


def test_a_cost_touches_two_files(copy: Path) -> None:
    assert len(apply("A cost term", copy)) == 2
    told = run(
        copy,
        refined(copy) + "from casadi_hands.stages.refine.settings import WEIGHTS\n"
        "print('joint_offset' in stage.problem.terms, WEIGHTS['joint_offset'])",
    )
    assert told.split() == ["True", "0.001"]


def test_a_constraint_touches_three_files(copy: Path) -> None:
    assert len(apply("A constraint", copy)) == 3
    told = run(
        copy,
        refined(copy) + "rows = stage.problem.constraint_rows['joint_motion0.acceleration']\n"
        "print(len(rows), stage.problem.constraint_upper[rows].max(),\n"
        "      stage.built.blocks['joint_motion0'].kernel.declared['acceleration'].cannot)",
    )
    knots, most, words = told.split(maxsplit=2)
    assert (int(knots) > 5, float(most), words.strip()) == (True, 50.0, "turn as gently as asked")


def test_a_body_is_a_file_that_is_there_or_not(copy: Path) -> None:
    task = (ROOT / "problems" / "small_ball_outward.yaml").read_text(encoding="utf-8")
    shapes = re.compile(r"^  shapes:\n(?:    .*\n)+", re.MULTILINE)
    can = "  shapes:\n    - cylinder: {start: [0, 0, -0.03], end: [0, 0, 0.03], radius: 0.02}\n"
    (copy / "can.yaml").write_text(shapes.sub(can, task), encoding="utf-8")
    load = (
        "from casadi_hands.errors import TaskError\nfrom casadi_hands.task import load_task\n"
        "try:\n    load_task('can.yaml')\n    print('loaded')\nexcept TaskError as error:\n    print(error)"
    )
    assert "cylinder" not in run(copy, load)  # whatever else it may find, such a shape is known
    (copy / "casadi_hands/geometry/bodies/cylinder.py").unlink()
    assert "sphere: {radius} or capsule: {start, end, radius}" in run(copy, load)


def test_an_exporter_is_one_file(copy: Path) -> None:
    assert len(apply("An exporter", copy)) == 1
    told = run(
        copy,
        "from casadi_hands.export.targets import TARGETS, export_design\n"
        "from tests.export.example import example_design\n"
        "example_design().save('design')\n"
        "print(*TARGETS)\nprint(export_design('design', 'angles').read_text()[:8])",
    )
    assert told.split() == ["angles", "csv", "ros2", "urdf", "usd", '{"time":']


def test_a_stage_is_a_problem_and_a_solver(copy: Path) -> None:
    code = re.search(r"```python\n(.*?)```", section("A stage"), re.DOTALL)
    assert code is not None
    assert "Solve_Succeeded" in run(copy, code[1])
