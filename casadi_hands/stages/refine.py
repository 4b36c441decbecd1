"""Stage 4, beyond the thesis: the same motion as a hard-constrained problem at dense knots, the morphology free.

Newton–Euler by shooting, contact on both surfaces with opposed normals, rolling without slip, friction cones with a
margin, a floor on normal forces, forces that joints supply with a lever, clearance: all constraints. Reached by
continuation: rolling and supply first as soft costs, then as firm ones, then as constraints. (Straight from soft to
hard, the solver was seen to turn fingers to the object's other side.)
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike, NDArray

from casadi_hands.nlp import Options, Problem, Rows, Solution, Solver
from casadi_hands.stages import exact_kernels as kernels
from casadi_hands.stages.model import Model
from casadi_hands.stages.object_side import GOAL_TOLERANCE, MOST_FORCE, MOST_TURN, NO_GROUND
from casadi_hands.stages.synthesis import AXIS_RANGE
from casadi_hands.stages.whole_hand import WholeHand

Array = NDArray[np.float64]
_FAR = (("nlp_scaling_method", "none"), ("mu_strategy", "adaptive"))
_NEAR = (("nlp_scaling_method", "none"), ("bound_push", 1e-6), ("bound_frac", 1e-6))
# The first solve starts far from a solution; from then on an adaptive barrier was seen to leap away from a good start.
SOFT = Options(max_iter=150, tol=1e-3, acceptable_tol=1e-2, constr_viol_tol=1e-6, mu_init=1e-2, extra=_FAR)
CLOSER = Options(max_iter=100, tol=1e-3, acceptable_tol=1e-2, constr_viol_tol=1e-6, mu_init=1e-3, extra=_NEAR)
HARD = Options(max_iter=150, tol=1e-6, acceptable_tol=1e-5, constr_viol_tol=1e-10, mu_init=1e-3, extra=_NEAR)
JOINT_MARGIN = 0.005  # rad, so that a smooth curve through the knots stays within the limits between them
CLEARANCE = 0.02  # half extents, asked of bodies that do not touch
ACCEPTED = 1e-7  # largest violation with which a refined motion is handed on
HOPELESS = 0.1  # half extents of slip: where a firm solve leaves more, rolling is out of the structure's reach
Bounds = dict[str, tuple[ArrayLike, ArrayLike]]
_FREE = (-np.inf, np.inf)


@dataclass(frozen=True)
class Margin:
    """How far inside its limits a motion must stay; exact motions can still balance on a fingertip.

    Attributes:
        friction: share of μ that may be used.
        normal_force: least normal force of an active contact, m·g.
        passive: largest component of a force that no joint supplies, m·g.
    """

    friction: float = 0.5
    normal_force: float = 1.0
    passive: float = 0.009


WEIGHTS = {
    "slip": 3.0,
    "passive_force": 3.0,
    "spin": 0.1,
    "stay_point": 1.0,
    "stay_force": 0.02,
    "friction_margin": 0.02,
    "force_change": 0.5,
    "joint_acceleration": 1e-3,
    "object_acceleration": 1e-2,
    "stay_design": 0.02,
    "stay_path": 1.0,
}
FIRM = {"slip": 100.0, "passive_force": 30.0}


@dataclass(frozen=True)
class Refined:
    """A motion that meets its constraints, or how far it got.

    Attributes:
        hand: as the whole-hand stage's, with the design as it is now.
        exact: whether every constraint is met within ``ACCEPTED``.
        worst: (constraint, violation) of the last solve.
        slips: for each contact the slip that its last soft solve was left with, half extents.
        moved: for each contact how far base and lengths moved, half extents, and axes turned, rad.
        runs: every solve: (what, solution).
    """

    hand: WholeHand
    exact: bool
    worst: tuple[str, float]
    slips: dict[str, float]
    moved: dict[str, dict[str, float]]
    runs: tuple[tuple[str, Solution], ...]

    @property
    def slips_hopelessly(self) -> bool:
        """Whether the firm solve was left with so much slip that no exact one was tried."""
        return self.runs[-1][0] == "firm"


class RefineStage:
    """The stage's problem for one structure: joints of each finger and when each contact touches."""

    def __init__(
        self, model: Model, contacts: tuple[int, ...], joints: tuple[int, ...], active: NDArray[np.bool_]
    ) -> None:
        self.model, self.contacts, self.joints = model, contacts, joints
        self.active = active[:, list(contacts)]
        self.touching = self.active | np.vstack([np.zeros((1, len(contacts)), bool), self.active[:-1]])
        self.problem = problem = Problem()
        self.knots = count = len(model.schedule.samples)
        self._declare(count)
        p = problem.parameters
        self._common()
        now, later = np.arange(count - 1), np.arange(1, count)
        states = [r.take(k) for k in (now, later) for r in (self.pose, self.rate)]
        wrenches = [self.wrench.take(now), self.wrench.take(later), self.middle]
        common = [p[name] for name in ("reference", "step", "gravity", "inertial", "inertia", "inverse")]
        problem.bind(kernels.physics(), [*states, *wrenches], common, {"defect": (0, 0)})
        problem.bind(kernels.wrench(len(contacts)), [self.wrench, self.point, self.force], [], {"sum": (0, 0)})
        ends = [r.take(k) for k in (now, later) for r in (self.point, self.force)]
        problem.bind(kernels.middle_torque(len(contacts)), [self.middle, *ends], [], {"sum": (0, 0)})
        problem.bind(kernels.force_change(len(contacts)), [self.force.take(now), self.force.take(later)])
        wanted = problem.parameter("wanted_pose", (count, 6))
        problem.bind(kernels.stay_on_path(), [self.pose], [wanted])
        for i in range(len(contacts)):
            self._bind_finger(i, count)
            for j in range(i):
                self._bind_pair(i, j, count)
        self.solver = Solver(problem)

    def _declare(self, count: int) -> None:
        problem, model = self.problem, self.model
        self.pose = problem.variable("pose", (count, 6))
        self.rate = problem.variable("rate", (count, 6))
        self.point = problem.variable("point", (count, 3 * len(self.contacts)))
        self.force = problem.variable("force", (count, 3 * len(self.contacts)), -MOST_FORCE, MOST_FORCE)
        self.wrench = problem.variable("wrench", (count, 6))
        self.middle = problem.variable("middle_torque", (count - 1, 3))
        shortest, longest = model.link_length
        lowest, highest = model.joint_limits
        reach = model.palm_radius
        self.angles, self.shape = [], []
        for c, n in zip(self.contacts, self.joints, strict=True):
            self.angles.append(
                problem.variable(f"angles{c}", (count, n), lowest + JOINT_MARGIN, highest - JOINT_MARGIN)
            )
            self.shape.append(
                [
                    problem.variable(f"base{c}", (1, 2), -reach, reach),
                    problem.variable(f"lengths{c}", (1, n), shortest, longest),
                    problem.variable(f"axes{c}", (1, 2 * n), -AXIS_RANGE, AXIS_RANGE),
                ]
            )

    def _common(self) -> None:
        problem, model = self.problem, self.model
        count = len(model.schedule.samples)
        widths = {
            "reference": 4,
            "gravity": 3,
            "inertial": 1,
            "inertia": 9,
            "inverse": 9,
            "radius": 1,
            "palm_radius": 1,
        }
        widths |= {"ground_height": 1, "friction": 1, "primitives": 7 * len(model.primitives)}
        for name, width in widths.items():
            problem.parameter(name, (1, width))
        problem.parameter("step", (count - 1, 1))
        problem.parameter("palm_position", (count, 3))
        problem.parameter("palm_quaternion", (count, 4))
        for c in self.contacts:
            problem.parameter(f"capsule{c}", (1, 7))
            problem.parameter(f"helper{c}", (count, 3))
            problem.parameter(f"wanted_point{c}", (count, 3))
            problem.parameter(f"wanted_force{c}", (count, 3))

    def _scene(self, contact: int, knots: NDArray[np.int64]) -> list[NDArray[np.int64]]:
        p = self.problem.parameters
        places = [p["palm_position"][knots], p["palm_quaternion"][knots]]
        return [p["reference"], *places, p[f"capsule{contact}"], p["radius"]]

    def _bind_finger(self, i: int, count: int) -> None:
        problem, model, c, n = self.problem, self.model, self.contacts[i], self.joints[i]
        p = problem.parameters
        frames = problem.parameter(f"frames{c}", (1, 9 * n))
        shape, angles = self.shape[i], self.angles[i]
        point, force = self.point.entries(3 * i, 3 * i + 3), self.force.entries(3 * i, 3 * i + 3)
        touching = np.flatnonzero(self.touching[:, i])
        rows = [
            *[r.constant(len(touching)) for r in shape],
            *[r.take(touching) for r in (self.pose, point, force, angles)],
        ]
        own = [p[f"{name}{c}"][touching] for name in ("helper", "wanted_point", "wanted_force")]
        torque = model.torque_limit
        bounds = {
            "on_surfaces": (0, 0),
            "opposed": (0, 0),
            "facing": (-np.inf, -0.5),
            "pressing": (0, np.inf),
            "cone": (0, np.inf),
            "passive": _FREE,
            "torque": (-torque, torque),  # bound only where the task limits it
        }
        parameters = [frames, *self._scene(c, touching), own[0], p["friction"], *own[1:]]
        problem.bind(kernels.contact(n, c, np.isfinite(torque)), rows, parameters, bounds)
        start = np.flatnonzero(self.active[:-1, i])
        rows = [r.constant(len(start)) for r in shape]
        for knots in (start, start + 1):
            rows += [r.take(knots) for r in (self.pose, point, angles)]
        parameters = [
            frames,
            *self._scene(c, start),
            *self._scene(c, start + 1),
            p[f"helper{c}"][start],
            p["step"][start],
        ]
        problem.bind(kernels.rolling(n, c), rows, parameters, {"no_slip": _FREE})
        self._bind_clearance(i, frames)
        # The motion mirrored at both ends, so that joints start and end at rest.
        knots, inner = np.arange(count), np.arange(-1, count + 1)
        mirrored = np.where(inner < 0, 1, np.where(inner >= count, count - 2, inner))
        three = [angles.take(mirrored[offset : offset + count]) for offset in range(3)]
        speed = model.speed_limit
        steps = p["step"][np.clip(knots - 1, 0, count - 2)]
        problem.bind(kernels.joint_motion(n, c, np.isfinite(speed)), three, [steps], {"speed": (-speed, speed)})
        own = [
            problem.parameter(f"wanted_{name}{c}", (1, k)) for name, k in (("base", 2), ("lengths", n), ("axes", 2 * n))
        ]
        reach = (model.palm_radius - model.link_radius) ** 2
        problem.bind(kernels.stay(n, c), shape, own, {"on_palm": (0, reach)})

    def _bind_clearance(self, i: int, frames: NDArray[np.int64]) -> None:
        problem, model, c, n = self.problem, self.model, self.contacts[i], self.joints[i]
        p = problem.parameters
        primitives = len(model.primitives)
        touched = int(np.argmin(np.abs(model.primitives - model.capsules[c]).sum(axis=1)))
        for knots, skipped in (
            (np.flatnonzero(self.touching[:, i]), touched),
            (np.flatnonzero(~self.touching[:, i]), None),
        ):
            if not len(knots):
                continue
            kernel = kernels.apart(n, primitives, c, skipped, model.ground is not None)
            rows = [*[r.constant(len(knots)) for r in self.shape[i]], self.pose.take(knots), self.angles[i].take(knots)]
            places = [p["palm_position"][knots], p["palm_quaternion"][knots]]
            scene = [p[name] for name in ("radius", "palm_radius", "ground_height", "primitives")]
            problem.bind(kernel, rows, [frames, p["reference"], *places, *scene], {"clear": (CLEARANCE, np.inf)})

    def _bind_pair(self, i: int, j: int, count: int) -> None:
        p, c, d = self.problem.parameters, self.contacts[i], self.contacts[j]
        rows: list[Rows] = []
        for k in (i, j):
            rows += [*[r.constant(count) for r in self.shape[k]], self.angles[k]]
        kernel = kernels.fingers_apart(self.joints[i], self.joints[j], f"{c}_{d}")
        parameters = [p[f"frames{c}"], p[f"frames{d}"], p["radius"]]
        self.problem.bind(kernel, rows, parameters, {"clear": (CLEARANCE, np.inf)})

    def solve(self, start: WholeHand, margin: Margin | None = None) -> Refined:
        """Refine a whole-hand motion: rolling and supply soft, then firm, then constraints."""
        margin = margin or Margin()
        values, parameters = self._start(start), self._parameters(start, margin)
        lower, upper = self._bounds()
        pressing: Bounds = {}
        for i, c in enumerate(self.contacts):
            knots = np.flatnonzero(self.touching[:, i])
            floor = np.where(self.active[knots, i], margin.normal_force, 0.0)[:, None]
            pressing[f"contact{c}.pressing"] = (floor, np.inf)
        roll: Bounds = {f"rolling{c}.no_slip": (0.0, 0.0) for c in self.contacts}
        supply: Bounds = {f"contact{c}.passive": (-margin.passive, margin.passive) for c in self.contacts}
        runs: list[tuple[str, Solution]] = []
        for what, weights, hard, options in (
            ("soft", WEIGHTS, Bounds(), SOFT),
            ("firm", WEIGHTS | FIRM, Bounds(), CLOSER),
            ("exact", WEIGHTS, roll | supply, HARD),
        ):
            weighted: dict[str, ArrayLike] = {
                f"weight.{term}": weights[term] / self.knots for term in self.problem.terms
            }
            solution = self.solver.solve(values, parameters | weighted, options, lower, upper, pressing | hard)
            runs.append((what, solution))
            values = solution.values
            if what == "firm":
                slips = self._slips(solution)
                if max(slips.values()) > HOPELESS:
                    break
        return self._result(start, runs, slips)

    def _slips(self, solution: Solution) -> dict[str, float]:
        """Path length of each contact's slip."""
        return {
            self.model.contact_names[c]: float(
                np.linalg.norm(solution.constraints[f"rolling{c}.no_slip"], axis=1).sum()
            )
            for c in self.contacts
        }

    def _bounds(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """Goals as bounds, rest at both ends, no force where there is no contact."""
        model, schedule = self.model, self.model.schedule
        count = len(schedule.samples)
        pose = np.tile([np.inf] * 3 + [MOST_TURN] * 3, (count, 1))
        low_pose, high_pose = -pose, pose
        if model.tool is None:
            goals, at = (
                np.hstack([model.goal_positions, model.goal_vectors]),
                schedule.keyframe_samples[list(schedule.goals)],
            )
            low_pose[at], high_pose[at] = goals - GOAL_TOLERANCE, goals + GOAL_TOLERANCE
        rate = np.full((count, 6), np.inf)
        rate[[0, -1]] = 0.0
        force = np.repeat(np.where(self.active, MOST_FORCE, 0.0), 3, axis=1)
        return {"pose": low_pose, "rate": -rate, "force": -force}, {"pose": high_pose, "rate": rate, "force": force}

    def _start(self, start: WholeHand) -> dict[str, Array]:
        samples = self.model.schedule.samples
        chosen = list(self.contacts)
        values = {
            "pose": np.hstack([start.position, start.vector]),
            "rate": np.hstack([np.gradient(start.position, samples, axis=0), self._spins(start)]),
            "point": start.point[:, chosen].reshape(len(samples), -1),
            "force": start.force[:, chosen].reshape(len(samples), -1),
        }
        points, forces = (values[name].reshape(len(samples), -1, 3) for name in ("point", "force"))
        values["wrench"] = np.hstack([forces.sum(axis=1), np.cross(points, forces).sum(axis=1)])
        halfway = [(a[1:] + a[:-1]) / 2 for a in (points, forces)]
        values["middle_torque"] = np.cross(*halfway).sum(axis=1)
        for c, finger, angles in zip(self.contacts, start.fingers, start.angles, strict=True):
            values |= {f"angles{c}": angles, f"base{c}": finger.base, f"lengths{c}": finger.lengths}
            values[f"axes{c}"] = finger.axes.reshape(1, -1)
        return values

    def _spins(self, start: WholeHand) -> Array:
        """Angular velocities (S, 3), object frame, by central differences."""
        samples = self.model.schedule.samples
        reference = pin.Quaternion(*self.model.reference).matrix()
        turns = [pin.exp3(v) @ reference for v in start.vector]
        spins = np.zeros((len(samples), 3))
        for k in range(1, len(samples) - 1):
            spins[k] = pin.log3(turns[k - 1].T @ turns[k + 1]) / (samples[k + 1] - samples[k - 1])
        return spins

    def _parameters(self, start: WholeHand, margin: Margin) -> dict[str, ArrayLike]:
        model = self.model
        values: dict[str, ArrayLike] = {
            "reference": model.reference,
            "gravity": model.gravity,
            "inertial": model.units.inertial,
            "inertia": model.inertia.reshape(1, 9),
            "inverse": np.linalg.inv(model.inertia).reshape(1, 9),
            "radius": model.link_radius,
            "palm_radius": model.palm_radius,
            "ground_height": NO_GROUND if model.ground is None else model.ground.height,
            "friction": margin.friction * model.friction,
            "primitives": model.primitives.reshape(1, -1),
            "step": np.diff(model.schedule.samples)[:, None],
            "palm_position": start.palm_position,
            "palm_quaternion": start.palm_quaternion,
            "wanted_pose": np.hstack([start.position, start.vector]),
        }
        for c, finger in zip(self.contacts, start.fingers, strict=True):
            values[f"frames{c}"] = finger.frames.transpose(0, 2, 1).reshape(1, -1)
            values[f"wanted_base{c}"], values[f"wanted_lengths{c}"] = finger.base, finger.lengths
            values[f"wanted_axes{c}"] = finger.axes.reshape(1, -1)
            values[f"capsule{c}"] = model.capsules[c]
            values[f"wanted_point{c}"], values[f"wanted_force{c}"] = start.point[:, c], start.force[:, c]
            values[f"helper{c}"] = _helpers(start.point[:, c], model.capsules[c])
        return values

    def _result(self, start: WholeHand, runs: list[tuple[str, Solution]], slips: dict[str, float]) -> Refined:
        solution = runs[-1][1]
        values, count = solution.values, len(self.model.schedule.samples)
        # Fingers alone carry the refined motion; a ground contact of the soft stages ends here.
        point, force, active = start.point.copy(), np.zeros_like(start.force), np.zeros_like(start.active)
        active[:, list(self.contacts)] = self.active
        point[:, list(self.contacts)] = values["point"].reshape(count, -1, 3)
        force[:, list(self.contacts)] = values["force"].reshape(count, -1, 3)
        fingers, moved = [], {}
        for c, old in zip(self.contacts, start.fingers, strict=True):
            new = replace(
                old,
                base=values[f"base{c}"][0],
                lengths=values[f"lengths{c}"][0],
                axes=values[f"axes{c}"].reshape(-1, 2),
                angles=values[f"angles{c}"][self.model.schedule.keyframe_samples],
            )
            fingers.append(new)
            cosines = np.clip((new.axis_vectors * old.axis_vectors).sum(axis=1), -1, 1)
            moved[self.model.contact_names[c]] = {
                "base": float(np.linalg.norm(new.base - old.base)),
                "lengths": float(np.abs(new.lengths - old.lengths).max()),
                "axes": float(np.arccos(cosines).max()),
            }
        hand = replace(
            start,
            fingers=tuple(fingers),
            angles=tuple(values[f"angles{c}"] for c in self.contacts),
            position=values["pose"][:, :3],
            vector=values["pose"][:, 3:],
            point=point,
            force=force,
            active=active,
            solution=solution,
        )
        worst = max(solution.violations.items(), key=lambda item: item[1])
        exact = runs[-1][0] == "exact" and worst[1] <= ACCEPTED
        return Refined(hand, exact, worst, slips, moved, tuple(runs))


def _helpers(points: Array, capsule: Array) -> Array:
    """Vectors (S, 3) well across the surface normal at each contact point, continuous along the motion."""
    along = capsule[3:6] - capsule[:3]
    helper = along / np.linalg.norm(along) if np.linalg.norm(along) > 1e-9 else np.eye(3)[0]
    helpers = []
    for point in points:
        normal = point - capsule[:3] - np.clip((point - capsule[:3]) @ along / max(along @ along, 1e-12), 0, 1) * along
        normal /= np.linalg.norm(normal)
        across = helper - (helper @ normal) * normal
        if np.linalg.norm(across) < 0.5:
            across = np.eye(3)[np.argmin(np.abs(normal))]
            across = across - (across @ normal) * normal
        helper = across / np.linalg.norm(across)
        helpers.append(helper)
    return np.array(helpers)
