"""The README and what it links to say what is so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from casadi_hands.design import Motion
from casadi_hands.task import describe_fields, load_task, parse_task
from casadi_hands.verify import audit
from tests.verify.fixture import carried

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")


def block(language: str) -> str:
    """The README's first fenced block of a language."""
    found = re.search(rf"```{language}\n(.*?)```", README, re.DOTALL)
    assert found
    return found[1]


def test_reference_of_fields_is_up_to_date() -> None:
    # Written by: casadi-hands fields > docs/task-fields.md
    assert (ROOT / "docs/task-fields.md").read_text(encoding="utf-8") == describe_fields() + "\n"


def test_task_of_the_readme_loads() -> None:
    task = parse_task(block("yaml"))
    assert task.object.half_extent == pytest.approx(0.06)
    assert tuple(task.fingers) == ("left", "right")


def test_python_of_the_readme_compiles_and_names_what_exists() -> None:
    import casadi_hands

    code = block("python")
    compile(code, "README.md", "exec")
    names = re.search(r"from casadi_hands import (.*)", code)
    assert names
    assert {name.strip() for name in names[1].split(",")} == set(casadi_hands.__all__)
    assert len([line for line in code.splitlines() if line.strip()]) <= 12


def test_first_command_solves_a_task_that_exists() -> None:
    task = re.search(r"^python3 -m venv .* solve (\S+)$", README, re.MULTILINE)
    assert task
    assert load_task(ROOT / task[1]).name == "horizontal translation"


def test_links_lead_somewhere() -> None:
    for page in (ROOT / "README.md", *(ROOT / "docs").glob("*.md")):
        for target in re.findall(r"\]\(([^)#]+)[^)]*\)", page.read_text(encoding="utf-8")):
            assert target.startswith("https://") or (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_figure_of_the_audit_is_explained(tmp_path: Path) -> None:
    found = audit(carried(tmp_path / "task").write(tmp_path / "result"))
    section = README.partition("## How to read the result")[2].partition("## From Python")[0]
    rows = [line.split("|")[1] for line in section.splitlines() if line.startswith("| `")]
    explained = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert set(found.figures) <= explained


def test_every_array_of_the_motion_is_explained() -> None:
    text = (ROOT / "docs/result-folder.md").read_text(encoding="utf-8")
    assert [name for name in Motion.__dataclass_fields__ if f"`{name}`" not in text] == []
