"""Draw the shipped tasks, small: palm, object, contacts and goals.

    python scripts/thumbnails.py

Writes ``problems/pictures/NAME.webp`` for every task file, or for those that are named; needs Chromium.
"""

from __future__ import annotations

from argparse import ArgumentParser
from pathlib import Path

from casadi_hands.export.page.film import pictures
from casadi_hands.problem.result import Result
from casadi_hands.task import load_task

PROBLEMS = Path(__file__).parents[1] / "problems"
SIZE = (320, 240)


def main() -> None:
    """Draw them."""
    parser = ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help="tasks; by default all")
    names = parser.parse_args().names
    for file in sorted(PROBLEMS.rglob("*.yaml")):
        if names and file.stem not in names:
            continue
        target = PROBLEMS / "pictures" / f"{file.stem}.webp"
        target.write_bytes(thumbnail(file))
        print(target, f"{target.stat().st_size} bytes", flush=True)


def thumbnail(file: Path) -> bytes:
    """The drawing of a task file, WebP."""
    return pictures(Result(task=load_task(file), status=""), [0.0], SIZE, "webp")[0]


if __name__ == "__main__":
    main()
