"""Contacts kept off the edges of the faces that they are on: files have these sharp, motions see them round."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.nlp import Kernel
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine.declaration import Declaration
from casadi_hands.stages.refine.touching import runs
from casadi_hands.terms import constraints as limits

Array = NDArray[np.float64]


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
            own, reach = _bounds(body, np.unique(patches[run, c], axis=0) if known else motion.point[run[:1], c])
            normals[run, : len(own)], offsets[run, : len(own)] = own, reach
        values |= {f"face_normals{c}": normals.reshape(len(patches), -1), f"face_offsets{c}": offsets}
    return values


def _bounds(body: Body, points: Array) -> tuple[Array, Array]:
    """Half-spaces (M, 3), (M,) of the face with all points (K, 3), that have these and its middle within; or none."""
    (normals, offsets), *others = (body.face(point) for point in points)
    if not all(np.array_equal(normals, each) for each, _ in others):
        return np.zeros((0, 3)), np.zeros(0)
    kept = np.all(np.vstack([points, body.centroid]) @ normals.T <= offsets, axis=0)
    return normals[kept], offsets[kept]
