"""Tasks with everything in them, made-up configurations, and the method's formulas written once more in NumPy."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
from scipy.interpolate import BPoly, CubicHermiteSpline
from scipy.spatial.transform import Rotation, Slerp

from casadi_hands.geometry.bodies import Body
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.nlp import Solution, Solver
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.model import Model
from casadi_hands.problem.si import build_model
from casadi_hands.task import Task, parse_task

Array = np.ndarray
Chain = list[tuple[Array, Array]]
SPLINE_WIDTH = 1e-3  # half the width of g's transition in the collision terms
STAND = 1.05  # radii of its links that a finger's first joint stands above the palm's face


def everything_text(s: float = 1.0) -> str:
    """A task in which every term has something to see, with lengths and gravity ``s`` times larger."""
    return f"""
name: everything
object:
  mass: 0.2
  shapes:
    - capsule: {{start: [0, 0, {-0.03 * s}], end: [0, {0.01 * s}, {0.03 * s}], radius: {0.015 * s}}}
    - sphere: {{center: [{0.02 * s}, 0, {0.03 * s}], radius: {0.02 * s}}}
palm:
  radius: {0.05 * s}
  position: [{0.01 * s}, {-0.02 * s}, {0.12 * s}]
  facing: [0.1, 0.2, -1]
  motion: [{{at: 1.5, position: [{0.02 * s}, 0, {0.13 * s}], facing: [0, 0.4, -1]}}]
motion:
  - {{at: 0, position: [0, 0, {0.045 * s}], rotation: {{axis: [1, 0, 0], degrees: 20}}}}
  - {{at: 0.6, position: [{0.02 * s}, 0, {0.05 * s}], rotation: {{axis: [0, 1, 1], degrees: 70}}}}
  - {{at: 1.5, position: [0, {0.03 * s}, {0.06 * s}], rotation: {{axis: [0, 0, 1], degrees: -40}}}}
fingers:
  thumb: {{touches: [{0.015 * s}, 0, {-0.01 * s}]}}
  index: {{touches: [{-0.015 * s}, 0, 0]}}
  top: {{touches: [{0.03 * s}, 0, {0.047 * s}]}}
friction: 0.6
gravity: [0, 0, {-9.81 * s}]
ground: {{height: {0.001 * s}, friction: 0.4}}
perturbations:
  - {{from: 0.3, to: 0.9, force: [{0.3 * s}, 0, {-0.5 * s}], torque: [0, {0.004 * s * s}, 0]}}
  - {{from: 0.5, to: 0.7, force: [0, {0.2 * s}, 0]}}
hand: {{link_radius: {0.006 * s}, link_length: [{0.012 * s}, {0.1 * s}], joint_limits: [-80, 85]}}
actuator: {{torque: {0.05 * s * s}, speed: 6, stiffness: {s * s}}}
limits:
  {{goal_position: {0.0005 * s}, gap: {5e-5 * s}, gap_between: {1e-4 * s}, slip: {2e-4 * s}, penetration: {1e-4 * s}}}
keyframes_between: 1
"""


DRAWING = """
object: {mass: 0.02, shapes: [{capsule: {start: [0, 0, -0.05], end: [0, 0, 0.05], radius: 0.005}}]}
palm: {radius: 0.05, position: [0, 0, 0.2], facing: [0, 0, -1]}
tool: [0, 0.001, -0.055]
motion:
  - {at: 0, tool_at: [0, 0, 0]}
  - {at: 0.7, tool_at: [0.04, 0, 0]}
  - {at: 1.5, tool_at: [0.04, 0.03, 0.01]}
fingers: {thumb: {touches: [0.005, 0, 0]}, index: {touches: [-0.005, 0, 0]}}
"""


def everything() -> tuple[Task, Model]:
    task = parse_task(everything_text())
    return task, build_model(task)


def with_tips(model: Model) -> Model:
    """The model with fingertips 1.4 times as thick as the links behind them, and a last link that is longer for it."""
    return replace(model, tip_radius=1.4 * model.link_radius, shortest_last=1.2 * model.link_length[0])


def sizes_of(model: Model, joints: int) -> list[float]:
    """Radii of a finger's links: only the last one's is the fingertip's."""
    return [model.tip_radius if j == joints - 1 else model.link_radius for j in range(joints)]


def drawing() -> tuple[Task, Model]:
    task = parse_task(DRAWING)
    return task, build_model(task)


