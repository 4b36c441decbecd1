"""Contacts kept off the edges of the faces that they are on: files have these sharp, motions see them round."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from casadi_hands.nlp import Kernel
from casadi_hands.problem.model import Model
from casadi_hands.stages.refine.declaration import Declaration
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
    ways, reach = kernel.parameter("face_ways", 3 * bounds), kernel.parameter("face_reach", bounds)
    kernel.constrain(limits.ON_FACE, reach - ca.mtimes(ca.reshape(ways, 3, bounds).T, point))
    return kernel


def bind(of: Declaration, i: int) -> None:
    """Bind the face of a finger's contact, if its body has any."""
    c, touching = of.structure.contacts[i], np.flatnonzero(of.structure.touching[:, i])
    if bounds := of.structure.model.touched[c].face_bounds:
        point = of.point.entries(3 * i, 3 * i + 3, c).take(touching)
        own = of.of(c, touching, "face_ways", "face_reach")
        of.bind(touching, face(bounds), {"on_face": (0, np.inf)}, (c,), f"face{c}", point=point, **own)


def parameters(model: Model, contacts: tuple[int, ...]) -> dict[str, ArrayLike]:
    """Half-spaces of the contacts' faces at all knots: those that the task's own points are in.

    Args:
        model: the task.
        contacts: of the fingers.
    """
    values: dict[str, ArrayLike] = {}
    patches = model.keyframe_patches[model.schedule.sample_keyframes]
    for c in contacts:
        if bounds := (body := model.touched[c]).face_bounds:
            distinct, at = np.unique(patches[:, c], axis=0, return_inverse=True)
            ways, reach = np.zeros((len(distinct), bounds, 3)), np.ones((len(distinct), bounds))
            for k, patch in enumerate(distinct):
                normals, offsets = body.face(patch)
                kept = np.flatnonzero(normals @ patch <= offsets)
                ways[k, kept], reach[k, kept] = normals[kept], offsets[kept]
            rows = at.reshape(-1)
            values |= {f"face_ways{c}": ways[rows].reshape(len(rows), -1), f"face_reach{c}": reach[rows]}
    return values
