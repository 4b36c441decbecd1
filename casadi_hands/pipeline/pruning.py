"""Joints that hardly move, left out: a certified hand makes way for one that does the same with fewer.

What such a joint does a bend of its finger does, too. Fingers that have one are designed anew with a joint less.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.pipeline.record import Record
from casadi_hands.stages.synthesis.algorithm import Candidate, Search

HOPELESS = 0.5  # score of a finger that leaves half of the object's weight to its structure
IDLE = np.radians(5)  # that a joint moves in a motion, below which a bend may do instead


class Pruner:
    """Looks for a hand without the joints that hardly move.

    Args:
        record: of the solve.
        search: that found the hand.
        certify: gives the judged design of one of its hands.
    """

    def __init__(self, record: Record, search: Search, certify: Callable[[Candidate], Design]) -> None:
        self.record, self.search, self._certify = record, search, certify

    def run(self, design: Design) -> Design:
        """The certified design with the fewest joints that is found, from one that may have some that hardly move.

        Args:
            design: as it was judged and replayed.

        Returns:
            The design itself where it is not certified, or where none with fewer joints is.
        """
        if design.status != "certified":
            return design
        tried, again = set[tuple[int, ...]](), True
        while again:
            again = False
            for joints in fewer_joints(design):
                if joints in tried:
                    continue
                tried.add(joints)
                words = "+".join(map(str, joints))
                self.record.log("synthesis", f"{words} joints, because others hardly move")
                candidate = self.search.with_joints(dict(zip(self.search.contacts, joints, strict=True)))[0]
                self.record.add_runs(self.search.take_runs())
                if (score := max(candidate.scores)) > HOPELESS:
                    self.record.log("synthesis", f"not with {words} joints: a finger has score {score:.2g}")
                    continue
                found = self._certify(candidate)
                if found.status == "certified":
                    design, again = found, True
                    break
                self.record.log("refine", f"not with {words} joints: {found.reason}")
        return design


def fewer_joints(design: Design) -> list[tuple[int, ...]]:
    """Joints of each finger of hands with fewer idle joints, in the order in which they are to be tried.

    A joint less of all fingers that have idle ones; of those of more than two joints, as a single joint hardly ever
    holds a finger's share of the weight; of the one whose joint moves least.

    Args:
        design: with a hand and a motion.
    """
    assert design.hand is not None
    assert design.motion is not None
    joints = [len(finger.links) for finger in design.hand.fingers]
    moved = np.split(np.ptp(design.motion.joint_angles, axis=0), np.cumsum(joints)[:-1])
    least = {i: float(moved[i].min()) for i, n in enumerate(joints) if n > 1 and moved[i].min() < IDLE}
    choices = [set(least), {i for i in least if joints[i] > 2}, set(sorted(least, key=least.__getitem__)[:1])]
    return list(dict.fromkeys(tuple(n - (i in chosen) for i, n in enumerate(joints)) for chosen in choices if chosen))
