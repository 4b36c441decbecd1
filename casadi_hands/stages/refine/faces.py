"""Contacts kept off the edges of the faces that they are on: files have these sharp, motions see them round."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from casadi_hands.nlp import Kernel
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.stages.refine.touching import runs
from casadi_hands.terms import constraints as limits


@cache
def face(bounds: int) -> Kernel:
    """One contact's point at one knot, within half-spaces.

    Constraints: ``on_face`` (bounds).

    Args:
        bounds: how many.
    """
    kernel = Kernel("face")
    point = kernel.variable("point", 3)
    normals, offsets = kernel.parameter("face_normals", 3 * bounds), kernel.parameter("face_offsets", bounds)
    kernel.constrain(limits.ON_FACE, offsets - ca.mtimes(ca.reshape(normals, 3, bounds).T, point))
    return kernel


def bind(of: Declaration, i: int) -> None:
    """Bind the face of a finger's contact, if its body has any."""
    c, touching = of.structure.contacts[i], np.flatnonzero(of.structure.touching[:, i])
    if bounds := of.structure.model.touched[c].face_bounds:
        point = of.point.entries(3 * i, 3 * i + 3, c).take(touching)
        own = of.of(c, touching, "face_normals", "face_offsets")
        of.bind(touching, face(bounds), {"on_face": (0, np.inf)}, (c,), f"face{c}", point=point, **own)


def parameters(structure: Structure, motion: WholeHand) -> dict[str, ArrayLike]:
    """Half-spaces of the contacts' faces at the S knots: ``face_normals`` (S, 3 B) and ``face_offsets`` (S, B) of each.

    From touch to lift a contact stays on the face on which the task or a plan has it, or where neither says, the
    motion. Where a plan moves it from one to another, or has it beside an edge, nothing bounds it there.

    Args:
        structure: of the problem, with its knots.
        motion: on them.
    """
    values: dict[str, ArrayLike] = {}
    model = structure.model
    patches = model.keyframe_patches[model.schedule.sample_keyframes]
    for i, c in enumerate(structure.contacts):
        body = model.touched[c]
        if not body.face_bounds:
            continue
        normals = np.zeros((len(patches), body.face_bounds, 3))
        offsets = np.ones((len(patches), body.face_bounds))
        for k, run in enumerate(runs(structure.touching[:, i])):
            known = k == 0 or model.regrasp is not None
            wanted = np.unique(patches[run, c], axis=0) if known else motion.point[run[:1], c]
            faces = [body.face(point) for point in wanted]
            if all(np.array_equal(each[0], faces[0][0]) for each in faces):
                within = np.all(wanted @ faces[0][0].T <= faces[0][1], axis=0)
                kept = np.flatnonzero(within & (faces[0][0] @ body.centroid < faces[0][1]))
                normals[np.ix_(run, kept)], offsets[np.ix_(run, kept)] = faces[0][0][kept], faces[0][1][kept]
        values |= {f"face_normals{c}": normals.reshape(len(patches), -1), f"face_offsets{c}": offsets}
    return values
