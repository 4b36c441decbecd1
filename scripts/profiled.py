"""Where the time of a solve goes: by stage, and within a stage by kind."""

from __future__ import annotations

import multiprocessing
import time
from collections import defaultdict
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from unittest.mock import patch

from casadi_hands.nlp import Options, Solution, Solver
from casadi_hands.pipeline import Progress, judge, solve
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.synthesis.stage import SynthesisStage
from casadi_hands.stages.whole_hand.stage import WholeHandStage
from casadi_hands.task import load_task
from casadi_hands.verify import audit_files, run_replays

KINDS = ("building", "value", "gradient", "Jacobian", "Hessian", "rest of IPOPT", "replays", "audits")
CALLED = {"value": ("nlp_f", "nlp_g"), "gradient": ("nlp_grad_f",), "Jacobian": ("nlp_jac_g",)}
CALLED["Hessian"] = ("nlp_hess_l",)
Seconds = dict[str, dict[str, float]]


class Ledger:
    """Seconds by stage and kind, and iterations and solves by stage, of what this process solves.

    Attributes:
        stage: that time is booked on.
        seconds: stage -> kind -> s.
        iterations: stage -> IPOPT's iterations.
        solves: stage -> calls of IPOPT.
    """

    def __init__(self) -> None:
        self.stage = ""
        self.seconds: Seconds = defaultdict(lambda: defaultdict(float))
        self.iterations: dict[str, int] = defaultdict(int)
        self.solves: dict[str, int] = defaultdict(int)
        self._timing = 0

    @contextmanager
    def open(self) -> Iterator[Ledger]:
        """Book every stage that is built and every solve meanwhile."""
        stages = (FloatingStage, SynthesisStage, WholeHandStage, RefineStage)
        patches = [patch.object(stage, "__init__", self._timed(stage.__init__)) for stage in stages]
        patches += [patch.object(Solver, "nlpsol", self._timed(Solver.nlpsol))]
        patches += [patch.object(Solver, "solve", self._booked(Solver.solve))]
        # Where they are used, not where they are made: that name is what is looked up.
        patches += [patch.object(judge, "run_replays", self._timed(run_replays, "replays"))]
        patches += [patch.object(judge, "audit_files", self._timed(audit_files, "audits", "audit"))]
        for each in patches:
            each.start()
        try:
            yield self
        finally:
            for each in patches:
                each.stop()

    def _timed(self, function: Callable[..., Any], kind: str = "building", stage: str = "") -> Callable[..., Any]:
        """The same function, whose time is booked on a stage, or on the one that runs."""

        def timed(*given: Any, **named: Any) -> Any:
            self._timing += 1
            began = time.perf_counter()
            try:
                return function(*given, **named)
            finally:
                self._timing -= 1
                if not self._timing:
                    self.seconds[stage or self.stage][kind] += time.perf_counter() - began

        return timed

    def _booked(self, function: Callable[..., Solution]) -> Callable[..., Solution]:
        def booked(solver: Solver, start: Any, parameters: Any, options: Any = None, *rest: Any, **named: Any) -> Any:
            solution = function(solver, start, parameters, options, *rest, **named)
            record = solver.nlpsol(options or Options()).stats()
            booked = self.seconds[self.stage]
            left = solution.seconds
            for kind, names in CALLED.items():
                seconds = sum(record[f"t_wall_{name}"] for name in names)
                booked[kind] += seconds
                left -= seconds
            booked["rest of IPOPT"] += left
            self.iterations[self.stage] += solution.iterations
            self.solves[self.stage] += 1
            return solution

        return booked


def profiled_solve(task_file: Path, seed: int) -> dict[str, Any]:
    """Solve a task in this process alone and say where the time went.

    Returns:
        ``status``; ``total`` s; ``seconds`` stage -> kind -> s, where ``all`` is the stage's time; ``iterations`` and
        ``solves`` by stage.
    """
    ledger = Ledger()
    task = load_task(task_file)
    with ledger.open():
        design = solve(task, seed=seed, jobs=1, progress=lambda news: setattr(ledger, "stage", news.stage))
    seconds = {name: dict(kinds) for name, kinds in ledger.seconds.items()}
    for stage in seconds:
        # Audits run between the stages.
        seconds[stage]["all"] = design.seconds.get(stage, sum(seconds[stage].values()))
    return {
        "status": design.status,
        "total": design.seconds["total"],
        "seconds": seconds,
        "iterations": dict(ledger.iterations),
        "solves": dict(ledger.solves),
    }


def cores_used(task_file: Path) -> tuple[float, float]:
    """Shares of two cores that two processes get, and ask for, during stage 2 of a solve.

    What they ask for and do not get went to others on the machine. Needs Linux.
    """
    heard: list[tuple[float, float, float]] = []

    def hear(news: Progress) -> None:
        if news.stage == "synthesis":
            heard.append((time.perf_counter(), *processor_time()))

    solve(load_task(task_file), jobs=2, until="synthesis", progress=hear)
    wall, got, waited = (last - first for first, last in zip(heard[0], heard[-1], strict=True))
    return got / (2 * wall), (got + waited) / (2 * wall)


def processor_time() -> tuple[float, float]:
    """Seconds that this process's children have run, and have been ready to run without a processor."""
    threads = [file for c in multiprocessing.active_children() for file in Path(f"/proc/{c.pid}/task").glob("*")]
    spent = [tuple(map(int, (thread / "schedstat").read_text().split())) for thread in threads]
    return 1e-9 * sum(each[0] for each in spent), 1e-9 * sum(each[1] for each in spent)
