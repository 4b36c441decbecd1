"""Solve all tasks of a folder and show them: one page with a card for each, and a table.

    python scripts/gallery.py problems --seeds 0 1 2 --limit 30

Results stay in ``--out``; a task and seed that has one there is not solved again, so this can be interrupted at any
time. ``gallery.html`` and ``table.md`` are written there after every solve. Pictures are of each result's own
page, by Chromium without a screen; ``--picture FILE`` writes one of the gallery's page, too.
"""

from __future__ import annotations

import os
from pathlib import Path

from cards import page
from entries import REPLAYS, Entry, entry_of, figures_of
from shared import NOTHING, kept_solve, options_of, table_text
from tables import add_json, write_record

from casadi_hands.export.browser import MISSING, browser, screenshot

PAGE = "gallery.html"
PICTURE = (1110, 1538)
"""Width and height of the page's picture, pixels."""
HEAD = (
    "task",
    "figure",
    "seed",
    "fingers × joints",
    "by the soft stages",
    "the thesis",
    "status",
    "goal error",
    "slip mm",
    "replay error",
    f"dropped of {REPLAYS}",
    "s",
)


def main() -> None:
    """Solve what is not solved yet, and write page and table."""
    parser = options_of(__doc__)
    parser.add_argument("problems", metavar="DIR", nargs="?", type=Path, default=Path("problems"), help="task files")
    parser.add_argument("--seeds", nargs="+", type=int, default=[0], help="seeds; a card shows the best")
    parser.add_argument("--out", type=Path, default=Path("results/gallery"), help="folder for results, page and table")
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes of each solve")
    parser.add_argument("--limit", type=float, metavar="MINUTES", help="end a solve that takes longer")
    parser.add_argument("--no-solve", action="store_true", help="only show what has been solved")
    parser.add_argument("--picture", type=Path, metavar="FILE", help="write a PNG of the page's top")
    parser.add_argument("--table", default="gallery", help="name of the record that --json writes")
    add_json(parser)
    given = parser.parse_args()
    if browser() is None:  # told before solves that take hours
        parser.error(MISSING)
    # In the thesis's order, then what is not from it.
    files = sorted(given.problems.glob("*.yaml"), key=lambda file: (figures_of(file) or ("~",), file.stem))
    if not files:
        parser.error(f"no task files (*.yaml) in {given.problems}")
    wanted = [(file, seed) for seed in given.seeds for file in files]
    entries = {key: entry_of(*key, given.out, given.jobs) for key in wanted}
    write_all(list(entries.values()), given.out)
    for file, seed in [] if given.no_solve else wanted:
        # A result under the task's own name is as good, unless that solve was cut short.
        if entries[file, seed].state in ("certified", "feasible", "failed"):
            continue
        kept_solve(file, seed, "refine", given.out, given.jobs, given.limit)
        entries[file, seed] = entry_of(file, seed, given.out, given.jobs)
        write_all(list(entries.values()), given.out)
    write_record(given.json, given.table, HEAD, rows_of(by_task(list(entries.values()))))
    if given.picture:
        screenshot((given.out / PAGE).resolve().as_uri(), given.picture, PICTURE)
    print(given.out / PAGE)


def write_all(entries: list[Entry], out: Path) -> None:
    """Write ``gallery.html`` and ``table.md``; a task's entries of all seeds share a card and have a row each."""
    out.mkdir(parents=True, exist_ok=True)
    tasks = by_task(entries)
    (out / "table.md").write_text(table_text(HEAD, rows_of(tasks)), encoding="utf-8")
    cards = [sorted(seeds, key=lambda entry: entry.rank) for seeds in tasks]
    (out / PAGE).write_text(page(cards, out), encoding="utf-8")


def by_task(entries: list[Entry]) -> list[list[Entry]]:
    """The entries of each task, of all seeds."""
    tasks: dict[Path, list[Entry]] = {}
    for entry in entries:
        tasks.setdefault(entry.file, []).append(entry)
    return list(tasks.values())


def rows_of(tasks: list[list[Entry]]) -> list[list[str]]:
    """The table's lines, those of a task together."""
    return [row(entry) for seeds in tasks for entry in seeds]


def row(entry: Entry) -> list[str]:
    """One line of the table."""
    return [
        entry.name,
        ", ".join(entry.figures) or NOTHING,
        str(entry.seed),
        entry.structure,
        entry.soft_structure,
        entry.thesis,
        entry.state,
        entry.goal_error,
        entry.figure("slip", 1e3),
        entry.replay_error,
        entry.drops.partition("/")[0],
        entry.seconds,
    ]


if __name__ == "__main__":
    main()
