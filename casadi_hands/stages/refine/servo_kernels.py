"""The blocks of the refine stage that keep servos in the joints clear of all that they are not in."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np

from casadi_hands.geometry.bodies import Body, surfaces, width_of
from casadi_hands.motion import conjugate, rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Kernel, Rows
from casadi_hands.stages.refine.declaration import Declaration, Knots
from casadi_hands.stages.refine.finger_kernels import free_morphology
from casadi_hands.terms import clearance
from casadi_hands.terms import constraints as limits


@cache
def servos(joints: int, kinds: tuple[type[Body], ...], grounded: bool) -> Kernel:
    """One finger's servos clear of object, palm, ground and the rest of the finger at one time.

    Args:
        joints: of the finger.
        kinds: of the object's bodies.
        grounded: whether there is a ground.
    """
    kernel = Kernel("servos")
    symbols = free_morphology(kernel, joints)
    pose, angles = kernel.variable("pose", 6), kernel.variable("angles", joints)
    reference, palm_position, palm_quaternion = (
        kernel.parameter(n, k) for n, k in (("reference", 4), ("palm_position", 3), ("palm_quaternion", 4))
    )
    radius, servo, palm_radius, ground = (
        kernel.parameter(name) for name in ("radius", "servo_radius", "palm_radius", "ground_height")
    )
    bodies = surfaces(kinds, kernel.parameter("bodies", width_of(kinds)))
    position, quaternion = placed(pose, reference)
    to_palm = rotation_matrix(conjugate(palm_quaternion))
    rotation, center = ca.mtimes(to_palm, rotation_matrix(quaternion)), ca.mtimes(to_palm, position - palm_position)
    seen = [body.mapped(lambda point: ca.mtimes(rotation, point) + center) for body in bodies]
    ends = symbols.placed(angles, radius).ends
    up, height = (to_palm[:, 2] if grounded else None), ground - palm_position[2]
    apart = clearance.servos_and_rest(ends, radius, servo, palm_radius, seen, up, height)
    kernel.constrain(limits.CLEAR, apart)
    return kernel


@cache
def servos_apart(joints: int, other_joints: int) -> Kernel:
    """The servos of two fingers clear of each other and of each other's links at one time."""
    kernel = Kernel("servos_apart")
    first = free_morphology(kernel, joints, 0)
    angles = kernel.variable("angles0", joints, "angles", 0)
    second = free_morphology(kernel, other_joints, 1)
    other_angles = kernel.variable("angles1", other_joints, "angles", 1)
    radius, servo = kernel.parameter("radius"), kernel.parameter("servo_radius")
    ends = first.placed(angles, radius).ends, second.placed(other_angles, radius).ends
    kernel.constrain(limits.CLEAR_OF_EACH_OTHER, clearance.servos_and_finger(*ends, radius, servo))
    return kernel


def bind(of: Declaration) -> None:
    """Bind both at all knots."""
    structure, model, knots = of.structure, of.structure.model, np.arange(of.knots)
    bounds, names = {"clear": (model.clearance, np.inf)}, ("radius", "servo_radius")
    around = (*names, "reference", "palm_radius", "ground_height", "bodies", "palm_position", "palm_quaternion")
    for i, (c, n) in enumerate(zip(structure.contacts, structure.joints, strict=True)):
        shape = _shape(of, i, knots)
        of.bind(
            knots,
            servos(n, model.kinds, model.ground is not None),
            bounds,
            (c,),
            f"servos{c}",
            **shape,
            pose=of.pose,
            angles=of.angles[i],
            **of.at(knots, *around),
            **of.of(c, knots, "frames"),
        )
        for j in range(i):
            d, other = structure.contacts[j], _shape(of, j, knots)
            of.bind(
                knots,
                servos_apart(n, structure.joints[j]),
                bounds,
                (c, d),
                f"servos_apart{c}_{d}",
                **{name: (shape[name], other[name]) for name in shape},
                angles=[of.angles[i], of.angles[j]],
                frames=(of.problem[f"frames{c}"], of.problem[f"frames{d}"]),
                **{name: of.problem[name] for name in names},
            )


def _shape(of: Declaration, i: int, knots: Knots) -> dict[str, Rows]:
    """A finger's morphology, the same at all knots."""
    return {name: rows.constant(len(knots)) for name, rows in of.shape[i].items()}
