"""The refine stage's problem: its variables, and every block bound to its knots."""

from __future__ import annotations

from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.stages.refine.finger_binding import bind_clearance, bind_contact, bind_pair, bind_shape
from casadi_hands.stages.refine.object_binding import bind_ground, bind_object, bind_physics
from casadi_hands.stages.refine.restoration import Proximity


class RefineProblem(Declaration):
    """The problem of one structure.

    Attributes:
        guarded: whether fingers are kept clear of each other between knots, too.
        proximity: the proximal terms of a restoration.
    """

    def __init__(self, structure: Structure, guarded: bool = False) -> None:
        """Declare variables and parameters and bind every block."""
        super().__init__(structure)
        self.guarded = guarded
        bind_physics(self)
        bind_object(self)
        if structure.grounded:
            bind_ground(self)
        for i in range(len(structure.contacts)):
            bind_contact(self, i)
            bind_clearance(self, i)
            bind_shape(self, i)
            for j in range(i):
                bind_pair(self, i, j, guarded)
        self.proximity = Proximity(self.problem)
