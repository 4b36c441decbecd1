"""An earlier result as the start of a refinement of a task that was edited since."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from casadi_hands.design import Design, Finger, Hand, Motion
from casadi_hands.errors import SolveError
from casadi_hands.motion import eased, held, linear, nearest_exponential
from casadi_hands.nlp import Solution
from casadi_hands.pipeline.certify import AMPLE, FIRM, SMALL
from casadi_hands.search.seeds import frame_about
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.grasp import inward_normals, on_capsules
from casadi_hands.stages.model import Model, build_model, quaternion
from casadi_hands.stages.refine import Margin, eased_in
from casadi_hands.stages.synthesis import FingerSeed
from casadi_hands.stages.whole_hand import WholeHand
from casadi_hands.task import Task

Array = NDArray[np.float64]
_NEARLY = 0.98  # margins are kept on surfaces whose kinks are rounded
_NOT_SOLVED = Solution({}, {}, 0.0, 0.0, {}, {}, "taken from an earlier result", 0, 0.0)


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
    return _Warm(earlier, earlier.hand, earlier.motion, task, model).start()


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
        asked = eased_in(bearing)
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
    active = start.active[at]
    return Floating(start.pose, start.point[at], start.force, active, active.astype(float), 0.0, _NOT_SOLVED, (), model)


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


class _Warm:
    """The numbers of both tasks; lengths and forces of the earlier one in its SI or in its own units as named."""

    def __init__(self, earlier: Design, hand: Hand, motion: Motion, task: Task, model: Model) -> None:
        self.hand, self.motion, self.task, self.model = hand, motion, task, model
        self.old = build_model(earlier.task)
        self.scale = self.old.units.length / model.units.length
        self.when = _stretched(self.old, model)

    def start(self) -> WholeHand:
        """Everything at the samples of the new task."""
        model, motion = self.model, self.motion
        contacts = [model.contact_names.index(finger.name) for finger in self.hand.fingers]
        order = np.argsort(contacts)
        names = motion.contact_names
        columns = [names.index(name) for name in (*model.contact_names, *(["ground"] if model.ground else []))]
        turns = np.array([pin.Quaternion(*q).matrix() for q in motion.object_orientation])
        forces = np.einsum("sji,scj->sci", turns, motion.contact_force[:, columns]) / self.old.units.force
        active = motion.contact_active[held(motion.time, self.when)][:, columns]
        position, vector = self._path(turns)
        joints = _spline(motion.time, motion.joint_angles)(self.when)
        angles = tuple(joints[:, self._joints(int(i))] for i in order)
        at = model.schedule.keyframe_samples
        palm_position, palm_quaternion = self._palm()
        return WholeHand(
            fingers=tuple(self._finger(self.hand.fingers[i], a[at]) for i, a in zip(order, angles, strict=True)),
            contacts=tuple(contacts[i] for i in order),
            pose=np.hstack([position, vector])[at],
            angles=angles,
            palm_position=palm_position,
            palm_quaternion=palm_quaternion,
            position=position,
            vector=vector,
            point=self._points(columns),
            force=self._between(forces) * active[:, :, None],
            active=active,
            solution=_NOT_SOLVED,
        )

    def _joints(self, finger: int) -> list[int]:
        """Columns of a finger's joint angles."""
        names = self.motion.joint_names
        return [names.index(f"finger{finger}_joint{j}") for j in range(len(self.hand.fingers[finger].links))]

    def _finger(self, finger: Finger, angles: Array) -> FingerSeed:
        length = self.model.units.length
        return FingerSeed(
            base=np.array(finger.base[:2]) / length,
            lengths=np.array([link.length for link in finger.links]) / length,
            frames=np.array([frame_about(np.array(link.axis)) for link in finger.links]),
            axes=np.zeros((len(finger.links), 2)),
            angles=angles,
            tips=np.zeros((0, 2)),
        )

    def _between(self, values: Array) -> Array:
        """Values (S, ...) at the earlier samples, linear in between, at the new ones."""
        return np.asarray(np.tensordot(linear(self.motion.time, self.when), values, axes=1))

    def _path(self, turns: Array) -> tuple[Array, Array]:
        """Position (S, 3) and rotation vector (S, 3) of the object: the earlier ones, moved by what goals moved."""
        model, old, time = self.model, self.old, self.motion.time
        reference = pin.Quaternion(*old.reference).matrix()
        vectors = [np.zeros(3)]
        for turn in turns:
            vectors.append(nearest_exponential(turn @ reference.T, vectors[-1]))
        position = _spline(time, self.motion.object_position / model.units.length)(self.when)
        vector = _spline(time, np.array(vectors[1:]))(self.when)
        goals = model.schedule.keyframes[list(model.schedule.goals)]
        blend = linear(goals, eased(goals, model.schedule.samples))
        position = position + blend @ (model.goal_positions - self.scale * old.goal_positions)
        vector = vector + blend @ (model.goal_vectors - old.goal_vectors)
        if model.tool is not None and old.tool is not None:
            moved = model.tool - self.scale * old.tool
            position = position - np.array([pin.exp3(v) @ moved for v in vector])
        return position, vector

    def _palm(self) -> tuple[Array, Array]:
        """Palm's position (S, 3) and quaternion (S, 4): the task's, and where it may move, off it as it was."""
        model, old, motion = self.model, self.old, self.motion
        if not self.task.palm.may_move:
            return model.palm_position, model.palm_quaternion
        off = motion.base_position / old.units.length - old.palm_position
        turned = []
        for was, given in zip(motion.base_orientation, old.palm_quaternion, strict=True):
            turned.append(pin.log3(pin.Quaternion(*was).matrix() @ pin.Quaternion(*given).matrix().T))
        off, turned = (_spline(motion.time, values)(self.when) for values in (self.scale * off, np.array(turned)))
        given = [pin.Quaternion(*q).matrix() for q in model.palm_quaternion]
        quaternions = [quaternion(pin.exp3(v) @ g) for v, g in zip(turned, given, strict=True)]
        return model.palm_position + off, np.array(quaternions)

    def _points(self, columns: list[int]) -> Array:
        """Contact points (S, C, 3) on the object as it is now, moved by what the task's contacts moved."""
        model, old = self.model, self.old
        patches, before, capsules = model.patches, old.patches, model.capsules
        if model.ground is not None and old.ground is not None:
            patches, before = np.vstack([patches, model.ground.patch]), np.vstack([before, old.ground.patch])
            capsules = np.vstack([capsules, model.ground.capsule])
        fingers = [old.contact_names.index(name) for name in model.contact_names]
        before = before[[*fingers, *range(len(fingers), len(before))]]
        points = self._between(self.motion.contact_point_object[:, columns] / model.units.length)
        points = points + patches - self.scale * before
        return np.array([on_capsules(p, capsules, inward_normals(p, capsules)) for p in points])


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
