"""One task with one seed, as the gallery's page and table show it."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from apart import ended, read_apart
from shared import NOTHING, is_of, joints_of, replays_of, result_folder, with_seed

from casadi_hands.errors import DesignError, HandsError, TaskError
from casadi_hands.export.design import Design
from casadi_hands.task import Task, load_task

STATES = ("certified", "feasible", "failed", "stopped", "crashed", "not solved")
"""How a task may stand: the statuses of a design, and why there is none."""
REPLAYS = 12
"""Perturbed replays of each result."""
THESIS = {
    "3.1c": "the top finger lets go and re-places itself",
    "3.2c": "2 a finger",
    "3.3b": "another hand than 3.3a",
    "3.5a": "slips less than 3.5b",
    "3.5b": "slips more than 3.5a",
    "3.6a": "1 a finger",
    "3.6b": "2 a finger",
    "3.7a": "2 a finger",
    "3.7b": "2 a finger",
    "3.7c": "3 a finger",
}
"""What CMU-RI-TR-18-36 says came out, by figure."""


@dataclass(frozen=True)
class Entry:
    """A task, a seed, and what came of them.

    Attributes:
        file: the task file.
        seed: of the search.
        name, about: of the task.
        figures: of the thesis, as its file's first line names them.
        state: one of ``STATES``.
        reason: why it is not certified; else empty.
        task: None where the file is not a task.
        folder: where the result is.
        design: None where there is none to read.
        replays: as `replays_of` has them.
    """

    file: Path
    seed: int
    name: str
    about: str
    figures: tuple[str, ...]
    state: str
    reason: str = ""
    task: Task | None = None
    folder: Path | None = None
    design: Design | None = None
    replays: dict[str, Any] = field(default_factory=dict)

    @property
    def rank(self) -> tuple[int, int, int]:
        """What sorts the best of several seeds first: state, joints, seed."""
        hand = self.design.hand if self.design else None
        return STATES.index(self.state), hand.degrees_of_freedom if hand else 1000, self.seed

    @property
    def structure(self) -> str:
        """Fingers × joints of the hand, as in ``3 × 2`` or ``2+2+3``."""
        return _product(joints_of(self.design)) if self.design else NOTHING

    @property
    def soft_structure(self) -> str:
        """The same of the hand that Algorithm 1 ended with: what the thesis's own stages give."""
        return _product(_searched(self.design)) if self.design else NOTHING

    @property
    def thesis(self) -> str:
        """What the thesis says came out."""
        return "; ".join(dict.fromkeys(THESIS[figure] for figure in self.figures if figure in THESIS)) or NOTHING

    @property
    def seconds(self) -> str:
        """Wall time of the solve, s."""
        total = self.design.seconds.get("total") if self.design else None
        return NOTHING if total is None else f"{total:.0f}"

    def figure(self, name: str, scale: float = 1.0, digits: str = ".2g") -> str:
        """A figure of the certificate, scaled; a dash where there is none."""
        value = self.design.certificate.get(name, {}).get("value") if self.design else None
        return NOTHING if value is None else f"{scale * value:{digits}}"

    def misses(self, *names: str) -> bool:
        """Whether one of these figures misses its limit."""
        known = self.design.certificate if self.design else {}
        return any(not known[name]["holds"] for name in names if name in known)

    @property
    def goal_error(self) -> str:
        """Distance and, where there is one, angle from the goals."""
        distance, angle = self.figure("goal_position", 1e3), self.figure("goal_angle")
        return " · ".join(f"{v}{u}" for v, u in ((distance, " mm"), (angle, "°")) if v != NOTHING) or NOTHING

    @property
    def replay_error(self) -> str:
        """Mean distance and angle of the object from its plan in the replay that nothing perturbs."""
        if not self.replays:
            return NOTHING
        nominal = self.replays["nominal"]
        if nominal["dropped"]:
            return "dropped"
        return f"{1e3 * nominal['position_mean']:.2g} mm · {nominal['angle_mean']:.2g}°"

    @property
    def drops(self) -> str:
        """Perturbed replays that lost the object, of the first ``REPLAYS``."""
        if not self.replays:
            return NOTHING
        tried = self.replays["perturbed"][:REPLAYS]
        return f"{sum(each['dropped'] for each in tried)}/{len(tried)}"


def entry_of(file: Path, seed: int, root: Path, jobs: int) -> Entry:
    """Read what ``root`` has of a task file, replaying a design that has not been replayed.

    A folder with the file's own name, as ``casadi-hands solve`` writes it, will do if it is of this seed.
    """
    try:
        task = with_seed(load_task(file), seed)
    except TaskError as error:
        return Entry(
            file,
            seed,
            file.stem.replace("_", " "),
            "",
            figures_of(file),
            "failed",
            str(error).replace(str(file), file.name),
        )
    about = (task.name, task.about, figures_of(file))
    folders = (result_folder(file, seed, "refine", root), root / file.stem)
    folder = next((each for each in folders if is_of(task, each)), None)
    if folder is None:
        return Entry(file, seed, *about, "not solved", "", task)
    design = read_apart(folder, task)
    state = state_of(design, folder)
    replays = _replays(folder, jobs) if design.status != "failed" else {}
    return Entry(file, seed, *about, state, design.reason, task, folder, design, replays)


def state_of(design: Design, folder: Path) -> str:
    """One of ``STATES``; a folder without an end of its own may be of a solve that still runs."""
    how = str(ended(folder).get("how", ""))
    if how:
        return "stopped" if how.startswith("stopped") else "crashed"
    return "stopped" if design.status == "failed" and design.reason.startswith("stopped before") else design.status


def figures_of(file: Path) -> tuple[str, ...]:
    """Figures of the thesis that the first line of a task file names."""
    with file.open(encoding="utf-8") as lines:
        found = re.match(r"# Figures? (3\.\d\w(?:(?:, | and )3\.\d\w)*) of CMU-RI-TR-18-36", lines.readline())
    return tuple(re.findall(r"3\.\d\w", found[1])) if found else ()


def _replays(folder: Path, jobs: int) -> dict[str, Any]:
    try:
        return replays_of(folder, REPLAYS, jobs)
    except (DesignError, HandsError):
        # No simulator, or a scene it does not take: the page can do without.
        return {}


def _searched(design: Design) -> str:
    """Joints of each finger of the hands that the last round before the first whole-hand solve combined."""
    found = NOTHING
    for run in design.stages:
        if run["stage"] == "whole_hand":
            break
        match = re.match(r"hand of ([\d+]+) joints", str(run.get("what", "")))
        found = match[1] if match else found
    return found


def _product(joints: str) -> str:
    """``2+2+2`` as ``3 × 2``; left alone if fingers differ."""
    counts = joints.split("+")
    return joints if len(set(counts)) > 1 or joints == NOTHING else f"{len(counts)} × {counts[0]}"
