"""Measure where a solve's time goes, and how the optimisers a user would otherwise run do on the same problems.

    python scripts/benchmark.py problems/horizontal_translation.yaml problems/pill_turn.yaml

Everything runs one after the other, each in a process of its own with one thread, kernels compiled beforehand.
`peers.py` says on which footing problems are compared. Stage 1 is the first solve, with free contact invariants;
stage 2 is one finger alone from ``--trials`` random starts, and a hand of one such finger for each contact, in three
annealing steps each; a step starts where the program's own solve of the step before ended, for every optimiser.
"""

from __future__ import annotations

import sys
import tempfile
from argparse import BooleanOptionalAction
from collections import defaultdict
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from os import environ
from pathlib import Path

import numpy as np
from evaluated import FUNCTIONS, evaluation
from isolated import Outcome, isolated
from peers import Attempt, Build, Method, Posed, Run, by_scipy, opti, ours, recorded_solves
from profiled import KINDS, cores_used, profiled_solve
from shared import NOTHING, options_of, write_table
from tables import add_json, write_record

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.problem.si import build_model
from casadi_hands.stages.floating.stage import FloatingStage, solve_floating
from casadi_hands.stages.synthesis.seeds import random_finger
from casadi_hands.stages.synthesis.stage import SynthesisStage
from casadi_hands.stages.synthesis.target import Target, target_of
from casadi_hands.task import Task, load_task

OURS = "IPOPT, exact Hessian (ours)"
METHODS: dict[str, Method] = {
    OURS: ours,
    "the same, cones as constraints too": partial(ours, constrained=True),
    "IPOPT, limited-memory Hessian": partial(ours, limited_memory=True),
    "SciPy L-BFGS-B, our gradients": partial(by_scipy, name="L-BFGS-B"),
    "SciPy L-BFGS-B, the same interpreted": partial(by_scipy, name="L-BFGS-B", interpreted=True),
    "SciPy BFGS, our gradients": partial(by_scipy, name="BFGS"),
    "Opti, automatic Hessian": opti,
    "Opti, expanded": partial(opti, expand=True),
}
CONSTRAINED = "the same, cones as constraints too"
STAGES = 3  # that are compared
SAME = 1e-3  # relative difference below which objectives count as equal
PEERS = (
    "task",
    "stage",
    "optimiser",
    "building s",
    "solving s",
    "iterations",
    "objective / ours",
    "lower / equal / higher",
    "reached at the limit",
    "times slower to its own objective",
    "times slower in all",
    "MB",
)
EVALUATED = ("task", "stage", *(f"{name}: ms, times its kernels in a loop" for name in FUNCTIONS), "all, as called")
BUSY = ("task", "two processes ask for", "and get")
MEDIANS = ("stage", "optimiser", "times slower to its own objective", "times slower in all", "tasks")
SPENT = ("task", "stage", "s", "solves", "iterations", *(f"{kind} %" for kind in KINDS), "Python and files %")


@dataclass(frozen=True)
class Problems:
    """The nonlinear programs of one stage of a task, and what builds them."""

    task: str
    stage: str
    build: Build
    programs: Sequence[Posed]


