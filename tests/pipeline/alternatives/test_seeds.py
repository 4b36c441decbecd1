"""Exploring seeds: the folders, the ranking, the pages; solves are pretended."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from casadi_hands import explore
from casadi_hands.errors import SolveError
from casadi_hands.export.design import Design
from casadi_hands.pipeline import Progress
from tests.export.example import example_design, example_task
from tests.pipeline.alternatives.example import certified, shifted, without_hand

Outcome = Design | BaseException


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> Callable[[dict[int, Outcome]], list[dict[str, Any]]]:
    """Let solve write and return what is given for each seed; gives the list of calls."""

    def pretend(outcomes: dict[int, Outcome]) -> list[dict[str, Any]]:
        calls: list[dict[str, Any]] = []

        def solve(task: Any, *, seed: int, out: Path | None, progress: Any, **settings: Any) -> Design:
            calls.append({"seed": seed, "out": out, **settings})
            progress(Progress("floating", "begins", 0.5))
            outcome = outcomes[seed]
            if isinstance(outcome, BaseException):
                if out is not None:
                    without_hand().save(out)
                raise outcome
            if out is not None:
                outcome.save(out)
            return outcome

        monkeypatch.setattr("casadi_hands.pipeline.alternatives.seeds.solve", solve)
        return calls

    return pretend


def menu(page: Path) -> list[tuple[str | None, str]]:
    """The addresses and texts of a page's menu; None for the page itself."""
    found = re.search(r'<nav id="menu"[^>]*>(.*?)</nav>', page.read_text(encoding="utf-8"))
    links = re.findall(r'<a (?:href="([^"]*)"|aria-current="page")>(.*?)</a>', found[1]) if found else []
    return [(address or None, text) for address, text in links]


def ranking(folder: Path) -> list[dict[str, Any]]:
    entries: list[dict[str, Any]] = json.loads((folder / "alternatives/ranking.json").read_text())["seeds"]
    return entries


def test_the_best_is_in_the_folder_and_the_distinct_ones_beside_it(solves, tmp_path) -> None:
    worse, best = certified(shifted(0.03), friction_use=0.8), certified()
    calls = solves({4: worse, 5: best, 6: certified(shifted(0.001), friction_use=0.7)})
    workers = ThreadPoolExecutor(1)
    found = explore(example_task(), seeds=range(4, 7), jobs=1, until="whole_hand", out=tmp_path, executor=workers)
    assert [(one.seed, one.kept, one.like) for one in found] == [(5, True, None), (6, False, 5), (4, True, None)]
    settings = {"jobs": 1, "until": "whole_hand", "executor": workers, "terms": (), "force": True, "resume": False}
    assert calls[1] == {"seed": 5, "out": tmp_path / "alternatives/seed5", **settings}
    assert Design.load(tmp_path).hand == best.hand
    assert {path.name for path in (tmp_path / "alternatives").iterdir()} == {"seed4", "seed5", "ranking.json"}
    for name in ("result.json", "motion.npz", "hand.urdf", "scene.xml"):
        assert (tmp_path / name).read_bytes() == (tmp_path / "alternatives/seed5" / name).read_bytes()
    assert Design.load(tmp_path / "alternatives/seed4").hand == worse.hand


def test_pages_lead_to_each_other(solves, tmp_path) -> None:
    solves({0: certified(shifted(0.03), friction_use=0.8), 1: certified()})
    explore(example_task(), seeds=[0, 1], out=tmp_path)
    texts = ["seed 1 · 2+2+2 joints · certified", "seed 0 · 2+2+2 joints · certified"]
    pages = [tmp_path / "viewer.html", *(tmp_path / f"alternatives/seed{k}/viewer.html" for k in (1, 0))]
    for page in pages:
        assert [text for _, text in menu(page)] == texts
    current = [[address is None for address, _ in menu(page)] for page in pages]
    assert current == [[True, False], [True, False], [False, True]]
    for page, other in ((pages[0], pages[2]), (pages[1], pages[2]), (pages[2], pages[1])):
        (address,) = (address for address, _ in menu(page) if address)
        assert (page.parent / address).resolve() == other.resolve()


def test_a_single_distinct_hand_has_no_menu(solves, tmp_path) -> None:
    solves({0: certified(), 1: certified()})
    explore(example_task(), seeds=[0, 1], out=tmp_path)
    assert menu(tmp_path / "viewer.html") == []
    assert not (tmp_path / "alternatives/seed1").exists()


