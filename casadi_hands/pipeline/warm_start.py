"""An earlier result as the start of a refinement of a task that was edited since."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from casadi_hands.errors import SolveError
from casadi_hands.export.design import Design
from casadi_hands.geometry.contact_points import inward_normals, on_bodies
from casadi_hands.kinematics import STAND, finger_kinematics
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.motion import linear, time_scaled
from casadi_hands.motion.quaternion import quaternion
from casadi_hands.pipeline.earlier_motion import (
    NOT_SOLVED,
    earlier_motion,
    in_columns,
    matrix,
    resting_spline,
    stretched,
    turns_at,
)
from casadi_hands.pipeline.margins import SMALL, margins_for
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.placement import in_palm
from casadi_hands.problem.si import build_model
from casadi_hands.stages.refine.touching import force_ramp
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task import Task

Array = NDArray[np.float64]
_NEARLY = 0.98  # margins are kept on surfaces whose kinks are rounded
_STEPS = 4  # of Gauss and Newton
_STIFF = 0.05  # lengths/rad, what keeps joints near their angles where that gains little


def warm_start(earlier: Design, task: Task, model: Model) -> WholeHand:
    """The hand and the motion of an earlier result, moved to what a task asks for now.

    The object's path moves by the difference of the goals, blended smoothly from one to the next; contact points by the
    change of the task's contacts, and onto the object's surface; forces stay the same in terms of the object's weight.
    Where goals are at other times, the motion in between is stretched. Motors that share joints are left out: every
    joint has one of its own, from which fewer are fitted anew.

    Args:
        earlier: as loaded from a result folder.
        task: as it is now.
        model: the same, nondimensional.

    Returns:
        The motion, in the numbers of ``model``.

    Raises:
        SolveError: the earlier result has no motion, or is of a task of another structure.
    """
    if earlier.hand is None or earlier.motion is None:
        raise SolveError(_refused("it holds no hand with a motion", earlier))
    _check_structure(earlier, earlier.hand, task)
    old, motion = build_model(earlier.task), earlier.motion
    was = earlier_motion(earlier.hand, motion, old, model)
    on_link = in_columns(motion, model, motion.contact_point_link) / model.units.length
    on_link = np.tensordot(linear(motion.time, old.schedule.real(stretched(old, model))), on_link, axes=1)
    stood = {finger.name: finger.base[2] / model.units.length for finger in earlier.hand.fingers}
    rises = [
        STAND * model.radii(finger.joints)[0] - stood[model.contact_names[c]]
        for c, finger in zip(was.contacts, was.fingers, strict=True)
    ]
    return _followed(was, _moved(was, task, old, model), on_link, rises, old, model)


def kept_margin(earlier: Design) -> Margin:
    """The firmest margin that an earlier result keeps, so that it is the one to keep again; the ample one if unknown.

    Raises:
        SolveError: it has no motion.
    """
    model = build_model(earlier.task)
    whole = warm_start(earlier, earlier.task, model)
    margins = margins_for(model, whole)
    if earlier.status != "certified":
        return margins.ample
    least, use = np.inf, 0.0
    for c in whole.contacts:
        active = whole.active[:, c]
        bearing = active & np.append(active[:1], active[:-1])
        asked = force_ramp(bearing, model.schedule.samples)
        points, force = whole.point[bearing, c], whole.force[bearing, c]
        inward = inward_normals(points, [model.touched[c]] * len(points))
        normal = (force * inward).sum(axis=1)
        across = np.linalg.norm(force - normal[:, None] * inward, axis=1)
        least = min(least, float((normal / asked[bearing]).min()))
        use = max(use, float((across / (model.friction * normal)).max()))
    kept = (
        m for m in (margins.larger, margins.ample) if least >= _NEARLY * m.normal_force and _NEARLY * use <= m.friction
    )
    return next(kept, SMALL)


def as_floating(model: Model, start: WholeHand) -> Floating:
    """What a start has of stage 1's motion: the object's poses and the contacts at the keyframes."""
    at = model.schedule.keyframe_samples
    pose, active = np.hstack([start.position, start.vector])[at], start.active[at]
    return Floating(pose, start.point[at], start.force, active, active.astype(float), 0.0, NOT_SOLVED, (), model)


def _check_structure(earlier: Design, hand: Hand, task: Task) -> None:
    """Refuse what cannot be carried over; all differences in one message."""
    differing = []
    old_and_new = earlier.task, task
    for name, (was, now) in {
        "fingers": [", ".join(sorted(t.fingers)) for t in old_and_new],
        "number of goals": [str(len(t.motion)) for t in old_and_new],
        "kind of goals": ["points to draw" if t.draws else "poses" for t in old_and_new],
        "ground": ["none" if t.ground is None else "one" for t in old_and_new],
        "palm": ["moved by the program" if t.palm.may_move else "where the task has it" for t in old_and_new],
    }.items():
        if was != now:
            differing.append(f"{name}: {was} there, {now} in the task")
    if not differing:
        differing = [text for name in task.fingers if (text := _other_regrasps(earlier.task, task, name))]
    joints = max(len(finger.links) for finger in hand.fingers)
    if joints > task.search.max_joints:
        differing.append(f"joints of a finger: {joints} there, at most {task.search.max_joints} in the task")
    if differing:
        raise SolveError(_refused("; ".join(differing), earlier))


def _other_regrasps(before: Task, after: Task, name: str) -> str:
    """Say that a finger lets go at other times than it did, moved as the goals have; empty where it does not."""
    was, now = (np.ravel([each.times for each in task.fingers[name].regrasps or ()]) for task in (before, after))
    there, here = ([*(goal.at for goal in task.motion), task.duration] for task in (before, after))
    was = np.interp(was, there, here)
    if len(was) == len(now) and np.all(np.abs(was - now) < after.time_step):
        return ""
    lifts = (", ".join(f"{time:g} s" for time in times[:6:2]) or "never" for times in (was, now))
    return f"when finger {name!r} lets go: {{}} there, {{}} in the task".format(*lifts)


def _refused(why: str, earlier: Design) -> str:
    return (
        f"the earlier result, of {earlier.task.name!r}, is no start for this task: {why}; solving without --from works"
    )


def _moved(was: WholeHand, task: Task, old: Model, model: Model) -> WholeHand:
    """The object's path, the palm's and the contacts on the object, moved by what the task moved."""
    scale = old.units.length / model.units.length
    goals = model.schedule.keyframes[list(model.schedule.goals)]
    blend = linear(goals, time_scaled(goals, model.schedule.samples))
    vector = was.vector + blend @ (model.goal_vectors - old.goal_vectors)
    position = was.position + blend @ (model.goal_positions - scale * old.goal_positions)
    if model.tool is not None and old.tool is not None:
        position = position - np.array([pin.exp3(v) @ (model.tool - scale * old.tool) for v in vector])
    palm = _moved_palm(was, old, model) if task.palm.may_move else (model.palm_position, model.palm_quaternion)
    return replace(
        was,
        palm_position=palm[0],
        palm_quaternion=palm[1],
        position=position,
        vector=vector,
        point=_moved_points(was.point, old, model),
    )


def _moved_palm(was: WholeHand, old: Model, model: Model) -> tuple[Array, Array]:
    """Positions (S, 3) and quaternions (S, 4) of a palm that the program moved, as far off the task's as before."""
    when, time = stretched(old, model), old.schedule.samples
    given = resting_spline(time, old.palm_position)(when) * old.units.length / model.units.length
    turns = turns_at(time, old.palm_quaternion, when)
    quaternions = [
        quaternion(matrix(now) @ turn.T @ matrix(before))
        for now, turn, before in zip(model.palm_quaternion, turns, was.palm_quaternion, strict=True)
    ]
    return was.palm_position + model.palm_position - given, np.array(quaternions)


