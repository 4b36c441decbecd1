"""The README and the pages of docs/ say what is so: links lead somewhere, commands parse, code runs."""

from __future__ import annotations

import math
import re
import runpy
import shlex
import subprocess
import sys
import tomllib
from argparse import ArgumentParser
from pathlib import Path

import pytest
import typer
import yaml

import casadi_hands
from casadi_hands import Design
from casadi_hands.cli.app import app
from casadi_hands.task import describe_fields, load_task, parse_task
from casadi_hands.verify import audit
from tests.documents import PAGES, README, ROOT, blocks, commands, heading_anchors, links, read
from tests.verify.fixture import carried

NUMBERS = {"N": "1", "K": "1"}
"""What stands for a number in a command of the documents."""
# Its examples change a copy of the package: tests/test_extending.py runs them.
EXTENDING = ROOT / "docs" / "extending.md"
SLOW = "docs/how-to/several-hands.md"
"""Its code solves four times."""


def named(page: Path) -> str:
    return str(page.relative_to(ROOT))


def test_the_readme_is_a_page() -> None:
    assert len(read(README).splitlines()) <= 130


# Links.


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_links_lead_somewhere(page: Path) -> None:
    for target in links(page):
        if target.startswith("https://"):
            continue
        path, _, anchor = target.partition("#")
        file = (page.parent / path).resolve() if path else page
        assert file.exists(), f"{page.name}: {target}"
        assert not anchor or anchor in heading_anchors(file), f"{page.name}: {target}"


def test_every_page_is_found_from_the_index() -> None:
    found, new = set(), [ROOT / "docs/README.md"]
    while new:
        page = new.pop()
        found.add(page)
        targets = [(page.parent / link.partition("#")[0]).resolve() for link in links(page) if "://" not in link]
        targets = [each / "README.md" if each.is_dir() else each for each in targets]
        new += [each for each in targets if each in PAGES and each not in found]
    assert set(PAGES) <= found


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_files_that_are_named_exist(page: Path) -> None:
    for name in re.findall(r"\b(?:casadi_hands|problems|scripts|tests|examples)/[\w/]+(?:\.\w+)?", read(page)):
        # A page that shows how to add files names some that are not there; its own test makes them.
        assert (ROOT / name).exists() or (page == EXTENDING and f"A new file `{name}`" in read(page)), name


# Commands.


def test_first_command_solves_a_task_that_exists() -> None:
    task = re.search(r"^python3 -m venv .* solve (\S+)$", read(README), re.MULTILINE)
    assert task
    assert load_task(ROOT / task[1]).name == "horizontal translation"


