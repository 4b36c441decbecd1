"""A checked task brought to the form the program works on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from casadi_hands.geometry.bodies import Body
from casadi_hands.task.fields import Vector, vector
from casadi_hands.task.motion import Goal
from casadi_hands.task.object import ManipulatedObject
from casadi_hands.task.on_joint import placed
from casadi_hands.task.problem import Problem
from casadi_hands.task.task import Task

Array = NDArray[np.float64]
# Share of the characteristic length within which a contact is moved onto the surface without a word.
CONTACT_TOLERANCE = 0.2
# The same within which contacts that were moved are in one place.
_TOGETHER = 1e-3
# Of the characteristic length; shorter lengths are rounding: nothing is moved for them, so that normalising a task
# twice, or saving and loading it, leaves it equal to the last digit.
_ROUNDING = 1e-12
_OFF = 1e-6  # of the characteristic length, within which a point is on a surface
_SMOOTH = np.cos(np.radians(20))  # of the angle between faces that go on in one another
_AWAY, _WAYS = (1e-3, 2e-3, 5e-3, 0.01, 0.02, 0.05, 0.1), 24  # of it, and in how many directions: looked at for a face


def normalise(task: Task) -> tuple[Task, list[Problem]]:
    """Move contacts onto the object's surface and the object frame to the centre of mass.

    Returns:
        The task, and what is wrong with its contacts; the task is unchanged if anything is.
    """
    problems: list[Problem] = []
    fingers, ground = {}, task.ground
    for name, finger in task.fingers.items():
        if not finger.is_placed:
            fingers[name] = finger
            continue
        path: tuple[str | int, ...] = "fingers", name
        fingers[name] = finger.touching(
            _snap(point, task.object, (*path, *(("regrasps", n - 1) if n else ()), "touches"), problems)
            for n, point in enumerate(finger.points)
        )
    problems += (
        []
        if problems
        else _together(task, {name: finger.point for name, finger in fingers.items() if finger.is_placed})
    )
    if ground:
        snapped = _snap(ground.touches, task.object, ("ground", "touches"), problems)
        ground = ground.model_copy(update={"touches": snapped})
    if problems:
        return task, problems
    return _recentre(task.model_copy(update={"fingers": fingers, "ground": ground})), []


def _snap(point: Vector, body: ManipulatedObject, path: tuple[str | int, ...], problems: list[Problem]) -> Vector:
    """Nearest point of the surface of the nearest primitive, (3,) m; a problem if that is no contact."""
    start = np.array(point)
    distances = [abs(shape.body.signed_distance(start)) for shape in body.shapes]
    nearest = int(np.argmin(distances))
    shape, distance = body.shapes[nearest], distances[nearest]
    given, size = f"{list(point)}", body.characteristic_length
    tolerance = CONTACT_TOLERANCE * size
    if distance > tolerance:
        allowed = f"a point within {tolerance:.3g} m of the object's surface; this one is {distance:.3g} m from it"
        problems.append(Problem(path, given, allowed))
        return point
    if not shape.body.has_normal(start):
        problems.append(
            Problem(path, given, "a point off the axis or middle of its primitive, so that one side is nearest")
        )
        return point
    snapped = start if distance <= _ROUNDING * size else shape.body.on_surface(start)
    for number, other in enumerate(body.shapes):
        if other is not shape and other.body.signed_distance(snapped) < -_OFF * size:
            allowed = f"a point on the outside of the object; this one lies inside object.shapes[{number}]"
            problems.append(Problem(path, given, allowed))
            return point
    others = [other.body for other in body.shapes if other is not shape]
    return vector(_off_seam(snapped, shape.body, others, size))


def _off_seam(point: Array, body: Body, others: Sequence[Body], size: float) -> Array:
    """A point (3,) or, where it is next to an edge beyond which another body's surface goes on, one off that edge.

    Convex parts of a mesh meet in such seams: edges of the parts, and none of the object.

    Args:
        point: on the surface of a body.
        body: whose.
        others: of the object.
        size: characteristic length, m.
    """
    normals, most = body.face(point)
    if np.all(normals @ point <= most):
        return point
    across = np.linalg.svd(body.outward(point)[None])[2][1:]
    turns = 2 * np.pi * np.arange(_WAYS) / _WAYS
    directions = np.column_stack([np.cos(turns), np.sin(turns)]) @ across
    for way in _AWAY:
        found = [(_flush(point, way * size * each, body, others, size), k) for k, each in enumerate(directions)]
        best, k = max(found, key=lambda each: each[0])
        if best > _SMOOTH:
            return body.on_surface(point + way * size * directions[k])
    return point


def _flush(point: Array, step: Array, body: Body, others: Sequence[Body], size: float) -> float:
    """How well another body goes on where a body's face ends, the cosine between their normals; -1 where none does.

    Args:
        point: (3,) next to the edge.
        step: (3,) to the face; the other body is on the other side.
        body: with the edge.
        others: of the object.
        size: characteristic length, m.
    """
    at = body.on_surface(point + step)
    normals, most = body.face(at)
    off = [abs(body.signed_distance(at)), *(-other.signed_distance(at) for other in others)]
    if max(off) > _OFF * size or np.any(normals @ at > most):
        return -1.0
    # Along the face as far beyond the edge, and twice as far, since the other's own edge is round, too.
    normal, back = body.outward(at), point - at
    along = back - (back @ normal) * normal
    beyond = [(other, at + share * along) for other in others for share in (2, 3)]
    found = [(other, there, other.on_surface(there)) for other, there in beyond]
    near = [(other, on) for other, there, on in found if np.linalg.norm(on - there) < np.linalg.norm(along)]
    return max((float(other.outward(on) @ normal) for other, on in near), default=-1.0)


def _together(task: Task, moved: dict[str, Vector]) -> Iterator[Problem]:
    """Contacts that were apart as given, and are in one place on the surface."""
    names, room = list(moved), _TOGETHER * task.object.characteristic_length
    for number, name in enumerate(names):
        for other in names[:number]:
            if np.linalg.norm(np.subtract(moved[name], moved[other])) < room:
                given = f"{list(task.fingers[name].point)}"
                allowed = f"a point whose nearest one on the surface, {list(moved[name])}, is not that of {other}"
                yield Problem(("fingers", name, "touches"), given, allowed)


def _recentre(task: Task) -> Task:
    """The same task with the object frame's origin at the centre of mass."""
    body = task.object
    center = np.array(body.center_of_mass)
    origin = (0.0, 0.0, 0.0)
    if not center.any():
        return task
    if np.abs(center).max() <= _ROUNDING * body.characteristic_length:
        return task.model_copy(update={"object": body.model_copy(update={"center_of_mass": origin})})

    def shift(point: Vector) -> Vector:
        return vector(np.array(point) - center)

    def shift_goal(goal: Goal) -> Goal:
        if goal.position is None:
            return goal
        return goal.model_copy(update={"position": vector(np.array(goal.position) + goal.rotation.matrix @ center)})

    moved = {
        "shapes": tuple(shape.moved(-center) for shape in body.shapes),
        "meshes": body.meshes and tuple(mesh.moved(-center) for mesh in body.meshes),
        "center_of_mass": origin,
        "attached": body.attached and body.attached.moved(-center),
    }
    body = body.model_copy(update=moved)
    return task.model_copy(
        update={
            "object": body,
            "fingers": {
                name: (
                    finger.touching(map(shift, finger.points)).model_copy(
                        update={"placed": finger.placed and finger.placed.shifted(-center)}
                    )
                    if finger.is_placed
                    else finger.model_copy(update={"touches": finger.touches.shifted(-center)})
                )
                for name, finger in task.fingers.items()
            },
            "ground": task.ground and task.ground.model_copy(update={"touches": shift(task.ground.touches)}),
            "tool": task.tool and shift(task.tool),
            "motion": placed(tuple(shift_goal(goal) for goal in task.motion), body),
        }
    )