def main() -> None:
    """Benchmark every task."""
    parser = options_of(__doc__)
    parser.add_argument("tasks", metavar="TASK", nargs="+", type=Path, help="task files")
    parser.add_argument("--trials", type=int, default=2, help="random starts of the finger")
    parser.add_argument("--joints", type=int, default=2, help="joints of the finger")
    parser.add_argument("--limit", type=float, default=20.0, help="s for each solve of a peer")
    parser.add_argument("--peers", action=BooleanOptionalAction, default=True, help="compare optimisers")
    parser.add_argument("--profile", action=BooleanOptionalAction, default=True, help="profile whole solves")
    parser.add_argument("--evaluation", action=BooleanOptionalAction, default=True, help="time functions alone")
    parser.add_argument("--out", type=Path, default=Path("results/benchmark"), help="folder for tables and chart")
    add_json(parser)
    given = parser.parse_args()
    comparisons: list[list[str]] = []
    spent: list[list[str]] = []
    evaluated: list[list[str]] = []
    busy: list[list[str]] = []
    for task in given.tasks:
        if given.peers:
            search = {"joints": given.joints, "trials": given.trials}
            for pose in (pose_floating, partial(pose_finger, **search), partial(pose_hand, **search)):
                comparisons += compare(pose, task, given.limit)
                write_table(PEERS, comparisons, given.out / "peers.md")
            write_table(MEDIANS, medians(comparisons), given.out / "medians.md")
            write_record(given.json, "peers", *side_by_side(comparisons))
            write_record(given.json, "medians", MEDIANS, medians(comparisons))
        if given.evaluation:
            evaluated += evaluations(task)
            write_table(EVALUATED, evaluated, given.out / "evaluation.md")
            write_record(given.json, "evaluation", EVALUATED, evaluated)
        if given.profile:
            spent += spending(task)
            write_table(SPENT, spent, given.out / "profile.md")
            busy.append([load_task(task).name, *two_processes(task)])
            write_table(BUSY, busy, given.out / "busy.md")
            write_record(given.json, "profile", SPENT, spent)
            write_record(given.json, "busy", BUSY, busy)
    print(f"cold start: {cold_start(given.tasks[0])}")


def pose_floating(task_file: Path) -> Problems:
    """Stage 1's first solve."""
    task = load_task(task_file)
    model = build_model(task)
    with recorded_solves() as posed:
        FloatingStage(model).solve(dict(task.weights.floating))
    return Problems(task.name, "1", partial(FloatingStage, model), posed[:1])


def pose_finger(task_file: Path, joints: int, trials: int) -> Problems:
    """The first finger's trials of stage 2."""
    task, target = _target(task_file)
    build = partial(SynthesisStage, target, (0,), (joints,))
    with recorded_solves() as posed:
        _trials(task, target, build(), 0, trials)
    return Problems(task.name, "2, finger", build, posed)


def pose_hand(task_file: Path, joints: int, trials: int) -> Problems:
    """Recombinations of stage 2: as many as trials, each of one trial's fingers."""
    task, target = _target(task_file)
    contacts = tuple(range(len(target.model.contact_names)))
    alone = [_trials(task, target, SynthesisStage(target, (c,), (joints,)), c, trials) for c in contacts]
    build = partial(SynthesisStage, target, contacts, (joints,) * len(contacts))
    stage = build()
    with recorded_solves() as posed:
        for fingers in zip(*alone, strict=True):
            stage.solve(fingers, dict(task.weights.synthesis))
    return Problems(task.name, "2, hand", build, posed)


def _target(task_file: Path) -> tuple[Task, Target]:
    task = load_task(task_file)
    floating = solve_floating(build_model(task), dict(task.weights.floating))
    return task, target_of(floating.model, floating)


def _trials(task: Task, target: Target, stage: SynthesisStage, contact: int, trials: int) -> list[FingerSeed]:
    """Fingers of one contact, each annealed from a random start, the ones that the search draws."""
    fingers, joints = [], stage.joints[0]
    for trial in range(trials):
        rng = np.random.default_rng((task.search.seed, contact, joints, trial))
        start = random_finger(target, contact, joints, rng)
        fingers.append(stage.solve((start,), dict(task.weights.synthesis)).fingers[0])
    return fingers


def compare(pose: Callable[[Path], Problems], task_file: Path, limit: float) -> list[list[str]]:
    """Rows of the table of optimisers for one stage of a task; ours is the first."""
    outcome = isolated(pose, task_file, limit=600)
    problems = outcome.value
    if problems is None:
        raise SystemExit(f"{task_file}: {outcome.failure}")
    rows, reference = [], None
    for name, method in METHODS.items():
        if name == CONSTRAINED and problems.stage != "1":
            continue
        # Building may take long too; what is stopped during it reached nothing.
        ended = isolated(
            method, problems.build, problems.programs, limit, limit=60 + 2 * limit * len(problems.programs)
        )
        reference = ended.value if name == OURS else reference
        if reference is None:
            raise SystemExit(f"{problems.task}, stage {problems.stage}: {ended.failure}")
        rows.append([problems.task, problems.stage, name, *compared(ended, reference, limit, name != CONSTRAINED)])
        print(" | ".join(rows[-1]), file=sys.stderr, flush=True)
    return rows


