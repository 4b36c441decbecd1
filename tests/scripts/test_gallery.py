from __future__ import annotations

import io
import json
import re
from base64 import b64decode
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path

import pytest
from apart import ENDED
from entries import Entry, entry_of, figures_of
from gallery import HEAD, main, row, write_all
from PIL import Image
from shared import is_of, result_folder, table_text, with_seed
from stills import MOMENTS, SIZE

from casadi_hands import load_task
from casadi_hands.task import FingerSpec
from tests.export.browser import needs_browser
from tests.export.example import TASK, example_design

RUNS = [
    {"stage": "synthesis", "what": "hand of 1+1+1 joints, trial 0"},
    {"stage": "synthesis", "what": "hand of 1+2+1 joints, trial 0"},
    {"stage": "whole_hand", "what": "hand"},
    {"stage": "synthesis", "what": "hand of 2+2+2 joints, trial 0"},
]
CERTIFICATE = {
    "goal_position": {"value": 0.00012, "limit": 0.0005, "holds": True},
    "goal_angle": {"value": 0.25, "limit": 0.5, "holds": True},
    "slip": {"value": 0.0031, "limit": 0.0002, "holds": False},
}


def problem(folder: Path, name: str, first: str = "") -> Path:
    folder.mkdir(exist_ok=True)
    file = folder / f"{name}.yaml"
    file.write_text(first + TASK.replace("move a capsule & back", name), encoding="utf-8")
    return file


