"""What a finger's links and bearings bear, as constraints: statics of its contact's force at every knot.

The audit has the same figures of its own, with the links' weight and the fingertips' torsion (``docs/method.md``).
"""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from casadi import SX

from casadi_hands.geometry import norm
from casadi_hands.geometry.bodies import Body
from casadi_hands.nlp import Kernel, Rows
from casadi_hands.stages.refine.declaration import Declaration, Knots
from casadi_hands.stages.refine.finger_binding import shape_at
from casadi_hands.stages.refine.finger_kernels import Scene, free_morphology
from casadi_hands.terms import constraints as limits

POISSON = 0.35  # of plastics
ROUNDING = 1e-6  # lengths, of distances where they vanish
_WITHIN_LIMIT = (-np.inf, 1.0)


def bind(of: Declaration, i: int) -> None:
    """Hold a finger to what it bears at all knots at which it touches, also under the task's disturbances."""
    structure = of.structure
    c, n = structure.contacts[i], structure.joints[i]
    strength = structure.model.strength
    assert strength is not None

    def bind_at(block: str, knots: Knots, force: Rows) -> None:
        of.bind(
            knots,
            borne(n, type(structure.model.touched[c])),
            {"bearing": _WITHIN_LIMIT, "stress": _WITHIN_LIMIT, "deflection": _WITHIN_LIMIT},
            (c,),
            f"{block}{c}",
            **shape_at(of, i, knots),
            pose=of.pose.take(knots),
            point=of.point.entries(3 * i, 3 * i + 3, c).take(knots),
            force=force.entries(3 * i, 3 * i + 3, c),
            angles=of.angles[i].take(knots),
            **of.scene(c, knots),
            **of.of(c, knots, "frames"),
            **of.at(knots, *strength.parameters),
        )

    touching = np.flatnonzero(structure.touching[:, i])
    bind_at("borne", touching, of.force.take(touching))
    disturbed = np.flatnonzero(structure.active[of.disturbed, i])
    if len(disturbed):
        bind_at("disturbed_borne", of.disturbed[disturbed], of.force_disturbed.take(disturbed))


@cache
def borne(joints: int, kind: type[Body]) -> Kernel:
    """One finger that touches at one knot: ``bearing`` (n), ``stress`` (2n), ``deflection`` (1), squares over limits'.

    A link is a round bar from its joint to the next one, or to its end. At both ends of each, √(σ² + 3 τ²) with
    σ = N/(π r²) + 4 M/(π r³), τ = 2 T/(π r³); the end moves as M/(E I), T/(G J), N/(E A), I = π r⁴/4, add up.
    """
    kernel = Kernel("borne")
    symbols = free_morphology(kernel, joints)
    pose, point, force = kernel.variable("pose", 6), kernel.variable("point", 3), kernel.variable("force", 3)
    angles = kernel.variable("angles", joints)
    touch = Scene.declare(kernel, kind).touch(pose, point, angles, symbols)
    moment, stress, deflection, flexibility = (
        kernel.parameter(name) for name in ("bearing_moment", "link_stress", "tip_deflection", "flexibility")
    )
    finger, load = touch.placed, -ca.mtimes(touch.rotation, force)  # what the object presses the finger with

    def turning(at: SX) -> SX:
        return ca.cross(finger.contact - at, load)

    across, stresses, moved = [], [], SX.zeros(3, 1)
    for j, ((root, end), radius) in enumerate(zip(finger.ends, finger.radii, strict=True)):
        axis = ca.mtimes(finger.rotations[:, 3 * j : 3 * j + 3], symbols.axes[:, j])
        across.append(_across(turning(root), axis) / moment)
        length = norm(end - root, ROUNDING)
        along = (end - root) / length
        pulled = ca.dot(load, along)
        # Beyond the contact, which is on the last link, nothing bends it.
        loaded = length if j < joints - 1 else ca.fmax(ca.fmin(ca.dot(finger.contact - root, along), length), 0)
        for at in (root, root + loaded * along):
            bent, twisted = norm(_across(turning(at), along), ROUNDING), ca.dot(turning(at), along)
            normal = (norm(pulled, ROUNDING) * radius + 4 * bent) / (ca.pi * radius**3)
            stresses.append((normal**2 + 12 * (twisted / (ca.pi * radius**3)) ** 2) / stress**2)
        moved += loaded * pulled * along * flexibility / (4 * radius**2)
        for node in (-1.0, 1.0):  # Gauss's two points: exact, as curvature and arm are linear
            at = root + loaded / 2 * (1 + node / np.sqrt(3)) * along
            twist = ca.dot(turning(at), along) * along
            turn = (turning(at) + POISSON * twist) * flexibility / radius**4
            moved += loaded / 2 * ca.cross(turn, finger.tip - at)
    kernel.constrain(limits.BEARING, ca.vertcat(*[ca.sumsqr(each) for each in across]))
    kernel.constrain(limits.STRESS, ca.vertcat(*stresses))
    kernel.constrain(limits.DEFLECTION, ca.sumsqr(moved) / deflection**2)
    return kernel


def _across(vector: SX, axis: SX) -> SX:
    """The part (3,) of a vector across a unit axis."""
    return vector - ca.dot(vector, axis) * axis
