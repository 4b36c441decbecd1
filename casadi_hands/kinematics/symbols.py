"""A finger's symbols: morphology and angles as a kernel's locals, and the bodies they make."""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from typing import Protocol

import casadi as ca
from casadi import SX

from casadi_hands.geometry import clamp, norm
from casadi_hands.kinematics import STAND, finger_kinematics, link_radii


@dataclass(frozen=True)
class FingerSymbols:
    """One finger in a kernel, palm frame.

    Attributes:
        base: (2,) of the first joint, which stands ``STAND`` radii of its link above the palm's face.
        lengths: (n,).
        axes: (3, n) unit joint axes, frames of their links.
        turns: (3, 3n) rotations of links at zero angle, parent <- link: their bends.
    """

    base: SX
    lengths: SX
    axes: SX
    turns: SX

    @property
    def joints(self) -> int:
        """Number of joints."""
        return int(self.lengths.numel())

    def placed(self, angles: SX, radii: tuple[SX, SX], point: SX | None = None) -> PlacedFinger:
        """The finger at joint angles (n,).

        Args:
            angles: (n,) rad.
            radii: of its links, and of the last one.
            point: (3,) its contact, in the last link's frame.
        """
        function = finger_kinematics(self.joints)
        at = SX.zeros(3, 1) if point is None else point
        each = link_radii(self.joints, *radii)
        base = ca.vertcat(self.base, STAND * each[0])
        origins, rotations, tip, contact, jacobian = function(base, self.turns, self.axes, self.lengths, angles, at)
        return PlacedFinger(origins, rotations, tip, contact, jacobian, each)


@dataclass(frozen=True)
class PlacedFinger:
    """Forward kinematics, palm frame: joint origins (3, n), rotations (3, 3n), tip, contact (3,), Jacobian (3, n).

    ``radii`` are those of its n links.
    """

    origins: SX
    rotations: SX
    tip: SX
    contact: SX
    jacobian: SX
    radii: list[SX]

    @property
    def ends(self) -> list[tuple[SX, SX]]:
        """Both ends (3,) of each link's axis."""
        points = [self.origins[:, j] for j in range(self.origins.shape[1])] + [self.tip]
        return list(itertools.pairwise(points))

    @property
    def links(self) -> tuple[list[tuple[SX, SX]], list[SX]]:
        """Both ends of each link's axis, and the links' radii."""
        return self.ends, self.radii

    @property
    def tip_rotation(self) -> SX:
        """(3, 3) palm <- last link."""
        return self.rotations[:, -3:]


class Declare(Protocol):
    """A kernel's ``variable`` or ``parameter``."""

    def __call__(self, name: str, size: int, quantity: str, place: int | None) -> SX:
        """Declare a symbol (size,)."""


def morphology_sizes(joints: int) -> dict[str, int]:
    """How many numbers each part of a finger's morphology has, in the order in which kernels declare them."""
    return {"base": 2, "lengths": joints, "axes": 2 * joints, "bends": 2 * joints}


def morphology(declare: Declare, frames: SX, joints: int, place: int | None = None) -> FingerSymbols:
    """Declare a finger's morphology with ``declare``.

    Args:
        declare: a kernel's ``variable`` or ``parameter``.
        frames: (9n,) for each axis a rotation, columns stacked, whose third column is the seed axis.
        joints: number of joints.
        place: which of several fingers of the kernel, appended to the names; None for the only one.
    """
    tag = "" if place is None else str(place)
    sizes = morphology_sizes(joints)
    base, lengths, axes, bends = (declare(f"{name}{tag}", size, name, place) for name, size in sizes.items())
    return FingerSymbols(base, lengths, axes_of(axes, frames), turns_of(bends))


def axes_of(coordinates: SX, frames: SX) -> SX:
    """The unit axes (3, n) at coordinates (2n,) about seed frames (9n,)."""
    return ca.horzcat(
        *[axis(coordinates[2 * j : 2 * j + 2], frames[9 * j : 9 * j + 9]) for j in range(frames.numel() // 9)]
    )


def turns_of(bends: SX) -> SX:
    """The rotations (3, 3n), parent <- link, of bends (2n,)."""
    return ca.horzcat(*[bend_rotation(bends[2 * j : 2 * j + 2]) for j in range(bends.numel() // 2)])


def axis(coordinates: SX, frame: SX) -> SX:
    """The unit axis (3,) at exponential coordinates (2,) about the third column of ``frame`` (9,)."""
    rotation = ca.reshape(frame, 3, 3)
    angle = norm(coordinates, 1e-5)
    return ca.mtimes(rotation, ca.vertcat(ca.sin(angle) / angle * coordinates, ca.cos(angle)))


def bend_rotation(bend: SX) -> SX:
    """The rotation (3, 3), parent <- link, by a rotation vector (2,) across the parent's z axis, rad."""
    x, y = bend[0], bend[1]
    angle = norm(bend, 1e-5)
    cross = SX.zeros(3, 3)
    cross[0, 2], cross[1, 2], cross[2, 0], cross[2, 1] = y, -x, -y, x
    half = ca.sin(angle / 2) / angle
    return SX.eye(3) + ca.sin(angle) / angle * cross + 2 * half**2 * ca.mtimes(cross, cross)


def cosines_from_links(axes: SX, turns: SX) -> SX:
    """Cosines (2n - 1,) between joint axes (3, n) and the links beside them: each one's own, then the ones before."""
    before = [ca.dot(axes[:, j], turns[2, 3 * j : 3 * j + 3].T) for j in range(1, axes.shape[1])]
    return ca.vertcat(axes[2, :].T, *before)


def tip_point(coordinates: SX, length: SX, radius: SX) -> tuple[SX, SX]:
    """A point on the last link's surface and its outward normal, both (3,) in the link's frame.

    The coordinates (2,) point from the cap's pole along the surface: their length is the arc length, which goes
    over the hemispherical cap and on along the cylinder; on the surface by construction (eq. 2.19 is zero).
    """
    arc = norm(coordinates, 1e-5)
    direction = coordinates / arc
    angle = clamp(arc / radius, 0, ca.pi / 2)
    normal = ca.vertcat(ca.sin(angle) * direction, ca.cos(angle))
    down_the_cylinder = ca.fmax(arc - radius * ca.pi / 2, 0)
    return radius * normal + ca.vertcat(0, 0, length - down_the_cylinder), normal
