"""Show hands whose joints share motors beside those with a motor for every joint.

    python scripts/motors.py results/fewest/* --beside results/gallery

For each result folder: joints, motors, and what the replay as planned and the perturbed ones did, beside the result of
the same task in another folder, where it has one.
"""

from __future__ import annotations

import json
from argparse import ArgumentParser
from pathlib import Path
from statistics import median
from typing import Any

from shared import write_table
from tables import add_json, write_record

HEAD = (
    "task",
    "status",
    "joints",
    "motors",
    "off plan on average",
    "off goals at most",
    "perturbed replays that drop it",
    "joints with a motor each",
    "off plan on average then",
    "s",
)
NONE = "–"


def main() -> None:
    """Write the table, and how many hands have how few motors."""
    parser = ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path, help="result folders")
    parser.add_argument("--beside", type=Path, metavar="DIR", help="folder of results with a motor for every joint")
    parser.add_argument("--out", type=Path, default=Path("results/motors.md"), help="file for the table")
    add_json(parser)
    given = parser.parse_args()
    records = {path: json.loads((path / "result.json").read_text(encoding="utf-8")) for path in given.folders}
    rows = [row(record, beside(given.beside, path)) for path, record in records.items()]
    write_table(HEAD, rows, given.out)
    certified = [count(record["hand"]) for record in records.values() if record["status"] == "certified"]
    if certified:
        ones = sum(motors == 1 for motors in certified)
        words = f"{len(certified)} of {len(rows)} certified, median {median(certified):g} motors"
        print(f"{words}, {ones} with one, at most {max(certified)}")
    if given.json:
        write_record(given.json, "motors", HEAD, rows)


def beside(folder: Path | None, path: Path) -> dict[str, Any] | None:
    """The record of the same task in another folder."""
    file = folder / path.name / "result.json" if folder else None
    return json.loads(file.read_text(encoding="utf-8")) if file and file.is_file() else None


def row(record: dict[str, Any], other: dict[str, Any] | None) -> list[str]:
    """Cells of one result."""
    hand = record.get("hand") or {}
    played = (record.get("replays") or [None])[0]
    goals, dropped = NONE, NONE
    if played:
        millimetres, degrees = (max(goal[unit] or 0.0 for goal in played["goals"]) for unit in ("mm", "degrees"))
        goals = f"{millimetres:.2f} mm, {degrees:.1f}°"
        drops = [name for name, replay in played["perturbed"].items() if replay["dropped"]]
        dropped = f"{len(drops)}/{len(played['perturbed'])}"
    return [
        record["task"],
        record["status"],
        joints(record),
        str(count(hand)) if hand else NONE,
        mean(record),
        goals,
        dropped,
        joints(other) if other else NONE,
        mean(other) if other else NONE,
        f"{record['seconds']['total']:.0f}",
    ]


def count(hand: dict[str, Any]) -> int:
    """Motors of a hand; one for every joint where its folder, of an earlier version, does not say."""
    return int(hand.get("motors", sum(len(finger["links"]) for finger in hand["fingers"])))


def joints(record: dict[str, Any]) -> str:
    """Of each finger."""
    hand = record.get("hand") or {}
    return "+".join(str(len(finger["links"])) for finger in hand.get("fingers", [])) or NONE


def mean(record: dict[str, Any]) -> str:
    """How far the replay as planned was off the plan on average."""
    played = (record.get("replays") or [None])[0]
    return f"{played['mean']['mm']:.2f} mm, {played['mean']['degrees']:.1f}°" if played else NONE


if __name__ == "__main__":
    main()