def test_the_test_command_is_the_one_that_ci_runs() -> None:
    pattern = re.search(r"grep -E '(.*)' README\.md", read(ROOT / ".ci/run"))
    assert pattern
    assert len(re.findall(pattern[1], read(README), re.MULTILINE)) == 1


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_commands_parse(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for words in commands(page):
        parse([NUMBERS.get(word, word) for word in words], monkeypatch)


@pytest.mark.parametrize(
    ("wrong", "match"),
    [
        ("casadi-hands solve TASK --hurry", "hurry"),
        ("casadi-hands draw TASK", "draw"),
        ("casadi-hands export DIR", "Missing parameter: to"),
        ("casadi-hands solve TASK --seeds many", "valid integer"),
        ("python scripts/gallery.py --hurry", "2"),
    ],
)
def test_a_wrong_command_does_not_parse(wrong: str, match: str, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises((Exception, SystemExit), match=match):
        parse(shlex.split(wrong), monkeypatch)


def parse(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    """Let a program of ours parse its command line, and do nothing."""
    program = Path(words[0]).name
    if program == "casadi-hands":
        command = typer.main.get_command(app).commands[words[1]]  # type: ignore[attr-defined]
        if words[2:]:  # or only the command's name is told
            command.make_context(words[1], words[2:])
    elif program == "python" and words[1].startswith("scripts/"):
        parse_script(words[1:], monkeypatch)
    elif program == "dask":
        from distributed.cli import dask_scheduler, dask_worker

        {"scheduler": dask_scheduler, "worker": dask_worker}[words[1]].main.make_context(words[1], words[2:])


class ParsedError(Exception):
    """A script has parsed its options."""


def parse_script(words: list[str], monkeypatch: pytest.MonkeyPatch) -> None:
    original = ArgumentParser.parse_args

    def parse_only(self: ArgumentParser, *args: list[str]) -> None:
        original(self, *args)
        raise ParsedError

    with monkeypatch.context() as patched:
        patched.setattr(ArgumentParser, "parse_args", parse_only)
        patched.setattr(sys, "argv", words)
        patched.syspath_prepend(str(ROOT / "scripts"))
        with pytest.raises(ParsedError):
            runpy.run_path(str(ROOT / words[0]), run_name="__main__")


@pytest.mark.parametrize("page", PAGES, ids=named)
def test_extras_that_are_named_exist(page: Path) -> None:
    extras = tomllib.loads(read(ROOT / "pyproject.toml"))["project"]["optional-dependencies"]
    assert set(re.findall(r"pip install (?:-e )?'[\w.-]+\[(\w+)\]'", read(page))) <= set(extras)


# Tasks.


def smallest() -> str:
    (task,) = blocks(README, "yaml")
    return task


def test_task_of_the_readme_loads() -> None:
    task = parse_task(smallest())
    assert task.object.characteristic_length == pytest.approx(0.06)
    assert tuple(task.fingers) == ("thumb", "index", "middle")


@pytest.mark.parametrize("page", [page for page in PAGES if page != README and blocks(page, "yaml")], ids=named)
def test_parts_of_tasks_make_one_with_the_readmes(page: Path) -> None:
    for part in blocks(page, "yaml"):
        changed = yaml.safe_load(part)
        task = parse_task(yaml.safe_dump(yaml.safe_load(smallest()) | changed))
        assert set(changed) <= task.model_fields_set


# Python.


def run(code: str, name: str, folder: Path, result: str = "results/mine") -> str:
    """What a script prints that is run in a folder, in a process of its own, as the documents' readers run it."""
    file = folder / name
    file.write_text(code, encoding="utf-8")
    done = subprocess.run([sys.executable, file.name, result], cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """A folder in which the README's Python has solved the README's task, and what it printed."""
    folder = tmp_path_factory.mktemp("reader")
    (folder / "task.yaml").write_text(smallest(), encoding="utf-8")
    (code,) = blocks(README, "python")
    return folder, run(code, "readme.py", folder)


def test_python_of_the_readme_gives_a_certified_hand(solved: tuple[Path, str]) -> None:
    folder, printed = solved
    lines = printed.splitlines()
    design = Design.load(folder / "results/mine")
    assert lines[0].split() == ["certified"]
    assert [line.split()[0] for line in lines[1:-2]] == ["thumb", "index", "middle"]
    assert lines[-2] == "[]"
    assert float(lines[-1]) == pytest.approx(design.replays[0]["mean"]["mm"] / 1e3, rel=1e-6)


@pytest.mark.parametrize(
    "page", [page for page in PAGES if page not in (README, EXTENDING) and blocks(page, "python")], ids=named
)
def test_python_of_the_pages_runs(page: Path, solved: tuple[Path, str]) -> None:
    for number, code in enumerate(blocks(page, "python")):
        if named(page) == SLOW:  # everything but the later stages; the next test runs it as it stands
            assert code.count("out=") == 1
            code = code.replace("out=", 'until="floating", out=')
        assert run(code, f"{page.stem}{number}.py", solved[0])


@pytest.mark.slow
def test_python_of_several_hands_runs_as_it_stands(solved: tuple[Path, str]) -> None:
    (code,) = blocks(ROOT / SLOW, "python")
    lines = run(code, "several.py", solved[0]).splitlines()
    assert sorted(int(line.split()[0]) for line in lines) == [0, 1, 2, 3]
    assert lines[0].split()[1] == "certified"


def test_the_pages_show_every_name_of_the_package() -> None:
    shown = {
        name.strip()
        for page in PAGES
        for code in blocks(page, "python")
        for names in re.findall(r"from casadi_hands import (.*)", code)
        for name in names.split(",")
    }
    assert shown == set(casadi_hands.__all__)


@pytest.mark.slow
def test_the_tutorial_leads_to_a_certified_hand_and_a_printed_trajectory(tmp_path: Path) -> None:
    page = ROOT / "docs/tutorial.md"
    (task,) = blocks(page, "yaml")
    (tmp_path / "pencil.yaml").write_text(task, encoding="utf-8")
    for words in commands(page)[:2]:
        command = [sys.executable, "-c", "from casadi_hands.cli import main; main()", *words[1:]]
        assert subprocess.run(command, cwd=tmp_path, check=False).returncode == 0, words
    design = Design.load(tmp_path / "results/pencil")
    assert design.status == "certified"
    dimensions, trajectory = (
        run(code, f"{k}.py", tmp_path, "results/pencil") for k, code in enumerate(blocks(page, "python"))
    )
    assert [line.split(":")[0] for line in dimensions.splitlines() if ":" in line] == ["thumb", "index", "middle"]
    table = [line.split("\t") for line in trajectory.splitlines()]
    assert table[0][1:] == list(design.motion.joint_names)
    assert len(table) == 1 + len(design.motion.time)
    assert float(table[-1][0]) == 2.0
    assert float(table[1][1]) == pytest.approx(math.degrees(design.motion.joint_commands[0, 0]), abs=0.006)


# References.


def test_reference_of_fields_is_up_to_date() -> None:
    # Written by: casadi-hands fields > docs/task-fields.md
    assert read(ROOT / "docs/task-fields.md") == describe_fields() + "\n"


def test_every_figure_of_the_audit_is_explained(tmp_path: Path, solved: tuple[Path, str]) -> None:
    pushed = carried(tmp_path / "task", "perturbations:\n  - {from: 0.55, to: 0.95, force: [0, 0, 0.1]}\n")
    figures = {
        **audit(pushed.write(tmp_path / "result")).figures,
        **Design.load(solved[0] / "results/mine").certificate,
    }
    rows = [line.split("|")[1] for line in read(ROOT / "docs/reading-the-verdict.md").splitlines() if "| `" in line]
    explained = {name for row in rows for name in re.findall(r"`(\w+)`", row)}
    assert {"residual_disturbed", "replay_dropped"} <= set(figures) <= explained


def test_every_array_of_the_motion_is_explained(solved: tuple[Path, str]) -> None:
    text = read(ROOT / "docs/result-folder.md")
    motion = Design.load(solved[0] / "results/mine").motion
    assert [name for name in type(motion).__dataclass_fields__ if f"`{name}`" not in text] == []
