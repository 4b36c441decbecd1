"""What is run where there is an earlier result to start from, on made-up outcomes of its refinement."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from casadi_hands.errors import DesignError, SolveError
from casadi_hands.export.design import Design
from casadi_hands.nlp import Options, Solver, SolverError
from casadi_hands.pipeline import Progress, run, solve
from casadi_hands.pipeline.couplings import Coupler
from casadi_hands.pipeline.judge import counted
from casadi_hands.pipeline.record import Record
from casadi_hands.pipeline.refiner import Refiner
from casadi_hands.task import parse_task
from tests.pipeline.replayed import replayed
from tests.pipeline.test_warm_start import HELD, earlier, edited, held_margins, pressing
from tests.stages.synthesis.example import ball_task


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """An earlier result that kept a firm grip."""
    earlier(motion=pressing(4.1, 0.8), status="certified").save(tmp_path / "earlier")
    return tmp_path / "earlier"


def refined_as(monkeypatch: pytest.MonkeyPatch, status: str, drops: int) -> list[dict[str, Any]]:
    """Let refinements end with a status and dropped replays; the calls they get."""
    calls: list[dict[str, Any]] = []

    def certify(self: Refiner, whole: Any, short: Any, margin: Any, near: bool) -> tuple[Design, Any]:
        calls.append(
            {"whole": whole, "short": short, "margin": margin, "near": near, "motion": self.record.design.motion}
        )
        self.record.add_runs([{"stage": "refine", "seconds": 0.0}])
        reason = "" if status == "certified" else "too far"
        certificate = {"slip": {"holds": status == "certified"}}
        design = replace(self.record.design, status=status, reason=reason, certificate=certificate)
        if status == "certified":
            design = replayed(design, drops)
            design = replace(design, reason=f"{drops} drops" if design.status == "feasible" else "")
        return design, None

    monkeypatch.setattr(Refiner, "certify", certify)
    return calls


def never(*_: Any) -> Design:
    raise AssertionError("not asked for")


def test_what_no_hand_can_do_fails_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(run, "_run", never)
    task = ball_task()
    palm = task.palm.model_copy(update={"facing": tuple(-value for value in task.palm.facing)})
    design = solve(task.model_copy(update={"palm": palm}), jobs=1, out=tmp_path)
    assert design.status == "failed"
    assert design.reason.startswith("the object is behind the palm at every goal")
    assert Design.load(tmp_path).reason == design.reason


def test_a_certified_refinement_of_the_earlier_hand_is_the_result(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls = refined_as(monkeypatch, "certified", 1)
    monkeypatch.setattr(run, "_run", never)
    solve(parse_task(edited("[0.115, 0, 0.3] -> [0.115, 0.005, 0.3]")), jobs=1, out=tmp_path / "out", start=folder)
    (call,) = calls
    assert (call["short"], call["margin"], call["near"]) == ((), held_margins().larger, True)
    np.testing.assert_allclose(call["motion"].object_position[10], [0.115, 0.005, 0.3], atol=1e-9)
    np.testing.assert_allclose(call["whole"].position[10] * 0.06, [0.115, 0.005, 0.3], atol=1e-9)
    loaded = Design.load(tmp_path / "out")
    assert loaded.status == "certified"
    assert [entry["started_from"] for entry in loaded.stages] == [str(folder)]
    assert set(loaded.seconds) == {"total"}


def test_the_folder_that_is_written_may_be_the_start(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    refined_as(monkeypatch, "certified", 0)
    solve(parse_task(edited("mass: 0.1 -> mass: 0.15")), jobs=1, out=folder, start=folder, force=True)
    motion = Design.load(folder).motion
    assert motion is not None
    np.testing.assert_allclose(motion.contact_force, 1.5 * pressing(4.1, 0.8).contact_force, atol=1e-9)


@pytest.mark.parametrize(
    ("status", "drops", "words"),
    [("feasible", 0, "no hand is certified: too far; now"), ("certified", 5, "no hand is certified: 5 drops")],
)
def test_where_it_does_not_serve_all_stages_are_run_and_know_of_it(
    status: str, drops: int, words: str, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refined_as(monkeypatch, status, drops)

    def all_stages(record: Record, until: str, executor: Any, jobs: int) -> Design:
        # Without the earlier hand, which is not that of the motions to come.
        assert (record.design.hand, record.design.motion) == (None, None)
        worse = {"slip": {"holds": False}, "gap": {"holds": False}}
        return record.update_best(replace(record.design, certificate=worse))

    monkeypatch.setattr(run, "_run", all_stages)
    news: list[Progress] = []
    design = solve(parse_task(HELD), jobs=1, start=folder, progress=news.append)
    assert design.hand is not None
    assert design.status == "feasible"
    assert any(words in word.text for word in news)


def test_where_its_refinement_breaks_off_all_stages_are_run(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def breaks(*_: Any, **__: Any) -> Any:
        raise SolverError("IPOPT: no memory left")

    def all_stages(record: Record, until: str, executor: Any, jobs: int) -> Design:
        assert (record.design.hand, record.design.motion) == (None, None)
        return replace(record.design, status="certified", reason="")

    monkeypatch.setattr(Refiner, "certify", breaks)
    monkeypatch.setattr(run, "_run", all_stages)
    news: list[Progress] = []
    assert solve(parse_task(HELD), jobs=1, start=folder, progress=news.append).status == "certified"
    assert any("no hand is certified: the solve broke off: IPOPT: no memory left" in word.text for word in news)


def test_where_motors_out_of_reach_keep_the_earlier_hand_from_its_certificate_all_stages_are_run(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And the hand that is handed over has the number in its certificate, whichever way it came."""
    refined_as(monkeypatch, "certified", 0)
    out_of_reach: list[Design] = []

    def without(self: Coupler, design: Design) -> Design:
        out_of_reach.append(design)
        return counted(design)

    monkeypatch.setattr(Coupler, "run", without)
    ran: list[Record] = []

    def all_stages(record: Record, until: str, executor: Any, jobs: int) -> Design:
        ran.append(record)
        return replace(record.design, hand=out_of_reach[0].hand, status="certified", reason="", certificate={"gap": {}})

    monkeypatch.setattr(run, "_run", all_stages)
    task = parse_task(HELD).model_copy(update={"motors": 1})
    design = solve(task, jobs=1, start=folder)
    assert len(out_of_reach) == len(ran) == 1
    assert design.status == "feasible"
    assert design.certificate["motors"]["limit"] == 1.0
    assert design.reason.endswith("motors, the task asks for 1 (motors)")


