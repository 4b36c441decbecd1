"""Every error that a user can cause says what to do next."""

from __future__ import annotations

import ast
import pickle
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from casadi_hands.cli import main
from casadi_hands.errors import MADE_ANEW, DesignError
from tests.documents import ROOT
from tests.export.example import example_design

STEPS = re.compile(
    r"allowed|\b(give|try|start|leave|install|open|see|without|build|mend)\b|casadi-hands \w+"
    r"|a task file (is|needs|has)"
)
"""Words with which a next step begins."""
KINDS = ("HandsError", "TaskError", "SolveError", "KinematicsError")
COMPOSED = re.compile(r"\.(what|problem)\b|\['why'\]|too_deep\(\)")
"""Where a message's words come from another error, which has them."""


def raised() -> Iterator[tuple[str, str]]:
    """Place and fixed words of every error of the package that is written for users, but of those of result folders."""
    for file in sorted((ROOT / "casadi_hands").glob("**/*.py")):
        module = ast.parse(file.read_text(encoding="utf-8"))
        named: dict[str, list[ast.AST]] = {}
        for node in ast.walk(module):
            if isinstance(node, ast.Assign):
                for target in node.targets:
                    named.setdefault(getattr(target, "id", ""), []).append(node.value)
            elif isinstance(node, ast.FunctionDef):
                named.setdefault(node.name, []).append(node)
        for node in ast.walk(module):
            if isinstance(node, ast.Raise) and isinstance(node.exc, ast.Call):
                kind = getattr(node.exc.func, "id", "")
                if kind in KINDS and not COMPOSED.search(ast.unparse(node.exc)):
                    yield f"{file.relative_to(ROOT)}:{node.lineno}", " ".join(words(node.exc, named))


def words(node: ast.AST, named: dict[str, list[ast.AST]]) -> Iterator[str]:
    """The fixed texts of an expression, and of what it names in its module."""
    for part in ast.walk(node):
        if isinstance(part, ast.Constant) and isinstance(part.value, str):
            yield part.value
        elif isinstance(part, ast.Name):
            for value in named.get(part.id, ()):
                yield from words(value, {name: values for name, values in named.items() if name != part.id})


def test_every_message_names_a_next_step() -> None:
    found = list(raised())
    assert len(found) > 50
    assert [(place, text) for place, text in found if not STEPS.search(text)] == []


@pytest.mark.parametrize("command", ["audit", "replay"])
def test_an_error_of_a_folder_says_how_to_make_it_anew(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = tmp_path / "result"
    example_design().save(folder)
    (folder / "motion.npz").write_bytes(b"cut short")
    monkeypatch.setattr("sys.argv", ["casadi-hands", command, str(folder)])
    with pytest.raises(SystemExit) as left:
        main()
    assert left.value.code == 2
    first, last = capsys.readouterr().err.splitlines()
    assert first.startswith(f"casadi-hands: {folder / 'motion.npz'}: ")
    assert last == MADE_ANEW


def test_notes_go_from_process_to_process_once() -> None:
    error = pickle.loads(pickle.dumps(DesignError("x: missing")))
    assert (str(error), error.__notes__) == ("x: missing", [MADE_ANEW])
    assert not hasattr(DesignError("x: missing; give another", ""), "__notes__")
