"""Change tasks a little, solve them, and report how many are certified.

    python scripts/variation.py problems/*.yaml --count 5 --limit 30

Sizes change by up to 20 %, masses by 30 %, displacements and turns by 20 %, contacts by 15 degrees. Each variation is
written as a task file in ``--out``; its result stays beside it and is not solved again. ``variation.md`` is written
there after every solve.
"""

from __future__ import annotations

import os
from collections import Counter
from dataclasses import dataclass
from pathlib import Path

from entries import STATES, state_of
from shared import joints_of, kept_solve, options_of, table_text
from tables import add_json, write_record
from vary import Change, write_variation

from casadi_hands.export.design import Design
from casadi_hands.task import load_task

RATES = ("task", "solved", *STATES[:-1], "rate certified")
RUNS = (
    "task",
    "variation",
    "object ×",
    "mass ×",
    "displacements ×",
    "turns ×",
    "contacts moved by",
    "status",
    "joints",
    "s",
    "not certified because",
)


@dataclass(frozen=True)
class Run:
    """One variation that was solved.

    Attributes:
        name: of the task that was changed.
        number: of the variation.
        change: what is different.
        state: one of ``entries.STATES``.
        design: what came out.
    """

    name: str
    number: int
    change: Change
    state: str
    design: Design


def main() -> None:
    """Write, solve and count variations."""
    parser = options_of(__doc__)
    parser.add_argument("tasks", metavar="TASK", nargs="+", type=Path, help="task files")
    parser.add_argument("--count", type=int, default=5, help="variations of each task")
    parser.add_argument("--seed", type=int, default=0, help="seed of the changes")
    parser.add_argument("--out", type=Path, default=Path("results/variation"), help="folder for task files and results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes of each solve")
    parser.add_argument("--limit", type=float, metavar="MINUTES", help="end a solve that takes longer")
    parser.add_argument("--no-solve", action="store_true", help="only write the task files")
    add_json(parser)
    given = parser.parse_args()
    runs: list[Run] = []
    # All tasks once, then all again: a count that is cut short is of all tasks.
    for number in range(1, given.count + 1):
        for task in given.tasks:
            file, change = write_variation(task, number, given.seed, given.out / f"seed{given.seed}")
            if given.no_solve:
                print(file)
                continue
            name, seed = load_task(task).name, load_task(file).search.seed
            design, folder = kept_solve(file, seed, "refine", file.parent, given.jobs, given.limit)
            runs.append(Run(name, number, change, state_of(design, folder), design))
            text = report(runs)
            (given.out / "variation.md").write_text(text, encoding="utf-8")
            print(text, flush=True)
            write_record(given.json, "variation", RATES, rates_of(runs))


def report(runs: list[Run]) -> str:
    """How many variations are certified, by task and in all, and what became of each."""
    names = list(dict.fromkeys(run.name for run in runs))
    each = [_row(run) for run in sorted(runs, key=lambda run: (names.index(run.name), run.number))]
    return f"{table_text(RATES, rates_of(runs))}\n{table_text(RUNS, each)}"


def rates_of(runs: list[Run]) -> list[list[str]]:
    """How many variations of each task are certified, and of all."""
    names = list(dict.fromkeys(run.name for run in runs))
    return [*(_rate(name, [run for run in runs if run.name == name]) for name in names), _rate("all", runs)]


def _rate(name: str, runs: list[Run]) -> list[str]:
    count = Counter(run.state for run in runs)
    share = f"{100 * count['certified'] / len(runs):.0f} %"
    return [name, str(len(runs)), *(str(count[state]) for state in STATES[:-1]), share]


def _row(run: Run) -> list[str]:
    change = run.change
    factors = (change.size, change.mass, change.goal, change.turn)
    return [
        run.name,
        str(run.number),
        *(f"{factor:.2f}" for factor in factors),
        ", ".join(f"{abs(degrees):.0f}°" for degrees, _ in change.contacts.values()),
        run.state,
        joints_of(run.design),
        f"{run.design.seconds.get('total', 0.0):.0f}",
        run.design.reason.split(";")[0],
    ]


if __name__ == "__main__":
    main()
