"""The refine stage's problem: its variables, and every block bound to its knots."""

from __future__ import annotations

import numpy as np

from casadi_hands.problem.structure import Structure
from casadi_hands.stages.own_terms import bind_own, contact_names
from casadi_hands.stages.refine.coupling import bind as bind_coupling
from casadi_hands.stages.refine.declaration import Block, Declaration
from casadi_hands.stages.refine.faces import bind as bind_face
from casadi_hands.stages.refine.finger_binding import bind_clearance, bind_contact, bind_pair, bind_rolling, bind_shape
from casadi_hands.stages.refine.object_binding import bind_ground, bind_object, bind_physics
from casadi_hands.stages.refine.restoration import Proximity
from casadi_hands.stages.refine.sliding import bind as bind_sliding
from casadi_hands.stages.refine.strength import bind as bind_strength
from casadi_hands.stages.refine.torsion import bind as bind_torsion


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
        if structure.model.torsion:
            bind_torsion(self)
        if structure.model.motors:
            bind_coupling(self)
        if structure.model.sliding:
            bind_sliding(self)
        for i in range(len(structure.contacts)):
            bind_contact(self, i)
            bind_face(self, i)
            bind_rolling(self, i)
            bind_clearance(self, i)
            bind_shape(self, i)
            if structure.model.strength:
                bind_strength(self, i)
            for j in range(i):
                bind_pair(self, i, j, guarded)
        self._bind_own()
        self.proximity = Proximity(self.problem)

    def _bind_own(self) -> None:
        """A person's own terms, last of all that is of the motion."""
        model, structure = self.structure.model, self.structure
        contacts = [contact_names(model)[c] for c in structure.columns]
        angles = dict(zip(structure.contacts, self.angles, strict=True))
        rows = {"pose": self.pose, "point": self.point, "force": self.force}
        kernel = bind_own(self.problem, model, "refine", contacts, angles, **rows)
        if kernel is not None:
            self.blocks[kernel.name] = Block(kernel, np.arange(self.knots), ())
