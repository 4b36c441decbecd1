"""Stage 4, beyond the thesis: the same motion as a hard-constrained problem at dense knots, the morphology free.

Newton–Euler by shooting, contact on both surfaces with opposed normals, rolling without slip, friction cones with a
margin, a floor on normal forces, forces that joints supply with a lever, clearance: all constraints. Reached by
continuation: rolling and supply first as soft costs, then as firm ones, then as constraints. (Straight from soft to
hard, the solver was seen to turn fingers to the object's other side.) A motion that was exact for nearly the same task
is near enough for the last one or two of these.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.nlp import Options, Solution, Solver
from casadi_hands.stages.model import Model
from casadi_hands.stages.object_side import MOST_FORCE, MOST_TURN, tool_path
from casadi_hands.stages.refine_problem import RefineProblem, Structure
from casadi_hands.stages.start import balanced, rates_and_wrenches
from casadi_hands.stages.whole_hand import WholeHand

Array = NDArray[np.float64]
_NEAR = (("nlp_scaling_method", "none"), ("bound_push", 1e-6), ("bound_frac", 1e-6))
# Barriers are monotone: an adaptive one was seen to leap away from good starts. Small ones stay near them, where a
# large one first wanders to the middle of all bounds and back; too small ones crawl along every bound they meet.
SOFT = Options(max_iter=150, tol=1e-3, acceptable_tol=1e-2, constr_viol_tol=1e-4, mu_init=1e-3, extra=_NEAR)
FIRM_SOLVE = Options(max_iter=150, tol=1e-3, acceptable_tol=1e-2, constr_viol_tol=1e-6, mu_init=1e-4, extra=_NEAR)
HARD = Options(max_iter=200, tol=1e-4, acceptable_tol=1e-3, constr_viol_tol=1e-10, mu_init=1e-4, extra=_NEAR)
EASED = 5  # knots over which a contact that touches or lifts comes to press with its full force, or to let go
TOOL_TOLERANCE = 5e-3  # half extents, how far a drawing's tool may leave its path between goals
ACCEPTED = 1e-7  # largest violation with which a refined motion is handed on
HOPELESS = 0.1  # half extents of slip: where firm solves leave more, rolling is out of the structure's reach
FALLING = 0.5  # of the soft solve's slip: where the firm one leaves more than hopeless, but less than this, it goes on
SLIDING_TIE = 0.3  # of a contact to where it was planned to slide; it shall roll if it can
Bounds = dict[str, tuple[ArrayLike, ArrayLike]]


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
    passive: float = 0.0075


WEIGHTS = {
    "slip": 3.0,
    "passive_force": 3.0,
    "spin": 0.1,
    "stay_point": 1.0,
    "stay_force": 0.02,
    "friction_margin": 0.02,
    "force_change": 0.5,
    "joint_acceleration": 1e-3,
    "joint_jerk": 3e-3,
    "object_acceleration": 1e-2,
    "object_jerk": 1e-3,
    "stay_design": 0.02,
    "stay_path": 1.0,
    "goal": 300.0,
    "force_regularisation": 1e-3,
}
FIRM = {"slip": 100.0, "passive_force": 30.0}
FIRMER = FIRM | {"slip": 1000.0}
EXACT = {"slip": 100.0}  # its tolerance is there for where it is needed
STAY = {"stay_design": 2.0}  # a hand that serves nearly
Step = tuple[str, dict[str, float], Options]
LONG_WAY: tuple[Step, ...] = (
    ("soft", WEIGHTS, SOFT),
    ("firm", WEIGHTS | FIRM, FIRM_SOLVE),
    ("firmer", WEIGHTS | FIRMER, FIRM_SOLVE),
    ("exact", WEIGHTS | EXACT, HARD),
)
# From an exact motion to one nearby; the first step can be left out where joints can follow and supply their forces.
SHORT_WAY: tuple[Step, ...] = (("firm", WEIGHTS | FIRM | STAY, FIRM_SOLVE), ("exact", WEIGHTS | EXACT | STAY, HARD))
SERVES = 0.1  # cost of slip and of forces that no joint supplies, of the start, in the short way's first step


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
        weights: of the terms in the last.
    """

    hand: WholeHand
    exact: bool
    worst: tuple[str, float]
    slips: dict[str, float]
    moved: dict[str, dict[str, float]]
    runs: tuple[tuple[str, Solution], ...]
    weights: dict[str, float]

    @property
    def slips_hopelessly(self) -> bool:
        """Whether the firm solves were left with so much slip that no exact one was tried."""
        return self.runs[-1][0] != "exact"

    @property
    def barely_rolls(self) -> bool:
        """Whether rolling is out of the structure's reach, or so nearly that a firmer solve had to look for it."""
        return self.slips_hopelessly or any(what == "firmer" for what, _ in self.runs)