def test_what_cannot_be_started_from_is_refused_before_anything_is_written(folder: Path, tmp_path: Path) -> None:
    task = parse_task(edited("ground: {height: 0.2}"))
    for start, error, words in (
        (folder, SolveError, "ground: none there, one in the task"),
        (tmp_path / "nowhere", DesignError, "there is no such folder"),
    ):
        with pytest.raises(error, match=words):
            solve(task, jobs=1, out=tmp_path / "out", start=start)
    with pytest.raises(
        SolveError, match="until: given 'floating'; allowed with an earlier result: refine, all that is run"
    ):
        solve(parse_task(HELD), until="floating", start=folder)
    assert not (tmp_path / "out").exists()
    assert Design.load(folder).status == "certified"


def test_where_a_solver_breaks_off_the_best_design_so_far_is_the_result(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def breaks(*_: Any) -> Design:
        raise SolverError("IPOPT: no memory left")

    monkeypatch.setattr(run, "_run", breaks)
    design = solve(parse_task(HELD), jobs=1, out=tmp_path / "out")
    assert design.status == "failed"
    assert design.reason == "the solve broke off: IPOPT: no memory left; another seed may not"
    assert Design.load(tmp_path / "out").reason == design.reason
    refined_as(monkeypatch, "certified", 1)
    design = solve(parse_task(HELD), jobs=1, start=folder, out=tmp_path / "out")
    assert design.status == "certified"
    assert Design.load(tmp_path / "out").status == "certified"


ERRORS = [RuntimeError("shapes do not match"), ZeroDivisionError(), np.linalg.LinAlgError("singular"), TypeError("no")]


@pytest.mark.parametrize("error", ERRORS, ids=lambda error: type(error).__name__)
def test_a_mistake_in_the_code_is_raised_and_what_was_computed_stays(
    error: Exception, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def mistaken(*_: Any) -> Any:
        raise error

    monkeypatch.setattr(run, "run_search", mistaken)
    with pytest.raises(type(error)) as raised:
        solve(ball_task(), jobs=1, out=tmp_path / "out")
    assert raised.value is error
    assert raised.traceback[-1].name == "mistaken"
    left = Design.load(tmp_path / "out")
    assert left.reason == "stopped before a hand was designed"
    assert left.motion is not None


def test_a_mistake_after_a_judged_design_leaves_that_in_the_folder(
    folder: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    refined_as(monkeypatch, "feasible", 0)

    def mistaken(*_: Any) -> Any:
        raise RuntimeError("a mistake")

    monkeypatch.setattr(run, "_run", mistaken)
    with pytest.raises(RuntimeError, match="a mistake"):
        solve(parse_task(HELD), jobs=1, start=folder, out=tmp_path / "out")
    assert Design.load(tmp_path / "out").hand is not None


def test_only_what_ipopt_itself_raises_is_a_solvers_failure(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(*_: Any, **__: Any) -> Any:
        raise RuntimeError("linear solver not found")

    class Broken(Solver):
        def nlpsol(self, options: Options) -> Any:
            return broken

    monkeypatch.setattr("casadi_hands.stages.floating.stage.Solver", Broken)
    design = solve(ball_task(), jobs=1, until="floating")
    assert design.status == "failed"
    assert design.reason == "the solve broke off: IPOPT: linear solver not found; another seed may not"
    monkeypatch.setattr(Broken, "nlpsol", broken)
    with pytest.raises(RuntimeError, match="linear solver not found") as raised:
        solve(ball_task(), jobs=1, until="floating")
    assert type(raised.value) is RuntimeError


@pytest.mark.parametrize(
    ("far", "straight", "bends"),
    [(False, "certified", [90]), (True, "certified", [0]), (True, "feasible", [0, 90]), (False, "feasible", [90])],
)
def test_straight_links_are_tried_first_where_fingers_must_roll_far(
    far: bool, straight: str, bends: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    tried, task = list[float](), ball_task()
    monkeypatch.setattr(run, "rolls_far", lambda _: far)
    monkeypatch.setattr(run, "run_floating", lambda _, model: SimpleNamespace(model=model))
    monkeypatch.setattr(run, "prepare_search", lambda _, model, *__: SimpleNamespace(model=model))
    monkeypatch.setattr(run, "run_search", lambda *_: None)

    def certified(certifier: Any, found: Any) -> Design:
        tried.append(round(np.degrees(certifier.model.bend)))
        status: Any = straight if len(tried) == 1 else "certified"
        return Design(task, status)

    monkeypatch.setattr(run, "_certified", certified)
    monkeypatch.setattr(run, "Judge", lambda *_: SimpleNamespace(concluded=lambda design, _: design))
    design = run._run(Record(task, None, lambda _: None), "refine", None, 1)
    assert tried == bends
    assert design.status == ("certified" if len(bends) == 2 else straight)


@pytest.mark.parametrize(
    ("motors", "far", "spare"), [("independent", False, True), ("independent", True, False), ("fewest", False, False)]
)
def test_joints_are_spared_where_each_has_a_motor_and_none_must_roll_far(
    motors: str, far: bool, spare: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    task = ball_task().model_copy(update={"motors": motors})
    found, asked, told = Design(task, "certified"), list[tuple[Any, ...]](), list[Any]()

    def certify(candidate: Any, margin: Any, thorough: bool) -> tuple[str, None]:
        asked.append((candidate, margin, thorough))
        return "design", None

    class Pruner:
        def __init__(self, record: Any, search: Any, certify: Any, spare: bool, failed: Any) -> None:
            told.extend((spare, failed))
            self.certify = certify

        def run(self, design: Design) -> Any:
            assert design is found
            return self.certify("candidate"), self.certify("another")

    kept = list[Design]()
    monkeypatch.setattr(run, "rolls_far", lambda _: far)
    monkeypatch.setattr(run, "kept_margin", lambda design: kept.append(design) or "margin")
    monkeypatch.setattr(run, "Pruner", Pruner)
    certifier: Any = SimpleNamespace(record=SimpleNamespace(task=task), model=None, search=None, failed={(2, 2)})
    certifier.run, certifier.certify = lambda _: found, certify
    assert run._certified(certifier, None) == ("design", "design")  # type: ignore[arg-type, comparison-overlap]
    # With the margin that the certified hand keeps, which is looked for once, and no other grips.
    assert asked == [("candidate", "margin", False), ("another", "margin", False)]
    assert kept == [found]
    assert told == [spare, {(2, 2)}]
