"""What is wrong with the regrasps that a task asks for, before they are tried: no room, or no hold meanwhile.

Contacts roll on the way, so that none of it is certain.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.diagnosis.finding import Finding, found, mm
from casadi_hands.diagnosis.fingertips import APART, in_each_other
from casadi_hands.diagnosis.grasps import BETTER, wrench_words
from casadi_hands.diagnosis.moment import moment
from casadi_hands.geometry.contact_points import inward_normals
from casadi_hands.motion import linear
from casadi_hands.problem.loads import HELD, cones
from casadi_hands.problem.model import Model
from casadi_hands.statics.programmes import nonnegative_fit
from casadi_hands.task import Task

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Stretch:
    """A while in which the same fingers touch at the same places.

    Attributes:
        start: s, of the schedule.
        names: of the fingers that touch.
        points: (K, 3) where, on the surface, object frame.
        normals: (K, 3) outward.
        new: which of them have just touched anew.
    """

    start: float
    names: tuple[str, ...]
    points: Array
    normals: Array
    new: NDArray[np.bool_]


def regrasp_findings(task: Task, model: Model) -> Iterator[Finding]:
    """The first touch without room for a fingertip, and the first while in which those that touch hold nothing."""
    stretches, wide = list(_stretches(model)), 2 * model.tip_radius
    for each in stretches:
        closest = in_each_other(model, each.points, each.normals)
        if closest is not None and closest[2] < APART * wide and (each.new[closest[0]] or each.new[closest[1]]):
            i, j, apart = closest
            what = (
                f"at {moment(model.schedule, each.start)} the fingertips of '{each.names[i]}' and '{each.names[j]}' "
                f"overlap by {mm(model, wide - apart)}, if they are where the task has them touch "
                f"(fingers.NAME.regrasps): their centres are {mm(model, apart)} apart"
            )
            yield found(what, "a place farther from the others for the finger that touches anew", certain=False)
            break
    if task.draws or model.attachment is not None or model.ground is not None or not np.any(model.gravity):
        return
    for each in stretches:
        missing = _missing(model, each)
        if np.linalg.norm(missing) > HELD:
            who = " and ".join(repr(name) for name in each.names)
            what = (
                f"from {moment(model.schedule, each.start)} on {who} alone cannot hold the object with friction "
                f"{model.friction:g} (friction), where the task has them touch (fingers.NAME.regrasps): "
                f"{wrench_words(model, missing)} missing"
            )
            yield found(what, f"fingers that let go one after the other, or {BETTER}", certain=False)
            return


def _stretches(model: Model) -> Iterator[Stretch]:
    """All of them, in order of time; none where the task asks for no regrasps."""
    names, asked = model.contact_names[: model.contacts], model.regrasp
    if asked is None or not asked.asked:
        return
    before: tuple[NDArray[np.bool_], Array] | None = None
    for k, time in enumerate(model.schedule.keyframes[:-1].tolist()):
        touching, wanted = ~asked.lifted[k, : model.contacts], asked.patches[k, : model.contacts]
        if before is not None and np.array_equal(touching, before[0]) and np.array_equal(wanted, before[1]):
            continue
        bodies = [min(model.bodies, key=lambda body: float(body.signed_distance(p))) for p in wanted[touching]]
        points = np.array([body.on_surface(p) for body, p in zip(bodies, wanted[touching], strict=True)]).reshape(-1, 3)
        new = touching & ~before[0] if before is not None else np.zeros_like(touching)
        chosen = tuple(name for name, touches in zip(names, touching, strict=True) if touches)
        yield Stretch(time, chosen, points, -inward_normals(points, bodies), new[touching])
        before = touching, wanted


def _missing(model: Model, each: Stretch) -> Array:
    """(6,) wrench that contacts at these places cannot make of the object's weight, object frame."""
    schedule = model.schedule
    way = linear(schedule.keyframes[list(schedule.goals)], [each.start])[0]
    turn = pin.exp3(way @ model.goal_vectors) @ pin.Quaternion(*model.reference).matrix()
    needed = -np.concatenate([turn.T @ model.gravity, np.zeros(3)])
    count = len(each.points)
    _, wrenches = cones(each.points, -each.normals, np.full(count, model.friction), model.torsion, count)
    return np.asarray(needed - wrenches @ nonnegative_fit(wrenches, needed)[0])
