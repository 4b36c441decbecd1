"""Solve tasks without their contacts, which the program then places, beside what the given contacts need.

    python scripts/placed.py problems/*.yaml --beside results/gallery
    python scripts/placed.py problems/*.yaml --beside results/gallery --fingers auto

For each task file its `fingers` are replaced by their number, or by `auto`; all else stays. A task that has been solved
already in the folder of results is not solved again.
"""

from __future__ import annotations

import io
import json
import sys
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

from apart import solve_apart
from motors import beside, joints
from ruamel.yaml import YAML
from shared import write_table
from tables import add_json, write_record

from casadi_hands.export.design import Design
from casadi_hands.task import parse_task

HEAD = ("task", "fingers", "status", "joints", "with given contacts", "sets", "placed in s", "s", "reason")
NONE = "–"
ASKED = "asked.yaml"


def main() -> None:
    """Write the table, and how many tasks are certified with how many joints."""
    parser = ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("tasks", metavar="TASK", nargs="+", type=Path, help="task files")
    parser.add_argument("--fingers", choices=("same", "auto"), default="same", help="their number")
    parser.add_argument("--beside", type=Path, metavar="DIR", help="folder of results with the given contacts")
    parser.add_argument("--results", type=Path, metavar="DIR", default=Path("results/placed"), help="folder of results")
    parser.add_argument("--jobs", type=int, help="processes of a solve; all cores by default")
    parser.add_argument("--limit", type=float, metavar="MIN", help="minutes that a solve may take")
    parser.add_argument("--out", type=Path, default=Path("results/placed.md"), help="file for the table")
    add_json(parser)
    given = parser.parse_args()
    rows, records = [], []
    for path in given.tasks:
        folder = given.results / given.fingers / path.stem
        record = solved(asked(path.read_text(encoding="utf-8"), given.fingers), path, folder, given.jobs, given.limit)
        other = beside(given.beside, folder)
        rows.append(row(record, other))
        records.append((record, other))
        write_table(HEAD, rows, given.out)
    print(in_all(records))
    if given.json:
        write_record(given.json, f"placed_{given.fingers}", HEAD, rows)


def asked(text: str, fingers: str) -> str:
    """A task file without its contacts.

    Args:
        text: of the file.
        fingers: ``same`` for as many, or ``auto``.
    """
    yaml, stream = YAML(), io.StringIO()
    data = yaml.load(text)
    data["fingers"] = len(data["fingers"]) if fingers == "same" else "auto"
    yaml.dump(data, stream)
    return stream.getvalue()


def solved(text: str, path: Path, folder: Path, jobs: int | None, limit: float | None) -> dict[str, Any]:
    """The record of a solve, from its folder if that has one of the same task."""
    known = folder / ASKED
    if not (known.is_file() and known.read_text(encoding="utf-8") == text and (folder / "result.json").is_file()):
        print(f"solving {path.stem}", file=sys.stderr, flush=True)
        design = solve_apart(parse_task(text, str(path), path.stem), folder, "refine", jobs, limit)
        if not (folder / "result.json").is_file():  # it was ended before it wrote any
            Design.save(design, folder)
        known.write_text(text, encoding="utf-8")
    record: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    told = folder / "placement.json"
    return record | {"placement": json.loads(told.read_text(encoding="utf-8")) if told.is_file() else {}}


def row(record: dict[str, Any], other: dict[str, Any] | None) -> list[str]:
    """Cells of one task."""
    placement, hand, seconds = record["placement"], record.get("hand") or {}, record["seconds"]
    sets = placement.get("sets", [])
    given = NONE if other is None else f"{joints(other)}{'' if other['status'] == 'certified' else ', not certified'}"
    return [
        record["task"],
        str(len(hand.get("fingers", []))) if hand else NONE,
        record["status"],
        joints(record),
        given,
        f"{len(sets)}, number {placement['chosen'] + 1} taken" if "chosen" in placement else NONE,
        f"{seconds['placement']:.0f}" if "placement" in seconds else NONE,
        f"{seconds.get('total', 0.0):.0f}",
        record["reason"] or NONE,
    ]


def in_all(records: list[tuple[dict[str, Any], dict[str, Any] | None]]) -> str:
    """How many are certified, and the joints of those that are with both kinds of contacts."""
    certified = [record["status"] == "certified" for record, _ in records]
    both = [(r, o) for r, o in records if o is not None and r["status"] == o["status"] == "certified"]
    placed, given = (sum(pair[k]["degrees_of_freedom"] for pair in both) for k in (0, 1))
    return f"{sum(certified)} of {len(certified)} certified; {placed} joints where given contacts take {given}"


if __name__ == "__main__":
    main()
