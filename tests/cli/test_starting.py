"""`new`, `examples`, `schema`, completion, and the examples of each command's help."""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from base64 import b64decode
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
import typer
from PIL import Image
from typer.testing import CliRunner

from casadi_hands.cli import examples as shipped
from casadi_hands.cli import main
from casadi_hands.cli.app import app
from casadi_hands.cli.options import Motion, Shape
from casadi_hands.cli.questions import ask
from casadi_hands.task import load_task
from casadi_hands.task.schema import SCHEMA_FILE, schema_line
from casadi_hands.task.starter import MOTIONS, SIZES, Idea

FOLDER = Path(__file__).parents[2] / "problems"
PROBLEMS = sorted(FOLDER.rglob("*.yaml"))
COMMANDS: dict[str, Any] = typer.main.get_command(app).commands  # type: ignore[attr-defined]


def run(*arguments: Any, **more: Any) -> Any:
    return CliRunner().invoke(app, [str(argument) for argument in arguments], **more)


def error_of(arguments: list[str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> str:
    monkeypatch.setattr(sys, "argv", ["casadi-hands", *arguments])
    with pytest.raises(SystemExit) as exit_:
        main()
    out, err = capsys.readouterr()
    assert (exit_.value.code, out) == (2, "")
    return err


def test_choices_are_those_of_the_starter() -> None:
    assert [each.value for each in Shape] == list(SIZES)
    assert [each.value for each in Motion] == list(MOTIONS)


def test_new_writes_a_task_and_says_how_it_is_understood(tmp_path: Path) -> None:
    file = tmp_path / "there" / "pill.yaml"
    found = run("new", file, "--shape", "capsule", "--size", "50 20", "--mass", 30, "--fingers", 2, "--amount", 25)
    assert found.exit_code == 0
    task = load_task(file)
    assert (task.name, task.object.mass, len(task.fingers)) == ("pill", 0.03, 2)
    assert task.motion[1].rotation.degrees == 25
    text = " ".join(found.output.split())
    assert "0.03 kg; 1 capsule, 50 mm at its longest" in text
    assert f"casadi-hands solve {file}" in found.output


def test_new_keeps_what_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("mine")
    said = error_of(["new", str(file)], monkeypatch, capsys)
    assert said == f"casadi-hands: {file}: is there already; give another file, or move it away\n"
    assert file.read_text() == "mine"


def test_new_refuses_in_a_message(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    said = error_of(["new", "x.yaml", "--size", "5cm"], monkeypatch, capsys)
    assert said == "casadi-hands: size: given '5cm'; allowed: numbers in mm with spaces between\n"


def test_questions_are_asked_until_the_answers_can_be_used(monkeypatch: pytest.MonkeyPatch) -> None:
    answers = iter(["cone", "box", "40", "40 60 50", "heavy", "80", "lift", "", "maybe", "yes", "9", "4"])
    asked: list[str] = []
    told: list[str] = []

    def prompt(text: str, default: str, **_: Any) -> str:
        asked.append(text)
        return next(answers) or default

    monkeypatch.setattr(typer, "prompt", prompt)
    monkeypatch.setattr(typer, "echo", told.append)
    idea = ask(Idea("crate"), set())
    assert (idea.shape, idea.size, idea.mass, idea.motion, idea.far) == ("box", (40, 60, 50), 80, "lift", 10)
    assert (idea.table, idea.fingers) == (True, 4)
    assert next(answers, None) is None
    assert [text.split(":")[0] for text in told] == [
        "shape",
        "size",
        "a number, please",
        "given 'maybe'; allowed",
        "fingers",
    ]
    assert "width, length, height" in asked[2]


def test_what_is_known_is_not_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(typer, "prompt", lambda *_, **__: pytest.fail("asked"))
    idea = Idea("x", motion="tilt")
    assert ask(idea, {"shape", "size", "mass", "motion", "amount", "fingers"}) == idea


def test_examples_are_listed_with_a_line_each() -> None:
    text = " ".join(run("examples").output.split())
    for path in PROBLEMS:
        assert re.search(rf"\b{path.stem} {re.escape(' '.join(load_task(path).about.split())[:20])}", text), path.stem


@pytest.mark.parametrize("name", ["pencil_pick_up", "mug"])
def test_an_example_is_copied_with_all_that_it_needs(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert run("examples", name).output == f"written: {name}.yaml\nnext: casadi-hands solve {name}.yaml\n"
    (original,) = [path for path in PROBLEMS if path.stem == name]
    assert load_task(f"{name}.yaml") == load_task(original)
    first, _, rest = Path(f"{name}.yaml").read_text(encoding="utf-8").partition("\n")
    assert (first, rest) == (schema_line(), original.read_text(encoding="utf-8"))


def test_commands_that_are_printed_can_be_typed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    said = run("examples", "pencil_pick_up", "--out", "my pencil.yaml").output
    assert said == "written: my pencil.yaml\nnext: casadi-hands solve 'my pencil.yaml'\n"


def test_an_example_that_is_none(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    said = error_of(["examples", "pensil"], monkeypatch, capsys)
    assert said.startswith("casadi-hands: given pensil; allowed: battery, can, circle, ")


def test_examples_are_shown_with_a_picture_each(tmp_path: Path) -> None:
    file = tmp_path / "there" / "examples.html"
    assert f"written: {file}" in run("examples", "--show", file).output
    text = file.read_text(encoding="utf-8")
    assert re.findall(r"<h2>(\w+)</h2>", text) == [path.stem for path in sorted(PROBLEMS, key=lambda each: each.stem)]
    pictures = [b64decode(data) for data in re.findall(r'src="data:image/webp;base64,([^"]+)"', text)]
    for path, picture in zip(sorted(PROBLEMS, key=lambda each: each.stem), pictures, strict=True):
        assert picture == (FOLDER / "pictures" / f"{path.stem}.webp").read_bytes()
        assert Image.open(BytesIO(picture)).size == (320, 240)
    assert "://" not in text
    found = run("examples", "pencil_pick_up", "--out", tmp_path / "pencil.yaml", "--show", file)
    assert "written" in found.output
    assert (tmp_path / "pencil.yaml").is_file()


def test_examples_that_cannot_be_shown_say_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "file").write_text("")
    said = error_of(["examples", "--show", str(tmp_path / "file" / "examples.html")], monkeypatch, capsys)
    assert "cannot be written" in said


def test_examples_are_found_in_the_package_first(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    installed = tmp_path / "problems"
    installed.mkdir()
    (installed / "one.yaml").write_text(PROBLEMS[0].read_text(encoding="utf-8"))
    monkeypatch.setattr(shipped, "FOLDERS", (installed, *shipped.FOLDERS))
    assert [each.name for each in shipped.examples()] == ["one"]


def test_schema_is_the_installed_one() -> None:
    assert json.loads(run("schema").output) == json.loads(SCHEMA_FILE.read_text(encoding="utf-8"))


def test_a_shell_is_told_how_words_go_on() -> None:
    asked = {"_CASADI_HANDS_COMPLETE": "complete_bash", "COMP_WORDS": "casadi-hands ex", "COMP_CWORD": "1"}
    code = "import sys; sys.argv = ['casadi-hands']; from casadi_hands.cli import main; main()"
    found = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | asked, capture_output=True, text=True, check=False
    )
    assert sorted(found.stdout.split()) == ["examples", "export"]
    assert {"--install-completion", "--show-completion"} <= set(run("--help").output.split())


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_an_example_that_parses(name: str) -> None:
    (example,) = re.findall(r"^Example: `(casadi-hands .*)`$", COMMANDS[name].epilog or "")
    words = shlex.split(example.partition(" > ")[0])
    assert words[1] == name
    COMMANDS[name].make_context(name, words[2:])
    assert "Example: casadi-hands" in " ".join(run(name, "--help").output.split())
