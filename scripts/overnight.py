"""Solve random tasks one after the other, as a night's work is, and count how they end.

    python scripts/overnight.py --count 300 --json docs/benchmarks

Each ends certified, feasible for what replays in MuJoCo or the audit say, or failed with a reason; a file that is no
task is refused with a message. Nothing else may happen: the exit status is 1 where a solve crashed, was ended after
``--limit`` minutes on the clock with no certified hand, or gave a reason that says nothing to a person. What was
solved is kept in ``--out`` and not solved again; what was ended, only with a longer limit.
"""

from __future__ import annotations

import os
import sys
from collections import Counter
from pathlib import Path

from apart import STOPPED, ended
from extremes import faults
from random_tasks import random_task
from shared import kept_solve, options_of, write_table
from tables import add_json, write_record

from casadi_hands.errors import TaskError
from casadi_hands.export.design import Design
from casadi_hands.task import load_task

WAYS = (
    "certified",
    "feasible, by replays",
    "feasible, by the audit",
    "failed, with a reason",
    "refused, with a message",
)
ELSE = "anything else"
HEAD = ("tasks", *WAYS, ELSE, "median s", "longest s")


def main() -> None:
    """Solve, count, and exit 1 where anything else happened."""
    parser = options_of(__doc__ or "")
    parser.add_argument("--first", type=int, default=0, help="number of the first task")
    parser.add_argument("--count", type=int, default=300, help="tasks")
    parser.add_argument("--out", type=Path, default=Path("results/overnight"), help="folder for task files and results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes of each solve")
    parser.add_argument("--limit", type=float, metavar="MINUTES", default=30.0, help="end a solve that takes longer")
    add_json(parser)
    given = parser.parse_args()
    given.out.mkdir(parents=True, exist_ok=True)
    found, seconds = Counter[str](), []
    for number in range(given.first, given.first + given.count):
        file = given.out / f"random_{number}.yaml"
        file.write_text(random_task(number), encoding="utf-8")
        try:
            task = load_task(file)
        except TaskError as error:
            way, why = WAYS[-1], str(error)
        else:
            design, folder = kept_solve(file, task.search.seed, "refine", given.out, given.jobs, given.limit)
            way, why = way_of(design, str(ended(folder).get("how", "")))
            seconds.append(design.seconds.get("total", 0.0))
        found[way] += 1
        print(number, way, why, sep=" | ", flush=True)
        line = row(found, seconds)
        write_record(given.json, "overnight", HEAD, [line])
    write_table(HEAD, [line])
    sys.exit(found[ELSE] > 0)


def way_of(design: Design, how: str) -> tuple[str, str]:
    """How a solve ended, one of ``WAYS`` or ``ELSE``, and why.

    Args:
        design: what it left.
        how: what was done to it where it did not end by itself.
    """
    stopped = how.startswith(STOPPED)
    if stopped and design.status == "certified":
        return WAYS[0], f"{how}, while a hand of fewer joints or better figures was looked for"
    wrong = [how] if how else faults(design)
    if wrong:
        return ELSE, "; ".join(wrong)
    if design.status == "certified":
        return WAYS[0], ""
    if design.status == "failed":
        return WAYS[3], design.reason
    return WAYS[2 if design.missed - design.missed_in_replays else 1], design.reason


def row(found: Counter[str], seconds: list[float]) -> list[str]:
    """The line of the table."""
    times = sorted(seconds)
    shown = [f"{times[len(times) // 2]:.0f}", f"{times[-1]:.0f}"] if times else ["–", "–"]
    return [str(found.total()), *(str(found[way]) for way in (*WAYS, ELSE)), *shown]


if __name__ == "__main__":
    main()
