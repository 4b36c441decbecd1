"""Fingertips that have no room where the task has them touch: in each other, the ground, the palm or the object."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import combinations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.diagnosis.finding import Finding, found, mm
from casadi_hands.diagnosis.patches import nearby
from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.problem.model import Model, palm_from_world
from casadi_hands.task import Task
from casadi_hands.task.obstacles import distance_from_disc

Array = NDArray[np.float64]
APART = 0.75
"""Of a fingertip's diameter: stages move contacts apart that overlap by less."""
_ROOM = 0.25  # of a link's radius: depths below that are made up for by a little shift of the contact
_AROUND = math.radians(135)  # between a contact's outward normal and the way back to the palm


def fingertip_findings(task: Task, model: Model) -> Iterator[Finding]:
    """What is wrong with the room of fingertips at the start, where the fingers of a palm touch the object."""
    normals = -inward_normals(model.patches, model.touched)[: model.contacts]
    points = model.patches[: model.contacts]
    yield from _overlap(model, points, normals)
    if task.draws:
        return
    _, position, vector = task.goal_poses()[0]
    turn, place = pin.exp3(vector), position / model.units.length
    depths = [_depth(task, model, turn, place, *touch) for touch in zip(points, normals, strict=True)]
    index = max(range(len(points)), key=lambda i: depths[i][0])
    (depth, where), name = depths[index], model.contact_names[index]
    if depth > _ROOM * model.tip_radius:
        near = zip(*nearby(model, points[index]), strict=True)
        free = any(_depth(task, model, turn, place, *touch)[0] < _ROOM * model.tip_radius for touch in near)
        what = (
            f"the fingertip of '{name}', {mm(model, model.tip_radius)} in radius ({_field(model)}), is "
            f"{mm(model, depth)} inside {where} at the start, where it touches the object (fingers.{name}.touches)"
        )
        advice = f"a contact with room for a fingertip, or thinner {_what(model)} ({_field(model)})"
        yield found(what, advice, certain=not free)
    if not task.palm.may_move:
        yield from _around(model, turn, normals)


def _field(model: Model) -> str:
    """The task's field that makes fingertips as thick as they are."""
    return "fingertip.radius" if model.tip_radius > model.link_radius else "hand.link_radius"


def _what(model: Model) -> str:
    """What is as thick as a fingertip."""
    return "fingertips" if model.tip_radius > model.link_radius else "links"


def _overlap(model: Model, points: Array, normals: Array) -> Iterator[Finding]:
    """Two fingertips at their contacts (C, 3) are in each other; of several pairs the closest."""
    closest = in_each_other(model, points, normals)
    if closest is None:
        return
    i, j, apart = closest
    wide, (first, second) = 2 * model.tip_radius, (model.contact_names[k] for k in (i, j))
    what = (
        f"the fingertips of '{first}' and '{second}' overlap by {mm(model, wide - apart)} where they touch the object "
        f"(fingers.{second}.touches): their centres are {mm(model, apart)} apart, and {_what(model)} are "
        f"{mm(model, wide)} thick (2 × {_field(model)})"
    )
    radius = 0.49 * float(np.linalg.norm(points[i] - points[j])) * model.units.length
    field = _field(model)
    if model.tip_radius > model.link_radius > radius / model.units.length:
        field += " and hand.link_radius"
    yield found(what, f"contacts farther apart, or {field} below {radius:.3g}", certain=apart < APART * wide)


def in_each_other(model: Model, points: Array, normals: Array) -> tuple[int, int, float] | None:
    """The two fingertips that are deepest in each other at contacts (C, 3), and how far apart; None where none are.

    Args:
        model: gives their radius.
        points: of the contacts, object frame.
        normals: outward.
    """
    tips = points + model.tip_radius * normals
    pairs = [(float(np.linalg.norm(tips[i] - tips[j])), i, j) for i, j in combinations(range(len(tips)), 2)]
    apart, i, j = min(pairs, default=(math.inf, 0, 0))
    return (i, j, apart) if apart < 2 * model.tip_radius else None


def _depth(task: Task, model: Model, turn: Array, place: Array, point: Array, normal: Array) -> tuple[float, str]:
    """How deep a fingertip at a contact is in what it must not be in, lengths, and what that is."""
    radius = model.tip_radius
    center = point + radius * normal
    depths = [(radius - min(body.signed_distance(center) for body in model.bodies), "the object")]
    world = place + turn @ center
    if model.ground is not None:
        depths.append((radius - (float(world[2]) - model.ground), "the ground"))
    if not task.palm.may_move:
        to_palm, palm = palm_from_world(model, 0.0)
        seen, thickness = to_palm @ (world - palm), task.palm.thickness / model.units.length
        distance = float(distance_from_disc(seen[None], model.palm_radius, thickness)[0])
        depths.append((radius - distance, "the palm"))
    return max(depths)


def _around(model: Model, turn: Array, normals: Array) -> Iterator[Finding]:
    """A contact on the far side of the object, seen from the palm; of several the one farthest around."""
    facing = palm_from_world(model, 0.0)[0][2]
    angles = [math.acos(float(np.clip(-(turn @ normal) @ facing, -1, 1))) for normal in normals]
    name, angle = model.contact_names[int(np.argmax(angles))], max(angles)
    if angle > _AROUND:
        what = (
            f"finger '{name}' touches the side of the object that is away from the palm, {math.degrees(angle):.0f}° "
            f"around (fingers.{name}.touches): it must reach around the object and press back toward the palm"
        )
        yield found(what, "a contact on the object's flank, or a palm at another side (palm.position)", certain=False)
