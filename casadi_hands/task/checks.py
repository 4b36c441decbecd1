"""What a task's sections must be to each other."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from casadi_hands.task.obstacles import depth_below, depth_in_palm, palm_depth_below
from casadi_hands.task.on_joint import joint_problems
from casadi_hands.task.problem import Problem
from casadi_hands.task.region import Region
from casadi_hands.task.regrasps import regrasp_problems
from casadi_hands.task.rotation import LARGEST_TURN, WIDEST_TURN
from casadi_hands.task.task import Task
from casadi_hands.task.units import wrong_units

# Depths below this share of the characteristic length are the rounding of numbers typed by hand.
_TYPED = 1e-3
_NAMELESS = "the name of one of object.shapes, and none has any: give it one, as in `sphere: {..., name: knob}`"
# rad/s: what swings faster on its joint's spring is over before a simulation's time step is.
_QUICKEST = 500.0


def check(task: Task) -> list[Problem]:
    """Find what contradicts itself in a task whose fields are each valid."""
    units = list(wrong_units(task))
    if units:  # what follows from them is no second mistake
        return units
    timing = list(_goal_times(task)) + list(_goal_kinds(task)) + list(_other_times(task)) + list(_attached(task))
    timing = timing or list(regrasp_problems(task))
    # Where things stand at the goals says nothing while the goals themselves are in doubt.
    places = [] if timing else list(_turns(task)) + list(_object_places(task)) + list(_palm_places(task))
    places += list(_keep_out(task))
    return timing + places + list(_contacts(task)) + list(_object_points(task)) + list(_fingertips(task))


def _goal_times(task: Task) -> Iterator[Problem]:
    times = [goal.at for goal in task.motion]
    if times[0] != 0:
        yield Problem(("motion", 0, "at"), f"{times[0]:g}", "0: the first goal is where the motion starts")
    shortest = (task.keyframes_between + 1) * task.time_step
    for number, (before, time) in enumerate(pairwise(times), start=1):
        path = ("motion", number, "at")
        if time <= before:
            yield Problem(path, f"{time:g}", f"a time later than that of the goal before, {before:g} s")
        elif time - before < shortest * (1 - 1e-9):
            allowed = f"goals at least {shortest:g} s apart: (keyframes_between + 1) × time_step"
            yield Problem(path, f"{time:g}", allowed)
        if time > task.duration:
            yield Problem(path, f"{time:g}", f"a time within the duration, {task.duration:g} s")


def _goal_kinds(task: Task) -> Iterator[Problem]:
    for number, goal in enumerate(task.motion):
        if goal.tool_at is not None and not task.draws:
            allowed = "goals by position and rotation; to draw, also give `tool`, the point of the object that draws"
            yield Problem(("motion", number, "tool_at"), f"{list(goal.tool_at)} without a tool", allowed)
        if goal.tool_at is None and task.draws:
            allowed = "tool_at in every goal, since `tool` makes this a drawing task"
            yield Problem(("motion", number, "position"), "a pose", allowed)


def _other_times(task: Task) -> Iterator[Problem]:
    before = 0.0
    for number, waypoint in enumerate(task.palm.motion or ()):
        path = ("palm", "motion", number, "at")
        if waypoint.at <= before:
            yield Problem(path, f"{waypoint.at:g}", f"a time later than that of the waypoint before, {before:g} s")
        if waypoint.at > task.duration:
            yield Problem(path, f"{waypoint.at:g}", f"a time within the duration, {task.duration:g} s")
        before = waypoint.at
    for number, perturbation in enumerate(task.perturbations):
        if perturbation.end > task.duration:
            allowed = f"a time within the duration, {task.duration:g} s"
            yield Problem(("perturbations", number, "to"), f"{perturbation.end:g}", allowed)


def _attached(task: Task) -> Iterator[Problem]:
    """What a joint to the world does not go with."""
    if task.motion[0].exert is not None:
        allowed = "exert of a later goal: it acts on the way there from the goal before"
        yield Problem(("motion", 0, "exert"), "exert of the first goal", allowed)
    held = task.object.attached
    if held is None:
        return
    path = ("object", "attached")
    if task.draws:
        yield Problem(("tool",), f"a tool of an object on a {held.kind}", "goals of the joint: an angle or a distance")
        return
    if task.palm.motion or task.palm.may_move:
        name = "motion" if task.palm.motion else "moves"
        yield Problem(("palm", name), "a palm that moves", "a palm that stands, where the object is attached")
    joint, body = held.joint, task.object
    lever = np.cross(joint.direction, np.array(body.center_of_mass) - joint.pivot)
    turned = joint.direction @ np.array(body.inertia) @ joint.direction + body.mass * (lever @ lever)
    inertia = body.mass * joint.advance**2 + (turned if joint.turns else 0.0)
    quick = float(np.sqrt(joint.stiffness / inertia))
    if quick > _QUICKEST:
        given = f"{joint.stiffness:g}, with which the object swings at {quick:.3g} rad/s"
        allowed = (
            f"at most {inertia * _QUICKEST**2:.3g}: {_QUICKEST:g} rad/s; is the object's mass or inertia too small?"
        )
        yield Problem((*path, held.kind, "stiffness"), given, allowed)
    yield from joint_problems(body, task.motion, task.goal_turns())


def _turns(task: Task) -> Iterator[Problem]:
    """Turns of goals from the first goal's orientation."""
    if task.object.attached is not None:  # whose turns are its joint's
        return
    middle = task.middle_turn
    most = WIDEST_TURN / 2 if middle.any() else LARGEST_TURN
    turns = task.goal_turns()
    sizes, counted = (np.degrees(np.linalg.norm(each, axis=1)) for each in (turns, turns - middle))
    for number, turn in enumerate(sizes):
        if turn > LARGEST_TURN and counted[number] > most * (1 + 1e-6):
            allowed = f"a turn of at most ±{LARGEST_TURN:g}° from the first goal's orientation; this one is {turn:.4g}°"
            if middle.any():
                allowed = f"turns about one axis that are at most {WIDEST_TURN:g}° apart; this one is {turn:.4g}°"
            degrees = task.motion[number].rotation.degrees
            yield Problem(("motion", number, "rotation"), f"{degrees:.4g} degrees", allowed)


