"""Fewer motors than joints: a hand that is certified with a motor for every joint, refined with motors that share them.

The commands of all joints are put on as many lines as there are motors, from the nearest such on. The number that the
task asks for is tried; of `fewest` one motor, then one more and one more. The first hand that is certified, by the
audit and by replays that move those motors alone, is taken.

A finger of fewer than three joints pushes in fewer directions than three, so that each joint it lacks takes a freedom
from the forces, which are what fits the hand to the object where motors are few: N motors and fingers of J joints leave
N - sum(3 - J) ways to go. Where that is none, hands of more joints are tried, too, before there is another motor.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.pipeline.certify import Certifier, rolls_far
from casadi_hands.pipeline.judge import Judge, counted
from casadi_hands.pipeline.record import STOPPED, Record
from casadi_hands.pipeline.refiner import Refiner
from casadi_hands.pipeline.steps import adopt, run_whole_hand
from casadi_hands.pipeline.warm_start import kept_margin, warm_start
from casadi_hands.problem.commands import coupled, joint_commands
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.stages.refine.values import Margin

MOST = 4  # motors that are tried: with more, sharing them is hardly worth its springs and pulleys
FARTHEST = 0.35  # rad that commands may be off the nearest lines, for an exact motion with these to be near
ENOUGH = 3  # joints of a finger that pushes in all directions


class Coupler:
    """Looks for the motors that a task asks for: their number, or the fewest.

    Args:
        record: of the solve.
        model: the task.
        judge: of the designs.
        jobs: processes for the replays.
        certifier: of the hand, whose search gives others with more joints; None for no others.
    """

    def __init__(
        self, record: Record, model: Model, judge: Judge, jobs: int, certifier: Certifier | None = None
    ) -> None:
        self.record, self.model, self.judge, self.jobs, self.certifier = record, model, judge, jobs, certifier

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
        own, margin, other = warm_start(design, self.record.task, self.model), kept_margin(design), None
        own_joints = [len(finger.links) for finger in hand.fingers]
        larger = _with_enough(own_joints, self.record.task.search.max_joints)
        lacking = sum(max(0, ENOUGH - n) for n in own_joints)
        for motors in range(least, most + 1):
            found = self._driven(own, margin, motors, near=True)
            if found is None and larger and motors <= lacking:
                other = other or self._with_joints(larger)
                found = self._driven(other, None, motors, near=False) if other else None
            if found is not None:
                return counted(found)
        return counted(_without(design, most, joints))

    def _with_joints(self, joints: tuple[int, ...]) -> WholeHand | None:
        """The best hand of so many joints a finger, as it is before it is refined; none where there is no search.

        Where contacts must go far with the object, fingers have the joints for that already.
        """
        if self.certifier is None or rolls_far(self.model):
            return None
        search = self.certifier.search
        candidate = search.with_joints(dict(zip(search.contacts, joints, strict=True)))[0]
        self.record.add_runs(search.take_runs())
        return run_whole_hand(self.record, self.model, self.certifier.floating, candidate)

    def _driven(self, whole: WholeHand, margin: Margin | None, motors: int, near: bool) -> Design | None:
        """The certified design of a hand with so many motors, or None.

        Args:
            whole: the hand with its motion.
            margin: to its limits.
            motors: their number.
            near: whether the motion is exact with a motor for each joint.
        """
        model = replace(self.model, motors=motors)
        begun = coupled(model, whole, motors)
        assert begun.coupling is not None
        if near and np.abs(joint_commands(self.model, begun) - begun.coupling.commands).max() > FARTHEST:
            return None
        joints = "+".join(str(finger.joints) for finger in whole.fingers)
        drives = f"{motors} motor{'s' if motors > 1 else ''} for {joints} joints"
        self.record.log("refine", drives)
        adopt(self.record, self.model, whole)
        tried, _ = Refiner(self.record, model, self.judge, self.jobs).certify(begun, (), margin, near=near)
        if tried.status == "certified":
            return tried
        self.record.log("refine", f"not with {drives}: {tried.reason}")
        return None


def _with_enough(joints: list[int], most: int) -> tuple[int, ...]:
    """Joints of each finger that pushes in all directions, as far as a finger may have them; none if all have."""
    enough = tuple(max(n, min(ENOUGH, most)) for n in joints)
    return enough if enough != tuple(joints) else ()


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
