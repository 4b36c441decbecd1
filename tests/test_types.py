"""Every example passes a type checker: those of the documents, scripts, and notebooks."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from tests.documents import PAGES, ROOT, blocks
from tests.test_notebooks import NOTEBOOKS, cells

# What it takes is untyped code of people's own; the package's types are asked for everywhere.
OPTIONS = ["--check-untyped-defs", "--ignore-missing-imports", "--follow-imports=silent", "--no-color-output"]
# Its examples are parts of modules that change a copy of the package.
OTHERS = {ROOT / "docs" / "extending.md"}
WRONG = """
from casadi_hands import load_task, solve

design = solve(load_task({"name": "x"}), until="refined")
solve("task.yaml")
design.hand.fingerz
"""


def sources() -> dict[str, str]:
    """Python of the examples by a name of their own."""
    found = {f"script_{path.stem}": path.read_text(encoding="utf-8") for path in (ROOT / "examples").glob("*.py")}
    found |= {f"notebook_{path.stem}": "\n".join(cells(path)) for path in NOTEBOOKS}
    for page in PAGES:
        if page not in OTHERS:
            name = page.stem.replace("-", "_").lower()
            found |= {f"page_{name}_{number}": code for number, code in enumerate(blocks(page, "python"))}
    return found


def errors(folder: Path, code: dict[str, str]) -> list[str]:
    """What mypy finds in modules of these names, as installed packages are seen."""
    for name, text in code.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", *OPTIONS, "--config-file=", *[f"{name}.py" for name in code]]
    done = subprocess.run(
        command, cwd=folder, env={**os.environ, "MYPYPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert done.returncode in (0, 1), done.stderr
    return [line for line in done.stdout.splitlines() if ": error: " in line]


def test_examples_pass_mypy_and_mistakes_do_not(tmp_path: Path) -> None:
    found = errors(tmp_path, {**sources(), "wrong": WRONG})
    mine = [line for line in found if line.startswith("wrong.py")]
    assert [line for line in found if line not in mine] == []
    assert [line.split(":")[1] for line in mine] == ["4", "5", "6"]
