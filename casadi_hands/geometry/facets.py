"""The core of a polytope, in symbols: what is inside of flat faces, the nearest of which is chosen softly."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from casadi import SX

from casadi_hands.geometry.core import Core
from casadi_hands.geometry.segments import nearest_points, segment_distance
from casadi_hands.geometry.smooth import constant, norm

# The surface is where log Σ exp β(n·x - d) vanishes; with this β times its edges' radius, square edges are as far
# inside those of the faces as round ones of that radius would be.
SHARPNESS = float(np.sqrt(2) * np.log(2) / (np.sqrt(2) - 1))
_LOWEST = 1e-3  # lengths by which corners may be higher than the lowest and count for it


@dataclass(frozen=True)
class Facets(Core):
    """What is inside of all faces.

    Attributes:
        normals: (F, 3) outward, in the frame of the body.
        reaches: (F, 1) of the faces' planes along them, moved so that the surface goes through the faces' middles.
        corners: (V, 3) of the core.
        edge: radius of the rounded edges.
        vertices: (W, 3) corners of the polytope itself.
        starts: (E, 3) of its sharp edges.
        ends: (E, 3) of those.
    """

    normals: SX
    reaches: SX
    corners: SX
    edge: SX
    vertices: SX
    starts: SX
    ends: SX

    def beside(self, start: SX, end: SX) -> tuple[SX, SX]:
        """See `Core`: the distance from the nearest edge, which the planes across the way to it bound."""
        found, nearest = SX(np.inf), SX.zeros(6)
        for k in range(self.starts.shape[0]):
            edge = ca.horzcat(self.starts[k, :], self.ends[k, :]).T
            distance = segment_distance(start, end, edge[:3], edge[3:])
            nearest = ca.if_else(distance < found, edge, nearest)
            found = ca.fmin(distance, found)
        between = ca.vertcat(*nearest_points(start, end, nearest[:3], nearest[3:]))
        way = between[:3] - between[3:]
        way /= norm(way, 1e-9)
        apart = ca.fmin(ca.dot(way, start), ca.dot(way, end)) - ca.mmax(ca.mtimes(self.vertices, way))
        return apart + self.edge, segment_distance(start, end, nearest[:3], nearest[3:]) + self.edge

    def _weighed(self, beyond: SX) -> tuple[SX, SX, SX]:
        """Of how far a point is beyond the faces (F, 1): the most, weights (F, 1) of the nearest, and their sum."""
        most = constant(ca.mmax(beyond))
        weights = ca.exp(SHARPNESS / self.edge * (beyond - most))
        return most, weights, ca.sum1(weights)

    def _beyond(self, point: SX) -> SX:
        """How far a point (3,) is beyond the faces (F, 1)."""
        return ca.mtimes(self.normals, point) - self.reaches

    def distance_and_normal(self, point: SX, rounding: float) -> tuple[SX, SX]:
        """See `Core`; outside, the distance of a plane that is as steep as the nearest faces are together."""
        most, weights, total = self._weighed(self._beyond(point))
        beyond = most + ca.log(total) * self.edge / SHARPNESS
        mean = ca.mtimes(self.normals.T, weights) / total
        steep = norm(mean, 1e-6)
        return ca.if_else(beyond > 0, beyond / steep, beyond) + self.edge, mean / steep

    def slopes(self, start: SX, along: SX) -> Callable[[SX], SX]:
        """See `Core`."""
        first, change = self._beyond(start), ca.mtimes(self.normals, along)

        def slope(share: SX) -> SX:
            _, weights, total = self._weighed(first + share * change)
            return ca.dot(weights, change) / total

        return slope

    def bound(self) -> tuple[SX, SX]:
        """See `Core`."""
        count = self.vertices.shape[0]
        center = ca.sum1(self.vertices) / count
        return center.T, ca.sqrt(ca.mmax(ca.sum2((self.vertices - ca.repmat(center, count, 1)) ** 2)))

    def offset(self, point: SX) -> SX:
        """See `Core`."""
        distance, normal = self.distance_and_normal(point, 0.0)
        return distance * normal

    def marks(self, up: SX) -> list[SX]:
        """See `Core`: the lowest."""
        return self.lowest(up)

    def lowest(self, up: SX) -> list[SX]:
        """See `Core`: a corner; the middle of the corners that are level."""
        heights = ca.mtimes(self.corners, up)
        weights = ca.exp((constant(ca.mmin(heights)) - heights) / _LOWEST)
        return [ca.mtimes(self.corners.T, weights) / ca.sum1(weights)]