def made_up_values(model: Model, seed: int = 0) -> dict[str, Array]:
    """Poses off their goals, contacts off their surfaces, forces in and out of their cones, flags between 0 and 1."""
    rng = np.random.default_rng(seed)
    keyframes, samples = len(model.schedule.keyframes), len(model.schedule.samples)
    contacts = model.contacts + (model.ground is not None)
    patches = model.patches
    return {
        "pose": np.hstack([rng.uniform(-0.6, 0.9, (keyframes, 3)), rng.uniform(-1.2, 1.2, (keyframes, 3))]),
        "point": (patches + 0.1 * rng.normal(size=(keyframes, contacts, 3))).reshape(keyframes, -1),
        "force": rng.normal(size=(samples, 3 * contacts)),
        "invariant": rng.uniform(0.1, 0.9, (keyframes, contacts)),
        **({"force_perturbed": rng.normal(size=(samples, 3 * contacts))} if model.disturbance is not None else {}),
    }


def made_up_solution(values: dict[str, Array], objective: float = 1.0, **terms: float) -> Solution:
    """What a solver returns, made up."""
    return Solution(
        values=values,
        terms=terms,
        objective=objective,
        excess={},
        constraints={},
        status="Solve_Succeeded",
        iterations=3,
        seconds=0.01,
    )


def made_up_floating(model: Model, seed: int = 0) -> Floating:
    """The same with flags of 0 and 1; every finger lifts once, away from the ends."""
    values = made_up_values(model, seed)
    keyframes, contacts = values["invariant"].shape
    active = np.ones((keyframes, contacts), bool)
    for c in range(contacts):
        active[1 + c % (keyframes - 2), c] = False
    return Floating(
        pose=values["pose"],
        point=values["point"].reshape(keyframes, contacts, 3),
        force=values["force"].reshape(-1, contacts, 3),
        active=active,
        invariant=values["invariant"],
        threshold=0.2,
        solution=made_up_solution(values),
        runs=(),
        model=model,
    )


def made_up_finger(model: Model, joints: int, strings: int, seed: int, bend: float = 0.8) -> FingerSeed:
    rng = np.random.default_rng((joints, seed))
    return FingerSeed(
        base=rng.uniform(-0.8, 0.8, 2),
        lengths=rng.uniform(0.9, 2.0, joints),
        frames=Rotation.random(joints, rng=rng).as_matrix(),
        axes=rng.uniform(-0.7, 0.7, (joints, 2)),
        bends=rng.uniform(-0.4, 0.4, (joints, 2)),
        angles=rng.uniform(-bend, bend, (len(model.schedule.keyframes), joints)),
        tips=rng.uniform(-0.25, 0.25, (strings, 2)),
    )


def spline_at(knots: Array, values: Array, times: Array) -> Array:
    """Catmull–Rom as SciPy's Hermite spline; times beyond the ends see the mirror image."""
    slopes = np.zeros_like(values)
    slopes[1:-1] = (values[2:] - values[:-2]) / (knots[2:] - knots[:-2])[:, None]
    mirrored = np.abs(times - knots[0]) + knots[0]
    mirrored = knots[-1] - np.abs(knots[-1] - mirrored)
    found: Array = CubicHermiteSpline(knots, values, slopes)(mirrored)
    return found


def linear_at(knots: Array, values: Array, times: Array) -> Array:
    return np.column_stack([np.interp(times, knots, column) for column in values.T])


def resting_at(knots: Array, values: Array, times: Array) -> Array:
    """The straight way through values (K, d) with no speed and no acceleration at any of them: SciPy's quintic."""
    return np.asarray(BPoly.from_derivatives(knots, [[value, 0 * value, 0 * value] for value in values])(times))


def g(x: Array) -> Array:
    """The penalty of 2.2.2 with its transition at ±1e-3."""
    e = SPLINE_WIDTH
    return np.where(x < -e, 0, np.where(x < e, x**3 / (6 * e) + x**2 / 2 + e * x / 2 + e**2 / 6, x**2 + e**2 / 3))


def cone(force: Array, inward: Array, friction: float, sharpness: float = 5.0) -> float:
    """exp(α(‖f_t‖ - μ f_n)), continued quadratically above 10."""
    pressing = force @ inward
    x = sharpness * (np.linalg.norm(force - pressing * inward) - friction * pressing)
    above = max(x - 10, 0)
    return float(np.exp(min(x, 10)) * (1 + above + above**2 / 2))