class RefineStage:
    """The stage for one structure: joints of each finger and when each contact, the ground's included, touches."""

    def __init__(
        self, model: Model, contacts: tuple[int, ...], joints: tuple[int, ...], active: NDArray[np.bool_]
    ) -> None:
        self.model, self.contacts = model, contacts
        self.structure = Structure.of(model, contacts, joints, active)
        built = RefineProblem(self.structure)
        self.problem, self.pushed, self.knots = built.problem, built.pushed, built.knots
        # A contact that touches anew bears nothing until it does: its force grows from zero.
        active = self.structure.active
        self.bearing = active & np.vstack([active[:1], active[:-1]])
        self.solver = Solver(self.problem)

    def solve(self, start: WholeHand, margin: Margin | None = None, near: bool = False) -> Refined:
        """Refine a whole-hand motion: rolling and supply soft, then firm, then constraints.

        Args:
            start: the motion.
            margin: to keep to the limits.
            near: whether the motion is nearly exact already, and the hand shall stay nearly what it is: then the short
                way is tried first.
        """
        margin = margin or Margin()
        if not near:
            return self._take(LONG_WAY, start, margin)
        weights = {f"weight.{term}": SHORT_WAY[0][1][term] / self.knots for term in self.problem.terms}
        costs = self.solver.evaluate(self._start(start), self._parameters(start, margin) | weights)
        ways: tuple[tuple[Step, ...], ...] = (SHORT_WAY, LONG_WAY)
        if costs["slip"] + costs["passive_force"] < SERVES:
            ways = (SHORT_WAY[1:], *ways)
        runs: tuple[tuple[str, Solution], ...] = ()
        for way in ways:
            refined = self._take(way, start, margin)
            runs += refined.runs
            if refined.exact:
                break
        return replace(refined, runs=runs)

    def _take(self, way: tuple[Step, ...], start: WholeHand, margin: Margin) -> Refined:
        """Solve step by step; not to the end where firm solves show rolling to be out of reach."""
        values, parameters = self._start(start), self._parameters(start, margin)
        lower, upper = self._bounds()
        always, exact = self._constraint_bounds(margin)
        runs: list[tuple[str, Solution]] = []
        slips: dict[str, float] = {}
        most = 0.0
        for what, weights, options in way:
            most, before = max(slips.values(), default=0.0), most
            if what == "firmer" and not HOPELESS < most < FALLING * before:
                continue
            if what == "exact" and not most <= HOPELESS:  # nor where a solve broke down
                break
            weighted: dict[str, ArrayLike] = {
                f"weight.{term}": weights[term] / self.knots for term in self.problem.terms
            }
            bounds = always | exact if what == "exact" else always
            solution = self.solver.solve(values, parameters | weighted, options, lower, upper, bounds)
            runs.append((what, solution))
            values = solution.values
            if what != "exact":
                slips = self._slips(solution)
        return self._result(start, runs, slips or self._slips(solution), weights)

    def _constraint_bounds(self, margin: Margin) -> tuple[Bounds, Bounds]:
        """Bounds of constraints: those that hold in every solve, and those of the exact one.

        Contact and rolling are met within a small part of the task's limits. Where joints have one freedom less than
        the motion needs, or a motion in a plane meets some of them twice, equations would have no solver's solution.
        """
        structure, model = self.structure, self.model
        always: Bounds = {}
        exact: Bounds = {}
        for i, c in enumerate(self.contacts):
            floor = margin.normal_force * eased_in(self.bearing[:, i])[structure.touching[:, i]]
            always[f"contact{c}.pressing"] = (floor[:, None], np.inf)
            # The point stays on the object's surface, where its force acts; the link may be a little off it.
            exact[f"contact{c}.on_link"] = (-model.gap_tolerance, model.gap_tolerance)
            slip = model.slip_tolerance / (np.sqrt(2) * longest_run(structure.active[:, i]))
            exact[f"rolling{c}.no_slip"] = (-slip, slip)
            for kernel in ("contact", "held"):
                if f"{kernel}{c}.passive" in self.problem.constraint_rows:
                    exact[f"{kernel}{c}.passive"] = (-margin.passive, margin.passive)
        if structure.grounded:
            slip = model.slip_tolerance / (np.sqrt(2) * longest_run(structure.active[:, -1]))
            exact["ground_rolling.no_slip"] = (-slip, slip)
        if model.tool is not None:
            tolerance = np.full((self.knots, 3), TOOL_TOLERANCE)
            tolerance[model.schedule.keyframe_samples[list(model.schedule.goals)]] = model.goal_tolerance[0]
            always["tool_point.on_path"] = (-tolerance, tolerance)
        return always, exact

    def _slips(self, solution: Solution) -> dict[str, float]:
        """Path length of each finger contact's slip."""
        names = {self.model.contact_names[c]: f"rolling{c}.no_slip" for c in self.contacts}
        return {who: float(np.linalg.norm(solution.constraints[name], axis=1).sum()) for who, name in names.items()}

    def _bounds(self) -> tuple[dict[str, Array], dict[str, Array]]:
        """Goals as bounds, rest at both ends, no force where there is no contact."""
        model, schedule = self.model, self.model.schedule
        count = len(schedule.samples)
        pose = np.tile([np.inf] * 3 + [MOST_TURN] * 3, (count, 1))
        low_pose, high_pose = -pose, pose
        if model.tool is None:
            goals = np.hstack([model.goal_positions, model.goal_vectors])
            at, tolerance = schedule.keyframe_samples[list(schedule.goals)], np.repeat(model.goal_tolerance, 3)
            low_pose[at], high_pose[at] = goals - tolerance, goals + tolerance
        rate = np.full((count, 6), np.inf)
        rate[[0, -1]] = 0.0
        force = np.repeat(np.where(self.bearing, MOST_FORCE, 0.0), 3, axis=1)
        upper = {"rate": rate, "force": force}
        if len(self.pushed):
            upper["force_pushed"] = force[self.pushed]
        lower = {name: -bound for name, bound in upper.items()}
        return {"pose": low_pose, **lower}, {"pose": high_pose, **upper}

    def _start(self, start: WholeHand) -> dict[str, Array]:
        count, chosen = self.knots, self.structure.columns
        rates, wrenches = rates_and_wrenches(self.model, start.position, start.vector)
        points = start.point[:, chosen]
        forces = balanced(points, start.force[:, chosen], self.bearing, wrenches)
        values = {
            "pose": np.hstack([start.position, start.vector]),
            "rate": rates,
            "point": points.reshape(count, -1),
            "force": forces.reshape(count, -1),
            "wrench": np.hstack([forces.sum(axis=1), np.cross(points, forces).sum(axis=1)]),
        }
        at, pushing = ((a[1:] + a[:-1]) / 2 for a in (points, forces))
        values["middle_torque"] = np.cross(at, pushing).sum(axis=1)
        if len(self.pushed):
            values["force_pushed"] = values["force"][self.pushed]
        for c, finger, angles in zip(self.contacts, start.fingers, start.angles, strict=True):
            values |= {f"angles{c}": angles, f"base{c}": finger.base, f"lengths{c}": finger.lengths}
            values[f"axes{c}"] = finger.axes.reshape(1, -1)
        return values

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
            "ground_height": model.ground_height,
            "friction": margin.friction * model.friction,
            "primitives": model.primitives.reshape(1, -1),
            "step": np.diff(model.schedule.samples)[:, None],
            "palm_position": start.palm_position,
            "palm_quaternion": start.palm_quaternion,
            "wanted_pose": np.hstack([start.position, start.vector]),
        }
        if len(self.pushed):
            values["push_force"] = model.perturbation_force[self.pushed]
            values["push_torque"] = model.perturbation_torque[self.pushed]
        if model.tool is None:
            values["goals"] = np.hstack([model.goal_positions, model.goal_vectors])
        else:
            values["tool"], values["tool_path"] = model.tool, tool_path(model)
        if self.structure.grounded and model.ground is not None:
            values["ground_friction"] = margin.friction * model.ground.friction
            values[f"capsule{model.contacts}"] = model.ground.capsule
        for c in self.structure.columns:
            values[f"wanted_point{c}"], values[f"wanted_force{c}"] = start.point[:, c], start.force[:, c]
        for c, finger in zip(self.contacts, start.fingers, strict=True):
            values[f"frames{c}"] = finger.frames.transpose(0, 2, 1).reshape(1, -1)
            values[f"wanted_base{c}"], values[f"wanted_lengths{c}"] = finger.base, finger.lengths
            values[f"wanted_axes{c}"] = finger.axes.reshape(1, -1)
            values[f"capsule{c}"] = model.capsules[c]
            values[f"tie{c}"] = SLIDING_TIE if model.slides(c) else 1.0
            values[f"helper{c}"] = _helpers(start.point[:, c], model.capsules[c])
        return values

    def _result(
        self, start: WholeHand, runs: list[tuple[str, Solution]], slips: dict[str, float], weights: dict[str, float]
    ) -> Refined:
        solution = runs[-1][1]
        values, count = solution.values, len(self.model.schedule.samples)
        point, force, active = start.point.copy(), np.zeros_like(start.force), np.zeros_like(start.active)
        columns = self.structure.columns
        active[:, columns] = self.structure.active
        point[:, columns] = values["point"].reshape(count, -1, 3)
        force[:, columns] = values["force"].reshape(count, -1, 3)
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
        return Refined(hand, exact, worst, slips, moved, tuple(runs), weights)


def eased_in(bearing: NDArray[np.bool_]) -> Array:
    """Share (S,) of the normal force asked of a contact: it grows after a touch and falls before a lift, over knots."""
    idle = np.flatnonzero(~bearing)
    if not len(idle):
        return np.ones(len(bearing))
    away = np.abs(np.arange(len(bearing))[:, None] - idle).min(axis=1)
    return np.asarray(np.minimum(away / EASED, 1.0))


def longest_run(flags: NDArray[np.bool_]) -> int:
    """Length of the longest stretch of set flags (S,); 1 where none is set."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], flags, [False]])))
    return max(1, int((edges[1::2] - edges[::2]).max(initial=1)))


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
