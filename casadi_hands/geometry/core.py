"""What a core is: a convex set in symbols, in one frame or placed in another."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from casadi_hands.geometry.smooth import norm


class Core(ABC):
    """A convex core in symbols; all in one frame. Its fields are matrices (SX)."""

    @abstractmethod
    def offset(self, point: SX) -> SX:
        """The vector (3,) to a point from the core's nearest one, smooth."""

    def mapped(self, placed: Callable[[SX], SX]) -> Core:
        """The core in another frame, of a rigid motion that takes each point (3,) there."""
        origin = placed(SX.zeros(3))
        return Placed(self, origin, ca.horzcat(*[placed(SX(axis)) - origin for axis in np.eye(3)]))

    @abstractmethod
    def marks(self, up: SX) -> list[SX]:
        """Points (3,) of the core whose distances from a disc with a normal (3,) stand for its own."""

    @abstractmethod
    def lowest(self, up: SX) -> list[SX]:
        """Points (3,) of the core among which its lowest is, for a direction (3,) upward."""

    def depth(self, point: SX) -> SX:
        """How deep a point is within the core, zero outside: what its distance is continued by there."""
        return SX(0)

    def beside(self, start: SX, end: SX) -> tuple[SX, SX] | None:
        """Bounds of a segment's distance, both ends (3,): the upper one is the distance where the lower one is near it.

        None of cores whose `distance_and_normal` is right everywhere.
        """
        return None

    def bound(self) -> tuple[SX, SX] | None:
        """Centre (3,) and radius of a ball around it; None where its own distances are found as soon as the ball's."""
        return None

    def distance_and_normal(self, point: SX, rounding: float) -> tuple[SX, SX]:
        """Signed distance of a point (3,) from the core, and the outward unit normal (3,) nearest to it.

        Args:
            point: any.
            rounding: of the distance where it vanishes.
        """
        offset = self.offset(point)
        distance = norm(offset, rounding)
        return distance - self.depth(point), offset / distance

    def slopes(self, start: SX, along: SX) -> Callable[[SX], SX]:
        """What of a share of a vector (3,) from a point (3,) has the sign of the distance's change there."""
        return lambda share: ca.dot(self.offset(start + share * along), along)


@dataclass(frozen=True)
class Placed(Core):
    """A core in another frame than its own; distances from links are found in that, see `pairs.core_distance`.

    Attributes:
        core: in its own frame.
        origin: (3,) of that frame.
        turn: (3, 3) that frame's axes by columns.
    """

    core: Core
    origin: SX
    turn: SX

    def own(self, point: SX) -> SX:
        """A point (3,) in the core's own frame."""
        return ca.mtimes(self.turn.T, point - self.origin)

    def offset(self, point: SX) -> SX:
        """See `Core`."""
        return ca.mtimes(self.turn, self.core.offset(self.own(point)))

    def distance_and_normal(self, point: SX, rounding: float) -> tuple[SX, SX]:
        """See `Core`."""
        distance, normal = self.core.distance_and_normal(self.own(point), rounding)
        return distance, ca.mtimes(self.turn, normal)

    def marks(self, up: SX) -> list[SX]:
        """See `Core`."""
        return [self._seen(each) for each in self.core.marks(ca.mtimes(self.turn.T, up))]

    def lowest(self, up: SX) -> list[SX]:
        """See `Core`."""
        return [self._seen(each) for each in self.core.lowest(ca.mtimes(self.turn.T, up))]

    def _seen(self, point: SX) -> SX:
        return self.origin + ca.mtimes(self.turn, point)
