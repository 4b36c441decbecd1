"""What the FAQ shows as mistakes makes `check` say what stands below it."""

from __future__ import annotations

import io
import re
from pathlib import Path

import pytest
import yaml
from rich.console import Console

from casadi_hands.cli.task_summary import check_summary
from casadi_hands.errors import TaskError
from casadi_hands.task.loader import load_questioned
from tests.documents import README, ROOT, blocks, read

FAQ = ROOT / "docs/faq.md"
MISTAKES = re.findall(
    r"^```yaml( title=\"refused\")?\n(.*?)^```\s+```text\n(.*?)^```", read(FAQ), re.DOTALL | re.MULTILINE
)


def said(part: str, folder: Path) -> tuple[str, bool]:
    """What `check` says of the README's task with a part changed, on one line, and whether it is refused."""
    (task,) = blocks(README, "yaml")
    file = folder / "task.yaml"
    file.write_text(yaml.safe_dump(yaml.safe_load(task) | yaml.safe_load(part), sort_keys=False), encoding="utf-8")
    try:
        text, _ = check_summary(*load_questioned(file))
    except TaskError as error:
        return " ".join(str(error).split()), True
    console = Console(width=10_000, file=io.StringIO())
    console.print(text)
    return " ".join(console.file.getvalue().split()), False  # type: ignore[attr-defined]


@pytest.mark.parametrize(("refused", "part", "message"), MISTAKES)
def test_a_mistake_is_told_as_the_faq_says(refused: str, part: str, message: str, tmp_path: Path) -> None:
    text, was_refused = said(part, tmp_path)
    assert was_refused == bool(refused)
    pieces = [re.escape(" ".join(piece.split())) for piece in message.split("…")]
    assert re.search(".*".join(pieces), text), text


def test_every_example_has_its_message() -> None:
    assert len(MISTAKES) == len(re.findall(r"^```yaml", read(FAQ), re.MULTILINE)) >= 11


def test_reasons_that_are_explained_are_given_somewhere() -> None:
    sources = " ".join(read(file) for file in sorted((ROOT / "casadi_hands").glob("**/*.py")))
    sources = " ".join(re.sub(r'"\s*\n\s*f?"', "", sources).split())  # strings over several lines
    rows = [line.split("|")[1] for line in read(FAQ).splitlines() if line.startswith("| `")]
    told = [piece for row in rows for piece in re.findall(r"`([^`]+)`", row)]
    assert len(told) >= 10
    assert [piece for piece in told if piece not in sources] == []
