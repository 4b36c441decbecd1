"""Solve small tasks one after the other in one process and measure its memory.

    python scripts/memory.py --json docs/benchmarks

Tasks differ, as those of a long night do: each has another mass, lift and seed. The exit status is 1 where memory grew
by more than ``--most`` between the first tenth of the solves, in which caches are filled, and the last.
"""

from __future__ import annotations

import gc
import os
import sys
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from extreme_tasks import plain
from shared import options_of, write_table
from tables import add_json, write_record

from casadi_hands.pipeline import solve
from casadi_hands.pipeline.record import STAGES
from casadi_hands.task import Task, load_task

HEAD = ("solves", "to stage", "after a tenth MB", "after half MB", "at the end MB", "growth a solve kB", "statuses")


def main() -> None:
    """Solve, measure, and exit 1 where memory grows."""
    parser = options_of(__doc__ or "")
    parser.add_argument("--solves", type=int, default=200, help="how many")
    parser.add_argument("--until", choices=STAGES, default="floating", help="the last stage of each")
    parser.add_argument("--most", type=float, default=20.0, help="MB that memory may grow by")
    add_json(parser)
    given = parser.parse_args()
    sizes, statuses = [], set()
    for number, task in enumerate(tasks(given.solves)):
        statuses.add(solve(task, until=given.until, jobs=1).status)
        gc.collect()
        sizes.append(resident())
        if number % 20 == 0:
            print(f"{number + 1} {sizes[-1]:.1f} MB", file=sys.stderr, flush=True)
    line = row(given.until, sizes, statuses)
    write_table(HEAD, [line])
    write_record(given.json, f"memory_{given.until}", HEAD, [line])
    sys.exit(sizes[-1] - sizes[len(sizes) // 10] > given.most)


def tasks(count: int) -> Iterator[Task]:
    """Balls that are lifted, no two the same."""
    rng = np.random.default_rng(0)
    for number in range(count):
        fields = plain(mass=float(rng.uniform(0.05, 0.2)))
        fields["motion"][1]["position"] = [0, 0, float(rng.uniform(0.002, 0.02))]
        yield load_task({"name": f"ball {number}", **fields, "search": {"seed": number, "trials": 2, "max_joints": 2}})


def row(until: str, sizes: list[float], statuses: set[str]) -> list[str]:
    """The line of the table."""
    at = (sizes[len(sizes) // 10], sizes[len(sizes) // 2], sizes[-1])
    late = sizes[len(sizes) // 10 :]
    slope = float(np.polyfit(np.arange(len(late)), late, 1)[0]) if len(late) > 1 else 0.0
    return [str(len(sizes)), until, *(f"{size:.0f}" for size in at), f"{1024 * slope:.1f}", ", ".join(sorted(statuses))]


def resident() -> float:
    """Resident memory of this process now, in 2^20 bytes."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 2**20


if __name__ == "__main__":
    main()