def _object_places(task: Task) -> Iterator[Problem]:
    palm, body = task.palm, task.object
    fixed = not palm.may_move and not palm.motion
    for number, (_, position, vector) in enumerate(task.goal_poses()):
        goal = task.motion[number]
        path = ("motion", number, "position" if goal.position is not None else "tool_at")
        given = str(list(goal.position or goal.tool_at or ()))
        depth = -np.inf if palm.auto else depth_in_palm(body, position, vector, palm)
        if depth > _TYPED * body.characteristic_length and (number == 0 or fixed):
            allowed = f"a place where the object is clear of the palm; here it is {depth:.3g} m inside"
            yield Problem(path, given, allowed)
        depth = depth_below(body, position, vector, task.ground.height) if task.ground else 0.0
        if depth > _TYPED * body.characteristic_length:
            allowed = f"a place where the object is above the ground; here it is {depth:.3g} m below"
            yield Problem(path, given, allowed)


def _palm_places(task: Task) -> Iterator[Problem]:
    if not task.ground or task.palm.auto:
        return
    for number, (_, position, rotation) in enumerate(task.palm.waypoints):
        depth = palm_depth_below(task.palm, position, rotation, task.ground.height)
        if depth > _TYPED * task.palm.radius:
            path = ("palm", "position") if number == 0 else ("palm", "motion", number - 1, "position")
            allowed = f"a place where the whole palm is above the ground; here it is {depth:.3g} m below"
            yield Problem(path, str([float(x) for x in position]), allowed)


