"""What the loads of a task ask of the contacts at least, before any motion is known: statics at its samples.

The object stands on the straight way between the goals, the contacts are where the task puts them, friction's cones are
circumscribed, and a soft fingertip twists with all of its torsion whatever else it bears: the least is a little less
than what any motion needs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.motion import linear
from casadi_hands.problem.model import Model
from casadi_hands.statics.grasp import grasp_map, spread_forces
from casadi_hands.statics.programmes import least_largest_solution, nonnegative_fit

Array = NDArray[np.float64]
HELD = 0.05  # m·g and m·g·length of missing wrench, that the floating stage lets pass too
USUAL_FORCE = 20.0  # m·g
_ROOM = 4.0  # of the usual limit over the least: half for friction's margin, half for a squeeze
_EDGES = 32  # of a circumscribed cone, which is wider than friction by 0.5 % at most
_NEAR = 0.1  # lengths above the ground, within which it may still carry


@dataclass(frozen=True)
class Load:
    """What acts on the object at a time, and what the contacts must bear for it.

    Attributes:
        time: s.
        force: (3,) m·g, world, that acts besides gravity.
        torque: (3,) m·g·length, world.
        contact: index of the one that bears the largest component of a force.
        least: the least that this component can be, m·g.
    """

    time: float
    force: Array
    torque: Array
    contact: int
    least: float


def hardest_load(model: Model, enough: float) -> Load | None:
    """The load for which the largest component of a contact force, in the object's frame, must be largest.

    Loads that the contacts cannot bear however they press, where the task puts them, are left out: another place may.

    Args:
        model: the task.
        enough: m·g; what can be borne with this is not looked at any closer.

    Returns:
        The load; None if ``enough`` is enough.
    """
    hardest = None
    for time, force, torque, forces, wrenches, needed in _balances(model):
        edges, missing = nonnegative_fit(wrenches, needed)
        if missing > HELD or np.abs(forces @ edges).max() <= enough:
            continue
        least = least_largest_solution(forces, wrenches, wrenches @ edges)
        borne = np.abs(forces @ (edges if least is None else least))
        if borne.max() > max(enough, hardest.least if hardest else 0.0):
            hardest = Load(time, force, torque, int(borne.argmax()) // 3, float(borne.max()))
    return hardest


def usual_force_limit(model: Model) -> float:
    """Limit of a contact force's components, m·g, for a task that gives none; in whole weights."""
    load = hardest_load(model, USUAL_FORCE / _ROOM)
    return USUAL_FORCE if load is None else float(math.ceil(_ROOM * load.least - 1e-6))


@dataclass(frozen=True)
class Acting:
    """What acts on the object at a sample, where it stands on the straight way between the goals.

    Attributes:
        sample: index.
        disturbed: whether a disturbance of the task is at work.
        force: (3,) m·g, world, besides gravity.
        torque: (3,) m·g·length, world.
        turn: (3, 3) world <- object.
        needed: (6,) wrench that contacts must make, object frame; of an attached object along its joint, (1,).
        grounded: whether the ground may carry.
    """

    sample: int
    disturbed: bool
    force: Array
    torque: Array
    turn: Array
    needed: Array
    grounded: bool


def acting(model: Model) -> Iterator[Acting]:
    """What acts on the object at the samples, with and without the task's disturbances; what comes twice once."""
    schedule, seen = model.schedule, set()
    ways = linear(schedule.keyframes[list(schedule.goals)], schedule.samples)
    # Goals first, so that what is the same at one and on the way to it is told of the goal.
    order = [*schedule.goal_samples, *range(len(ways))]
    reference, resisted = pin.Quaternion(*model.reference).matrix(), _resisted(model, ways)
    for scenario in model.scenarios:
        for k in order:
            turn = pin.exp3(ways[k] @ model.goal_vectors) @ reference
            force, torque = scenario.force[k], scenario.torque[k]
            needed = -np.concatenate([turn.T @ (model.gravity + force), turn.T @ torque])
            needed = model.unborne(needed) + resisted[k]
            place = ways[k] @ model.goal_positions - (0.0 if model.tool is None else turn @ model.tool)
            grounded = model.ground is not None and bool((place + turn @ model.patches[-1])[2] <= model.ground + _NEAR)
            # The ground's own normal, and how the object stands on it, change with the turn.
            key = (*np.round(needed, 9), *(np.round(turn[2], 9) if grounded else ()))
            if key not in seen:
                seen.add(key)
                yield Acting(k, bool(np.any(force) or np.any(torque)), force, torque, turn, needed, grounded)


def cones(points: Array, normals: Array, friction: Array, torsion: float, fingers: int) -> tuple[Array, Array]:
    """Forces (3C, E) and wrenches (6, E) by edge of the circumscribed cones of contacts; the first are of fingers."""
    forces = spread_forces(normals, friction / math.cos(math.pi / _EDGES), _EDGES)
    wrenches = grasp_map(points) @ forces
    if not torsion:
        return forces, wrenches
    # Each edge twice, with all of its contact's torsion one way and the other.
    twist = np.zeros_like(wrenches)
    twist[3:, : fingers * _EDGES] = torsion * np.repeat(normals[:fingers], _EDGES, axis=0).T
    return np.tile(forces, (1, 2)), np.hstack([wrenches - twist, wrenches + twist])


def _balances(model: Model) -> Iterator[tuple[float, Array, Array, Array, Array, Array]]:
    """Time, force and torque from outside, forces and wrenches by edge, and the wrench that contacts must make.

    Forces (3C, E), wrenches (6, E) and the wrench (6,) in the object's frame; what comes twice is given once.
    """
    points = model.patches
    normals = inward_normals(points, model.touched)
    for each in acting(model):
        normals[model.contacts :] = each.turn[2]
        count = model.contacts + each.grounded
        forces, wrenches = cones(
            points[:count], normals[:count], model.frictions[:count], model.torsion, model.contacts
        )
        wrenches = model.unborne(wrenches)
        yield float(model.schedule.samples[each.sample]), each.force, each.torque, forces, wrenches, each.needed


def _resisted(model: Model, ways: Array) -> Array:
    """What spring and friction of a joint ask for (S, 1), with weights (S, G) of the goals; 0 of a free object."""
    if model.attachment is None:
        return np.zeros((len(ways), 1))
    joint, coordinates = model.attachment, ways @ model.attachment.goals
    ahead = np.sign(np.round(np.gradient(coordinates), 12))
    return np.asarray((joint.stiffness * coordinates + joint.friction * ahead)[:, None])
