"""Statics that no optimiser took part in: what normal forces, friction and torque holding the object takes.

The forces that a grasp's friction cones allow are a cone of eight edges a contact (``statics.grasp``), so each question
is a least-squares fit or a linear programme at each keyframe or sample.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import compress

import casadi as ca
import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.kinematics import finger_kinematics
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.loads import HELD, hardest_load
from casadi_hands.problem.model import Model
from casadi_hands.problem.result import Result
from casadi_hands.stages.floating.gate import needed_wrenches
from casadi_hands.statics.grasp import grasp_map, spread_forces, torsion_edges
from casadi_hands.statics.joints import structural_projector
from casadi_hands.statics.programmes import least_largest, least_largest_solution, nonnegative_fit
from casadi_hands.terms.finger import NULL_SPACE_DAMPING

Array = NDArray[np.float64]
MOST_NORMAL_FORCE = (
    2.0  # m·g, the firmest holding that a refinement asks for; where more is needed, friction is too low
)
MOST_FRICTION = 4.0  # beyond that of any fingertip
_SPARE = 1e-6  # by which the second of two linear programmes may miss the optimum of the first


@dataclass(frozen=True)
class Holding:
    """What holding the object takes at a keyframe.

    Attributes:
        missing: (6,) wrench that the contacts cannot make, m·g and m·g·length, object frame; of an attached object what
            they cannot make along its joint, (1,).
        hardest: the least that the hardest-pressed contact must press with to make the rest, m·g.
    """

    missing: Array
    hardest: float

    @property
    def held(self) -> bool:
        """Whether the contacts can make the wrench."""
        return float(np.linalg.norm(self.missing)) <= HELD


def holdings(model: Model, floating: Floating, friction: float | None = None) -> tuple[Holding, ...]:
    """What holding the object takes at each keyframe of a floating motion.

    Args:
        model: the task.
        floating: the motion, with its contact points and flags.
        friction: of fingertips and object, in place of the task's; the ground keeps its own.
    """
    mu = model.frictions
    if friction is not None:
        mu[: model.contacts] = friction
    found = []
    for needed, points, active in zip(
        needed_wrenches(model, floating.pose), floating.point, floating.active, strict=True
    ):
        normals = inward_normals(points[active], list(compress(model.touched, active)))
        forces = spread_forces(normals, mu[active])
        fingers = int(active[: model.contacts].sum())
        twists = torsion_edges(points[active][:fingers], normals[:fingers], model.torsion)
        wrenches = model.unborne(np.hstack([grasp_map(points[active]) @ forces, twists]))
        made = wrenches @ nonnegative_fit(wrenches, needed)[0]
        # Normal forces: every edge has one of unit length.
        count = int(active.sum())
        each = np.kron(np.eye(count), np.ones(forces.shape[1] // count))
        normal = np.hstack([each, np.tile(np.eye(count, fingers), twists.shape[1] // max(fingers, 1))])
        found.append(Holding(needed - made, least_largest(normal, wrenches, made)))
    return tuple(found)


def firmest(model: Model) -> float:
    """The normal force, m·g, beyond which holding the object is hard, beside what the task's disturbances ask for."""
    if model.attachment is not None or model.exerted:  # what is to be moved or pressed has little to do with its weight
        return model.force_limit
    still, pushed = (
        0.0 if load is None else load.least
        for load in (hardest_load(each, 0.0) for each in (replace(model, scenarios=model.scenarios[:1]), model))
    )
    return max(MOST_NORMAL_FORCE, pushed - still) if model.disturbance else MOST_NORMAL_FORCE


def least_friction(model: Model, floating: Floating) -> float | None:
    """The least friction with which the contacts hold the object at all keyframes, within ``firmest``.

    Found by bisection, to a hundredth of itself; None if no friction up to ``MOST_FRICTION`` would do.
    """
    most = firmest(model)

    def enough(friction: float) -> bool:
        return all(holding.held and holding.hardest <= most for holding in holdings(model, floating, friction))

    low, high = 0.0, MOST_FRICTION
    if not enough(high):
        return None
    while high - low > 0.01 * high:
        middle = (low + high) / 2
        low, high = (low, middle) if enough(middle) else (middle, high)
    return high