def _keep_out(task: Task) -> Iterator[Problem]:
    """Boxes that the palm may not be in."""
    palm = task.palm
    if task.keep_out and (palm.motion or palm.may_move):
        name = "motion" if palm.motion else "moves"
        allowed = "a palm that stands still, where there are boxes that it keeps off (keep_out)"
        yield Problem(("palm", name), "a palm that moves", allowed)
    elif not palm.auto:
        for box in task.keep_out:
            distance = box.distance_from_palm(np.array(palm.position), palm.rotation, palm.radius, palm.thickness)
            if distance <= 0:
                allowed = f"a place where the whole palm is out of {box} (keep_out); or `palm: auto`"
                yield Problem(("palm", "position"), str([float(x) for x in palm.position]), allowed)


def _contacts(task: Task) -> Iterator[Problem]:
    names = list(task.fingers)
    if len(names) == 1 and any(task.gravity) and not task.ground and not task.object.attached:
        allowed = "two or more; a single contact cannot hold an object against gravity"
        yield Problem(("fingers",), "one finger", allowed)
    for number, name in enumerate(names):
        if not task.fingers[name].is_placed:
            yield from _region(task, name, task.fingers[name].touches)
            continue
        for other in names[:number]:
            if not task.fingers[other].is_placed:
                continue
            apart = np.linalg.norm(np.subtract(task.fingers[name].point, task.fingers[other].point))
            if apart < _TYPED * task.object.characteristic_length:
                allowed = f"a point away from that of {other}, since two fingertips cannot be in one place"
                yield Problem(("fingers", name, "touches"), str(list(task.fingers[name].point)), allowed)


def _region(task: Task, name: str, region: Region) -> Iterator[Problem]:
    """Of a contact that the program is to place."""
    path = ("fingers", name, "touches")
    known = [shape.name for shape in task.object.shapes if shape.name]
    for field in ("on", "not_on"):
        for each in getattr(region, field):
            if each not in known:
                names = f"the name of one of object.shapes: {', '.join(known)}" if known else _NAMELESS
                yield Problem((*path, field), repr(each), names)
    if region.near is not None and region.within is not None:
        distance = min(abs(shape.body.signed_distance(np.array(region.near))) for shape in task.object.shapes)
        if distance > region.within:
            allowed = f"at least {distance:.3g} m, at which the object's surface is from {list(region.near)}"
            yield Problem((*path, "within"), f"{region.within:g}", allowed)


def _fingertips(task: Task) -> Iterator[Problem]:
    """Sizes of fingertips beside those of the links behind them."""
    radius, hand, path = task.fingertip.radius, task.hand, ("fingertip", "radius")
    shortest = hand.shortest_of(radius)
    if radius < hand.link_radius * (1 - 1e-9):
        allowed = f"at least hand.link_radius ({hand.link_radius:.4g}), that of the links behind it"
        yield Problem(path, f"{radius:g}", allowed)
    elif shortest > hand.link_length[1] * (1 + 1e-9):
        most = hand.link_radius * (1 + (hand.link_length[1] - hand.link_length[0]) / hand.hinge_length)
        allowed = (
            f"at most {most:.4g}, or longer links (hand.link_length): with its hinge the last link is at least "
            f"{shortest:.4g} long, and links are at most {hand.link_length[1]:.4g}"
        )
        yield Problem(path, f"{radius:g}", allowed)


def _object_points(task: Task) -> Iterator[Problem]:
    body = task.object
    lower, upper = body.bounding_box
    center = np.array(body.center_of_mass)
    if (center < lower).any() or (center > upper).any():
        allowed = "a point within the box around the object's shapes"
        yield Problem(("object", "center_of_mass"), str(list(body.center_of_mass)), allowed)
    if task.tool is not None:
        distance = min(shape.body.signed_distance(np.array(task.tool)) for shape in body.shapes)
        if distance > body.characteristic_length:
            allowed = (
                f"a point within {body.characteristic_length:.3g} m of the object; this one is {distance:.3g} m from it"
            )
            yield Problem(("tool",), str(list(task.tool)), allowed)