def result(file: Path, out: Path, seed: int, status: str, **changes: object) -> Path:
    """Save a design of a task file, as if it had been solved, with replays of which four were dropped."""
    folder = result_folder(file, seed, "refine", out)
    design = replace(example_design(), task=with_seed(load_task(file), seed), status=status, stages=RUNS)
    replace(design, certificate=CERTIFICATE, **changes).save(folder)  # type: ignore[arg-type]
    play = {"position_mean": 0.00033, "angle_mean": 1.5, "dropped": False}
    perturbed = [{**play, "dropped": k in (1, 5, 11, 12)} for k in range(20)]
    (folder / "replays.json").write_text(json.dumps({"nominal": play, "perturbed": perturbed}))
    return folder


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder ``out`` with the page and the table of tasks that ended in every way."""
    root = tmp_path_factory.mktemp("gallery")
    problems, out = root / "problems", root / "out"
    good = problem(problems, "good", "# Figures 3.2c and 3.7a of CMU-RI-TR-18-36: a task.\n")
    result(good, out, 0, "feasible", reason="it <slips>")
    result(good, out, 1, "certified", reason="")
    cut = problem(problems, "cut", "# Figure 3.6b of CMU-RI-TR-18-36: a task.\n")
    result(cut, out, 0, "failed", reason="stopped before the motion was refined")
    ended = {"how": "stopped after 5 min", "minutes": 5}
    (result_folder(cut, 0, "refine", out) / ENDED).write_text(json.dumps(ended))
    lost = problem(problems, "lost")
    result(lost, out, 0, "failed", reason="no finger could", hand=None, motion=None)
    problem(problems, "new")
    (problems / "wrong.yaml").write_text("name: wrong\n")
    files = sorted(problems.glob("*.yaml"))
    write_all([entry_of(file, seed, out, 1) for file in files for seed in (0, 1)], out)
    return out


class Cards(HTMLParser):
    """States, links and pictures of each card, and everything the page would have to fetch."""

    def __init__(self) -> None:
        super().__init__()
        self.cards: list[dict[str, list[str]]] = []
        self.fetched: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = {name: value or "" for name, value in attrs}
        if tag == "article":
            self.cards.append({"state": [known["data-status"]], "a": [], "img": []})
        if tag == "a":
            self.cards[-1]["a"].append(known["href"])
        if tag == "img":
            self.cards[-1]["img"].append(known["src"])
        if tag in ("link", "script", "img") and not known.get("src", "data:").startswith("data:"):
            self.fetched.append(known["src"])


def read_cards(out: Path) -> Cards:
    parser = Cards()
    parser.feed((out / "gallery.html").read_text(encoding="utf-8"))
    return parser


@needs_browser
def test_page_has_a_card_for_each_task_and_shows_the_best_seed(made: Path) -> None:
    page = read_cards(made)
    # cut, good, lost, new, wrong
    assert [card["state"][0] for card in page.cards] == ["stopped", "certified", "failed", "not-solved", "failed"]
    assert [len(card["img"]) for card in page.cards] == [MOMENTS, MOMENTS, 1, 1, 0]
    assert [len(card["a"]) for card in page.cards] == [1, 2, 1, 0, 0]
    for card in page.cards:
        assert all((made / link).is_file() for link in card["a"])


@needs_browser
def test_page_needs_no_other_file_and_no_network(made: Path) -> None:
    page = read_cards(made)
    assert page.fetched == []
    text = (made / "gallery.html").read_text(encoding="utf-8")
    assert "http" not in text
    assert "{{" not in text
    assert "<slips>" not in text
    for card in page.cards:
        for picture in card["img"]:
            data = b64decode(picture.partition("base64,")[2])
            assert Image.open(io.BytesIO(data)).size == SIZE


@needs_browser
def test_moments_of_a_motion_differ(made: Path) -> None:
    pictures = read_cards(made).cards[1]["img"]
    # The example moves to and fro: start and end look the same, the middle does not.
    assert pictures[0] == pictures[-1] != pictures[MOMENTS // 2]


@needs_browser
def test_reasons_are_on_the_cards(made: Path) -> None:
    text = (made / "gallery.html").read_text(encoding="utf-8")
    reasons = re.findall(r'<p class="reason">(.*?)</p>', text, re.DOTALL)
    assert reasons[0] == "stopped after 5 min; stopped before the motion was refined"
    assert reasons[1] == "no finger could"
    assert "wrong.yaml:1: " in reasons[2]


@needs_browser
def test_table_has_a_row_for_each_seed(made: Path) -> None:
    lines = (made / "table.md").read_text(encoding="utf-8").splitlines()
    assert len(lines) == 2 + 5 * 2
    rows = [dict(zip(HEAD, line.strip("| ").split(" | "), strict=True)) for line in lines[2:]]
    certified = next(each for each in rows if each["status"] == "certified")
    assert certified == {
        "task": "good",
        "figure": "3.2c, 3.7a",
        "seed": "1",
        "fingers × joints": "3 × 2",
        "by the soft stages": "1+2+1",
        "the thesis": "2 a finger",
        "status": "certified",
        "goal error": "0.12 mm · 0.25°",
        "slip mm": "3.1",
        "replay error": "0.33 mm · 1.5°",
        "dropped of 12": "3",
        "s": "2",
    }
    stopped = next(each for each in rows if each["status"] == "stopped")
    assert (stopped["task"], stopped["figure"], stopped["the thesis"]) == ("cut", "3.6b", "2 a finger")


def test_result_of_another_seed_or_task_is_not_taken(tmp_path: Path) -> None:
    file = problem(tmp_path / "problems", "good")
    folder = result(file, tmp_path / "out", 0, "certified", reason="")
    assert entry_of(file, 0, tmp_path / "out", 1).state == "certified"
    assert entry_of(file, 1, tmp_path / "out", 1).state == "not solved"
    # As the command line names its folders.
    folder.rename(tmp_path / "out" / "good")
    assert entry_of(file, 0, tmp_path / "out", 1).folder == tmp_path / "out" / "good"
    file.write_text(file.read_text().replace("mass: 0.1", "mass: 0.11"))
    assert entry_of(file, 0, tmp_path / "out", 1).state == "not solved"


def test_a_result_with_contacts_that_were_placed_is_of_the_task_that_asked_for_them(tmp_path: Path) -> None:
    file = problem(tmp_path / "problems", "good")
    given = "{touches: [0, 0.02, -0.01]}"
    asked = file.read_text().replace(given, "{touches: anywhere}")
    file.write_text(asked)
    task = load_task(file)
    placed = FingerSpec(touches=(0.0, 0.02, -0.01), placed=task.fingers["thumb"].touches)
    done = task.model_copy(update={"fingers": {**task.fingers, "thumb": placed}})
    folder = result_folder(file, 0, "refine", tmp_path / "out")
    replace(example_design(), task=done, status="feasible", certificate=CERTIFICATE).save(folder)
    assert is_of(load_task(file), folder)
    (tmp_path / "foreign").mkdir()
    (tmp_path / "foreign" / "task.yaml").write_text("name: foreign\n")
    assert not is_of(load_task(file), tmp_path / "foreign")
    file.write_text(asked.replace("mass: 0.1", "mass: 0.11"))
    assert not is_of(load_task(file), folder)
    file.write_text(asked.replace("{touches: anywhere}", "{touches: {near: [0, 0.02, 0], within: 0.03}}"))
    assert not is_of(load_task(file), folder)


def test_solved_tasks_are_not_solved_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    # Not what is tested, and slow.
    monkeypatch.setattr("gallery.page", lambda *_: "")
    monkeypatch.setattr("gallery.browser", lambda: "chromium")
    done, undone = problem(tmp_path / "problems", "done"), problem(tmp_path / "problems", "undone")
    result(done, tmp_path / "out", 0, "certified", reason="")
    asked: list[Path] = []
    monkeypatch.setattr("gallery.kept_solve", lambda file, *_: asked.append(file))
    monkeypatch.setattr("sys.argv", ["gallery.py", str(tmp_path / "problems"), "--out", str(tmp_path / "out")])
    main()
    assert asked == [undone]


def test_figures_are_those_of_the_first_line() -> None:
    problems = Path(__file__).parents[2] / "problems"
    known = [figure for file in problems.glob("*.yaml") for figure in figures_of(file)]
    # Method, section 10 of the thesis's figures: each is one of these files.
    assert sorted(known) == [
        *("3.1a", "3.1b", "3.1c", "3.1d", "3.2a", "3.2b", "3.2c", "3.3a", "3.3b", "3.4a", "3.4b", "3.5a", "3.5b"),
        *("3.6a", "3.6b", "3.6c", "3.6d", "3.6e", "3.7a", "3.7b", "3.7c"),
    ]
    assert figures_of(problems / "pill_turn.yaml") == ()


def test_bars_in_a_name_do_not_end_its_cell() -> None:
    entry = Entry(Path("a.yaml"), 0, "a | b", "", (), "not solved")
    assert len(re.findall(r"(?<!\\)\|", table_text(HEAD, [row(entry)]).splitlines()[2])) == len(HEAD) + 1


def test_without_a_browser_nothing_is_solved(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    problem(tmp_path / "problems", "undone")
    monkeypatch.setattr("gallery.browser", lambda: None)
    monkeypatch.setattr("gallery.kept_solve", lambda *_: pytest.fail("solved"))
    monkeypatch.setattr("sys.argv", ["gallery.py", str(tmp_path / "problems"), "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit):
        main()
    assert "apt-get install chromium" in capsys.readouterr().err
