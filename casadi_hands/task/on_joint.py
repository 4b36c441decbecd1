"""Goals of an object that a joint holds to the world: from coordinates to poses, and back."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from casadi_hands.task.attached import Joint
from casadi_hands.task.fields import refuse, vector
from casadi_hands.task.motion import Goal
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.problem import Problem
from casadi_hands.task.rotation import LARGEST_TURN, rotation_matrix

# Of the characteristic length, and rad: what poses typed by hand may be off their joint.
_OFF, _TILTED = 1e-3, 1e-3


def placed(goals: tuple[Goal, ...], body: ManipulatedObject | None) -> tuple[Goal, ...]:
    """Goals with the poses that follow from their angles or distances.

    Raises:
        PydanticCustomError: there are such goals without the joint that they are of, or no pose to count from.
    """
    if not any(goal.on_joint for goal in goals):
        return goals
    if body is None:  # which is refused for reasons of its own
        return goals
    first = goals[0]
    if body.attached is None:
        raise refuse("goals by position and rotation; angle and distance are of objects that are `attached`")
    if first.position is None:
        raise refuse("a first goal with a position: it says where the object is when its joint is at 0")
    joint = body.attached.joint
    name = "angle" if joint.turns else "distance"
    if any(goal.on_joint and getattr(goal, name) is None for goal in goals):
        raise refuse(f"goals by {name}: the object is attached by a {body.attached.kind}")
    found = [first]
    for goal in goals[1:]:
        if goal.on_joint:
            place, turn = joint.displaced(np.array(first.position), first.rotation, _given(goal))
            goal = goal.model_copy(update={"position": vector(place), "rotation": turn})
        found.append(goal)
    return tuple(found)


def _given(goal: Goal) -> float:
    """The coordinate, rad or m, that a goal states."""
    return goal.distance if goal.distance is not None else float(np.radians(goal.angle or 0.0))


def coordinates(joint: Joint, goals: tuple[Goal, ...], turns: np.ndarray) -> np.ndarray:
    """Coordinates (G,) of the joint at the goals, rad or m.

    Args:
        joint: the object's.
        goals: with poses.
        turns: (G, 3) rad, world, of the object at every goal from its orientation at the first one.
    """
    axis, first = goals[0].rotation.matrix @ joint.direction, np.array(goals[0].position)
    measured = turns @ axis if joint.turns else np.array([(np.array(goal.position) - first) @ axis for goal in goals])
    return np.array([_given(g) if g.on_joint else q for g, q in zip(goals, measured, strict=True)])


def joint_problems(body: ManipulatedObject, goals: tuple[Goal, ...], turns: np.ndarray) -> Iterator[Problem]:
    """Goals that the joint cannot reach."""
    assert body.attached is not None
    joint, first = body.attached.joint, goals[0]
    for number, (goal, q) in enumerate(zip(goals, coordinates(joint, goals, turns), strict=True)):
        name = "angle" if goal.on_joint else "rotation"
        if joint.turns and abs(np.degrees(q)) > LARGEST_TURN * (1 + 1e-6):
            allowed = f"a turn of at most ±{LARGEST_TURN:g}° from the first goal"
            yield Problem(("motion", number, name), f"{np.degrees(q):.4g} degrees", allowed)
        if goal.on_joint:
            continue
        place, turn = joint.displaced(np.array(first.position), first.rotation, float(q))
        off = float(np.linalg.norm(place - np.array(goal.position)))
        apart = rotation_matrix(goal.rotation.vector).T @ turn.matrix
        tilted = float(np.arccos(np.clip((np.trace(apart) - 1) / 2, -1, 1)))
        if off > _OFF * body.characteristic_length or tilted > _TILTED:
            which = "distance" if not joint.turns else "angle"
            allowed = (
                f"a pose that the {body.attached.kind} lets the object reach; this one is {off:.3g} m and "
                f"{np.degrees(tilted):.3g}° off it (or give its {which} instead)"
            )
            yield Problem(("motion", number, "position"), str(list(goal.position or ())), allowed)


def resisting_force(body: ManipulatedObject, goals: tuple[Goal, ...], turns: np.ndarray) -> float:
    """The largest force, N, with which joint and world resist the object at its goals; 0 of a free one.

    Torques count as forces at the characteristic length, and so does what they resist together.

    Args:
        body: the object.
        goals: with poses.
        turns: (G, 3) rad, world, of the object at every goal from its orientation at the first one.
    """
    length, most = body.characteristic_length, 0.0
    for goal in goals:
        if goal.exert is not None:
            force, torque = (float(np.linalg.norm(each)) for each in (goal.exert.force, goal.exert.torque))
            most = max(most, force, torque / length)
    if body.attached is None:
        return most
    joint = body.attached.joint
    spring = joint.stiffness * float(np.abs(coordinates(joint, goals, turns)).max())
    return max(most, (joint.friction + spring) / (length if joint.turns else 1.0))
