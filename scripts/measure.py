"""Solve tasks, audit the results and replay them; print a table of what came out.

    python scripts/measure.py problems/horizontal_translation.yaml --seeds 0 1 2 --replays 100

Results stay in ``--out``; a task and seed that has one there is neither solved nor replayed again. The table is
written to ``table.md`` beside them after every row.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from shared import NOTHING, joints_of, kept_solve, options_of, replays_of, write_table
from tables import add_json, write_record

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.verify import Figure, audit

HEAD = (
    "task",
    "seed",
    "status",
    "joints",
    "goals mm / deg",
    "residual at / between",
    "friction in use %",
    "gap at / between mm",
    "slip mm",
    "penetration mm",
    "unsupplied force",
    "replay mean mm / deg",
    "replay final mm / deg",
    "perturbed: dropped",
    "s floating / synthesis / whole hand / refine",
    "s in all",
    "not certified because",
)
STAGES = ("floating", "synthesis", "whole_hand", "refine")


def main() -> None:
    """Measure every task with every seed."""
    parser = options_of(__doc__)
    parser.add_argument("tasks", metavar="TASK", nargs="+", type=Path, help="task files")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0, 1, 2], help="seeds of the search")
    parser.add_argument("--replays", type=int, default=100, help="perturbed replays of each result")
    parser.add_argument("--out", type=Path, default=Path("results/measured"), help="folder for the results")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    add_json(parser)
    given = parser.parse_args()
    rows = []
    for task in given.tasks:
        for seed in given.seeds:
            design, folder = kept_solve(task, seed, "refine", given.out, given.jobs)
            replays = replays_of(folder, given.replays, given.jobs)
            rows.append(row(design, figures_of(folder), replays, seed))
            write_table(HEAD, rows, given.out / "table.md")
            write_record(given.json, "measure", HEAD, rows)


def figures_of(folder: Path) -> dict[str, Figure]:
    """The audit's figures by name; none where no motion was designed."""
    try:
        return audit(folder).figures
    except DesignError:
        return {}


def row(design: Design, figures: dict[str, Figure], replays: dict[str, Any], seed: int) -> list[str]:
    """One line of the table."""

    def shown(name: str, scale: float = 1.0, digits: str = ".2g") -> str:
        return f"{scale * figures[name].value:{digits}}" if name in figures else NOTHING

    def errors(which: str) -> str:
        if not replays:
            return NOTHING
        nominal = replays["nominal"]
        return f"{1e3 * nominal[f'position_{which}']:.2f} / {nominal[f'angle_{which}']:.2f}"

    drops = NOTHING
    if replays:
        nominal, perturbed = replays["nominal"]["dropped"], replays["perturbed"]
        dropped = sum(each["dropped"] for each in perturbed)
        drops = f"{dropped}/{len(perturbed)}" + (", also unperturbed" if nominal else "")
    return [
        design.task.name,
        str(seed),
        design.status,
        joints_of(design),
        f"{shown('goal_position', 1e3)} / {shown('goal_angle')}",
        f"{shown('residual', digits='.0e')} / {shown('residual_between', digits='.0e')}",
        shown("friction_use", 100, ".0f"),
        f"{shown('gap', 1e3)} / {shown('gap_between', 1e3)}",
        shown("slip", 1e3),
        shown("penetration", 1e3),
        shown("unsupplied_force", digits=".3f"),
        errors("mean"),
        errors("final"),
        drops,
        " / ".join(f"{design.seconds.get(stage, 0.0):.0f}" for stage in STAGES),
        f"{design.seconds.get('total', 0.0):.0f}",
        # The first reason is the one that the others follow from.
        design.reason.split(";")[0],
    ]


if __name__ == "__main__":
    main()
