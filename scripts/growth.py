"""Measure how time and memory of building and of an iteration grow with the size of a task.

    python scripts/growth.py --plot growth.png

One capsule is carried to and fro by fingers that alternate between its sides. From 3 fingers of 2 joints, 20
keyframes and 1 primitive, one of these changes at a time. Each point has a process of its own with one thread;
building is timed with kernels compiled, which a build beforehand sees to. Starts are made up (the straight way and
random fingers; for refine, one random start of each finger taken through the stages before) and solves stop after few
iterations: what is measured is the cost of one, not how many there are. Seconds are the processor's, which other work
on the machine disturbs less.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from isolated import isolated, largest_memory
from shared import NOTHING, options_of, write_table
from tables import add_json, write_record

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.nlp import Options, Solution, Solver
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.model import Model, sizes
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.object_motion.values import object_parameters, term_weights
from casadi_hands.stages.refine.settings import ALL_STEPS
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin
from casadi_hands.stages.synthesis.seeds import random_finger
from casadi_hands.stages.synthesis.stage import OPTIONS, SynthesisStage
from casadi_hands.stages.synthesis.target import Target, target_of
from casadi_hands.stages.whole_hand.stage import OPTIONS as WHOLE
from casadi_hands.stages.whole_hand.stage import WholeHandStage
from casadi_hands.task import Task, parse_task

ITERATIONS = 8
STAGES = ("floating", "synthesis", "refine")
HEAD = ("changed", "value", "stage", "variables", "building s", "ms an iteration", "MB")
EXPONENTS = ("stage", "building", "an iteration")


@dataclass(frozen=True)
class Size:
    """How large a task is."""

    fingers: int = 3
    keyframes: int = 21
    primitives: int = 1
    joints: int = 2


SWEEPS: dict[str, Sequence[int]] = {
    "fingers": (2, 3, 4, 5, 6),
    "keyframes": (5, 11, 21, 41, 81),
    "primitives": (1, 2, 4, 8),
    "joints": (1, 2, 3, 4),
}


@dataclass(frozen=True)
class Point:
    """One measurement: number of variables, CPU s to build and for an iteration, memory of the process, MB."""

    variables: int
    building: float
    iteration: float
    megabytes: float


def main() -> None:
    """Measure every sweep, print the table and the growth with the motion's length."""
    parser = options_of(__doc__)
    parser.add_argument("--sweeps", nargs="+", choices=list(SWEEPS), default=list(SWEEPS), help="what to change")
    parser.add_argument("--stages", nargs="+", choices=STAGES, default=list(STAGES), help="stages to measure")
    parser.add_argument("--limit", type=float, default=300.0, help="s for each point")
    parser.add_argument("--out", type=Path, default=Path("results/growth"), help="folder for the table")
    parser.add_argument("--plot", type=Path, help="also draw a chart to this file; needs matplotlib")
    add_json(parser)
    given = parser.parse_args()
    rows: list[list[str]] = []
    measured: dict[tuple[str, str], dict[int, Point]] = {}
    for sweep in given.sweeps:
        for value in SWEEPS[sweep]:
            for stage in given.stages:
                outcome = isolated(measure, stage, replace(Size(), **{sweep: value}), limit=given.limit)
                rows.append([sweep, str(value), stage, *cells(outcome.value, outcome.failure)])
                print(" ".join(rows[-1]), flush=True)
                if outcome.value is not None:
                    measured.setdefault((sweep, stage), {})[value] = outcome.value
        write_table(HEAD, rows, given.out / "growth.md")
    write_record(given.json, "growth", *by_size(rows))
    write_record(given.json, "growth_exponents", EXPONENTS, exponents(measured))
    for stage, building, iterating in exponents(measured):
        print(f"{stage}: building grows as keyframes^{building}, an iteration as keyframes^{iterating}")
    if given.plot:
        draw(measured, given.plot)


def cells(point: Point | None, failure: str) -> list[str]:
    """Cells of the table from ``variables`` on."""
    if point is None:
        return [NOTHING, failure, NOTHING, NOTHING]
    return [f"{point.variables}", f"{point.building:.2f}", f"{1e3 * point.iteration:.1f}", f"{point.megabytes:.0f}"]