def rod(body: Body) -> Array:
    """Both ends of the axis and the radius (7,) of a capsule, or of a sphere, whose ends are one."""
    given = body.parameters
    return given if len(given) == 7 else np.r_[given[:3], given]


def marks(capsule: Array) -> Array:
    """Ends and middle of an axis (3, 3); of a sphere its centre, which counts as much as they do."""
    return np.array([capsule[:3], (capsule[:3] + capsule[3:6]) / 2, capsule[3:6]])


def rods(bodies: Sequence[Body], parameters: Array) -> list[Array]:
    """The same (7,) of each of some bodies' kinds, from their parameters in one row."""
    parts = np.split(parameters, np.cumsum([body.width for body in bodies])[:-1])
    return [part if body.width == 7 else np.r_[part[:3], part] for body, part in zip(bodies, parts, strict=True)]


def nearest_on_axis(point: Array, capsule: Array) -> Array:
    start, along = capsule[:3], capsule[3:6] - capsule[:3]
    length = along @ along
    nearest: Array = start + (np.clip((point - start) @ along / length, 0, 1) if length else 0.0) * along
    return nearest


def project(point: Array, capsule: Array) -> tuple[Array, Array]:
    """Nearest surface point and outward normal."""
    outward = point - nearest_on_axis(point, capsule)
    normal = outward / np.linalg.norm(outward)
    return nearest_on_axis(point, capsule) + capsule[6] * normal, normal


def segments_apart(a: Array, b: Array, c: Array, d: Array) -> float:
    """Distance of two segments: the best of the inner solution and the four ends' projections."""
    u, v, w = b - a, d - c, a - c
    ends = [
        np.linalg.norm(p - nearest_on_axis(p, np.r_[q, r, 0]))
        for p, q, r in ((a, c, d), (b, c, d), (c, a, b), (d, a, b))
    ]
    matrix = np.array([[u @ u, -u @ v], [-u @ v, v @ v]])
    if np.linalg.det(matrix) > 1e-12:
        s, t = np.linalg.solve(matrix, [-u @ w, v @ w])
        if 0 <= s <= 1 and 0 <= t <= 1:
            ends.append(np.linalg.norm(w + s * u - t * v))
    return float(min(ends))


def joints_and_tip(chain: Chain, radii: Sequence[float]) -> list[tuple[Array, float]]:
    """A finger's joints and its tip, each with the radius of the thickest link that ends there."""
    ends = [chain[0][0], *(end for _, end in chain)]
    return [(end, max(radii[max(j - 1, 0) : j + 1])) for j, end in enumerate(ends)]


def from_palm_and_self(chain: Chain, radii: Sequence[float], palm_radius: float) -> list[float]:
    """Distances of a finger's links from the palm, and of those that are no neighbours from each other."""
    ends = joints_and_tip(chain, radii)[1:]
    marked = ends[:1]
    for (start, end), radius, at_end in zip(chain[1:], radii[1:], ends[1:], strict=True):
        marked += [((start + end) / 2, radius), at_end]
    apart = [palm_apart(point, palm_radius) - radius for point, radius in marked]
    for i, j in itertools.combinations(range(len(chain)), 2):
        if j > i + 1:
            apart.append(segments_apart(*chain[i], *chain[j]) - radii[i] - radii[j])
    return apart


def fingers_apart(one: Chain, radii: Sequence[float], other: Chain, other_radii: Sequence[float]) -> list[float]:
    """Distances between the links of two fingers."""
    pairs = itertools.product(zip(one, radii, strict=True), zip(other, other_radii, strict=True))
    return [segments_apart(*a, *b) - radius - thick for (a, radius), (b, thick) in pairs]


def folds_apart(chain: Sequence[tuple[Array, Array]], radius: float) -> list[float]:
    """How far neighbouring links are from the sharpest fold, of cosine -0.3, times a radius; law of cosines."""
    folds = []
    for (start, joint), (_, end) in itertools.pairwise(chain):
        before, after, across = (float(np.linalg.norm(a - b)) for a, b in ((joint, start), (end, joint), (end, start)))
        folds.append(radius * ((across**2 - before**2 - after**2) / (2 * before * after) + 0.3))
    return folds


def palm_apart(point: Array, radius: float) -> float:
    """Signed distance of a point from a disc's body, which fills z < 0 below it."""
    height, beyond = point[2], np.hypot(point[0], point[1]) - radius
    if height <= 0 and beyond <= 0:
        above: float = max(height, beyond)
        return above
    return float(np.hypot(max(height, 0), max(beyond, 0)))


