"""Which of several designs for one task is the best, and which of the others are worth keeping beside it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from casadi_hands.export.design import Design
from casadi_hands.pipeline.alternatives.likeness import ALIKE, difference

MOST = 4
"""Hands that are kept."""

_ACCURACY = frozenset(("structure", "goal_position", "goal_angle", "residual", "residual_between", "gap"))
"""Figures of how accurately a motion was planned; the refinement uses up tolerances that cost it something."""
_NO_SHARE = _ACCURACY | {"motors"}
"""Figures of which nothing need be left: as many motors as are asked for are no risk."""

_STATUS = ("certified", "feasible", "failed")


@dataclass(frozen=True)
class Alternative:
    """What one seed gave.

    Attributes:
        seed: of the search.
        design: the solve's.
        kept: whether it is among the best distinct hands; never when it failed.
        like: seed of the better hand that this one is a near-duplicate of, else None.
    """

    seed: int
    design: Design
    kept: bool
    like: int | None = None

    @property
    def joints(self) -> tuple[int, ...]:
        """Joints of each finger; none without a hand."""
        return tuple(len(finger.links) for finger in self.design.hand.fingers) if self.design.hand else ()

    @property
    def margin(self) -> float:
        """What `margin` says."""
        return margin(self.design)

    @property
    def torque(self) -> float:
        """What `largest_torque` says."""
        return largest_torque(self.design)


def rank(designs: Mapping[int, Design]) -> list[Alternative]:
    """Rank designs for one task, best first, and say which to keep.

    Certified designs come before feasible and these before failed ones; then those with fewer motors, with fewer
    joints, with more `margin`, with less torque in their hardest worked joint or motor. Margins are compared to the
    nearest tenth, so that torque decides between hands that are about as far from their limits.

    Args:
        designs: seed -> what it gave.
    """
    order = sorted(designs, key=lambda seed: (*_key(designs[seed]), seed))
    kept: list[int] = []
    ranked = []
    for seed in order:
        design = designs[seed]
        if design.status == "failed":
            ranked.append(Alternative(seed, design, kept=False))
            continue
        like = next((better for better in kept if _alike(designs[better], design)), None)
        keep = like is None and len(kept) < MOST
        ranked.append(Alternative(seed, design, keep, like))
        if keep:
            kept.append(seed)
    return ranked


def margin(design: Design) -> float:
    """The smallest share that is left of any limit of the certificate, and of the friction.

    1 is all of it, 0 none, and a limit that is missed counts as negative. Three kinds of figures count only when they
    are missed: those with a limit of 0, which leaves no share, those of accuracy (goals, residuals, gap at the
    samples), which say nothing of how robust the hand is, and the number of motors. Minus infinity without a
    certificate, or where a figure is not a number.
    """
    shares = [_share_left(name, figure) for name, figure in design.certificate.items()]
    return min((share for share in shares if share is not None), default=-math.inf)


def largest_torque(design: Design) -> float:
    """The largest torque of any joint by the certificate, N·m; infinite where it says nothing of torques."""
    figure = design.certificate.get("torque", {})
    if figure.get("value") is None:
        return math.inf
    # A share of the actuator's torque where the task names one.
    actuator = design.task.actuator
    return float(figure["value"]) * (actuator.torque or 1.0)


def _share_left(name: str, figure: Mapping[str, Any]) -> float | None:
    """The share of a figure's limit that is left; None where nothing is asked of it."""
    value, limit = figure["value"], figure["limit"]
    if name == "friction_use":
        limit = 1.0  # of which the certificate asks nothing: `friction_excess` does
    if limit is None:
        return None
    if value is None:
        return -math.inf
    if figure["holds"] and (limit == 0.0 or name in _NO_SHARE):
        return None
    if limit == 0.0:
        return -math.inf
    # The certificate says whether a limit holds, but not whether it is a least or a largest value.
    at_least = name != "friction_use" and figure["holds"] == (value > limit)
    return float(value / limit - 1.0 if at_least else 1.0 - value / limit)


def _key(design: Design) -> tuple[float, ...]:
    motors, joints = (math.inf,) * 2 if design.hand is None else (design.hand.motors, design.hand.degrees_of_freedom)
    return (_STATUS.index(design.status), motors, joints, -round(margin(design), 1), largest_torque(design))


def _alike(first: Design, second: Design) -> bool:
    """Whether two designs are near-duplicates; those without a hand are all the same."""
    if first.hand is None or second.hand is None:
        return first.hand is second.hand
    return difference(first.hand, second.hand, first.task.object.characteristic_length) < ALIKE