def by_size(rows: Sequence[Sequence[str]]) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of the table with the stages side by side, from the rows of ``HEAD``."""
    stages = list(dict.fromkeys(row[2] for row in rows))
    cells: dict[tuple[str, str], dict[str, str]] = {}
    memory: dict[tuple[str, str], list[float]] = {}
    for changed, value, stage, _, building, iteration, megabytes in rows:
        cells.setdefault((changed, value), {})[stage] = f"{building}, {iteration}"
        if megabytes != NOTHING:
            memory.setdefault((changed, value), []).append(float(megabytes))
    head = ["changed", "to", *(f"{stage}: building s, ms an iteration" for stage in stages), "most memory MB"]
    lines = [
        [
            *size,
            *(each.get(stage, NOTHING) for stage in stages),
            f"{max(memory[size]):.0f}" if size in memory else NOTHING,
        ]
        for size, each in cells.items()
    ]
    return head, lines


def exponents(measured: dict[tuple[str, str], dict[int, Point]]) -> list[list[str]]:
    """What power of the number of keyframes, from 11 on, each stage's building and iterating grow with."""
    lines = []
    for (sweep, stage), points in measured.items():
        long = {n: point for n, point in points.items() if n > 10}
        if sweep != "keyframes" or len(long) < 2:
            continue
        building, iterating = (
            exponent(list(long), [getattr(point, what) for point in long.values()])
            for what in ("building", "iteration")
        )
        lines.append([stage, f"{building:.2f}", f"{iterating:.2f}"])
    return lines


def exponent(sizes: Sequence[float], seconds: Sequence[float]) -> float:
    """The power b of the least-squares fit seconds = a·sizes^b in logarithms."""
    return float(np.polyfit(np.log(sizes), np.log(seconds), 1)[0])


