"""An earlier result as the start of a refinement of a task that was edited since."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from casadi_hands.design import Design, Finger, Hand, Motion
from casadi_hands.errors import SolveError
from casadi_hands.kinematics import STAND, finger_kinematics
from casadi_hands.motion import eased, held, linear, nearest_exponential
from casadi_hands.nlp import Solution
from casadi_hands.pipeline.certify import AMPLE, FIRM, SMALL
from casadi_hands.search.seeds import frame_about
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.grasp import inward_normals, on_capsules
from casadi_hands.stages.model import Model, build_model, quaternion
from casadi_hands.stages.refine_values import Margin, eased_in
from casadi_hands.stages.synthesis import FingerSeed
from casadi_hands.stages.whole_hand import WholeHand
from casadi_hands.stages.whole_hand_numbers import in_palm
from casadi_hands.task import Task

Array = NDArray[np.float64]
_NEARLY = 0.98  # margins are kept on surfaces whose kinks are rounded
_STEPS = 4  # of Gauss and Newton
_STIFF = 0.05  # half extents/rad, what keeps joints near their angles where that gains little
_NOT_SOLVED = Solution({}, {}, 0.0, {}, {}, "taken from an earlier result", 0, 0.0)


def warm_start(earlier: Design, task: Task, model: Model) -> WholeHand:
    """The hand and the motion of an earlier result, moved to what a task asks for now.

    The object's path moves by the difference of the goals, blended smoothly from one to the next; contact points by the
    change of the task's contacts, and onto the object's surface; forces stay the same in terms of the object's weight.
    Where goals are at other times, the motion in between is stretched.

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
    was = _retold(earlier.hand, motion, old, model)
    on_link = _in_columns(motion, model, motion.contact_point_link) / model.units.length
    on_link = np.tensordot(linear(motion.time, _stretched(old, model)), on_link, axes=1)
    stood = {finger.name: finger.base[2] / model.units.length for finger in earlier.hand.fingers}
    rises = [STAND * model.link_radius - stood[model.contact_names[c]] for c in was.contacts]
    return _followed(was, _moved(was, task, old, model), on_link, rises, old, model)


def kept_margin(earlier: Design) -> Margin:
    """The firmest margin that an earlier result keeps, so that it is the one to keep again; the ample one if unknown.

    Raises:
        SolveError: it has no motion.
    """
    model = build_model(earlier.task)
    whole = warm_start(earlier, earlier.task, model)
    if earlier.status != "certified":
        return AMPLE
    grip, use = np.inf, 0.0
    for c in whole.contacts:
        active = whole.active[:, c]
        bearing = active & np.append(active[:1], active[:-1])
        asked = eased_in(bearing, model.schedule.samples)
        points, force = whole.point[bearing, c], whole.force[bearing, c]
        inward = inward_normals(points, np.tile(model.capsules[c], (len(points), 1)))
        normal = (force * inward).sum(axis=1)
        across = np.linalg.norm(force - normal[:, None] * inward, axis=1)
        grip = min(grip, float((normal / asked[bearing]).min()))
        use = max(use, float((across / (model.friction * normal)).max()))
    kept = (m for m in (FIRM, AMPLE) if grip >= _NEARLY * m.normal_force and _NEARLY * use <= m.friction)
    return next(kept, SMALL)


def as_floating(model: Model, start: WholeHand) -> Floating:
    """What a start has of stage 1's motion: the object's poses and the contacts at the keyframes."""
    at = model.schedule.keyframe_samples
    pose, active = np.hstack([start.position, start.vector])[at], start.active[at]
    return Floating(pose, start.point[at], start.force, active, active.astype(float), 0.0, _NOT_SOLVED, (), model)


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
    joints = max(len(finger.links) for finger in hand.fingers)
    if joints > task.search.max_joints:
        differing.append(f"joints of a finger: {joints} there, at most {task.search.max_joints} in the task")
    if differing:
        raise SolveError(_refused("; ".join(differing), earlier))


def _refused(why: str, earlier: Design) -> str:
    return (
        f"the earlier result, of {earlier.task.name!r}, is no start for this task: {why}; solving without --from works"
    )


def _retold(hand: Hand, motion: Motion, old: Model, model: Model) -> WholeHand:
    """The earlier motion as it was, at the samples and in the units of the new task; still of the old reference."""
    when, length = _stretched(old, model), model.units.length
    between = linear(motion.time, when)
    turns = np.array([_matrix(q) for q in motion.object_orientation])
    forces = np.einsum("sji,scj->sci", turns, _in_columns(motion, model, motion.contact_force)) / old.units.force
    active = _in_columns(motion, model, motion.contact_active)[held(motion.time, when)]
    contacts = [model.contact_names.index(finger.name) for finger in hand.fingers]
    joints, at = _spline(motion.time, motion.joint_angles)(when), model.schedule.keyframe_samples
    fingers, angles = [], []
    for i in np.argsort(contacts):
        own = [motion.joint_names.index(f"finger{i}_joint{j}") for j in range(len(hand.fingers[i].links))]
        angles.append(joints[:, own])
        fingers.append(_seed(hand.fingers[i], joints[at][:, own], length))
    path = [
        _spline(motion.time, motion.object_position / length)(when),
        _spline(motion.time, _vectors(turns @ _matrix(old.reference).T))(when),
    ]
    return WholeHand(
        fingers=tuple(fingers),
        contacts=tuple(sorted(contacts)),
        angles=tuple(angles),
        palm_position=_spline(motion.time, motion.base_position / length)(when),
        palm_quaternion=np.array([quaternion(r) for r in _turns(motion.time, motion.base_orientation, when)]),
        position=path[0],
        vector=path[1],
        point=np.tensordot(between, _in_columns(motion, model, motion.contact_point_object) / length, axes=1),
        force=np.tensordot(between, forces, axes=1) * active[:, :, None],
        active=active,
        solution=_NOT_SOLVED,
    )


