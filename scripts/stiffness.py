"""Compare the least stiffness that the files foretell with the one at which a replay loses the object.

    python scripts/stiffness.py results/gallery/*

For each result folder: `least_stiffness` of the audit, computed from the files alone, and the stiffness of the motors,
by bisection in MuJoCo, below which the replay as planned loses the object: it drops it, or turns it by `WHIRLED` more
than with the task's own motors. All else stays as planned: softer motors get commands that press as the plan does.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from shared import options_of, write_table
from tables import add_json, write_record

from casadi_hands.verify import Perturbation
from casadi_hands.verify.figures.stability import Stability
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.replays.replay import Player, Replay

HEAD = ("task", "foretold, N·m/rad", "lost below, N·m/rad", "over the foretold", "within a factor of 2")
WHIRLED = 45.0
"""deg beyond what the task's own motors leave."""
SOFTEST, STIFFEST = 1 / 1024, 4.0
"""Of the task's stiffness, tried at most."""
ROUNDS = 5
"""Of bisection within a factor of 2: to 2 %."""


def main() -> None:
    """Compare them in every folder."""
    parser = options_of(__doc__)
    parser.add_argument("folders", metavar="DIR", nargs="+", type=Path, help="result folders")
    parser.add_argument("--out", type=Path, default=Path("results/stiffness.md"), help="file for the table")
    add_json(parser)
    given = parser.parse_args()
    rows = []
    for path in given.folders:
        rows.append(row(path))
        write_table(HEAD, rows, given.out)
    agreeing = sum(cells[-1] == "yes" for cells in rows)
    print(f"{agreeing} of {len(rows)} within a factor of 2, {agreeing / len(rows):.0%}")
    if given.json:
        write_record(given.json, "stiffness", HEAD, rows)


def row(path: Path) -> list[str]:
    """Cells of one result."""
    folder = read_folder(path)
    foretold = max(max(mode.stiffness for mode in Stability(folder).modes()), 0.0)
    lost, bracket = lost_below(path)
    supplied = folder.task.actuator.stiffness
    least = SOFTEST * supplied
    if bracket == "never":  # not even with the softest motors
        agrees, shown, ratio = foretold <= 2 * least, f"< {least:.2g}", "–"
    elif bracket == "always":
        agrees, shown, ratio = foretold >= STIFFEST * supplied / 2, f"> {STIFFEST * supplied:.2g}", "–"
    else:
        agrees, shown, ratio = (
            0.5 <= lost / max(foretold, least) <= 2.0,
            f"{lost:.2g}",
            f"{lost / max(foretold, least):.2g}",
        )
    return [folder.task.name, f"{foretold:.2g}", shown, ratio, "yes" if agrees else "no"]


def lost_below(path: Path) -> tuple[float, str]:
    """The stiffness (N·m/rad) below which a replay loses the object; ``never``, ``always`` or ``found``."""
    player = Player(path)
    supplied = player.folder.task.actuator.stiffness
    usual = player.play(Perturbation())

    def lost(factor: float) -> bool:
        played: Replay = player.play(Perturbation(stiffness=factor))
        return played.dropped or played.angle_max > usual.angle_max + WHIRLED

    factor = STIFFEST if usual.dropped else 1.0
    if lost(factor):
        return STIFFEST * supplied, "always"
    while not lost(factor / 2):
        factor /= 2
        if factor <= SOFTEST:
            return SOFTEST * supplied, "never"
    low, high = factor / 2, factor
    for _ in range(ROUNDS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if lost(middle) else (low, middle)
    return float(np.sqrt(low * high)) * supplied, "found"


if __name__ == "__main__":
    main()