def test_a_seed_that_breaks_off_is_listed_and_keeps_what_it_wrote(solves, tmp_path) -> None:
    solves({0: SolveError("no memory left"), 1: certified(), 2: replace(example_design(), status="failed")})
    found = explore(example_task(), seeds=[0, 1, 2], out=tmp_path)
    assert [(one.seed, one.design.status) for one in found] == [(1, "certified"), (2, "failed"), (0, "failed")]
    assert ranking(tmp_path)[2]["reason"] == "the solve broke off: no memory left"
    left = Design.load(tmp_path / "alternatives/seed0")
    assert (left.status, left.reason) == ("failed", "the solve broke off: no memory left")
    assert left.motion is not None


def test_when_every_seed_breaks_off_the_error_is_raised(solves) -> None:
    solves({0: SolveError("no contact"), 1: SolveError("no finger contact is ever active")})
    with pytest.raises(SolveError, match="ever active"):
        explore(example_task(), seeds=[0, 1])


def test_the_ranking_says_what_the_designs_say(solves, tmp_path) -> None:
    solves({0: certified(friction_use=0.25, torque=0.2), 1: without_hand()})
    explore(example_task(), seeds=[0, 1], out=tmp_path)
    assert ranking(tmp_path) == [
        {
            "seed": 0,
            "status": "certified",
            "reason": "",
            "joints": [2, 2, 2],
            "margin": 0.75,
            "torque": 0.2,
            "kept": True,
            "like": None,
        },
        {
            "seed": 1,
            "status": "feasible",
            "reason": "made by hand",
            "joints": [],
            "margin": None,
            "torque": None,
            "kept": True,
            "like": None,
        },
    ]


def test_what_is_done_so_far_is_there_when_interrupted(solves, tmp_path) -> None:
    solves({0: certified(shifted(0.03), friction_use=0.8), 1: certified(), 2: KeyboardInterrupt()})
    with pytest.raises(KeyboardInterrupt):
        explore(example_task(), seeds=[0, 1, 2], out=tmp_path)
    assert [one["seed"] for one in ranking(tmp_path)] == [1, 0]
    assert Design.load(tmp_path).hand == certified().hand
    assert len(menu(tmp_path / "alternatives/seed0/viewer.html")) == 2


def test_nothing_of_an_earlier_exploration_is_left_and_nothing_else_is_touched(solves, tmp_path) -> None:
    solves({seed: certified(shifted(0.03 * seed)) for seed in range(3)})
    explore(example_task(), seeds=[0, 1, 2], out=tmp_path)
    for mine in ("notes.txt", "alternatives/notes.txt", "alternatives/seed2/notes.txt"):
        (tmp_path / mine).write_text("mine")
    (tmp_path / "alternatives/seeds").mkdir()
    explore(example_task(), seeds=[0], out=tmp_path, force=True)
    assert [one["seed"] for one in ranking(tmp_path)] == [0]
    left = {str(path.relative_to(tmp_path / "alternatives")) for path in (tmp_path / "alternatives").rglob("*")}
    assert {name for name in left if not name.startswith("seed0")} == {
        "ranking.json",
        "notes.txt",
        "seed2",
        "seed2/notes.txt",
        "seeds",
    }
    assert (tmp_path / "notes.txt").read_text() == "mine"


def test_without_a_folder_nothing_is_written(solves, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    calls = solves({0: certified(), 1: certified(friction_use=0.1)})
    assert [one.seed for one in explore(example_task(), seeds=[0, 1, 0])] == [1, 0]
    assert [call["out"] for call in calls] == [None, None]
    assert list(tmp_path.iterdir()) == []


def test_progress_names_the_seed_and_time_goes_on(solves) -> None:
    solves({3: certified(), 4: certified()})
    heard: list[Progress] = []
    explore(example_task(), seeds=[3, 4], progress=heard.append)
    assert [news.text for news in heard] == ["seed 3: begins", "seed 4: begins"]
    assert heard[0].elapsed == pytest.approx(0.5, abs=0.1)
    assert heard[1].elapsed > heard[0].elapsed


def test_wrong_arguments_leave_earlier_results_alone(solves, tmp_path) -> None:
    example_design().save(tmp_path)
    with pytest.raises(SolveError, match="no seeds"):
        explore(example_task(), seeds=[], out=tmp_path)
    with pytest.raises(SolveError, match="allowed: floating"):
        explore(example_task(), seeds=[0], until="never", out=tmp_path)
    assert Design.load(tmp_path).hand == example_design().hand