def quaternion_product(a: Array, b: Array) -> Array:
    w, v = a[0], a[1:]
    product: Array = np.r_[w * b[0] - v @ b[1:], w * b[1:] + b[0] * v + np.cross(v, b[1:])]
    return product


@dataclass
class Motion:
    """The object at every sample, from SciPy's splines and rotations."""

    model: Model
    pose: Array

    def at(self, steps: int) -> tuple[Array, list[Rotation]]:
        """Positions and orientations ``steps`` time steps after the samples."""
        schedule = self.model.schedule
        times = schedule.samples + steps * schedule.step
        poses = spline_at(schedule.keyframes, self.pose, times)
        if self.model.tool is None:
            poses += self.along(times) - spline_at(schedule.keyframes, self.along(schedule.keyframes), times)
        reference = Rotation.from_quat(self.model.reference, scalar_first=True)
        return poses[:, :3], [Rotation.from_rotvec(v) * reference for v in poses[:, 3:]]

    def palm(self, times: Array) -> tuple[Array, Rotation]:
        """Positions (T, 3) and orientations of the palm as the task gives them; the ends mirror the motion."""
        path, last = self.model.palm_path, self.model.schedule.keyframes[-1]
        when = last - np.abs(last - np.abs(times))
        if len(path.times) == 1:
            return np.tile(path.positions[0], (len(when), 1)), Rotation.from_matrix(path.rotations[[0] * len(when)])
        eased = resting_at(path.times, path.times[:, None], np.clip(when, 0, path.times[-1]))[:, 0]
        turns = Slerp(path.times, Rotation.from_matrix(path.rotations))(eased)
        return linear_at(path.times, path.positions, eased), turns

    def along(self, times: Array) -> Array:
        """Poses (T, 6) of what is fixed to the palm where the object is at first."""
        first, (places, turns) = self.model.palm_path, self.palm(times)
        turned = turns * Rotation.from_matrix(first.rotations[0]).inv()
        position = places + turned.apply(self.model.goal_positions[0] - first.positions[0])
        return np.hstack([position, (turned * Rotation.from_rotvec(self.model.goal_vectors[0])).as_rotvec()])

    @property
    def acceleration(self) -> Array:
        before, now, after = (self.at(k)[0] for k in (-1, 0, 1))
        second: Array = (after - 2 * now + before) / self.model.schedule.step**2
        return second

    @property
    def inertial_torque(self) -> Array:
        """ω×Iω + Iω̇ with 2 Im(q* q̇) and 2 Im(q* q̈), in m·g·length."""
        h, torques = self.model.schedule.step, []
        for before, now, after in zip(*(self.at(k)[1] for k in (-1, 0, 1)), strict=True):
            q = now.as_quat(scalar_first=True)
            p, r = (o.as_quat(scalar_first=True) for o in (before, after))
            p, r = p * np.sign(p @ q), r * np.sign(r @ q)
            inverse = q * np.array([1, -1, -1, -1])
            omega = 2 * quaternion_product(inverse, (r - p) / (2 * h))[1:]
            alpha = 2 * quaternion_product(inverse, (r - 2 * q + p) / h**2)[1:]
            inertia = self.model.inertia
            torques.append(np.cross(omega, inertia @ omega) + inertia @ alpha)
        return self.model.units.inertial * np.array(torques)


@dataclass
class PinFinger:
    """A finger in numeric Pinocchio, palm frame, its first link of a radius."""

    seed: FingerSeed
    radius: float

    @property
    def axes(self) -> Array:
        """The seed frames' third columns turned by the exponential coordinates, with SciPy."""
        turned = []
        for frame, (x, y) in zip(self.seed.frames, self.seed.axes, strict=True):
            # The axis leans towards (x, y): a turn about (-y, x).
            turned.append(frame @ Rotation.from_rotvec([-y, x, 0]).apply([0, 0, 1]))
        return np.array(turned)

    def chain(self, angles: Array) -> tuple[Array, Array]:
        """Joint origins and tip (n + 1, 3), and the rotation of the last link."""
        rotation, points = np.eye(3), [np.append(self.seed.base, STAND * self.radius)]
        for axis, bend, length, angle in zip(self.axes, self.seed.bends, self.seed.lengths, angles, strict=True):
            rotation = rotation @ pin.exp3(np.append(bend, 0.0)) @ pin.exp3(angle * axis)
            points.append(points[-1] + length * rotation[:, 2])
        return np.array(points), rotation

    def links(self, angles: Array) -> list[tuple[Array, Array]]:
        return list(itertools.pairwise(self.chain(angles)[0]))

    def jacobian(self, angles: Array, on_link: Array) -> Array:
        """(3, n) of a point of the last link, by central differences of Rodrigues' formula."""
        h = 1e-6
        return np.column_stack(
            [
                (self.point(angles + h * e, on_link) - self.point(angles - h * e, on_link)) / (2 * h)
                for e in np.eye(len(angles))
            ]
        )

    def point(self, angles: Array, on_link: Array) -> Array:
        points, rotation = self.chain(angles)
        point: Array = points[-2] + rotation @ on_link
        return point