def _moved_points(points: Array, old: Model, model: Model) -> Array:
    """Contact points (S, C, 3) moved by what the task's contacts moved, on the object's surface as it is now."""
    names = [contact.name for contact in old.contact_table]
    before = old.patches[[names.index(contact.name) for contact in model.contact_table]]
    moved = points + model.patches - before * (old.units.length / model.units.length)
    return np.array([on_bodies(p, model.touched) for p in moved])


def _followed(
    was: WholeHand, moved: WholeHand, on_link: Array, rises: Sequence[float], old: Model, model: Model
) -> WholeHand:
    """Joints turned so that links follow their contacts in the palm's frame, as far as they can.

    Args:
        was: the motion before it was moved.
        moved: the motion after, with the joints of before.
        on_link: (S, C, 3) contacts on the links, link frame.
        rises: by how much each finger stands higher on the palm than before.
        old: of ``was``.
        model: of ``moved``.
    """
    away = _contacts(moved, model) - _contacts(was, old)
    fingers, angles = [], []
    for i, (finger, contact) in enumerate(zip(moved.fingers, moved.contacts, strict=True)):
        ways = away[:, contact] - [0, 0, rises[i]]
        turned = np.array(
            [_reach(finger, *row) for row in zip(moved.angles[i], on_link[:, contact], ways, strict=True)]
        )
        angles.append(turned)
        fingers.append(replace(finger, angles=turned[model.schedule.keyframe_samples]))
    return replace(moved, fingers=tuple(fingers), angles=tuple(angles))


def _reach(finger: FingerSeed, angles: Array, on_link: Array, away: Array) -> Array:
    """Joint angles (n,) near given ones with which a point of the last link is ``away`` (3,) from where it was."""
    function = finger_kinematics(finger.joints)
    turned, target = angles, None
    for _ in range(_STEPS):
        *_, point, jacobian = (
            np.asarray(value)
            for value in function(
                np.append(finger.base, 0),
                np.hstack(list(finger.turns)),
                finger.axis_vectors.T,
                finger.lengths,
                turned,
                on_link,
            )
        )
        target = point.ravel() + away if target is None else target
        rows = np.vstack([jacobian, _STIFF * np.eye(finger.joints)])
        step = np.linalg.lstsq(rows, np.append(target - point.ravel(), _STIFF * (angles - turned)), rcond=None)[0]
        turned = turned + step
    return turned


def _contacts(hand: WholeHand, model: Model) -> Array:
    """Contact points (S, C, 3) in the palm's frame."""
    return np.stack([in_palm(model, hand, hand.point[:, c]) for c in range(hand.point.shape[1])], axis=1)