@dataclass(frozen=True)
class Load:
    """The hardest moment for the motors of a hand.

    Attributes:
        torque: that its most loaded joint must give at least, N·m.
        finger: index of its finger.
        joint: index of the joint in the finger.
        time: s.
    """

    torque: float
    finger: int
    joint: int
    time: float


def least_torque(model: Model, design: Result) -> Load | None:
    """What holding the object as in a motion takes of the motors at least, however the contacts share it.

    At each sample the forces may be any in the friction cones that make the motion's wrench, as long as the joints
    supply them up to what the task's ``limits.unsupplied_force`` allows, or as far as this hand can. Of these the
    largest joint torque is made least.

    Args:
        model: the task.
        design: with a hand and a motion.

    Returns:
        The sample where this is most; None if forces in the cones make the wrench at no sample.
    """
    motion = design.motion
    if design.hand is None or motion is None:
        return None
    loads = [_load(model, design, sample) for sample in range(len(motion.time))]
    return max((load for load in loads if load is not None), key=lambda load: load.torque, default=None)


def _load(model: Model, design: Result, k: int) -> Load | None:
    """The load at one sample; None if the contacts cannot make the wrench, or there are none of fingers."""
    hand, motion = design.hand, design.motion
    assert hand is not None
    assert motion is not None
    names = list(motion.contact_names)
    chosen = [(i, names.index(finger.name)) for i, finger in enumerate(hand.fingers)]
    chosen = [(i, c) for i, c in chosen if motion.contact_active[k, c]]
    if not chosen:
        return None
    turn, palm = (
        Rotation.from_quat(q[k], scalar_first=True).as_matrix()
        for q in (motion.object_orientation, motion.base_orientation)
    )
    contacts = [c for _, c in chosen]
    points = motion.contact_point_object[k, contacts] / model.units.length
    normals = inward_normals(points, [model.touched[c] for c in contacts])
    forces = spread_forces(normals, np.full(len(contacts), model.friction))
    wrenches = model.unborne(grasp_map(points) @ forces)
    planned = (motion.contact_force[k, contacts] @ turn / model.units.force).reshape(-1)
    needed = model.unborne(grasp_map(points) @ planned)
    made = wrenches @ nonnegative_fit(wrenches, needed)[0]
    if np.linalg.norm(needed - made) > HELD:
        return None
    torques, structural, joints = [], [], []
    for place, (i, c) in enumerate(chosen):
        jacobian = _jacobian(design, i, k, c) / model.units.length
        in_palm = palm.T @ turn @ forces[3 * place : 3 * place + 3]
        torques.append(jacobian.T @ in_palm)
        structural.append(structural_projector(jacobian, NULL_SPACE_DAMPING) @ in_palm)
        joints += [(i, j) for j in range(jacobian.shape[1])]
    borne = np.vstack(structural)
    allowed = max(least_largest(borne, wrenches, made) + _SPARE, design.task.limits.unsupplied_force)
    rows = np.vstack(torques)
    edges = least_largest_solution(rows, wrenches, made, borne, allowed)
    if edges is None:
        return None
    loads = np.abs(rows @ edges)
    most = int(loads.argmax())
    return Load(float(loads[most]) * model.units.torque, *joints[most], float(motion.time[k]))


def _jacobian(design: Result, finger: int, sample: int, contact: int) -> Array:
    """(3, n) of a finger's contact at a sample, palm frame, m/rad."""
    hand, motion = design.hand, design.motion
    assert hand is not None
    assert motion is not None
    links = hand.fingers[finger].links
    columns = [motion.joint_names.index(f"finger{finger}_joint{j}") for j in range(len(links))]
    axes, lengths = np.array([link.axis for link in links]).T, [link.length for link in links]
    *_, jacobian = finger_kinematics(len(links))(
        ca.DM(hand.fingers[finger].base),
        np.hstack([link.turn.as_matrix() for link in links]),
        axes,
        lengths,
        motion.joint_angles[sample, columns],
        motion.contact_point_link[sample, contact],
    )
    return np.asarray(jacobian)
