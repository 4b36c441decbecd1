"""Fewer motors than joints: a hand that is certified with a motor for every joint, refined with motors that share them.

The commands of all joints are put on as many lines as there are motors, from the nearest such on. The number that the
task asks for is tried; of `fewest` one motor, then one more and one more. The first hand that is certified, by the
audit and by replays that move those motors alone, is taken.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.pipeline.judge import Judge, counted
from casadi_hands.pipeline.record import STOPPED, Record
from casadi_hands.pipeline.refiner import Refiner
from casadi_hands.pipeline.warm_start import kept_margin, warm_start
from casadi_hands.problem.commands import coupled, joint_commands
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model

MOST = 4  # motors that are tried: with more, sharing them is hardly worth its springs and pulleys
FARTHEST = 0.35  # rad that commands may be off the nearest lines, for an exact motion with these to be near


class Coupler:
    """Looks for the motors that a task asks for: their number, or the fewest.

    Args:
        record: of the solve.
        model: the task.
        judge: of the designs.
        jobs: processes for the replays.
    """

    def __init__(self, record: Record, model: Model, judge: Judge, jobs: int) -> None:
        self.record, self.model, self.judge, self.jobs = record, model, judge, jobs

    def run(self, design: Design) -> Design:
        """The hand with as few motors as the task asks for and as are found, from a design with one for each joint.

        Args:
            design: as it was judged and replayed.

        Returns:
            The design itself where no fewer are asked for, or where it is not certified; where none is found, with
            words on that. Where a number is asked for, the certificate has it.
        """
        asked, hand = self.record.task.motors, design.hand
        if asked == "independent" or hand is None or design.motion is None:
            return design
        if design.reason == STOPPED:
            design = replace(design, status="certified", reason="")
        joints = hand.degrees_of_freedom
        least, most = (asked, asked) if isinstance(asked, int) else (1, min(MOST, joints - 1))
        if design.status != "certified" or least >= joints:
            return counted(design)
        whole, margin = warm_start(design, self.record.task, self.model), kept_margin(design)
        found = design
        for motors in range(least, most + 1):
            model = replace(self.model, motors=motors)
            begun = coupled(model, whole, motors)
            if self._off(begun) > FARTHEST:
                continue
            drives = f"{motors} motor{'s' if motors > 1 else ''} for all {joints} joints"
            self.record.log("refine", drives)
            refiner = Refiner(self.record, model, self.judge, self.jobs)
            tried, _ = refiner.certify(begun, (), margin, near=True)
            if tried.status == "certified":
                found = tried
                break
            self.record.log("refine", f"not with {drives}: {tried.reason}")
        return counted(found if found is not design else _without(design, most, joints))

    def _off(self, begun: WholeHand) -> float:
        """How far commands are off the lines that a motion begins with, rad."""
        assert begun.coupling is not None
        return float(np.abs(joint_commands(self.model, begun) - begun.coupling.commands).max())


def _without(design: Design, most: int, joints: int) -> Design:
    """The design, a motor for every joint, with the words on motors that were not found.

    Args:
        design: certified.
        most: motors that were tried.
        joints: of the hand.
    """
    fewer = design.task.motors == "fewest" and most > 1
    drive = "1 motor drives" if most == 1 else f"{most} motors{' or fewer' if fewer else ''} drive"
    words = f"no motion was found with which {drive} all {joints} joints"
    return replace(design, reason=f"{words}. {design.reason}" if design.reason else words)
