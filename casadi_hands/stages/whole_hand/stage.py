"""Stage 3: object and hand together, the morphology fixed (section 2.2.4)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from casadi_hands.geometry.bodies import packed, width_of
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.kinematics.numeric import contact_kinematics
from casadi_hands.kinematics.symbols import morphology_sizes
from casadi_hands.nlp import Options, Parameter, Problem, Rows, Solution, Solver
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand_motion import WholeHand, turned
from casadi_hands.problem.model import Model, palm_from_world, sampled_points, sizes
from casadi_hands.problem.palm_motion import poses_at
from casadi_hands.stages.object_motion.binding import ObjectSide, bind_object, declare_object
from casadi_hands.stages.object_motion.values import object_parameters, pose_bounds, term_weights
from casadi_hands.stages.own_terms import bind_own, contact_names
from casadi_hands.stages.synthesis.stage import MARGIN
from casadi_hands.stages.synthesis.target import string_of
from casadi_hands.stages.whole_hand import kernels

Array = NDArray[np.float64]
# The start is near what is wanted: a small barrier, and no push away from bounds, halve the iterations of a large one.
OPTIONS = Options(mu_init=1e-3, extra=(("bound_push", 1e-4), ("bound_frac", 1e-4)))
BROKEN = 1e-2  # violation of a solve that lost its way, from which another barrier leads elsewhere
FARTHEST_PALM = 2.0  # lengths and rad, how far a palm that may move leaves its given motion


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
            c: problem.variable(f"angles{c}", (keyframes, n), *model.joint_limits, quantity="angles", owner=c)
            for c, n in zip(contacts, joints, strict=True)
        }
        palm: Rows | None = None
        if palm_moves:
            palm = problem.variable("palm", (keyframes, 6), -FARTHEST_PALM, FARTHEST_PALM)
        bind_object(problem, model, side, palm)
        for name in ("link_radius", "tip_radius", "hinge", "lowest", "highest", "margin"):
            problem.parameter(name, (1, 1))
        if model.servo:
            problem.parameter("servo_radius", (1, 1))
        problem.parameter("bodies", (1, width_of(model.kinds)))
        for name, width in (("palm_position", 3), ("palm_quaternion", 4)):
            problem.parameter(f"{name}_before", (samples, width), quantity=name, when=-1)
        for c, n in zip(contacts, joints, strict=True):
            for name, width in {"frames": 9 * n, **morphology_sizes(n)}.items():
                problem.parameter(f"{name}{c}", (1, width), quantity=name, owner=c)
        for c in contacts:
            self._bind_finger(side, c, angles, palm)
        if palm is not None:
            inner = np.arange(keyframes)
            three = [palm.take(np.clip(inner + offset, 0, keyframes - 1)) for offset in (-1, 0, 1)]
            step = problem.parameter("keyframe_step", (1, 1))
            problem.bind(kernels.palm_motion(), palm=three, keyframe_step=step)
        rows = {"pose": side.pose[1], "point": side.point[1], "force": side.force, "invariant": side.invariant}
        sampled = {c: each.combine(schedule.spline()) for c, each in angles.items()}
        bind_own(problem, model, "whole_hand", contact_names(model), sampled, **rows)
        self.solver = Solver(problem)

    def _bind_finger(self, side: ObjectSide, c: int, angles: Mapping[int, Rows], palm: Rows | None) -> None:
        """Bind what is a finger's, and what keeps it clear of the fingers before it."""
        problem, model, schedule = self.problem, self.model, self.model.schedule
        joints = dict(zip(self.contacts, self.joints, strict=True))
        before, now, after = (angles[c].combine(schedule.spline(offset), offset) for offset in (-1, 0, 1))
        shape, span = self._morphology(c), (3 * c, 3 * c + 3, c)
        given = problem.given("palm_position", "palm_quaternion", "palm_position_before", "palm_quaternion_before")
        moved = {} if palm is None else {"palm": palm.combine(schedule.spline(), 0)}
        moved_before = {} if palm is None else {"palm_before": palm.combine(schedule.spline(-1), -1)}
        problem.bind(
            kernels.touch(joints[c], self.palm_moves),
            pose=side.pose[1],
            pose_before=side.pose[0],
            point=side.point[1].entries(*span),
            force=side.force.entries(*span),
            invariant=side.invariant.entries(c, c + 1, c),
            angles=now,
            angles_before=before,
            **moved,
            **moved_before,
            **given,
            **shape,
            **problem.given("reference", "link_radius", "tip_radius", "hinge", "friction", "sharpness", "step"),
        )
        palm_pose = ("palm_position", "palm_quaternion")
        limits = problem.given("lowest", "highest", "step")
        problem.bind(kernels.move(joints[c]), angles=(before, now, after), **shape, **limits)
        radii = ("link_radius", "tip_radius")
        around = ("reference", *radii, "palm_radius", "ground_height", "margin", "bodies", *palm_pose)
        servos = ("servo_radius",) if model.servo else ()
        problem.bind(
            kernels.object_clearance(joints[c], model.kinds, self.palm_moves, bool(servos)),
            pose=side.pose[1],
            angles=now,
            **moved,
            **shape,
            **problem.given(*around, *servos),
        )
        for d in self.contacts[: self.contacts.index(c)]:
            other = self._morphology(d)
            problem.bind(
                kernels.finger_clearance(joints[c], joints[d], bool(servos)),
                angles=(now, angles[d].combine(schedule.spline())),
                **{name: (shape[name], other[name]) for name in shape},
                **problem.given(*radii, "margin", *servos),
            )

    def _morphology(self, contact: int) -> dict[str, Parameter]:
        return {name: self.problem[f"{name}{contact}"] for name in ("frames", *morphology_sizes(0))}

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
            "invariant": flags,
            **{f"angles{c}": f.angles for c, f in zip(self.contacts, fingers, strict=True)},
        }
        for scenario in model.scenarios[1:]:
            name = f"force{scenario.suffix}"
            start[name] = floating.solution.values[name]
        bounds = pose_bounds(model)
        parameters = self._parameters(fingers) | term_weights(self.problem, model, weights)
        lower, upper = ({"invariant": flags, "pose": bound} for bound in bounds)
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
            touched, _ = contact_kinematics(finger, string_of(floating.active[:, c]), model.radii(finger.joints))
            for k, in_palm in enumerate(touched):
                rotation, position = palm_from_world(model, model.schedule.keyframes[k])
                pose = floating.pose[k]
                turn = pin.exp3(pose[3:]) @ pin.Quaternion(*model.reference).matrix()
                local = turn.T @ (rotation.T @ in_palm + position - pose[:3])
                points[k, c] = model.touched[c].on_surface(local)
        return points

    def _parameters(self, fingers: tuple[FingerSeed, ...]) -> dict[str, Array | float]:
        model = self.model
        values = object_parameters(model)
        values |= {
            "link_radius": model.link_radius,
            "tip_radius": model.tip_radius,
            "hinge": model.hinge,
            **({"servo_radius": model.servo} if model.servo else {}),
            "lowest": model.joint_limits[0],
            "highest": model.joint_limits[1],
            "margin": MARGIN,
            "bodies": packed(model.bodies),
            "ground_height": model.ground_height,
        }
        before = model.palm_path.at(model.schedule.at(-1))
        values |= {"palm_position_before": before[:, :3], "palm_quaternion_before": before[:, 3:]}
        for c, finger in zip(self.contacts, fingers, strict=True):
            values[f"frames{c}"] = finger.frames.transpose(0, 2, 1).reshape(1, -1)
            values[f"base{c}"], values[f"lengths{c}"] = finger.base, finger.lengths
            values[f"axes{c}"] = finger.axes.reshape(1, -1)
            values[f"bends{c}"] = finger.bends.reshape(1, -1)
        if self.palm_moves:
            values["keyframe_step"] = float(np.mean(np.diff(model.schedule.keyframes)))
        return values

    def _result(self, solution: Solution, floating: Floating, fingers: tuple[FingerSeed, ...]) -> WholeHand:
        model, values, schedule = self.model, solution.values, self.model.schedule
        contacts = sizes(model)[2]
        joined = schedule.spline()
        pose = poses_at(model, values["pose"])
        moved = tuple(
            FingerSeed(f.base, f.lengths, f.frames, f.axes, f.bends, values[f"angles{c}"], f.tips)
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
        forces = [
            values[f"force{scenario.suffix}"].reshape(-1, contacts, 3) * active[:, :, None]
            for scenario in model.scenarios
        ]
        return WholeHand(
            fingers=moved,
            contacts=self.contacts,
            angles=tuple(joined @ f.angles for f in moved),
            palm_position=position,
            palm_quaternion=orientation,
            position=pose[:, :3],
            vector=pose[:, 3:],
            point=point,
            force=forces[0],
            active=active,
            solution=solution,
            disturbed=forces[1] if model.disturbance else None,
        )
