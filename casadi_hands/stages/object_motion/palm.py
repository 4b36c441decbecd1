"""The palm's pose as a kernel's symbols."""

from __future__ import annotations

import casadi as ca
from casadi import SX

from casadi_hands.motion import conjugate, exponential, multiply, rotation_matrix
from casadi_hands.nlp import Kernel


class Palm:
    """The palm's pose at one time: given, plus an offset where the task lets it move."""

    def __init__(self, kernel: Kernel, moves: bool, before: bool = False) -> None:
        """Declare the pose's symbols in a kernel.

        Args:
            kernel: where the symbols are declared.
            moves: whether the palm's offset (6,) - a translation and a rotation vector, world - is a variable.
            before: whether it is the pose one step earlier, where a kernel reads both.
        """
        tag, place = ("_before", -1) if before else ("", 0)
        offset = kernel.variable(f"palm{tag}", 6, "palm", place) if moves else SX.zeros(6, 1)
        self.position = kernel.parameter(f"palm_position{tag}", 3, "palm_position", place) + offset[:3]
        given = kernel.parameter(f"palm_quaternion{tag}", 4, "palm_quaternion", place)
        self.quaternion = multiply(exponential(offset[3:]), given) if moves else given

    def sees(self, point: SX) -> SX:
        """A world point (3,) in the palm frame."""
        return ca.mtimes(rotation_matrix(conjugate(self.quaternion)), point - self.position)

    @property
    def axis(self) -> SX:
        """The palm's normal (3,), world frame."""
        return rotation_matrix(self.quaternion)[:, 2]

    def turned(self, vector: SX) -> SX:
        """A world vector (3,) in palm axes."""
        return ca.mtimes(rotation_matrix(conjugate(self.quaternion)), vector)