def task_of(size: Size) -> Task:
    """A task of this size: goals every 0.8 s, with three keyframes between or, for few keyframes, one.

    The first primitive is what fingers touch; others are small spheres about its axis.
    """
    between = 3 if (size.keyframes - 1) % 4 == 0 and size.keyframes > 5 else 1
    gaps = (size.keyframes - 1) // (between + 1)
    goals = [(0.2 * (between + 1) * k, 0.01 * np.sin(np.pi * k / 2)) for k in range(gaps + 1)]
    motion = "\n".join(f"  - {{at: {at:.3f}, position: [0.09, {y:.5f}, 0.3]}}" for at, y in goals)
    heights = np.linspace(-0.035, 0.035, (size.fingers + 1) // 2) if size.fingers > 2 else np.zeros(1)
    touches = [(0.02 * (-1) ** i, heights[i // 2]) for i in range(size.fingers)]
    fingers = "\n".join(f"  finger{i}: {{touches: [0, {y}, {z:.5f}]}}" for i, (y, z) in enumerate(touches))
    added = np.linspace(-0.05, 0.05, size.primitives - 1) if size.primitives > 1 else ()
    spheres = "\n".join(f"    - sphere: {{center: [0.01, 0, {z:.5f}], radius: 0.015}}" for z in added)
    return parse_task(f"""
object:
  mass: 0.1
  shapes:
    - capsule: {{start: [0, 0, -0.05], end: [0, 0, 0.05], radius: 0.02}}
{spheres}
palm: {{radius: 0.06, position: [0, 0, 0.3], facing: [1, 0, 0]}}
motion:
{motion}
fingers:
{fingers}
friction: 0.6
keyframes_between: {between}
""")


def measure(stage: str, size: Size) -> Point:
    """Build one stage twice, iterate a little twice, and report the second time of each."""
    task = task_of(size)
    model = build_model(task)
    build, iterate = _STAGES[stage](task, model, size)
    build()
    began = time.process_time()
    built = build()
    building = time.process_time() - began
    iterate(built)
    began = time.process_time()
    solutions = iterate(built)
    solving = time.process_time() - began
    iterations = sum(solution.iterations for solution in solutions)
    solver: Solver = built.solver
    return Point(
        variables=solver.problem.variables.size,
        building=building,
        iteration=solving / iterations,
        megabytes=largest_memory(),
    )


Measured = tuple[Callable[[], Any], Callable[[Any], Sequence[Solution]]]


def _floating(task: Task, model: Model, size: Size) -> Measured:
    def iterate(stage: FloatingStage) -> list[Solution]:
        return [_short(stage, model, task, ITERATIONS)]

    return lambda: FloatingStage(model), iterate


def _short(stage: FloatingStage, model: Model, task: Task, iterations: int) -> Solution:
    """The first solve of stage 1, ended early."""
    problem = stage.solver.problem
    parameters = object_parameters(model) | term_weights(problem, model, dict(task.weights.floating))
    return stage.solver.solve(stage.start(), parameters, Options(max_iter=iterations, tol=1e-12, acceptable_tol=1e-12))


def _straight(task: Task, model: Model) -> Floating:
    """The motion that stage 1 starts from, with all contacts active."""
    stage, (keyframes, samples, contacts) = FloatingStage(model), sizes(model)
    start, solution = stage.start(), _short(stage, model, task, 0)
    return Floating(
        pose=start["pose"],
        point=start["point"].reshape(keyframes, contacts, 3),
        force=start["force"].reshape(samples, contacts, 3),
        active=np.ones((keyframes, contacts), bool),
        invariant=start["invariant"],
        threshold=0.0,
        solution=solution,
        runs=(),
        model=model,
    )


def _fingers(target: Target, size: Size) -> tuple[FingerSeed, ...]:
    return tuple(random_finger(target, c, size.joints, np.random.default_rng(c)) for c in range(size.fingers))


def _synthesis(task: Task, model: Model, size: Size) -> Measured:
    target = target_of(model, _straight(task, model))
    contacts, joints = tuple(range(size.fingers)), (size.joints,) * size.fingers
    options = replace(OPTIONS, max_iter=ITERATIONS, tol=1e-12, acceptable_tol=1e-12)

    def iterate(stage: SynthesisStage) -> list[Solution]:
        result = stage.solve(_fingers(target, size), dict(task.weights.synthesis), options)
        return [solution for _, solution in result.runs]

    return lambda: SynthesisStage(target, contacts, joints), iterate


def _refine(task: Task, model: Model, size: Size) -> Measured:
    floating = FloatingStage(model).solve(dict(task.weights.floating))
    # A contact that stage 1 does without would be a finger less.
    floating = replace(floating, active=np.ones_like(floating.active))
    target, contacts, joints = target_of(model, floating), tuple(range(size.fingers)), (size.joints,) * size.fingers
    weights = dict(task.weights.synthesis)
    alone = (
        SynthesisStage(target, (c,), (size.joints,)).solve((seed,), weights).fingers[0]
        for c, seed in enumerate(_fingers(target, size))
    )
    whole = WholeHandStage(model, contacts, joints, False)
    start = whole.solve(floating, tuple(alone), dict(task.weights.whole_hand), replace(WHOLE, max_iter=40))

    way = tuple((what, weight, replace(how, max_iter=ITERATIONS)) for what, weight, how in ALL_STEPS)

    def iterate(stage: RefineStage) -> list[Solution]:
        # What few iterations leave is no start for a projection, which is another problem.
        with patch.object(RefineStage, "_restored", lambda _, solution, *__: solution):
            return [run.solution for run in stage.take(way, start, Margin()).runs]

    return lambda: RefineStage(model, contacts, joints, start.active), iterate


_STAGES: dict[str, Callable[[Task, Model, Size], Measured]] = {
    "floating": _floating,
    "synthesis": _synthesis,
    "refine": _refine,
}


def draw(measured: dict[tuple[str, str], dict[int, Point]], file: Path) -> None:
    """A row of axes for each sweep: building, an iteration and memory against what changes."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    sweeps = list(dict.fromkeys(sweep for sweep, _ in measured))
    what = {"building": "building, s", "iteration": "an iteration, s", "megabytes": "memory, MB"}
    figure, axes = pyplot.subplots(len(what), len(sweeps), figsize=(3 * len(sweeps), 7), squeeze=False, sharey="row")
    for (sweep, stage), points in measured.items():
        for row, name in enumerate(what):
            values = [asdict(point)[name] for point in points.values()]
            axes[row, sweeps.index(sweep)].loglog(list(points), values, "o-", label=stage)
    for row, label in enumerate(what.values()):
        axes[row, 0].set_ylabel(label)
    for column, sweep in enumerate(sweeps):
        axes[-1, column].set_xlabel(sweep if sweep != "joints" else "joints a finger")
        for each in axes[:, column]:
            each.set_xticks(SWEEPS[sweep], [str(value) for value in SWEEPS[sweep]])
            each.set_xticks([], minor=True)
            each.grid(True, alpha=0.3)
    axes[0, 0].legend(fontsize="small")
    figure.tight_layout()
    figure.savefig(file, dpi=110)


if __name__ == "__main__":
    main()
