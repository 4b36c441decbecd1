"""Compare replays by how hard MuJoCo's friction is, and with Drake, in whose contacts that stick nothing creeps.

    python scripts/creep.py results/gallery/*

For each result folder: how far the object is off its plan at most, replayed as planned, with several settings of
``impratio`` and of the no-slip pass in ``scene.xml``, and in Drake.
"""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from shared import NOTHING, options_of, write_table
from tables import add_json, write_record

from casadi_hands.export.design import Design
from casadi_hands.verify import Replay, replay

SETTINGS = ((10, 5), (100, 20), (1000, 200))
HEAD = ("task", *(f"impratio {ratio}, {passes} passes" for ratio, passes in SETTINGS), "Drake")
_OPTION = re.compile(r'(<option[^>]*) impratio="[^"]*" noslip_iterations="[^"]*"')


def main() -> None:
    """Compare them in every folder."""
    parser = options_of(__doc__)
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path, help="result folders")
    parser.add_argument("--out", type=Path, default=Path("results/creep.md"), help="file for the table")
    add_json(parser)
    given = parser.parse_args()
    rows = []
    for path in given.folders:
        played = [with_friction(path, ratio, passes) for ratio, passes in SETTINGS]
        task = Design.load(path).task
        free = task.object.attached is None  # Drake replays no others
        rows.append([task.name, *map(shown, played), shown(replay(path, engine="drake")) if free else NOTHING])
        write_table(HEAD, rows, given.out)
    if given.json:
        write_record(given.json, "creep", HEAD, rows)


def with_friction(path: Path, ratio: int, passes: int) -> Replay:
    """Replay a folder as planned in MuJoCo with this ``impratio`` and so many no-slip passes at most."""
    with TemporaryDirectory() as scratch:
        copy = Path(shutil.copytree(path, Path(scratch) / "result"))
        scene = copy / "scene.xml"
        text, found = _OPTION.subn(
            rf'\1 impratio="{ratio}" noslip_iterations="{passes}"', scene.read_text(encoding="utf-8")
        )
        assert found == 1, scene
        scene.write_text(text, encoding="utf-8")
        return replay(copy)


def shown(played: Replay) -> str:
    """How far the object was off its plan at most, and whether it was dropped."""
    far = f"{1e3 * played.position_max:.2g} mm · {played.angle_max:.2g}°"
    return f"{far}, dropped" if played.dropped else far


if __name__ == "__main__":
    main()
