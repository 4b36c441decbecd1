"""Where a palm that the task places cannot have its fingers on the object: behind it, beyond reach, in each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.diagnosis.finding import WANDER, Finding, found, mm, numbers
from casadi_hands.diagnosis.moment import moment
from casadi_hands.kinematics import STAND
from casadi_hands.problem.model import Model, palm_from_world
from casadi_hands.task import Task
from casadi_hands.task.obstacles import depth_in_palm

Array = NDArray[np.float64]
_BESIDE = math.radians(75)  # from where fingers point; of 44 tasks that have hands none is beyond 21°


def place_findings(task: Task, model: Model) -> Iterator[Finding]:
    """What is wrong with where the palm stands at the goals; nothing where the program may move it."""
    if task.palm.may_move:
        return
    yield from _facing(task, model)
    yield from _beyond_reach(task, model)
    yield from _touches_beyond_reach(task, model)
    yield from _at_palm(task, model)


def _in_palm(task: Task, model: Model) -> Iterator[tuple[float, Array, Array]]:
    """Time (s) of every goal, and where the object is then: rotation (3, 3) and position (3,), lengths, palm frame."""
    for time, position, vector in task.goal_poses():
        turn, center = palm_from_world(model, time)
        yield time, turn @ pin.exp3(vector), turn @ (position / model.units.length - center)


def _facing(task: Task, model: Model) -> Iterator[Finding]:
    """The whole object is behind the palm's face at every goal, or behind its disc at one; or beside it."""
    places = []
    for time, turn, place in _in_palm(task, model):
        if model.tool is not None:
            top = float(turn[2] @ model.tool) + _radius_about_tool(task, model)
        else:
            top = max(float(np.max(body.support(turn[2]) @ turn[2])) + body.ball for body in model.bodies)
        places.append((place[2] + top, time, place))
    highest = [height for height, _, _ in places]
    points_to = f"fingers point to {numbers(task.palm.facing)} (palm.facing)"
    if max(highest) < 0:
        what = (
            f"the object is behind the palm at every goal, by {mm(model, -max(highest))} or more: {points_to}, and it "
            "is on the other side"
        )
        yield found(what, f"palm.facing {_towards(model, *places[0][1:])}")
        return
    if model.tool is not None:
        return
    for height, time, place in places:
        if height < 0:
            hidden = float(np.hypot(*place[:2])) < model.palm_radius
            what = f"the object is behind the palm at {moment(model.schedule, time)}, by {mm(model, -height)}"
            yield found(what, "a goal on the side where fingers point (palm.facing), or another palm.position", hidden)
            return
    angles = [float(np.arctan2(np.hypot(*place[:2]), place[2])) for _, _, place in places]
    if min(angles) > _BESIDE:
        what = f"the object is beside the palm at every goal: {points_to}, and it is {np.degrees(min(angles)):.0f}° off"
        yield found(what, f"palm.facing {_towards(model, *places[0][1:])}", certain=False)


def _towards(model: Model, time: float, place: Array) -> str:
    """The direction, world, from the palm to a place (3,) in its frame at a time."""
    away = palm_from_world(model, time)[0].T @ place
    return numbers([round(float(value), 2) for value in away / np.linalg.norm(away)])


def _reach(task: Task, model: Model) -> tuple[float, str]:
    """Lengths that a finger reaches from its first joint, and a clause that says of what."""
    joints, longest = task.search.max_joints, model.link_length[1]
    return joints * longest + model.tip_radius, f"a finger of {joints} links of at most {mm(model, longest)} each"


_NEARER = "a palm nearer by (palm.position), longer links (hand.link_length) or more of them (search.max_joints)"


def _beyond_reach(task: Task, model: Model) -> Iterator[Finding]:
    """The object's nearest point is farther from the palm than its longest finger reaches."""
    length, finger = _reach(task, model)
    reach = model.palm_radius + length
    distances = []
    for time, turn, place in _in_palm(task, model):
        if model.tool is not None:
            distance = float(np.linalg.norm(place + turn @ model.tool)) - _radius_about_tool(task, model)
        else:
            distance = min(body.signed_distance(-turn.T @ place) for body in model.bodies)
        distances.append((distance, time))
    distance, time = max(distances)
    if distance > reach:
        what = (
            f"the object is out of reach at {moment(model.schedule, time)}: it is {mm(model, distance)} from the "
            f"palm's centre, and {finger}, on the palm's rim, reaches {mm(model, reach)}"
        )
        yield found(what, _NEARER)


def _touches_beyond_reach(task: Task, model: Model) -> Iterator[Finding]:
    """A finger's contact is farther from the rim at the start than the finger reaches, wherever it may yet move."""
    if task.draws:
        return
    length, finger = _reach(task, model)
    standing = model.radii(task.search.max_joints)[0]
    time, turn, place = next(iter(_in_palm(task, model)))
    for name, point in zip(model.contact_names, model.patches, strict=False):
        x, y, z = place + turn @ point
        distance = float(np.hypot(np.hypot(x, y) - model.palm_radius, z - STAND * standing))
        nearest = min(body.signed_distance(-turn.T @ place) for body in model.bodies)
        if distance > length and nearest <= model.palm_radius + length:
            what = (
                f"finger '{name}' cannot reach its contact at {moment(model.schedule, time)}: that is "
                f"{mm(model, distance)} from the nearest place for its first joint on the palm's rim "
                f"(fingers.{name}.touches), and {finger} reaches {mm(model, length)}"
            )
            yield found(what, _NEARER, certain=distance - WANDER > length)


def _radius_about_tool(task: Task, model: Model) -> float:
    """Lengths from a drawing's tool, about which the object may turn, within which all of it is."""
    assert model.tool is not None
    farthest = np.linalg.norm(np.maximum(*np.abs(task.object.bounding_box))) / model.units.length
    return float(np.linalg.norm(model.tool) + farthest)


def _at_palm(task: Task, model: Model) -> Iterator[Finding]:
    """A goal is in the palm, or nearer to it than bodies may be that do not touch."""
    if task.draws:
        return
    room = math.sqrt(3) * model.goal_tolerance[0] * model.units.length
    gaps = []
    for time, place, turn in task.goal_poses():
        to_palm, center = palm_from_world(model, time)
        pose = (center * model.units.length, to_palm.T)
        gaps.append((-depth_in_palm(task.object, place, turn, task.palm, pose), time))
    gap, time = min(gaps)
    if gap + room < 0 and task.palm.motion:
        what = f"the object is {-1e3 * gap:.3g} mm inside the palm at {moment(model.schedule, time)}"
        yield found(what, "a palm (palm.motion) or a goal that is farther away")
    elif gap + room < task.hand.clearance:
        what = (
            f"the object is {1e3 * max(gap, 0.0):.3g} mm from the palm at {moment(model.schedule, time)}, and bodies "
            f"that do not touch keep {1e3 * task.hand.clearance:.3g} mm from each other (hand.clearance)"
        )
        yield found(what, "a goal farther from the palm, or less hand.clearance", certain=not task.palm.motion)
