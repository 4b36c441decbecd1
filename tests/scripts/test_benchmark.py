"""What the benchmark's numbers mean."""

from __future__ import annotations

import multiprocessing
import os
import time
from multiprocessing.connection import Connection
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from benchmark import MEDIANS, OURS, PEERS, SPENT, compared, medians, reached, shares, slowness
from evaluated import _compared, _loops
from growth import ITERATIONS, Size, exponent, measure, task_of
from isolated import Outcome, isolated
from peers import Attempt, Run, recorded_solves
from profiled import KINDS, Ledger, processor_time

from casadi_hands import load_task
from casadi_hands.nlp.derivatives import kernel_functions
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage

TASK = Path(__file__).parents[2] / "problems" / "horizontal_translation.yaml"
NAP = 60  # s


def attempt(*trace: tuple[float, float]) -> Attempt:
    return Attempt(trace[-1][1], len(trace) - 1, trace[-1][0], list(trace), "ended")


OUR = attempt((0.0, 9.0), (0.1, 4.0), (0.2, 1.0))


def test_times_are_to_what_the_peer_ends_with() -> None:
    # Its long tail from 2.0 s on, which gains less than a thousandth, is not held against it.
    theirs = attempt((0.0, 9.0), (1.0, 5.0), (2.0, 4.001), (8.0, 4.0))
    assert slowness(theirs, OUR) == pytest.approx(2.0 / 0.1)
    assert slowness(attempt((0.0, 9.0), (1.0, 0.5)), OUR) == 0
    assert reached(OUR, 0.9) == np.inf


def test_rows_of_optimisers() -> None:
    worse, better = attempt((0.0, 9.0), (1.0, 4.0)), attempt((0.0, 9.0), (3.0, 0.5))
    row = compared(Outcome(Run(2.0, [worse, better, OUR]), "", 99.6, 7.0), Run(0.4, [OUR] * 3), 3.0, True)
    named = dict(zip(PEERS[3:], row, strict=True))
    assert named["building s"] == "2.000"
    assert named["solving s"] == "4.200"
    assert named["iterations"] == "4"
    assert named["objective / ours"] == "1"
    assert named["lower / equal / higher"] == "1 / 1 / 1"
    assert named["reached at the limit"] == "1 of 3"
    # 10 for the worse one, 0 where ours never gets there, 1.
    assert named["times slower to its own objective"] == "1"
    assert named["times slower in all"] == "6.2"
    assert named["MB"] == "100"
    assert len(compared(Outcome(None, "the process died", 0, 7.0), Run(0.4, [OUR]), 3.0, True)) == len(row)


def test_medians_are_of_what_ended() -> None:
    ended = [
        [task, "1", "BFGS", *["1"] * 6, own, in_all, "90"]
        for task, own, in_all in (("a", "3", "10"), ("b", "5", "40"), ("c", "9", "20"))
    ]
    other = ["a", "2", "BFGS", "stopped after 3 s", *["–"] * 8]
    assert medians([*ended, other]) == [["1", "BFGS", "5", "20", "3"], ["2", "BFGS", "–", "–", "0"]]
    assert len(MEDIANS) == 5


def test_medians_of_all_stages_are_of_their_times_together() -> None:
    def row(task: str, stage: str, name: str, building: str, solving: str) -> list[str]:
        return [task, stage, name, building, solving, *["x"] * 4, "1", "1", "90"]

    rows = [row(task, stage, OURS, "1", "0") for task in "abc" for stage in ("1", "2, finger", "2, hand")]
    # 24 / 3, and only one stage of three.
    rows += [row("a", stage, "Opti", "7", "1") for stage in ("1", "2, finger", "2, hand")]
    rows += [row("b", "1", "Opti", "1", "1")]
    together = [each for each in medians(rows) if each[0] == "all"]
    assert together == [["all", OURS, "–", "1", "3"], ["all", "Opti", "–", "8", "1"]]


def test_functions_and_loops_of_kernels_compute_the_same() -> None:
    task = load_task(TASK)
    with recorded_solves() as posed:
        stage = FloatingStage(build_model(task))
        stage.solve(dict(task.weights.floating))
    solver, x, p = stage.solver, posed[0].start, posed[0].parameters
    kernels = kernel_functions([bound.kernel for bound in solver.problem._bound])
    multipliers = np.random.default_rng(1).normal(size=solver.problem.constraints.size)

    def called(role: str, output: int) -> list[np.ndarray]:
        """What each kernel's loop gives, in a column."""
        columns = []
        for loop, inputs in _loops(solver.problem, kernels, role, x, p, multipliers):
            shaped = [ca.reshape(ca.DM(each), *loop.size_in(i)) for i, each in enumerate(inputs)]
            columns.append(np.asarray(ca.vec(loop.call(shaped)[output])).reshape(-1))
        return columns

    f, g = solver.functions["nlp"](x, p)
    assert float(f) > 0
    assert np.ptp(np.asarray(g)) > 0
    assert sum(column.sum() for column in called("value", 0)) == pytest.approx(float(f), rel=1e-12)
    assert sum(column.sum() for column in called("gradient", 0)) == pytest.approx(float(f), rel=1e-12)
    np.testing.assert_allclose(np.concatenate(called("jacobian", 0)), np.asarray(g).reshape(-1), rtol=1e-12)
    # The Lagrangian's curvature along x, kernel by kernel: with multipliers in their places.
    upper = np.asarray(solver.functions["hess_lag"](x, p, 1.0, multipliers))
    curvature = x @ (upper + np.triu(upper, 1).T) @ x
    along = 0.0
    bounds = [(b, k) for b, k in zip(solver.problem._bound, kernels, strict=True) if k.hessian_pattern.nnz()]
    for (bound, kernel), column in zip(bounds, called("hessian", 0), strict=True):
        rows, columns = (np.array(each) for each in kernel.hessian_pattern.get_triplet())
        local = (bound.selector @ x).reshape(bound.count, -1)
        twice = np.where(rows == columns, 1.0, 2.0)
        along += np.sum(column.reshape(bound.count, -1) * twice * local[:, rows] * local[:, columns])
    assert abs(curvature) > 1
    assert along == pytest.approx(curvature, rel=1e-9)
    seconds = _compared(solver, x, p)
    assert list(seconds) == ["value", "gradient", "Jacobian", "Hessian"]
    assert all(whole > 0 and loop > 0 for whole, loop in seconds.values())


