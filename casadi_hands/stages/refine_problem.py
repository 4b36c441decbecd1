"""The refine stage's problem: its variables, and every block bound to its knots."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.nlp import Kernel, Problem, Rows
from casadi_hands.stages import exact_fingers as finger
from casadi_hands.stages import exact_object as body
from casadi_hands.stages.branch import SIZES
from casadi_hands.stages.model import Model
from casadi_hands.stages.object_side import CLEARANCE, GOAL_TOLERANCE, MOST_FORCE
from casadi_hands.stages.palm_motion import carried_velocity
from casadi_hands.stages.projection import Anchors
from casadi_hands.stages.structure import Structure
from casadi_hands.stages.synthesis import AXIS_RANGE

JOINT_MARGIN = 0.005  # rad, so that a smooth curve through the knots stays within the limits between them
_FREE = (-np.inf, np.inf)
_PALM_BETWEEN = ("palm_position_between", "palm_quaternion_between")  # in the middle of intervals
_HELD = {"pressing": (0.0, np.inf), "cone": (0.0, np.inf)}


class RefineProblem:
    """The problem of one structure.

    Attributes:
        structure: it is built for.
        guarded: whether fingers are kept clear of each other between knots, too.
        problem: its variables, parameters and blocks.
        knots: their number.
        pushed: those at which the task's perturbations act.
        anchors: of a projection.
        knots_of: for each block with constraints the knot of each of its instances; none where a block has no time.
    """

    def __init__(self, structure: Structure, guarded: bool = False) -> None:
        """Declare variables and parameters and bind every block."""
        self.structure, self.guarded, self.problem = structure, guarded, Problem()
        self.knots_of: dict[str, NDArray[np.int64]] = {}
        model = structure.model
        self.knots = len(model.schedule.samples)
        self.pushed = pushed_knots(model)
        self._declare_variables()
        self._declare_parameters()
        self._bind_physics()
        self._bind_object()
        if structure.grounded:
            self._bind_ground()
        for i in range(len(structure.contacts)):
            self._bind_contact(i)
            self._bind_clearance(i)
            self._bind_shape(i)
            for j in range(i):
                self._bind_pair(i, j)
        self.anchors = Anchors(self.problem)

    # Variables and parameters.

    def _declare_variables(self) -> None:
        problem, structure, model = self.problem, self.structure, self.structure.model
        count, width = self.knots, 3 * len(structure.columns)
        self.pose = problem.variable("pose", (count, 6))
        self.rate = problem.variable("rate", (count, 6))
        self.point = problem.variable("point", (count, width))
        self.force = problem.variable("force", (count, width), -MOST_FORCE, MOST_FORCE)
        self.wrench = problem.variable("wrench", (count, 6))
        self.middle = problem.variable("middle_torque", (count - 1, 3))
        if len(self.pushed):
            shape = (len(self.pushed), width)
            self.push = problem.variable("force_pushed", shape, -MOST_FORCE, MOST_FORCE)
        lowest, highest = model.joint_limits
        reach = model.palm_radius
        self.angles, self.shape = [], []
        for c, n in zip(structure.contacts, structure.joints, strict=True):
            limits = lowest + JOINT_MARGIN, highest - JOINT_MARGIN
            self.angles.append(problem.variable(f"angles{c}", (count, n), *limits))
            self.shape.append(
                [
                    problem.variable(f"base{c}", (1, 2), -reach, reach),
                    problem.variable(f"lengths{c}", (1, n), *model.link_length),
                    problem.variable(f"axes{c}", (1, 2 * n), -AXIS_RANGE, AXIS_RANGE),
                ]
            )

    def _declare_parameters(self) -> None:
        problem, structure, count = self.problem, self.structure, self.knots
        widths = {"reference": 4, "gravity": 3, "inertial": 1, "inertia": 9, "inverse": 9, "radius": 1}
        widths |= {
            "palm_radius": 1,
            "ground_height": 1,
            "friction": 1,
            "primitives": 7 * len(structure.model.primitives),
        }
        for name, width in widths.items():
            problem.parameter(name, (1, width))
        problem.parameter("step", (count - 1, 1))
        for name, width in (("palm_position", 3), ("palm_quaternion", 4), ("wanted_pose", 6)):
            problem.parameter(name, (count, width))
        for name, width in (("palm_position_between", 3), ("palm_quaternion_between", 4)):
            problem.parameter(name, (count - 1, width))
        for c in structure.columns:
            problem.parameter(f"capsule{c}", (1, 7))
            for name in ("wanted_point", "wanted_force"):
                problem.parameter(f"{name}{c}", (count, 3))
        for c, n in zip(structure.contacts, structure.joints, strict=True):
            problem.parameter(f"helper{c}", (count, 3))
            problem.parameter(f"tie{c}", (1, 1))
            if n in SIZES:
                problem.parameter(f"branch{c}", (count, SIZES[n]))
            for name, width in (("frames", 9 * n), ("wanted_base", 2), ("wanted_lengths", n), ("wanted_axes", 2 * n)):
                problem.parameter(f"{name}{c}", (1, width))

    def _at(self, names: tuple[str, ...], knots: NDArray[np.int64] | None = None) -> list[NDArray[np.int64]]:
        """Positions of parameters, of those that differ from knot to knot only the rows of ``knots``."""
        positions = [self.problem.parameters[name] for name in names]
        return [p if knots is None or len(p) == 1 else p[knots] for p in positions]

    def _steps(self, *intervals: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        """Positions of the times from knots to the next ones."""
        return [self.problem.parameters["step"][i] for i in intervals]

    def _bind(
        self,
        knots: NDArray[np.int64],
        kernel: Kernel,
        rows: list[Rows],
        parameters: list[NDArray[np.int64]],
        bounds: Mapping[str, tuple[ArrayLike, ArrayLike]],
        name: str = "",
    ) -> None:
        """Bind a block, and keep the knot that each of its instances is at, or begins at."""
        self.problem.bind(kernel, rows, parameters, bounds, name)
        self.knots_of[name or kernel.name] = knots

    # The object.

    def _bind_physics(self) -> None:
        problem, columns = self.problem, len(self.structure.columns)
        every, now, later = np.arange(self.knots), np.arange(self.knots - 1), np.arange(1, self.knots)
        states = [r.take(k) for k in (now, later) for r in (self.pose, self.rate)]
        wrenches = [self.wrench.take(now), self.wrench.take(later), self.middle]
        common = self._at(("reference", "step", "gravity", "inertial", "inertia", "inverse"))
        self._bind(now, body.physics(), [*states, *wrenches], common, {"defect": (0, 0)})
        self._bind(every, body.wrench(columns), [self.wrench, self.point, self.force], [], {"sum": (0, 0)})
        inner = np.arange(self.knots - 2)
        carried = np.hstack([carried_velocity(self.structure.model), np.zeros((self.knots, 3))])
        rates = [self.rate.plus(-carried).take(inner + k) for k in range(3)]
        problem.bind(body.object_jerk(), rates, self._steps(inner, inner + 1))
        ends = np.array([0, self.knots - 1])
        still = [r.take(ends) for r in (self.pose, self.wrench)]
        self._bind(ends, body.equilibrium(), still, self._at(("reference", "gravity")), {"sum": (0, 0)})
        contacts = [r.take(k) for k in (now, later) for r in (self.point, self.force)]
        self._bind(now, body.middle_torque(columns), [self.middle, *contacts], [], {"sum": (0, 0)})
        problem.bind(body.force_change(columns), [self.force.take(now), self.force.take(later)])
        problem.bind(body.stay_on_path(), [self.pose], self._at(("wanted_pose",)))
        if len(self.pushed):
            for kind in ("force", "torque"):
                problem.parameter(f"push_{kind}", (len(self.pushed), 3))
            rows = [self.pose.take(self.pushed), self.wrench.take(self.pushed), self.point.take(self.pushed), self.push]
            external = self._at(("reference", "push_force", "push_torque"))
            self._bind(self.pushed, body.pushed(columns), rows, external, {"sum": (0, 0)})

    def _bind_object(self) -> None:
        problem, model = self.problem, self.structure.model
        kernel = body.object_apart(len(model.primitives), model.ground is not None)
        places = ("reference", "palm_position", "palm_quaternion", "palm_radius", "ground_height", "primitives")
        bounds = {"palm": (CLEARANCE, np.inf), "ground": (-GOAL_TOLERANCE, np.inf)}
        self._bind(np.arange(self.knots), kernel, [self.pose], self._at(places), bounds)
        if model.tool is None:
            goals = problem.parameter("goals", (len(model.goal_positions), 6))
            at = model.schedule.goal_samples
            problem.bind(body.meet_goal(), [self.pose.take(at)], [goals])
        else:
            problem.parameter("tool", (1, 3))
            problem.parameter("tool_path", (self.knots, 3))
            parameters = self._at(("reference", "tool", "tool_path"))
            self._bind(np.arange(self.knots), body.tool_point(), [self.pose], parameters, {"on_path": _FREE})

    def _bind_ground(self) -> None:
        problem, structure = self.problem, self.structure
        problem.parameter("ground_friction", (1, 1))
        column, c = len(structure.contacts), structure.columns[-1]
        span = 3 * column, 3 * column + 3
        touching = np.flatnonzero(structure.touching[:, column])
        rows = [r.take(touching) for r in (self.pose, self.point.entries(*span), self.force.entries(*span))]
        names = ("reference", f"capsule{c}", "ground_height", "ground_friction", f"wanted_point{c}", f"wanted_force{c}")
        surfaces = {"on_surfaces": (0, 0), "opposed": (0, 0), "facing": (-np.inf, -0.5)}
        self._bind(touching, body.ground_contact(), rows, self._at(names, touching), surfaces | _HELD)
        start = np.flatnonzero(structure.active[:-1, column])
        rows = [r.take(k) for k in (start, start + 1) for r in (self.pose, self.point.entries(*span))]
        self._bind(
            start,
            body.ground_rolling(),
            rows,
            self._at(("reference", f"capsule{c}", "step"), start),
            {"no_slip": _FREE},
        )
        pushed = np.flatnonzero(structure.active[self.pushed, column])
        if len(pushed):
            knots = self.pushed[pushed]
            rows = [self.pose.take(knots), self.push.take(pushed).entries(*span)]
            self._bind(knots, body.ground_held(), rows, self._at(("reference", "ground_friction")), _HELD)

    # The fingers.

    def _scene(self, c: int, knots: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        return self._at(("reference", "palm_position", "palm_quaternion", f"capsule{c}", "radius"), knots)

    def _bind_contact(self, i: int) -> None:
        structure = self.structure
        c, n, torque = structure.contacts[i], structure.joints[i], structure.model.torque_limit
        frames, shape, span = self._at((f"frames{c}",)), self.shape[i], (3 * i, 3 * i + 3)
        point, angles = self.point.entries(*span), self.angles[i]
        held = {**_HELD, "passive": _FREE, "torque": (-torque, torque)}  # torque is bound only where the task limits it

        def rows(knots: NDArray[np.int64], *of: Rows) -> list[Rows]:
            return [*[r.constant(len(knots)) for r in shape], *[r.take(knots) for r in of]]

        touching = np.flatnonzero(structure.touching[:, i])
        parameters = [*frames, *self._scene(c, touching)]
        parameters += self._at(("friction", f"tie{c}", f"wanted_point{c}", f"wanted_force{c}"), touching)
        if n in SIZES:
            parameters += self._at((f"branch{c}",), touching)
        surfaces = {"on_object": (0.0, 0.0), "on_link": (0.0, 0.0), "regular": _FREE}
        kernel = finger.contact(n, np.isfinite(torque))
        variables = rows(touching, self.pose, point, self.force.entries(*span), angles)
        self._bind(touching, kernel, variables, parameters, surfaces | held, f"contact{c}")
        pushed = np.flatnonzero(structure.active[self.pushed, i])
        if len(pushed):
            knots = self.pushed[pushed]
            variables = [*rows(knots, self.pose, point, angles), self.push.take(pushed).entries(*span)]
            parameters = [*frames, *self._scene(c, knots), *self._at(("friction",))]
            kernel = finger.held(n, np.isfinite(torque))
            self._bind(knots, kernel, variables, parameters, held, f"held{c}")
        start = np.flatnonzero(structure.active[:-1, i])
        variables = rows(start, self.pose, point, angles)
        variables += [r.take(start + 1) for r in (self.pose, point, angles)]
        parameters = [*frames, *self._scene(c, start), *self._scene(c, start + 1)]
        parameters += self._at((f"helper{c}", "step"), start)
        self._bind(start, finger.rolling(n), variables, parameters, {"no_slip": _FREE}, f"rolling{c}")
        # Else a finger may be stretched out between knots, or folded, and find itself there on more of them.
        halves = structure.middles.weights(start)
        variables = [r.constant(len(start)) for r in shape]
        variables += [r.combine(halves) for r in (self.pose, point, angles, self.force.entries(*span))]
        parameters = [*frames, *self._at(("reference", *_PALM_BETWEEN, f"capsule{c}", "radius"), start)]
        self._bind(start, finger.supplied(n), variables, parameters, {"passive": _FREE}, f"midway{c}")

    def _bind_clearance(self, i: int) -> None:
        structure, model = self.structure, self.structure.model
        c, n = structure.contacts[i], structure.joints[i]
        touched = int(np.argmin(np.abs(model.primitives - model.capsules[c]).sum(axis=1)))
        touching, idle = structure.touching[:, i], np.flatnonzero(~structure.active[:-1, i])

        def bind(
            kind: str,
            knots: NDArray[np.int64],
            rows: list[Rows],
            parameters: list[NDArray[np.int64]],
            least: float,
            skipped: int | None,
        ) -> None:
            kernel = finger.apart(n, len(model.primitives), skipped, model.ground is not None)
            rows = [*[r.constant(len(knots)) for r in self.shape[i]], *rows]
            self._bind(knots, kernel, rows, parameters, {"clear": (least, np.inf)}, f"{kind}{c}")

        def scene(at: NDArray[np.int64], *palm: str) -> list[NDArray[np.int64]]:
            rest = ("radius", "palm_radius", "ground_height", "primitives")
            return self._at((f"frames{c}", "reference", *palm, *rest), at)

        for kind, where, skipped in (("apart_touching", touching, touched), ("apart", ~touching, None)):
            knots = np.flatnonzero(where)
            if len(knots):
                rows = [self.pose.take(knots), self.angles[i].take(knots)]
                bind(kind, knots, rows, scene(knots, "palm_position", "palm_quaternion"), CLEARANCE, skipped)
        if len(idle):  # a lifted finger is quick, and must not cut through the object's edge between two knots
            halves = structure.middles.weights(idle)
            rows = [self.pose.combine(halves), self.angles[i].combine(halves)]
            bind("apart_between", idle, rows, scene(idle, *_PALM_BETWEEN), 0.0, None)

    def _bind_shape(self, i: int) -> None:
        """A finger's morphology, and its joints' motion: mirrored at both ends, so that it starts and ends at rest."""
        problem, structure, model, count = self.problem, self.structure, self.structure.model, self.knots
        c, n, speed = structure.contacts[i], structure.joints[i], model.speed_limit
        inner = np.arange(-1, count + 1)
        mirrored = np.where(inner < 0, 1, np.where(inner >= count, count - 2, inner))
        three = [self.angles[i].take(mirrored[offset : offset + count]) for offset in range(3)]
        steps = self._steps(*(np.clip(np.arange(count) - back, 0, count - 2) for back in (1, 0)))
        kernel, limits = finger.joint_motion(n, np.isfinite(speed)), {"speed": (-speed, speed)}
        self._bind(np.arange(count), kernel, three, steps, limits, f"joint_motion{c}")
        switches = np.flatnonzero(np.diff(structure.active[:, i].astype(int))) + 1
        first = np.array([k for k in range(count - 3) if k + 1 not in switches and k + 2 not in switches], int)
        four = [self.angles[i].take(first + offset) for offset in range(4)]
        problem.bind(finger.joint_jerk(n), four, self._steps(first, first + 1, first + 2))
        wanted = self._at((f"wanted_base{c}", f"wanted_lengths{c}", f"wanted_axes{c}"))
        reach = (model.palm_radius - model.link_radius) ** 2
        problem.bind(finger.stay(n), self.shape[i], wanted, {"on_palm": (0, reach)}, f"stay{c}")

    def _bind_pair(self, i: int, j: int) -> None:
        structure = self.structure
        c, d = structure.contacts[i], structure.contacts[j]
        kernel = finger.fingers_apart(structure.joints[i], structure.joints[j])
        parameters = self._at((f"frames{c}", f"frames{d}", "radius"))

        def bind(kind: str, knots: NDArray[np.int64], angles: list[Rows], least: float) -> None:
            rows: list[Rows] = []
            for k, turned in zip((i, j), angles, strict=True):
                rows += [*[r.constant(len(knots)) for r in self.shape[k]], turned]
            self._bind(knots, kernel, rows, parameters, {"clear": (least, np.inf)}, f"{kind}{c}_{d}")

        every = np.arange(self.knots)
        bind("fingers_apart", every, [self.angles[k] for k in (i, j)], CLEARANCE)
        if self.guarded:
            knots, weights = structure.inner.interval, structure.inner.weights()
            bind("fingers_between", knots, [self.angles[k].combine(weights) for k in (i, j)], 0.0)


def pushed_knots(model: Model) -> NDArray[np.int64]:
    """Knots at which the task's perturbations act."""
    return np.flatnonzero(np.any(np.hstack([model.perturbation_force, model.perturbation_torque]), axis=1))
