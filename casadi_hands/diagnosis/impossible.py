"""What a task shows before anything is solved: what no hand can do, and what is likely a mistake.

Each rule leaves a task some room, so that what is certain speaks only where nothing could be found.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from casadi_hands.diagnosis.finding import Finding, found
from casadi_hands.diagnosis.fingertips import fingertip_findings
from casadi_hands.diagnosis.grasps import grasp_findings
from casadi_hands.diagnosis.moment import moment
from casadi_hands.diagnosis.places import place_findings
from casadi_hands.diagnosis.reason import Reason
from casadi_hands.diagnosis.regrasps import regrasp_findings
from casadi_hands.problem.inertia import capsule_inertial
from casadi_hands.problem.loads import Load, hardest_load, usual_force_limit
from casadi_hands.problem.model import Model
from casadi_hands.task import Task
from casadi_hands.task.servos import SERVOS
from casadi_hands.verify.figures.wrench import LEAST_LEVER

LEAST_INERTIA = 1e-14  # kg·m², that MuJoCo takes
_HARD = 5.0  # weights, beyond which a contact presses hard
_USUAL_LEVER = 1.0  # lengths, of the force on a fingertip about some joint of its finger


def findings(task: Task, model: Model) -> list[Finding]:
    """What is found: what is certain, or if nothing is, what is likely.

    Args:
        task: as loaded.
        model: the same, nondimensional.
    """
    light = list(_too_light(task))
    if not task.is_placed:  # nothing is known of contacts
        places = [*light, *place_findings(task, model)]
        return [each for each in places if each.certain] or places
    places = [*light, *place_findings(task, model), *fingertip_findings(task, model)]
    forces = [*_too_weak(task, model), *_weak_motors(task, model), *_slow_motors(task, model)]
    every = [*places, *grasp_findings(task, model), *regrasp_findings(task, model), *forces]
    # Beside what is certain, the likely may follow from it.
    return [each for each in every if each.certain] or [*every, *_hard(task, model)]


def impossibilities(task: Task, model: Model) -> list[Reason]:
    """Why no hand can do a task; nothing where it cannot be told without solving it.

    Args:
        task: as loaded.
        model: the same, nondimensional.
    """
    return [each.reason for each in findings(task, model) if each.certain]


def _too_light(task: Task) -> Iterator[Finding]:
    """MuJoCo, in which designs are replayed, does not move bodies as light and small as these."""
    hand = task.hand
    link = capsule_inertial(hand.link_length[1] - hand.hinge_length, hand.link_radius, hand.density)
    bodies = {
        "the object has": (np.asarray(task.object.inertia), "a larger or heavier object"),
        "the largest links allowed (hand.link_radius, hand.link_length) have": (
            link.inertia,
            "a larger object, or thicker links (hand.link_radius)",
        ),
    }
    for who, (inertia, advice) in bodies.items():
        least = float(np.linalg.eigvalsh(inertia)[0])
        if least < LEAST_INERTIA:
            what = (
                f"{who} a least moment of inertia of {least:.2g} kg·m², and MuJoCo, in which designs are replayed, "
                f"moves no body that has less than {LEAST_INERTIA:g} kg·m²"
            )
            yield found(what, advice)


def _too_weak(task: Task, model: Model) -> Iterator[Finding]:
    """The task allows its contacts less force than bearing its loads takes."""
    given, unit = task.hand.contact_force, model.units.force
    load = None if given is None else hardest_load(model, given)
    if given is None or load is None:
        return
    what = (
        f"contact '{model.contact_table[load.contact].name}' must bear at least {load.least:.3g} weights "
        f"({load.least * unit:.3g} N) along an axis of the object at {moment(model.schedule, load.time)} to withstand "
        f"{_acting(model, load)} at friction {model.friction:g} (friction); hand.contact_force allows "
        f"{given:.3g} ({given * unit:.3g} N)"
    )
    advice = f"hand.contact_force: {usual_force_limit(model):g}, its default here, more friction or more fingers"
    yield found(what, advice)


def _weak_motors(task: Task, model: Model) -> Iterator[Finding]:
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
    yield found(what, f"{advice}, a lighter object, more friction or more fingers")


def _slow_motors(task: Task, model: Model) -> Iterator[Finding]:
    """The motors are too slow to carry the object from goal to goal, if its contacts go where it goes."""
    speed, palm = task.actuator.speed, task.palm
    if speed is None or palm.may_move or len(palm.waypoints) > 1 or task.motors != "independent":
        return
    # Of n joints a lengths apart the outermost moves the tip by a, the next one by twice that, and so on.
    joints, longest = task.search.max_joints, task.hand.link_length[1]
    fastest = speed * longest * joints * (joints + 1) / 2
    legs = [
        (float(np.linalg.norm(there - here)), start, end)
        for (start, here, _), (end, there, _) in pairwise(task.goal_poses())
    ]
    distance, start, end = max(legs, key=lambda leg: leg[0] / (leg[2] - leg[1]), default=(0.0, 0.0, 1.0))
    needed = distance / (end - start)
    if needed > fastest:
        what = (
            f"from {start:.3g} s to {end:.3g} s the object goes {1e3 * distance:.3g} mm, by {1e3 * needed:.3g} mm/s; "
            f"fingers of {joints} joints of {1e3 * longest:.3g} mm (search.max_joints, hand.link_length) move tips "
            f"by {1e3 * fastest:.3g} mm/s at most with motors of {speed:.3g} rad/s (actuator.speed)"
        )
        yield found(what, "faster motors (actuator.speed) or slower goals", certain=False)


def _hard(task: Task, model: Model) -> Iterator[Finding]:
    """A contact must press hard, or motors may be too weak for the levers that fingers usually have."""
    given = task.actuator.torque
    enough = _HARD if given is None else min(_HARD, model.torque_limit / _USUAL_LEVER)
    load = hardest_load(model, enough)
    if load is None:
        return
    name, least = model.contact_table[load.contact].name, load.least * model.units.force
    what = (
        f"contact '{name}' must bear at least {load.least:.3g} weights ({least:.3g} N) along an axis of the object at "
        f"{moment(model.schedule, load.time)} to withstand {_acting(model, load)} at friction {model.friction:g} "
        f"(friction)"
    )
    torque = load.least * _USUAL_LEVER * model.units.torque
    if given is not None and load.contact < model.contacts and torque > given:
        what += (
            f", which takes {torque:.3g} N·m of a joint {1e3 * _USUAL_LEVER * model.units.length:.3g} mm away; motors "
            f"give {given:.3g} N·m (actuator.torque)"
        )
        yield found(what, "stronger motors, a lighter object, more friction or more fingers", certain=False)
    elif load.least > _HARD:
        limit = f"{model.force_limit:g} ({model.force_limit * model.units.force:.3g} N)"
        what += f"; contacts bear at most {limit} (hand.contact_force)"
        yield found(what, "more friction, more fingers, or weaker perturbations", certain=False)


def _acting(model: Model, load: Load) -> str:
    """What acts on the object, in SI."""
    force = float(np.linalg.norm(load.force)) * model.units.force
    torque = float(np.linalg.norm(load.torque)) * model.units.torque
    parts = [f"a force of {force:.3g} N"] if force else []
    parts += [f"a torque of {torque:.3g} N·m"] if torque else []
    return f"the task's {' and '.join(part.removeprefix('a ') for part in parts)}" if parts else "its weight"