def compared(ended: Outcome[Run], reference: Run, limit: float, same_problem: bool) -> list[str]:
    """Cells of one optimiser, from ``building s`` on."""
    run = ended.value
    if run is None:
        return [ended.failure, *[NOTHING] * 8]
    pairs = list(zip(run.attempts, reference.attempts, strict=True))
    relative = np.array([theirs.objective / our.objective for theirs, our in pairs])
    higher, lower = int((relative > 1 + SAME).sum()), int((relative < 1 - SAME).sum())
    slower = [slowness(theirs, our) for theirs, our in pairs]
    in_all = total(run) / total(reference)
    return [
        f"{run.building:.3f}",
        f"{sum(attempt.seconds for attempt in run.attempts):.3f}",
        str(sum(attempt.iterations for attempt in run.attempts)),
        f"{np.median(relative):.4g}",
        f"{lower} / {len(pairs) - lower - higher} / {higher}",
        f"{sum(attempt.seconds >= 0.99 * limit for attempt in run.attempts)} of {len(pairs)}",
        f"{np.median(slower):.3g}" if same_problem else NOTHING,
        f"{in_all:.3g}",
        f"{ended.megabytes:.0f}",
    ]


def side_by_side(rows: Sequence[Sequence[str]]) -> tuple[list[str], list[list[str]]]:
    """Columns and rows of the table with a stage of a task in a line, from the rows of ``PEERS``.

    A cell says how many times longer an optimiser takes than ours: to its own objective / in all; with ``>`` where a
    solve was stopped at the limit.
    """
    named = [dict(zip(PEERS, row, strict=True)) for row in rows]
    others = [name for name in METHODS if name not in (OURS, CONSTRAINED)]
    lines: dict[tuple[str, str], dict[str, str]] = {}
    for row in named:
        if row["times slower in all"] == NOTHING:
            cell = row["building s"]  # where the failure is told
        elif row["optimiser"] == OURS:
            cell = f"{float(row['building s']):.2f} + {float(row['solving s']):.2f}"
        else:
            stopped = "" if row["reached at the limit"].startswith("0 ") else "> "
            cell = f"{row['times slower to its own objective']} / {stopped}{row['times slower in all']}"
        lines.setdefault((row["task"], row["stage"]), {})[row["optimiser"]] = cell
    head = ["task", "stage", "ours: building + solving s", *others]
    return head, [[*key, *(cells.get(name, NOTHING) for name in (OURS, *others))] for key, cells in lines.items()]


def medians(rows: Sequence[Sequence[str]]) -> list[list[str]]:
    """Over the tasks, of each optimiser in each stage, from the rows of ``PEERS``; what never ended is not counted.

    At the end, of the times of all stages together.
    """
    table = []
    for stage, name in dict.fromkeys((row[1], row[2]) for row in rows):
        same = [dict(zip(PEERS, row, strict=True)) for row in rows if (row[1], row[2]) == (stage, name)]
        ended = [row for row in same if row["times slower in all"] != NOTHING]
        cells = []
        for column in MEDIANS[2:4]:
            values = [float(row[column]) for row in ended if row[column] != NOTHING]
            cells.append(f"{np.median(values):.3g}" if values else NOTHING)
        table.append([stage, name, *cells, str(len(ended))])
    seconds: dict[str, dict[str, list[float]]] = defaultdict(lambda: defaultdict(list))
    for row in (dict(zip(PEERS, cells, strict=True)) for cells in rows):
        if row["times slower in all"] != NOTHING:
            seconds[row["optimiser"]][row["task"]].append(float(row["building s"]) + float(row["solving s"]))
    for name, spent in seconds.items():
        whole = {task: sum(each) / sum(seconds[OURS][task]) for task, each in spent.items() if len(each) == STAGES}
        if whole:
            table.append(["all", name, NOTHING, f"{np.median(list(whole.values())):.3g}", str(len(whole))])
    return table