def unsupplied(jacobian: Array, force: Array, damping: float = 0.02) -> float:
    """Size of what no joint supplies, by SVD: a singular value s supplies a share s² / (s² + λ²)."""
    left, singular, _ = np.linalg.svd(jacobian)
    shares = np.zeros(3)
    shares[: len(singular)] = singular**2 / (singular**2 + damping**2)
    rest = (1 - shares) * (left.T @ force)
    return float(np.sqrt(rest @ rest + 1e-4))


def torques(jacobian: Array, force: Array) -> Array:
    """α of eq. A.5 by damped least squares on X = J / ‖J_i‖²."""
    x = jacobian / (jacobian**2).sum(axis=0)
    damped, right = np.vstack([x, 1e-3 * np.eye(x.shape[1])]), np.r_[force, np.zeros(x.shape[1])]
    alpha: Array = np.linalg.lstsq(damped, right, rcond=None)[0]
    return alpha


def doubling_each_weight(
    evaluate: Callable[[Mapping[str, object]], dict[str, float]], weights: Mapping[str, object]
) -> dict[str, set[str]]:
    """For each weight the terms whose value doubles when it does; every other term must stay the same."""
    plain, moved = evaluate(weights), {}
    for name, weight in weights.items():
        twice = tuple(2 * w for w in weight) if isinstance(weight, tuple) else 2 * weight  # type: ignore[operator]
        changed = evaluate({**weights, name: twice})
        doubled = {term for term in plain if not np.isclose(changed[term], plain[term], rtol=1e-12, atol=0)}
        for term in doubled:
            np.testing.assert_allclose(changed[term], 2 * plain[term], rtol=1e-12)
        moved[name] = doubled
    return moved


def check_derivatives(solver: Solver, values: Mapping[str, Array], parameters: Mapping[str, object]) -> None:
    """Gradient, Jacobian and Hessian of a whole problem against central differences along random directions."""
    problem, functions, h = solver.problem, solver.functions, 1e-6
    x = problem.variables.pack(values, np.zeros(problem.variables.size))
    p = problem.parameters.pack(parameters, np.zeros(problem.parameters.size))  # type: ignore[arg-type]
    rng = np.random.default_rng(0)
    multipliers = rng.normal(size=problem.constraints.size)

    def lagrangian_gradient(at: Array) -> Array:
        gradient = np.asarray(functions["grad_f"](at, p)[1]).ravel()
        return gradient + np.asarray(functions["jac_g"](at, p)[1]).T @ multipliers

    gradient = np.asarray(functions["grad_f"](x, p)[1]).ravel()
    upper = np.asarray(functions["hess_lag"](x, p, 1.0, multipliers))
    hessian = upper + np.triu(upper, 1).T
    for _ in range(5):
        way = rng.normal(size=x.size)
        ahead, behind = (functions["nlp"](x + s * h * way, p) for s in (1, -1))
        slope = (float(ahead[0]) - float(behind[0])) / (2 * h)
        assert abs(slope - gradient @ way) < 1e-5 * np.linalg.norm(gradient) * np.linalg.norm(way)
        bent = (lagrangian_gradient(x + h * way) - lagrangian_gradient(x - h * way)) / (2 * h)
        assert np.abs(bent - hessian @ way).max() < 1e-3 * np.abs(bent).max()


def standing(model: Model) -> Model:
    """The task with its palm left where it is first."""
    palm = (np.tile(values[0], (len(values), 1)) for values in (model.palm_position, model.palm_quaternion))
    return replace(model, palm_position=next(palm), palm_quaternion=next(palm))
