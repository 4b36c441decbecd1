"""A solve that was stopped goes on from what it had finished, to the design of one that was not."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from casadi_hands import explore, solve
from casadi_hands.errors import DesignError, SolveError
from casadi_hands.export.design import Design
from casadi_hands.export.moving import FILES
from casadi_hands.export.place import beside
from casadi_hands.nlp import Solver
from casadi_hands.pipeline import Progress
from casadi_hands.pipeline.unfinished import is_unfinished, stopped_solve
from casadi_hands.task import parse_task
from casadi_hands.terms.own import Cost
from tests.test_pipeline import BALL

TASK = parse_task(BALL.replace("max_joints: 2", "max_joints: 1"))


class StoppedError(Exception):
    """What stops a solve in these tests."""


def stopping_at(words: str) -> Any:
    """Progress that stops a solve when it tells of something."""

    def hear(news: Progress) -> None:
        if words in f"{news.stage}: {news.text}":
            raise StoppedError

    return hear


def content(folder: Path) -> dict[str, Any]:
    """All files but the pages, without times."""
    found: dict[str, Any] = {
        name: (folder / name).read_bytes()
        for name in FILES
        if (folder / name).exists() and name not in ("result.json", "viewer.html", "report.html")
    }
    record = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    del record["seconds"]
    for run in record["stages"]:
        del run["seconds"]
    return found | {"record": record}


@pytest.fixture
def solves(monkeypatch: pytest.MonkeyPatch) -> list[Solver]:
    """The solvers that ran, in order."""
    ran: list[Solver] = []
    run = Solver.solve
    monkeypatch.setattr(Solver, "solve", lambda self, *a, **named: (ran.append(self), run(self, *a, **named))[1])
    return ran


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("whole") / "out"
    solve(TASK, jobs=1, out=out, until="whole_hand")
    return out


@pytest.mark.parametrize(
    ("words", "left"),
    [
        ("synthesis: fingers for", True),
        ("synthesis: finger right, 1 joint(s), trial 2", True),
        ("synthesis: hand 1", True),
        ("whole_hand: object and hand", True),
        ("floating: object", False),
    ],
)
def test_it_comes_to_the_same_files(
    words: str, left: bool, uninterrupted: Path, tmp_path: Path, solves: list[Solver]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(StoppedError):
        solve(TASK, jobs=1, out=out, until="whole_hand", progress=stopping_at(words))
    before = len(solves)
    assert is_unfinished(out) == left
    task, request = stopped_solve(out) if left else (TASK, None)
    assert task == TASK
    if request is not None:
        assert (request.until, request.seeds, request.start) == ("whole_hand", None, None)
    solve(task, jobs=2 if "trial" in words else 1, out=out, until="whole_hand", resume=left)
    assert content(out) == content(uninterrupted)
    assert list(tmp_path.iterdir()) == [out]
    # What is finished is not done again.
    if "trial" not in words and left:
        assert len(solves) == len(json.loads((out / "result.json").read_text())["stages"])
        assert before > 0


def test_it_goes_on_only_with_what_it_was_asked_for(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(SolveError, match="no solve was stopped here"):
        solve(TASK, jobs=1, out=out, resume=True)
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(StoppedError):
        solve(TASK, jobs=1, out=out, until="synthesis", progress=stopping_at("synthesis: finger left"))
    with pytest.raises(SolveError, match="had another until"):
        solve(TASK, jobs=1, out=out, resume=True)
    with pytest.raises(SolveError, match="had another task"):
        solve(TASK, jobs=1, out=out, seed=3, until="synthesis", resume=True)
    with pytest.raises(SolveError, match="without terms of its own"):
        solve(TASK, jobs=1, out=out, resume=True, terms=[Cost("mine", lambda samples: [], "floating")])
    file = beside(out) / "request.json"
    request = json.loads(file.read_text())
    request["program"]["casadi"] = "3.7.0"
    file.write_text(json.dumps(request))
    with pytest.raises(SolveError, match="begun with another version of casadi, so"):
        solve(TASK, jobs=1, out=out, until="synthesis", resume=True)
    # A new solve forgets it.
    solve(TASK, jobs=1, out=out, until="floating")
    assert list(tmp_path.iterdir()) == [out]


def test_a_better_result_stays_and_the_other_one_can_still_be_had(tmp_path: Path) -> None:
    out = tmp_path / "out"
    solve(TASK, jobs=1, out=out, until="whole_hand")
    better = json.loads((out / "result.json").read_text())
    for figure in better["certificate"].values():
        figure["holds"] = True
    (out / "result.json").write_text(json.dumps({**better, "status": "feasible", "reason": "better"}))
    solve(TASK, jobs=1, out=out, until="whole_hand")
    assert Design.load(out).reason == "better"
    assert is_unfinished(out)
    solve(TASK, jobs=1, out=out, until="whole_hand", resume=True, force=True)
    assert Design.load(out).reason != "better"
    assert list(tmp_path.iterdir()) == [out]


def test_an_exploration_goes_on_with_the_seed_that_was_stopped(tmp_path: Path, solves: list[Solver]) -> None:
    whole, out = tmp_path / "whole", tmp_path / "out"
    explore(TASK, seeds=[0, 1], jobs=1, out=whole, until="whole_hand")
    all_of_them = len(solves)
    with pytest.raises(StoppedError):
        explore(TASK, seeds=[0, 1], jobs=1, out=out, until="whole_hand", progress=stopping_at("seed 1: hand 1"))
    task, request = stopped_solve(out)
    assert request.seeds == (0, 1)
    explore(task, seeds=request.seeds, jobs=1, out=out, until="whole_hand", resume=True)
    assert len(solves) == 2 * all_of_them
    for folder in ("", "alternatives/seed0", "alternatives/seed1"):
        assert (out / folder / "result.json").exists() == (whole / folder / "result.json").exists()
        if (whole / folder / "result.json").exists():
            assert content(out / folder) == content(whole / folder)
    assert (out / "alternatives/ranking.json").read_bytes() == (whole / "alternatives/ranking.json").read_bytes()
    assert {each.name for each in tmp_path.iterdir()} == {"whole", "out"}
    assert not list((out / "alternatives").glob(".*"))


def test_two_solves_into_one_folder(tmp_path: Path) -> None:
    """The second, of this process or another, ends at once, and the first goes on."""
    out = tmp_path / "out"
    heard: list[Any] = []

    def hear(news: Progress) -> None:
        if not heard and news.stage == "synthesis":
            heard.append(news)
            code = (
                "import sys; from casadi_hands import solve, load_task\n"
                "from casadi_hands.errors import DesignError\n"
                "from pathlib import Path\n"
                "try: solve(load_task(sys.argv[1]), jobs=1, out=Path(sys.argv[2]))\n"
                "except DesignError as error: print(error)"
            )
            (tmp_path / "task.yaml").write_text(BALL)
            command = [sys.executable, "-c", code, str(tmp_path / "task.yaml"), str(out)]
            heard.append(subprocess.run(command, capture_output=True, text=True, check=True).stdout)

    solve(TASK, jobs=1, out=out, until="synthesis", progress=hear)
    assert "another solve" in heard[1]
    assert "is writing here" in heard[1]
    assert Design.load(out).status == "feasible"


def test_a_certified_result_is_refused_before_anything_is_computed(tmp_path: Path, solves: list[Solver]) -> None:
    solve(TASK, jobs=1, out=tmp_path / "out", until="floating")
    record = json.loads((tmp_path / "out/result.json").read_text())
    (tmp_path / "out/result.json").write_text(json.dumps({**record, "status": "certified"}))
    ran = len(solves)
    with pytest.raises(DesignError, match="holds a certified result of this task already\n--force"):
        solve(TASK, jobs=1, out=tmp_path / "out", until="floating")
    with pytest.raises(DesignError, match="holds a certified result of this task already\n--force"):
        explore(TASK, seeds=[0, 1], jobs=1, out=tmp_path / "out", until="floating")
    assert len(solves) == ran
    solve(TASK, jobs=1, out=tmp_path / "out", until="floating", force=True)
    assert Design.load(tmp_path / "out").status == "feasible"
