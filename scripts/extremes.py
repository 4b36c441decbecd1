"""Solve tasks at the edge of what is allowed: each ends in time, with a status and a reason that a person can use.

    python scripts/extremes.py --json docs/benchmarks

Each is solved in a process of its own. It may take ``--limit`` minutes of a processor, which on a machine that has
nothing else to do are those on the clock, and is ended after three times as many on the clock. A result is kept in
``--out`` and not solved again. The exit status is 1 where a solve took longer, crashed, or gave a reason that says
nothing to a person.
"""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path

from apart import ended
from extreme_tasks import EXTREME, text_of
from shared import joints_of, kept_solve, options_of, write_table
from tables import add_json, write_record

from casadi_hands.export.design import Design
from casadi_hands.task import load_task

HEAD = ("task", "status", "joints", "s of a processor", "s", "why")
_INNER = re.compile(r"\.(cpp|hpp|c|h|py|so)\b|/[\w.-]+/[\w.-]+|0x[0-9a-f]{6}|Traceback|Error\b|\b(nan|inf|None)\b")
_LONGEST = 1200  # characters
_PATIENCE = 3  # times the limit, on the clock
_SPENT = "processor.txt"


def main() -> None:
    """Solve, print the table, and exit 1 where one is not as it must be."""
    parser = options_of(__doc__ or "")
    parser.add_argument("--only", nargs="*", default=list(EXTREME), metavar="NAME", help="tasks, by what is extreme")
    parser.add_argument("--out", type=Path, default=Path("results/extremes"), help="folder for task files and results")
    parser.add_argument("--jobs", type=int, default=1, help="processes of each solve")
    parser.add_argument("--limit", type=float, metavar="MINUTES", default=5.0, help="that a solve may take")
    add_json(parser)
    given = parser.parse_args()
    rows, wrong = [], 0
    given.out.mkdir(parents=True, exist_ok=True)
    for kind in given.only:
        file = given.out / f"{kind.replace(' ', '_')}.yaml"
        file.write_text(text_of(kind), encoding="utf-8")
        task = load_task(file)
        before, longest = _spent(), _PATIENCE * given.limit
        design, folder = kept_solve(file, task.search.seed, "refine", given.out, given.jobs, longest)
        note = folder / _SPENT
        if not note.is_file():
            note.write_text(f"{_spent() - before:.0f}", encoding="utf-8")
        seconds, how = float(note.read_text(encoding="utf-8")), str(ended(folder).get("how", ""))
        found = [how] if how else faults(design)
        if seconds > 60 * given.limit:
            found.append(f"took {seconds:.0f} s of a processor")
        wrong += bool(found)
        for fault in found:
            print(f"{kind}: {fault}", file=sys.stderr, flush=True)
        rows.append(row(kind, design, how, seconds))
        print(*rows[-1], sep=" | ", flush=True)
    write_table(HEAD, rows)
    write_record(given.json, "extremes", HEAD, rows)
    sys.exit(wrong > 0)


def faults(design: Design) -> list[str]:
    """What a person cannot use in why a design is not certified.

    Args:
        design: of a solve that ended by itself.
    """
    reason = design.reason
    if design.status == "certified":
        return []
    if not reason:
        return ["no reason is given"]
    found = [f"says {inner[0]!r}: {reason}" for inner in [_INNER.search(reason)] if inner]
    if len(reason) > _LONGEST:
        found.append(f"{len(reason)} characters: {reason}")
    if "try " not in reason:
        found.append(f"says nothing to try: {reason}")
    return found


def row(kind: str, design: Design, how: str, seconds: float) -> list[str]:
    """A line of the table; ``seconds`` are a processor's."""
    taken = f"{seconds:.0f}", f"{design.seconds.get('total', 0.0):.0f}"
    return [kind, how or design.status, joints_of(design), *taken, design.reason]


def _spent() -> float:
    """Seconds of a processor that processes which have ended took."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    main()
