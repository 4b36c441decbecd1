"""What no hand can do, seen from the task alone: told at once, before anything is solved.

Each rule leaves a task some room, so that it speaks only where nothing could be found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.diagnosis.moment import moment
from casadi_hands.diagnosis.reason import Reason
from casadi_hands.problem.loads import Load, hardest_load, usual_force_limit
from casadi_hands.problem.model import Model, palm_from_world
from casadi_hands.task import Task
from casadi_hands.task.obstacles import depth_in_palm
from casadi_hands.task.servos import SERVOS
from casadi_hands.verify.figures.wrench import LEAST_LEVER

Array = NDArray[np.float64]


def impossibilities(task: Task, model: Model) -> list[Reason]:
    """Why no hand can do a task; nothing where it cannot be told without solving it.

    Args:
        task: as loaded.
        model: the same, nondimensional.
    """
    places = [] if task.palm.may_move else [*_behind(task, model), *_beyond_reach(task, model), *_at_palm(task, model)]
    return [*places, *_too_weak(task, model), *_weak_motors(task, model)]


def _in_palm(task: Task, model: Model) -> Iterator[tuple[float, Array, Array]]:
    """Time (s) of every goal, and where the object is then: rotation (3, 3) and position (3,), lengths, palm frame."""
    for time, position, vector in task.goal_poses():
        turn, center = palm_from_world(model, time)
        yield time, turn @ pin.exp3(vector), turn @ (position / model.units.length - center)


def _behind(task: Task, model: Model) -> Iterator[Reason]:
    """The whole object is behind the palm's face at every goal."""
    highest = []
    for _, turn, place in _in_palm(task, model):
        if model.tool is not None:
            top = float(turn[2] @ model.tool) + _radius_about_tool(task, model)
        else:
            top = max(float(np.max(body.support(turn[2]) @ turn[2])) + body.ball for body in model.bodies)
        highest.append(place[2] + top)
    if max(highest) < 0:
        what = (
            f"the object is behind the palm at every goal, by {_mm(model, -max(highest))} or more: fingers point to "
            f"{_numbers(task.palm.facing)} (palm.facing), and it is on the other side"
        )
        yield Reason(what, f"palm.facing {_numbers([-value for value in task.palm.facing])}", root=True)


def _beyond_reach(task: Task, model: Model) -> Iterator[Reason]:
    """The object's nearest point is farther from the palm than its longest finger reaches."""
    joints, longest = task.search.max_joints, model.link_length[1]
    reach = model.palm_radius + joints * longest + model.link_radius
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
            f"the object is out of reach at {moment(model.schedule, time)}: it is {_mm(model, distance)} from the "
            f"palm's centre, and a finger of {joints} links of at most {_mm(model, longest)} each, on the palm's rim, "
            f"reaches {_mm(model, reach)}"
        )
        advice = "a palm nearer by (palm.position), longer links (hand.link_length) or more of them (search.max_joints)"
        yield Reason(what, advice, root=True)


def _radius_about_tool(task: Task, model: Model) -> float:
    """Lengths from a drawing's tool, about which the object may turn, within which all of it is."""
    assert model.tool is not None
    farthest = np.linalg.norm(np.maximum(*np.abs(task.object.bounding_box))) / model.units.length
    return float(np.linalg.norm(model.tool) + farthest)


def _at_palm(task: Task, model: Model) -> Iterator[Reason]:
    """A goal is nearer to a palm that stands still than bodies may be that do not touch."""
    if task.palm.motion or task.draws:
        return
    room = math.sqrt(3) * model.goal_tolerance[0] * model.units.length
    gaps = [(-depth_in_palm(task.object, place, turn, task.palm), time) for time, place, turn in task.goal_poses()]
    gap, time = min(gaps)
    if gap + room < task.hand.clearance:
        what = (
            f"the object is {1e3 * max(gap, 0.0):.3g} mm from the palm at {moment(model.schedule, time)}, and bodies "
            f"that do not touch keep {1e3 * task.hand.clearance:.3g} mm from each other (hand.clearance)"
        )
        yield Reason(what, "a goal farther from the palm, or less hand.clearance", root=True)


def _too_weak(task: Task, model: Model) -> Iterator[Reason]:
    """The task allows its contacts less force than bearing its loads takes."""
    given, unit = task.hand.contact_force, model.units.force
    load = None if given is None else hardest_load(model, given)
    if given is None or load is None:
        return
    what = (
        f"contact '{model.contact_table[load.contact].name}' must bear at least {load.least:.3g} weights "
        f"({load.least * unit:.3g} N) along an axis of the object at {moment(model.schedule, load.time)} to withstand "
        f"{_acting(model, load)}; hand.contact_force allows {given:.3g} ({given * unit:.3g} N)"
    )
    advice = f"hand.contact_force: {usual_force_limit(model):g}, its default here, more friction or more fingers"
    yield Reason(what, advice, root=True)


def _weak_motors(task: Task, model: Model) -> Iterator[Reason]:
    """The motors are too weak for the least contact forces, even with the shortest levers that count as actuated."""
    given = task.actuator.torque
    if given is None:
        return
    # Of a force, all but `unsupplied_force` must be actuated with levers of LEAST_LEVER or more; so together a finger's
    # torques are that lever times it at least, and the largest of n is a share 1/√n of that.
    shared, borne = math.sqrt(task.search.max_joints), task.limits.unsupplied_force
    load = hardest_load(model, borne + model.torque_limit * shared / LEAST_LEVER)
    if load is None or load.contact >= model.contacts:
        return
    least = (load.least - borne) * LEAST_LEVER / shared * model.units.torque
    servo = task.hand.drive.servo
    motors, limit = (f"servos {servo}", "hold") if servo else ("motors", "give")
    what = (
        f"contact '{model.contact_table[load.contact].name}' must bear at least {load.least:.3g} weights "
        f"({load.least * model.units.force:.3g} N) at {moment(model.schedule, load.time)} to withstand "
        f"{_acting(model, load)}, which takes {least:.3g} N·m of some joint with the shortest levers that count, and "
        f"{motors} {limit} {given:.3g} N·m (actuator.torque)"
    )
    stronger = [name for name, other in SERVOS.items() if other.continuous >= least] if servo else []
    advice = f"a stronger servo ({', '.join(stronger)})" if stronger else "stronger motors (actuator.torque)"
    yield Reason(what, f"{advice}, a lighter object, more friction or more fingers", root=True)


def _acting(model: Model, load: Load) -> str:
    """What acts on the object, in SI."""
    force = float(np.linalg.norm(load.force)) * model.units.force
    torque = float(np.linalg.norm(load.torque)) * model.units.torque
    parts = [f"a force of {force:.3g} N"] if force else []
    parts += [f"a torque of {torque:.3g} N·m"] if torque else []
    return f"the task's {' and '.join(part.removeprefix('a ') for part in parts)}" if parts else "its weight"


def _mm(model: Model, lengths: float) -> str:
    return f"{1e3 * lengths * model.units.length:.4g} mm"


def _numbers(values: tuple[float, ...] | list[float]) -> str:
    return f"[{', '.join(f'{value + 0.0:g}' for value in values)}]"