def evaluations(task_file: Path) -> list[list[str]]:
    """Rows of the table of functions' times, whole and of their kernels alone."""
    outcome = isolated(evaluation, task_file, limit=3600)
    name = load_task(task_file).name
    if outcome.value is None:
        return [[name, outcome.failure, *[NOTHING] * (len(EVALUATED) - 2)]]
    rows, everything = [], np.zeros(2)
    for stage, seconds in outcome.value.items():
        cells = []
        for function in FUNCTIONS:
            whole, loop, _ = seconds.get(function, (0.0, 0.0, 0))
            cells.append(f"{1e3 * whole:.2f}, {whole / loop:.2f}" if loop else NOTHING)
        spent = np.sum([(calls * whole, calls * loop) for whole, loop, calls in seconds.values()], axis=0)
        everything += spent
        rows.append([name, stage, *cells, f"{spent[0] / spent[1]:.2f}"])
    return [*rows, [name, "all", *[NOTHING] * len(FUNCTIONS), f"{everything[0] / everything[1]:.2f}"]]


def slowness(theirs: Attempt, our: Attempt) -> float:
    """How much longer a peer takes than ours to within ``SAME`` of what the peer ends with; 0 where ours never does."""
    wanted = theirs.objective + SAME * abs(theirs.objective)
    return reached(theirs, wanted) / reached(our, wanted)


def reached(attempt: Attempt, wanted: float) -> float:
    """Seconds until an attempt's objective is at most ``wanted``; infinite where it never is."""
    return next((max(seconds, 1e-9) for seconds, objective in attempt.trace if objective <= wanted), np.inf)


def total(run: Run) -> float:
    """Seconds of building and of all solves."""
    return run.building + sum(attempt.seconds for attempt in run.attempts)


def spending(task_file: Path) -> list[list[str]]:
    """Rows of the table of where a whole solve's time goes, by stage and in all."""
    outcome = isolated(profiled_solve, task_file, 0, limit=3600)
    if outcome.value is None:
        return [[task_file.stem, outcome.failure, *[NOTHING] * (len(SPENT) - 2)]]
    profile = outcome.value
    name = load_task(task_file).name
    rows = []
    for stage, seconds in profile["seconds"].items():
        whole = seconds["all"]
        counts = [str(profile[what].get(stage, 0)) for what in ("solves", "iterations")]
        rows.append([name, stage, f"{whole:.1f}", *counts, *shares(seconds, whole)])
    kinds = {kind: sum(s.get(kind, 0.0) for s in profile["seconds"].values()) for kind in KINDS}
    counts = [str(sum(profile[what].values())) for what in ("solves", "iterations")]
    text = f"all, {profile['status']}, {outcome.megabytes:.0f} MB"
    start = f"{profile['total']:.1f} + {outcome.seconds - profile['total']:.1f} to start"
    return [*rows, [name, text, start, *counts, *shares(kinds, profile["total"])]]


def two_processes(task_file: Path) -> tuple[str, str]:
    """How busy two processes keep two cores in stage 2: what they ask for of these, and what they get."""
    used = isolated(cores_used, task_file, limit=3600)
    if used.value is None:
        return used.failure, NOTHING
    got, asked = (f"{100 * share:.0f} %" for share in used.value)
    return asked, got


def shares(seconds: dict[str, float], whole: float) -> list[str]:
    """Each kind's percentage, and what is left."""
    kinds = [seconds.get(kind, 0.0) for kind in KINDS]
    return [f"{100 * kind / whole:.0f}" for kind in (*kinds, whole - sum(kinds))]


def cold_start(task_file: Path) -> str:
    """What building stage 1 takes without and with kernels in the cache."""
    kept = environ.get("CASADI_HANDS_CACHE")
    with tempfile.TemporaryDirectory() as empty:
        environ["CASADI_HANDS_CACHE"] = empty
        try:
            first, again = (isolated(_build_floating, task_file, limit=600) for _ in range(2))
        finally:
            environ.pop("CASADI_HANDS_CACHE") if kept is None else environ.update(CASADI_HANDS_CACHE=kept)
    return f"building stage 1 takes {first.value:.2f} s the first time, {again.value:.2f} s with compiled kernels"


def _build_floating(task_file: Path) -> float:
    model = build_model(load_task(task_file))
    return ours(partial(FloatingStage, model), [], 1.0).building


if __name__ == "__main__":
    main()
