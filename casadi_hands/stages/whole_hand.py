"""Stage 3: object, contacts and joints together, the morphology fixed (section 2.2.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from casadi_hands.nlp import Options, Problem, Rows, Solution, Solver
from casadi_hands.stages import soft_fingers
from casadi_hands.stages.finger_numbers import contact_kinematics
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.grasp import on_capsules
from casadi_hands.stages.model import Model, palm_from_world, quaternion
from casadi_hands.stages.object_side import (
    bind_object,
    declare_object,
    object_parameters,
    pose_bounds,
    sampled_points,
    sizes,
    term_weights,
)
from casadi_hands.stages.palm_motion import poses_at
from casadi_hands.stages.synthesis import MARGIN, FingerSeed
from casadi_hands.stages.target import string_of

Array = NDArray[np.float64]
# The start is near what is wanted: a small barrier, and no push away from bounds, halve the iterations of a large one.
OPTIONS = Options(mu_init=1e-3, extra=(("bound_push", 1e-4), ("bound_frac", 1e-4)))
BROKEN = 1e-2  # violation of a solve that lost its way, from which another barrier leads elsewhere
_FORCES = "force", "force_perturbed"
FARTHEST_PALM = 2.0  # half extents and rad, how far a palm that may move leaves its given motion


@dataclass(frozen=True)
class WholeHand:
    """A motion of object and hand at the samples; nondimensional, see ``Model``.

    Attributes:
        fingers: morphology, one for each contact in ``contacts``; their ``angles`` are at the keyframes.
        contacts: index of each finger's contact.
        angles: for each finger (S, n), rad.
        palm_position: (S, 3) world.
        palm_quaternion: (S, 4).
        position: (S, 3) of the object, world.
        vector: (S, 3) its rotation vector from the reference.
        point: (S, C, 3) contacts on the object, object frame.
        force: (S, C, 3) object frame.
        active: (S, C) bool.
        solution: of the solver.
        disturbed: (S, C, 3) forces that hold the object on the same path under the task's perturbations; None without.
    """

    fingers: tuple[FingerSeed, ...]
    contacts: tuple[int, ...]
    angles: tuple[Array, ...]
    palm_position: Array
    palm_quaternion: Array
    position: Array
    vector: Array
    point: Array
    force: Array
    active: NDArray[np.bool_]
    solution: Solution
    disturbed: Array | None = None


class WholeHandStage:
    """The stage's problem for one structure.

    Args:
        model: the task.
        contacts: index of each finger's contact.
        joints: number of joints of each finger.
        palm_moves: whether the palm may leave its given motion.
    """

    def __init__(self, model: Model, contacts: tuple[int, ...], joints: tuple[int, ...], palm_moves: bool) -> None:
        self.model, self.contacts, self.joints, self.palm_moves = model, contacts, joints, palm_moves
        self.problem = problem = Problem()
        schedule = model.schedule
        keyframes, samples, _ = sizes(model)
        side = declare_object(problem, model)
        angles = {
            c: problem.variable(f"angles{c}", (keyframes, n), *model.joint_limits)
            for c, n in zip(contacts, joints, strict=True)
        }
        palm: Rows | None = None
        if palm_moves:
            palm = problem.variable("palm", (keyframes, 6), -FARTHEST_PALM, FARTHEST_PALM)
        bind_object(problem, model, side, palm)
        for name in ("link_radius", "lowest", "highest", "margin"):
            problem.parameter(name, (1, 1))
        problem.parameter("all_primitives", (1, 7 * len(model.primitives)))
        for name, width in (("palm_position_before", 3), ("palm_quaternion_before", 4)):
            problem.parameter(name, (samples, width))
        at = {offset: schedule.spline(offset) for offset in (-1, 0, 1)}
        palms = [] if palm is None else [palm.combine(schedule.spline(offset)) for offset in (0, -1)]
        for c, n in zip(contacts, joints, strict=True):
            self._declare_morphology(c, n)
        p = problem.parameters
        given = [p["palm_position"], p["palm_quaternion"]]
        before = [p["palm_position_before"], p["palm_quaternion_before"]]
        for i, (c, n) in enumerate(zip(contacts, joints, strict=True)):
            shape, span = self._morphology(c), (3 * c, 3 * c + 3)
            now = angles[c].combine(at[0])
            rows = [side.pose[1], side.pose[0], side.point[1].entries(*span), side.force.entries(*span)]
            rows += [side.activity.entries(c, c + 1), now, angles[c].combine(at[-1]), *palms]
            tail = [p["reference"], p["link_radius"], p["friction"], p["sharpness"], p["step"]]
            problem.bind(soft_fingers.touch(n, palm_moves), rows, [*given, *before, *shape, *tail])
            three = [angles[c].combine(at[offset]) for offset in (-1, 0, 1)]
            problem.bind(soft_fingers.move(n), three, [*shape, p["lowest"], p["highest"], p["step"]])
            tail = [
                p[name]
                for name in ("reference", "link_radius", "palm_radius", "ground_height", "margin", "all_primitives")
            ]
            kernel = soft_fingers.object_clearance(n, len(model.primitives), palm_moves)
            problem.bind(kernel, [side.pose[1], now, *palms[:1]], [*given, *shape, *tail])
            for d, m in zip(contacts[:i], joints[:i], strict=True):
                kernel = soft_fingers.finger_clearance(n, m)
                both = [*shape, *self._morphology(d)]
                problem.bind(kernel, [now, angles[d].combine(at[0])], [*both, p["link_radius"], p["margin"]])
        if palm is not None:
            inner = np.arange(keyframes)
            three = [palm.take(np.clip(inner + offset, 0, keyframes - 1)) for offset in (-1, 0, 1)]
            problem.parameter("keyframe_step", (1, 1))
            problem.bind(soft_fingers.palm_motion(), three, [p["keyframe_step"]])
        self.solver = Solver(problem)

    def _declare_morphology(self, contact: int, joints: int) -> None:
        for name, width in (("frames", 9 * joints), ("base", 2), ("lengths", joints), ("axes", 2 * joints)):
            self.problem.parameter(f"{name}{contact}", (1, width))

    def _morphology(self, contact: int) -> list[NDArray[np.int64]]:
        return [self.problem.parameters[f"{name}{contact}"] for name in ("frames", "base", "lengths", "axes")]

    def solve(
        self,
        floating: Floating,
        fingers: tuple[FingerSeed, ...],
        weights: Mapping[str, float],
        options: Options = OPTIONS,
    ) -> WholeHand:
        """Start from stage 1's motion and stage 2's angles, contacts to the object's point nearest the tip."""
        model = self.model
        flags = floating.active.astype(float)
        start = {
            "pose": floating.pose,
            "point": self._start_points(floating, fingers).reshape(len(flags), -1),
            "force": floating.force.reshape(len(floating.force), -1),
            "activity": flags,
            **{f"angles{c}": f.angles for c, f in zip(self.contacts, fingers, strict=True)},
        }
        if model.perturbed:
            start["force_perturbed"] = floating.solution.values["force_perturbed"]
        bounds = pose_bounds(model)
        parameters = self._parameters(fingers) | term_weights(self.problem, model, weights)
        lower, upper = ({"activity": flags, "pose": bound} for bound in bounds)
        solution = self.solver.solve(start, parameters, options, lower, upper)
        if not solution.violation <= BROKEN:
            other = replace(options, mu_init=10 * options.mu_init)
            again = self.solver.solve(start, parameters, other, lower, upper)
            solution = min(solution, again, key=lambda found: found.violation)
        return self._result(solution, floating, fingers)

    def _start_points(self, floating: Floating, fingers: tuple[FingerSeed, ...]) -> Array:
        """Contact points (N, C, 3): the object's point nearest to each finger's contact of stage 2."""
        model, points = self.model, floating.point.copy()
        for finger, c in zip(fingers, self.contacts, strict=True):
            touched, _ = contact_kinematics(finger, string_of(floating.active[:, c]), model.link_radius)
            for k, in_palm in enumerate(touched):
                rotation, position = palm_from_world(model, model.schedule.keyframes[k])
                pose = floating.pose[k]
                turn = pin.exp3(pose[3:]) @ pin.Quaternion(*model.reference).matrix()
                local = turn.T @ (rotation.T @ in_palm + position - pose[:3])
                capsule = model.capsules[c : c + 1]
                points[k, c] = on_capsules(local[None], capsule)[0]
        return points

    def _parameters(self, fingers: tuple[FingerSeed, ...]) -> dict[str, Array | float]:
        model = self.model
        values = object_parameters(model)
        values |= {
            "link_radius": model.link_radius,
            "lowest": model.joint_limits[0],
            "highest": model.joint_limits[1],
            "margin": MARGIN,
            "all_primitives": model.primitives.reshape(1, -1),
            "ground_height": model.ground_height,
        }
        before = model.palm_path.at(model.schedule.at(-1))
        values |= {"palm_position_before": before[:, :3], "palm_quaternion_before": before[:, 3:]}
        for c, finger in zip(self.contacts, fingers, strict=True):
            values[f"frames{c}"] = finger.frames.transpose(0, 2, 1).reshape(1, -1)
            values[f"base{c}"], values[f"lengths{c}"] = finger.base, finger.lengths
            values[f"axes{c}"] = finger.axes.reshape(1, -1)
        if self.palm_moves:
            values["keyframe_step"] = float(np.mean(np.diff(model.schedule.keyframes)))
        return values

    def _result(self, solution: Solution, floating: Floating, fingers: tuple[FingerSeed, ...]) -> WholeHand:
        model, values, schedule = self.model, solution.values, self.model.schedule
        contacts = sizes(model)[2]
        joined = schedule.spline()
        pose = poses_at(model, values["pose"])
        moved = tuple(
            FingerSeed(f.base, f.lengths, f.frames, f.axes, values[f"angles{c}"], f.tips)
            for c, f in zip(self.contacts, fingers, strict=True)
        )
        position, orientation = model.palm_position, model.palm_quaternion
        if self.palm_moves:
            # Twice differentiable, as a palm moves that carries a load.
            offset = CubicSpline(schedule.keyframes, values["palm"], bc_type="clamped")(schedule.samples)
            position = position + offset[:, :3]
            orientation = np.array([turned(q, v) for q, v in zip(orientation, offset[:, 3:], strict=True)])
        active = floating.active[schedule.sample_keyframes]
        point = sampled_points(model, values["point"].reshape(-1, contacts, 3))
        forces = {
            name: values[name].reshape(-1, contacts, 3) * active[:, :, None] for name in _FORCES if name in values
        }
        return WholeHand(
            fingers=moved,
            contacts=self.contacts,
            angles=tuple(joined @ f.angles for f in moved),
            palm_position=position,
            palm_quaternion=orientation,
            position=pose[:, :3],
            vector=pose[:, 3:],
            point=point,
            force=forces["force"],
            active=active,
            solution=solution,
            disturbed=forces.get("force_perturbed"),
        )


def turned(start: Array, vector: Array) -> Array:
    """A quaternion turned further by a rotation vector in the world."""
    return quaternion(pin.exp3(vector) @ pin.Quaternion(*start).matrix())