def test_shares_are_of_the_whole_with_the_rest_last() -> None:
    cells = shares({"building": 1.0, "Hessian": 2.0}, 8.0)
    assert len(SPENT) == 5 + len(cells)
    assert dict(zip([*KINDS, "rest"], cells, strict=True)) == {
        **dict.fromkeys(KINDS, "0"),
        "building": "12",
        "Hessian": "25",
        "rest": "62",
    }


def test_the_ledger_books_each_second_once() -> None:
    task = load_task(TASK)
    ledger = Ledger()
    with ledger.open():
        ledger.stage = "floating"
        result = FloatingStage(build_model(task)).solve(dict(task.weights.floating))
    solutions = [solution for _, solution in result.runs]
    booked = ledger.seconds["floating"]
    solving = sum(solution.seconds for solution in solutions)
    assert booked.pop("building") > 0
    assert sum(booked.values()) == pytest.approx(solving, rel=1e-9)
    assert all(0 < booked[kind] < solving for kind in KINDS[1:-2])  # no replays or audits yet
    assert ledger.iterations["floating"] == sum(solution.iterations for solution in solutions)
    assert ledger.solves["floating"] == len(solutions)
    FloatingStage(build_model(task))
    assert "building" not in booked


@pytest.mark.parametrize("size", [Size(), Size(2, 5, 1, 1), Size(6, 11, 4, 3), Size(5, 41, 8, 2)])
def test_tasks_are_of_the_size_asked_for(size: Size) -> None:
    model = build_model(task_of(size))
    assert len(model.schedule.keyframes) == size.keyframes
    assert len(model.schedule.samples) == 2 * size.keyframes - 1
    assert len(model.bodies) == size.primitives
    assert model.contacts == size.fingers
    assert len({tuple(patch) for patch in model.patches}) == size.fingers


def test_the_exponent_is_that_of_a_power() -> None:
    sizes = [11, 21, 41, 81]
    assert exponent(sizes, [0.02 * n**1.3 for n in sizes]) == pytest.approx(1.3, rel=1e-9)


def test_a_point_of_refine_is_measured_on_few_iterations() -> None:
    with recorded_solves() as posed:
        point = measure("refine", Size(2, 5, 1, 1))
    own = [program.options.max_iter for program in posed if len(program.start) == point.variables]
    # Soft and firm at least, once to compile and once to measure.
    assert len(own) >= 4
    assert set(own) == {ITERATIONS}


def test_a_call_of_its_own_process_returns_fails_or_is_stopped() -> None:
    done = isolated(_allocate, 200, limit=60)
    assert done.value != os.getpid()
    assert done.failure == ""
    assert done.megabytes > isolated(os.getpid, limit=60).megabytes + 150
    assert isolated(int, "seven", limit=60).failure.startswith("ValueError")
    assert isolated(os._exit, 3, limit=60).failure == "the process died"
    slow = isolated(_wait, limit=0.5)
    assert slow.failure == "stopped after 0.5 s"
    assert slow.seconds < NAP


def _allocate(megabytes: int) -> int:
    assert np.ones(megabytes * 2**17).all()
    return os.getpid()


def _wait() -> None:
    time.sleep(NAP)


def spin(pipe: Connection) -> None:
    began = time.process_time()
    while time.process_time() - began < 0.3:
        pass
    pipe.send(time.process_time())
    pipe.recv()


def test_processor_time_is_what_children_have_used() -> None:
    context = multiprocessing.get_context("spawn")
    pipes = [context.Pipe() for _ in range(2)]
    children = [context.Process(target=spin, args=(theirs,)) for _, theirs in pipes]
    try:
        began = time.perf_counter()
        for child in children:
            child.start()
        used = sum(ours.recv() for ours, _ in pipes)
        got, waited = processor_time()
        assert got == pytest.approx(used, abs=0.1)
        # No thread waits for longer than it is there.
        threads = sum(len(list(Path(f"/proc/{child.pid}/task").iterdir())) for child in children)
        assert 0 <= waited < threads * (time.perf_counter() - began)
    finally:
        for ours, _ in pipes:
            ours.send(None)
        for child in children:
            child.join()
