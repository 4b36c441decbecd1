"""Joints left out: a certified hand makes way for one that does the same with fewer.

What a joint that hardly moves does a bend of its finger does, too. And where fingers have more than two joints, fewer
may do: the search asks of each finger alone that it follows its contact however that goes, while the hand and the
object may meet goals another way. Fingers are designed anew with a joint less.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from casadi_hands.export.design import Design
from casadi_hands.pipeline.record import Record
from casadi_hands.stages.synthesis.algorithm import Candidate, Search

HOPELESS = 0.5  # score of a finger that leaves half of the object's weight to its structure
IDLE = np.radians(5)  # that a joint moves in a motion, below which a bend may do instead
FEWEST = 2  # joints of a finger that bears its share of a weight and moves it, but for lucky ones


class Pruner:
    """Looks for a hand without the joints that hardly move, or that it can do without.

    Args:
        record: of the solve.
        search: that found the hand.
        certify: gives the judged design of one of its hands.
        spare: whether joints that do move are to be left out, too, where hands without them are certified.
        failed: joints of each finger of hands that were not certified.
    """

    def __init__(
        self,
        record: Record,
        search: Search,
        certify: Callable[[Candidate], Design],
        spare: bool = False,
        failed: Iterable[tuple[int, ...]] = (),
    ) -> None:
        self.record, self.search, self._certify, self.spare = record, search, certify, spare
        self.failed = set(failed)

    def run(self, design: Design) -> Design:
        """The certified design with the fewest joints that is found, from one that may have more.

        Args:
            design: as it was judged and replayed.

        Returns:
            The design itself where it is not certified, or where none with fewer joints is.
        """
        if design.status != "certified":
            return design
        # Another hand of the same structure, or of more joints, may have failed before: that says nothing now.
        own, _ = _moved(design)
        self.failed = {joints for joints in self.failed if any(n < m for n, m in zip(joints, own, strict=True))}
        while (fewer := self._fewer(design)) is not None:
            design = fewer
        return design

    def _fewer(self, design: Design) -> Design | None:
        """A certified design with fewer joints, or None."""
        choices = fewer_joints(design)
        for joints in [*choices, *(spare_joints(design) if self.spare else ())]:
            # Idle joints are left out even where hands with more have failed.
            if joints in self.failed or (joints not in choices and self._fails(joints)):
                continue
            words = "+".join(map(str, joints))
            why = "because others hardly move" if joints in choices else "in case so few do"
            self.record.log("synthesis", f"{words} joints, {why}")
            candidate = self.search.with_joints(dict(zip(self.search.contacts, joints, strict=True)))[0]
            self.record.add_runs(self.search.take_runs())
            if (score := max(candidate.scores)) > HOPELESS:
                self.record.log("synthesis", f"not with {words} joints: a finger has score {score:.2g}")
                self.failed.add(joints)
                continue
            found = self._certify(candidate)
            if found.status == "certified":
                return found
            self.record.log("refine", f"not with {words} joints: {found.reason}")
            self.failed.add(joints)
        return None

    def _fails(self, joints: tuple[int, ...]) -> bool:
        """Whether a hand was not certified that has as many joints at least in every finger."""
        return any(all(n <= more for n, more in zip(joints, failed, strict=True)) for failed in self.failed)


def fewer_joints(design: Design) -> list[tuple[int, ...]]:
    """Joints of each finger of hands with fewer idle joints, in the order in which they are to be tried.

    A joint less of all fingers that have idle ones; of those of more than two joints, as a single joint hardly ever
    holds a finger's share of the weight; of the one whose joint moves least.

    Args:
        design: with a hand and a motion.
    """
    joints, moved = _moved(design)
    least = {i: each for i, each in moved.items() if joints[i] > 1 and each < IDLE}
    choices = [set(least), {i for i in least if joints[i] > FEWEST}, set(sorted(least, key=least.__getitem__)[:1])]
    return _without(joints, choices)


def spare_joints(design: Design) -> list[tuple[int, ...]]:
    """Joints of each finger of hands with one less in fingers of more than two, in the order they are to be tried.

    In all such fingers; in one, first that with the joint that moves least.

    Args:
        design: with a hand and a motion.
    """
    joints, moved = _moved(design)
    spare = sorted((i for i in moved if joints[i] > FEWEST), key=moved.__getitem__)
    return _without(joints, [set(spare), *({i} for i in spare)])


def _moved(design: Design) -> tuple[list[int], dict[int, float]]:
    """Joints of each finger, and how far (rad) that moves which moves least."""
    assert design.hand is not None
    assert design.motion is not None
    joints = [len(finger.links) for finger in design.hand.fingers]
    moved = np.split(np.ptp(design.motion.joint_angles, axis=0), np.cumsum(joints)[:-1])
    return joints, {i: float(each.min()) for i, each in enumerate(moved)}


def _without(joints: list[int], choices: list[set[int]]) -> list[tuple[int, ...]]:
    """Joints of each finger where chosen ones have one less, each choice once."""
    return list(dict.fromkeys(tuple(n - (i in chosen) for i, n in enumerate(joints)) for chosen in choices if chosen))