def _in_columns(motion: Motion, model: Model, values: NDArray[Any]) -> NDArray[Any]:
    """Values (S, C, …) of a motion's contacts in the order of the model's; zero for one that never acts."""
    names = (*model.contact_names, *(["ground"] if model.ground else []))
    result = np.zeros((len(values), len(names), *values.shape[2:]), values.dtype)
    for c, name in enumerate(names):
        if name in motion.contact_names:
            result[:, c] = values[:, motion.contact_names.index(name)]
    return result


def _seed(finger: Finger, angles: Array, length: float) -> FingerSeed:
    """A finger in units of ``length`` (m), with its joint angles at the keyframes."""
    return FingerSeed(
        base=np.array(finger.base[:2]) / length,
        lengths=np.array([link.length for link in finger.links]) / length,
        frames=np.array([frame_about(np.array(link.axis)) for link in finger.links]),
        axes=np.zeros((len(finger.links), 2)),
        angles=angles,
        tips=np.zeros((0, 2)),
    )


def _moved(was: WholeHand, task: Task, old: Model, model: Model) -> WholeHand:
    """The object's path, the palm's and the contacts on the object, moved by what the task moved."""
    scale = old.units.length / model.units.length
    goals = model.schedule.keyframes[list(model.schedule.goals)]
    blend = linear(goals, eased(goals, model.schedule.samples))
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
    when, time = _stretched(old, model), old.schedule.samples
    given = _spline(time, old.palm_position)(when) * old.units.length / model.units.length
    turns = _turns(time, old.palm_quaternion, when)
    quaternions = [
        quaternion(_matrix(now) @ turn.T @ _matrix(before))
        for now, turn, before in zip(model.palm_quaternion, turns, was.palm_quaternion, strict=True)
    ]
    return was.palm_position + model.palm_position - given, np.array(quaternions)


def _moved_points(points: Array, old: Model, model: Model) -> Array:
    """Contact points (S, C, 3) moved by what the task's contacts moved, on the object's surface as it is now."""
    before = old.patches[[old.contact_names.index(name) for name in model.contact_names]]
    patches, capsules = model.patches, model.capsules
    if model.ground is not None and old.ground is not None:
        patches, before = np.vstack([patches, model.ground.patch]), np.vstack([before, old.ground.patch])
        capsules = np.vstack([capsules, model.ground.capsule])
    moved = points + patches - before * (old.units.length / model.units.length)
    return np.array([on_capsules(p, capsules) for p in moved])


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
            for value in function(np.append(finger.base, 0), finger.axis_vectors.T, finger.lengths, turned, on_link)
        )
        target = point.ravel() + away if target is None else target
        rows = np.vstack([jacobian, _STIFF * np.eye(finger.joints)])
        step = np.linalg.lstsq(rows, np.append(target - point.ravel(), _STIFF * (angles - turned)), rcond=None)[0]
        turned = turned + step
    return turned


def _contacts(hand: WholeHand, model: Model) -> Array:
    """Contact points (S, C, 3) in the palm's frame."""
    return np.stack([in_palm(model, hand, hand.point[:, c]) for c in range(hand.point.shape[1])], axis=1)


def _vectors(rotations: Array) -> Array:
    """Rotation vectors (S, 3) of rotations (S, 3, 3), continuous from one to the next."""
    vectors = [np.zeros(3)]
    for rotation in rotations:
        vectors.append(nearest_exponential(rotation, vectors[-1]))
    return np.array(vectors[1:])


def _turns(time: Array, quaternions: Array, when: Array) -> Array:
    """Rotations (S, 3, 3) at other times, of something that starts and ends at rest."""
    turns = np.array([_matrix(q) for q in quaternions])
    vectors = _spline(time, _vectors(turns @ turns[0].T))(when)
    return np.array([pin.exp3(v) @ turns[0] for v in vectors])


def _matrix(orientation: Array) -> Array:
    """Rotation matrix (3, 3) of a unit quaternion."""
    return np.asarray(pin.Quaternion(*orientation).matrix())


def _stretched(old: Model, new: Model) -> Array:
    """The earlier motion's time at each of the new samples: linear from goal to goal, and to the end."""
    ends = []
    for schedule in (old.schedule, new.schedule):
        ends.append([*schedule.keyframes[list(schedule.goals)], schedule.keyframes[-1]])
    rests = ends[1][-1] > ends[1][-2] + 1e-9  # else the last goal is the end
    knots = len(ends[1]) if rests else -1
    return np.asarray(np.interp(new.schedule.samples, ends[1][:knots], ends[0][:knots]))


def _spline(time: Array, values: Array) -> CubicSpline:
    """Through samples of something that starts and ends at rest."""
    return CubicSpline(time, values, bc_type="clamped")
