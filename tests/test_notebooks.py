"""The notebooks of examples/: their cells run from top to bottom, and show what they say."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

EXAMPLES = Path(__file__).parents[1] / "examples"
NOTEBOOKS = sorted(EXAMPLES.glob("*.ipynb"))


def cells(path: Path) -> list[str]:
    """Source of the code cells."""
    notebook: dict[str, Any] = json.loads(path.read_text(encoding="utf-8"))
    return ["".join(cell["source"]) for cell in notebook["cells"] if cell["cell_type"] == "code"]


def run(path: Path) -> list[str]:
    """Lines that the cells print, each cell run on its own as a notebook does, and its last value shown."""
    code = f"""
import ast, json
names = {{"__name__": "__main__"}}
for source in json.loads({json.dumps(cells(path))!r}):
    tree = ast.parse(source)
    last = tree.body.pop() if isinstance(tree.body[-1], ast.Expr) else None
    exec(compile(tree, "cell", "exec"), names)
    if last is not None:
        value = eval(compile(ast.Expression(last.value), "cell", "eval"), names)
        if hasattr(value, "_repr_html_"):
            print("html:", value._repr_html_().replace("\\n", " "))
        elif value is not None:
            print("value:", value)
"""
    done = subprocess.run([sys.executable, "-c", code], cwd=EXAMPLES, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def test_there_are_two_and_they_are_clean() -> None:
    assert [path.stem for path in NOTEBOOKS] == ["own_cost", "sweep"]
    for path in NOTEBOOKS:
        notebook = json.loads(path.read_text(encoding="utf-8"))
        assert (notebook["nbformat"], notebook["nbformat_minor"]) == (4, 5)
        identities = [cell["id"] for cell in notebook["cells"]]
        assert len(set(identities)) == len(identities)
        assert not any(cell.get("outputs") or cell.get("execution_count") for cell in notebook["cells"])


@pytest.mark.slow
def test_the_sweep_presses_harder_the_more_slippery_things_are() -> None:
    lines = run(EXAMPLES / "sweep.ipynb")
    forces = [float(line.split()[-2]) for line in lines[:3]]
    assert forces[0] > forces[1] > forces[2] > 0.1 * 9.81 / 3
    assert lines[3] == "0.2 0.0 3"
    assert lines[4].startswith("html: <div>")
    assert "<svg" in lines[4]


@pytest.mark.slow
def test_the_cost_of_ones_own_does_what_it_is_for() -> None:
    without, with_terms, shown = run(EXAMPLES / "own_cost.ipynb")
    heights = [float(line.split("down to ")[1].split()[0]) for line in (without, with_terms)]
    forces = [float(line.split()[-2]) for line in (without, with_terms)]
    assert heights[1] < heights[0] - 0.005
    assert forces[1] <= 1.2 + 0.01 < forces[0]
    assert shown.startswith("value: {'weight': 5.0, 'value': ")
