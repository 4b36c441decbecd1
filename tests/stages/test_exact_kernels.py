"""The exact stage's blocks against SciPy's integrator, numeric Pinocchio, coal, and closed forms of rolling."""

from __future__ import annotations

import itertools
from collections.abc import Mapping

import casadi as ca
import coal
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from casadi_hands.nlp import Kernel
from casadi_hands.stages import exact_kernels as kernels
from casadi_hands.stages.synthesis import FingerSeed
from tests.stages.example import PinFinger, nearest_on_axis, palm_apart

Array = np.ndarray
STEP = 0.1
STILL = [1.0, 0.0, 0.0, 0.0]


def numbers(kernel: Kernel, variables: Mapping[str, object], parameters: Mapping[str, object]) -> dict[str, Array]:
    """Every term and constraint of a kernel; its variables and parameters by name, in the order of declaration."""
    packed = []
    for symbols, values in ((kernel._variables, variables), (kernel._parameters, parameters)):
        for symbol, (name, value) in zip(symbols, values.items(), strict=True):
            assert symbol[0].name() in (name, f"{name}_0")
            assert symbol.numel() == np.size(value)
        packed.append(np.concatenate([np.zeros(0), *[np.ravel(value) for value in values.values()]]))
    found = {**kernel.terms, **kernel.constraints}
    function = ca.Function("f", [kernel.variables, kernel.parameters], list(found.values()))
    return {name: np.asarray(v).ravel() for name, v in zip(found, function.call(packed), strict=True)}


# The object's physics.

LENGTH, MASS, INERTIA = 0.04, 0.3, np.array([[3e-4, 4e-5, 0], [4e-5, 2e-4, -2e-5], [0, -2e-5, 1e-4]])
WEIGHT, GRAVITY = MASS * 9.81, np.array([0, 0, -9.81])


class Carried:
    """A body in SI that contacts push from one knot to the next, integrated by SciPy."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng(seed)
        self.points = 0.03 * rng.normal(size=(2, 3, 3))
        self.forces = 0.1 * rng.normal(size=(2, 3, 3))
        self.reference = Rotation.random(rng=rng)
        self.start = rng.normal(size=3), Rotation.from_rotvec(0.5 * rng.normal(size=3)) * self.reference
        self.rate = 0.2 * rng.normal(size=3), 2.0 * rng.normal(size=3)
        turn = self.start[1].as_quat(scalar_first=True)
        state = np.concatenate([self.start[0], turn, *self.rate])
        end = solve_ivp(self._slope, (0, STEP), state, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        self.end = end[:3], Rotation.from_quat(end[3:7], scalar_first=True)
        self.end_rate = end[7:10], end[10:]

    def _slope(self, t: float, state: Array) -> Array:
        """Forces and points linear in time in the body's frame; the spin is the body's too."""
        s = t / STEP
        points, forces = ((1 - s) * a[0] + s * a[1] for a in (self.points, self.forces))
        turn, omega = Rotation.from_quat(state[3:7], scalar_first=True), state[10:]
        w, v = state[3], state[4:7]
        spin = np.r_[-v @ omega, w * omega + np.cross(v, omega)] / 2
        acceleration = turn.apply(forces.sum(axis=0)) / MASS + GRAVITY
        torque = np.cross(points, forces).sum(axis=0)
        return np.concatenate(
            [state[7:10], spin, acceleration, np.linalg.solve(INERTIA, torque - np.cross(omega, INERTIA @ omega))]
        )

    def pose(self, position: Array, turn: Rotation) -> Array:
        return np.r_[position / LENGTH, (turn * self.reference.inv()).as_rotvec()]

    def wrench(self, points: Array, forces: Array) -> Array:
        return np.r_[forces.sum(axis=0) / WEIGHT, np.cross(points, forces).sum(axis=0) / (WEIGHT * LENGTH)]

    def physics(self) -> tuple[dict[str, Array], dict[str, object]]:
        """Variables and parameters of the physics kernel."""
        middle = self.wrench(self.points.mean(axis=0), self.forces.mean(axis=0))[3:]
        inertia = INERTIA / (MASS * LENGTH**2)
        variables = {
            "pose0": self.pose(*self.start),
            "rate0": np.r_[self.rate[0] / LENGTH, self.rate[1]],
            "pose1": self.pose(*self.end),
            "rate1": np.r_[self.end_rate[0] / LENGTH, self.end_rate[1]],
            "wrench0": self.wrench(self.points[0], self.forces[0]),
            "wrench1": self.wrench(self.points[1], self.forces[1]),
            "middle": middle,
        }
        parameters = {
            "reference": self.reference.as_quat(scalar_first=True),
            "step": STEP,
            "gravity": [0, 0, -1],
            "inertial": LENGTH / 9.81,
            "inertia": inertia,
            "inverse": np.linalg.inv(inertia),
        }
        return variables, parameters


@pytest.mark.parametrize("seed", range(4))
def test_physics_is_that_of_scipy_s_integrator(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    variables, parameters = Carried(seed).physics()
    assert np.abs(variables["rate1"] - variables["rate0"])[3:].max() > 0.5
    change = (variables["rate1"] - variables["rate0"]) / STEP
    found = numbers(kernels.physics(), variables, parameters)
    np.testing.assert_allclose(found["object_acceleration"], change @ change, rtol=1e-12)
    defects = [np.abs(found["defect"]).max()]
    assert defects[0] < 5e-4  # 5 rad/s and more, changing by as much in one step
    for substeps in (8, 16, 64):
        monkeypatch.setattr(kernels, "SUBSTEPS", substeps)
        defects.append(np.abs(numbers(kernels.physics(), variables, parameters)["defect"]).max())
    # Runge and Kutta's fourth order, towards what SciPy found.
    assert defects[1] / defects[2] == pytest.approx(16, rel=0.3)
    assert defects[3] < 1e-8


def test_physics_names_what_is_off() -> None:
    variables, parameters = Carried(1).physics()
    plain = numbers(kernels.physics(), variables, parameters)["defect"]
    pushed = {**variables, "wrench1": variables["wrench1"] + [0.02, 0, 0, 0, 0, 0]}
    moved = numbers(kernels.physics(), pushed, parameters)["defect"] - plain
    # Half the step's mean of 0.02 m·g more: a change of speed of 0.01 g·step, and nothing turns.
    speed = 0.01 * STEP / parameters["inertial"]  # type: ignore[operator]
    assert np.linalg.norm(moved[6:9]) == pytest.approx(speed, rel=0.1)
    np.testing.assert_allclose(moved[[3, 4, 5, 9, 10, 11]], 0, atol=1e-12)
    slower = numbers(kernels.physics(), {**variables, "rate0": variables["rate0"] * 0.99}, parameters)["defect"]
    np.testing.assert_allclose(slower[:3] - plain[:3], 0.01 * STEP * variables["rate0"][:3], atol=2e-4)


def test_wrenches_are_sums_over_the_contacts() -> None:
    body, rng = Carried(2), np.random.default_rng(0)
    points, forces = body.points / LENGTH, body.forces / WEIGHT
    total = rng.normal(size=6)
    found = numbers(kernels.wrench(3), {"total": total, "points": points[0], "forces": forces[0]}, {})
    np.testing.assert_allclose(found["sum"], body.wrench(body.points[0], body.forces[0]) - total, atol=1e-12)
    ends = {"points0": points[0], "forces0": forces[0], "points1": points[1], "forces1": forces[1]}
    found = numbers(kernels.middle_torque(3), {"middle": total[:3], **ends}, {})
    halfway = body.wrench(body.points.mean(axis=0), body.forces.mean(axis=0))[3:]
    np.testing.assert_allclose(found["sum"], halfway - total[:3], atol=1e-12)


# A contact, seen from both bodies.


def random_finger(joints: int, rng: np.random.Generator) -> FingerSeed:
    return FingerSeed(
        base=rng.uniform(-0.8, 0.8, 2),
        lengths=rng.uniform(0.9, 2.0, joints),
        frames=Rotation.random(joints, rng=rng).as_matrix(),
        axes=rng.uniform(-0.7, 0.7, (joints, 2)),
        angles=rng.uniform(-0.8, 0.8, (1, joints)),
        tips=np.zeros((1, 2)),
    )


def shape(finger: FingerSeed, tag: str = "") -> dict[str, object]:
    return {f"base{tag}": finger.base, f"lengths{tag}": finger.lengths, f"axes{tag}": finger.axes}


def frames(finger: FingerSeed) -> Array:
    """Rotations with their columns stacked, one after another."""
    return finger.frames.transpose(0, 2, 1).ravel()


class Place:
    """Where object and palm are, at random."""

    def __init__(self, rng: np.random.Generator) -> None:
        self.position, self.palm_position = rng.normal(size=(2, 3))
        self.reference, self.palm = Rotation.random(rng=rng), Rotation.random(rng=rng)
        self.vector = rng.uniform(-1, 1, 3)

    @property
    def pose(self) -> Array:
        return np.r_[self.position, self.vector]

    @property
    def turn(self) -> Rotation:
        return Rotation.from_rotvec(self.vector) * self.reference

    @property
    def parameters(self) -> dict[str, object]:
        quaternions = [r.as_quat(scalar_first=True) for r in (self.reference, self.palm)]
        return {"reference": quaternions[0], "palm_position": self.palm_position, "palm_quaternion": quaternions[1]}

    def in_palm(self, point: Array) -> Array:
        return self.palm.inv().apply(self.turn.apply(point) + self.position - self.palm_position)


def surface(point: Array, capsule: Array) -> tuple[float, Array]:
    """Signed distance and outward normal of a capsule."""
    outward = point - nearest_on_axis(point, capsule)
    return float(np.linalg.norm(outward)) - capsule[6], outward / np.linalg.norm(outward)


@pytest.mark.parametrize("joints", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(3))
def test_a_contact_s_numbers_are_those_of_numpy_and_pinocchio(joints: int, seed: int) -> None:
    rng = np.random.default_rng((joints, seed))
    finger, place = random_finger(joints, rng), Place(rng)
    capsule = np.r_[rng.normal(size=6), 0.3]
    point, helper = rng.normal(size=(2, 3))
    off_object, normal = surface(point, capsule)
    force = 0.5 * rng.normal(size=3) - rng.uniform(0.5, 2) * normal
    wanted_point, wanted_force = rng.normal(size=(2, 3))
    mu, radius = 0.6, 0.2
    found = numbers(
        kernels.contact(joints, 0, limited=True),
        {**shape(finger), "pose": place.pose, "point": point, "force": force, "angles": finger.angles[0]},
        {
            "frames": frames(finger),
            **place.parameters,
            "capsule": capsule,
            "radius": radius,
            "helper": helper,
            "friction": mu,
            "wanted_point": wanted_point,
            "wanted_force": wanted_force,
        },
    )
    chain, link = PinFinger(finger).chain(finger.angles[0])
    on_link = link.T @ (place.in_palm(point) - chain[-2])
    off_link, link_normal = surface(on_link, np.array([0, 0, 0, 0, 0, finger.lengths[-1], radius]))
    # Kinks of capsules are rounded by a thousandth of their length.
    np.testing.assert_allclose(found["on_surfaces"], [off_object, off_link], atol=1e-5)
    facing = place.turn.inv().apply(place.palm.apply(link @ link_normal))
    first = np.cross(helper, normal) / np.linalg.norm(np.cross(helper, normal))
    second = np.cross(normal, first)
    np.testing.assert_allclose(found["opposed"], [facing @ first, facing @ second], atol=2e-3)
    np.testing.assert_allclose(found["facing"], facing @ normal, atol=2e-3)
    pressing = -force @ normal
    np.testing.assert_allclose(found["pressing"], pressing, atol=2e-3)
    across = force + pressing * normal
    np.testing.assert_allclose(found["cone"], (mu * pressing) ** 2 - across @ across, atol=5e-3)
    # The fourth power of the friction in use: flat inside the cone, steep towards its edge.
    used = np.linalg.norm(across) / (mu * pressing + 0.1)
    np.testing.assert_allclose(found["friction_margin"], used**4, rtol=5e-2)
    jacobian = PinFinger(finger).jacobian(finger.angles[0], on_link)
    in_palm = place.palm.inv().apply(place.turn.apply(force))
    left, singular, _ = np.linalg.svd(jacobian)
    kept = np.ones(3)
    kept[: len(singular)] = 0.04**2 / (singular**2 + 0.04**2)
    passive = left @ (kept * (left.T @ in_palm))
    np.testing.assert_allclose(found["passive"], passive, atol=1e-6)
    np.testing.assert_allclose(found["passive_force"], passive @ passive, atol=1e-6)
    np.testing.assert_allclose(found["torque"], jacobian.T @ in_palm, atol=1e-6)
    np.testing.assert_allclose(found["stay_point"], ((point - wanted_point) ** 2).sum(), rtol=1e-12)
    np.testing.assert_allclose(found["stay_force"], ((force - wanted_force) ** 2).sum(), rtol=1e-12)


def test_torque_is_a_constraint_only_where_it_is_limited() -> None:
    assert "torque" in kernels.contact(2, 0, limited=True).constraints
    assert "torque" not in kernels.contact(2, 0, limited=False).constraints
    assert "speed" in kernels.joint_motion(2, 0, limited=True).constraints
    assert "speed" not in kernels.joint_motion(2, 0, limited=False).constraints


# Rolling.

REACH, TIP, BALL = 2.0, 0.15, 0.7  # of an upright finger of one joint that turns about y; the ball touches its cap
UPRIGHT = FingerSeed(
    base=np.zeros(2),
    lengths=np.array([REACH]),
    frames=np.array([[[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]]),
    axes=np.zeros((1, 2)),
    angles=np.zeros((1, 1)),
    tips=np.zeros((1, 2)),
)


Knot = tuple[Array, Rotation, Array, float]


def rolls(before: Knot, after: Knot) -> dict[str, Array]:
    """The rolling kernel for a ball at (position, orientation, contact in the palm frame, finger's angle) twice."""
    knots, scenes = {}, {}
    for i, (position, turn, contact, angle) in enumerate((before, after)):
        point = turn.inv().apply(contact - position)
        knots |= {f"pose{i}": np.r_[position, turn.as_rotvec()], f"point{i}": point, f"angles{i}": angle}
        scenes |= {f"reference{i}": STILL, f"palm_position{i}": np.zeros(3), f"palm_quaternion{i}": STILL}
        scenes |= {f"capsule{i}": [0, 0, 0, 0, 0, 0, BALL], f"radius{i}": TIP}
    across = np.cross(before[2] - before[0], [0, 1, 0])
    helper = before[1].inv().apply(across)
    parameters = {"frames": frames(UPRIGHT), **scenes, "helper": helper, "step": STEP}
    return numbers(kernels.rolling(1, 0), {**shape(UPRIGHT), **knots}, parameters)


def on_cap(phi: float, spin: float, lean: float = 0.0) -> Knot:
    """A ball that touches the finger's cap at an angle from the pole in the plane of x and z, turned about y."""
    centre = REACH * np.array([np.sin(lean), 0, np.cos(lean)])
    out = np.array([np.sin(phi + lean), 0, np.cos(phi + lean)])
    return centre + (TIP + BALL) * out, Rotation.from_rotvec([0, spin + lean, 0]), centre + TIP * out, lean


def test_a_ball_that_rolls_over_a_cap_slips_only_to_third_order() -> None:
    # Rolling without slip it turns by the path over the cap's radius and its own.
    slips = []
    for phi in (0.4, 0.2, 0.1):
        found = rolls(on_cap(0.3, 0.0), on_cap(0.3 + phi, (1 + TIP / BALL) * phi))
        slips.append(np.linalg.norm(found["no_slip"]))
        assert found["spin"][0] < 1e-12
    assert slips[0] < 0.02 * TIP
    assert slips[0] / slips[1] == pytest.approx(8, rel=0.1)
    assert slips[1] / slips[2] == pytest.approx(8, rel=0.1)


def test_a_wheel_that_rolls_along_a_link_slips_by_the_chord_s_lack() -> None:
    # On the cylinder: a turn by a moves the wheel by its radius times a; the chord falls short by a³/6.
    def rolled(angle: float) -> Knot:
        height = 0.6 + BALL * angle
        return np.array([TIP + BALL, 0, height]), Rotation.from_rotvec([0, -angle, 0]), np.array([TIP, 0, height]), 0.0

    for angle in (0.05, 0.2, 0.5):
        for way in (-1, 1):
            found = rolls(rolled(0.0), rolled(way * angle))
            lack = BALL * (angle - np.sin(angle))
            assert np.linalg.norm(found["no_slip"]) == pytest.approx(lack, rel=1e-3, abs=1e-7)


def test_a_ball_that_slides_slips_by_its_path() -> None:
    # Not turning, it sweeps the path of both surfaces: the sum of the radii times the angle.
    phi = 0.1
    found = rolls(on_cap(0.3, 0.0), on_cap(0.3 + phi, 0.0))
    path = (TIP + BALL) * np.sin(phi)
    assert np.linalg.norm(found["no_slip"]) == pytest.approx(path, rel=1e-6)
    assert found["slip"][0] == pytest.approx((path / STEP) ** 2, rel=1e-6)


def test_a_ball_that_moves_with_the_finger_neither_slips_nor_spins() -> None:
    found = rolls(on_cap(0.3, 0.0, lean=0.1), on_cap(0.3, 0.0, lean=0.5))
    np.testing.assert_allclose(found["no_slip"], 0, atol=1e-9)
    assert found["spin"][0] < 1e-12


def test_a_ball_that_turns_about_the_contact_s_normal_spins() -> None:
    position, turn, contact, angle = on_cap(0.3, 0.0)
    normal = (contact - position) / BALL
    turned = Rotation.from_rotvec(0.2 * normal) * turn
    found = rolls((position, turn, contact, angle), (position, turned, contact, angle))
    np.testing.assert_allclose(found["no_slip"], 0, atol=1e-12)
    assert found["spin"][0] == pytest.approx((np.sin(0.2) / STEP) ** 2, rel=1e-6)


# Clearance.


def between(one: tuple[Array, Array], other: tuple[Array, Array], radii: float) -> float:
    """Distance of two capsules' surfaces, by coal."""
    shapes = []
    for start, end in (one, other):
        length = np.linalg.norm(end - start)
        turn = Rotation.align_vectors([(end - start) / length], [[0, 0, 1]])[0]
        shapes.append((coal.Capsule(1e-6, length), coal.Transform3s(turn.as_matrix(), (start + end) / 2)))
    request, result = coal.DistanceRequest(), coal.DistanceResult()
    return float(coal.distance(*shapes[0], *shapes[1], request, result)) + 2e-6 - radii


@pytest.mark.parametrize(("touched", "grounded"), [(None, False), (1, False), (None, True), (0, True)])
def test_clearances_of_a_finger_are_those_of_coal(touched: int | None, grounded: bool) -> None:
    joints, radius, palm_radius, ground = 3, 0.1, 1.2, -0.4
    for seed in range(5):
        rng = np.random.default_rng(seed)
        finger, place = random_finger(joints, rng), Place(rng)
        primitives = np.hstack([rng.normal(size=(2, 6)), [[0.2], [0.3]]])
        found = numbers(
            kernels.apart(joints, 2, 0, touched, grounded),
            {**shape(finger), "pose": place.pose, "angles": finger.angles[0]},
            {
                "frames": frames(finger),
                **place.parameters,
                "radius": radius,
                "palm_radius": palm_radius,
                "ground": ground,
                "primitives": primitives,
            },
        )["clear"]
        links = PinFinger(finger).links(finger.angles[0])
        expected = [palm_apart(links[0][1], palm_radius) - radius]
        for start, end in links[1:]:
            expected += [palm_apart(p, palm_radius) - radius for p in ((start + end) / 2, end)]
        expected.append(between(links[0], links[2], 2 * radius))
        if grounded:
            joints_and_tip = [links[0][0], *[end for _, end in links]]
            heights = [(place.palm.apply(p) + place.palm_position)[2] for p in joints_and_tip]
            expected += [height - ground - radius for height in heights]
        seen = [(place.in_palm(c[:3]), place.in_palm(c[3:6])) for c in primitives]
        for (i, link), k in itertools.product(enumerate(links), range(2)):
            if i < joints - 1 or k != touched:
                expected.append(between(link, seen[k], radius + primitives[k, 6]))
        # Never too small; parallel or crossing segments are rounded off.
        np.testing.assert_allclose(found, expected, atol=6e-3)
        assert np.median(np.abs(found - expected)) < 1e-4


def test_clearances_of_two_fingers_are_those_of_coal() -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        one, other = random_finger(2, rng), random_finger(3, rng)
        found = numbers(
            kernels.fingers_apart(2, 3, "0_1"),
            {
                **shape(one, "_a"),
                "angles_a": one.angles[0],
                **shape(other, "_b"),
                "angles_b": other.angles[0],
            },
            {"frames_a": frames(one), "frames_b": frames(other), "radius": 0.1},
        )["clear"]
        links = [PinFinger(f).links(f.angles[0]) for f in (one, other)]
        expected = [between(a, b, 0.2) for a, b in itertools.product(*links)]
        np.testing.assert_allclose(found, expected, atol=6e-3)
        assert np.median(np.abs(found - expected)) < 1e-4


# What regularises.


def test_smoothness_and_staying() -> None:
    rng = np.random.default_rng(0)
    angles = rng.normal(size=(3, 2))
    found = numbers(
        kernels.joint_motion(2, 0, limited=True), {f"angles{i}": angles[i] for i in range(3)}, {"step": STEP}
    )
    speeds = np.diff(angles, axis=0) / STEP
    np.testing.assert_allclose(found["speed"], speeds.ravel(), rtol=1e-12)
    np.testing.assert_allclose(found["joint_acceleration"], ((np.diff(speeds, axis=0) / STEP) ** 2).sum(), rtol=1e-9)
    before, after = rng.normal(size=(2, 6))
    found = numbers(kernels.force_change(2), {"before": before, "after": after}, {})
    np.testing.assert_allclose(found["force_change"], ((after - before) ** 2).sum(), rtol=1e-12)
    pose, wanted = rng.normal(size=(2, 6))
    found = numbers(kernels.stay_on_path(), {"pose": pose}, {"wanted": wanted})
    np.testing.assert_allclose(found["stay_path"], ((pose - wanted) ** 2).sum(), rtol=1e-12)
    finger, other = random_finger(2, rng), random_finger(2, rng)
    found = numbers(kernels.stay(2, 0), shape(finger), shape(other))
    apart = [finger.base - other.base, finger.lengths - other.lengths, finger.axes - other.axes]
    np.testing.assert_allclose(found["stay_design"], sum((a**2).sum() for a in apart), rtol=1e-12)
    np.testing.assert_allclose(found["on_palm"], finger.base @ finger.base, rtol=1e-12)


def test_a_smooth_surface_is_the_capsule_but_at_its_kinks() -> None:
    capsule = np.array([0.1, 0.2, -0.4, 0.3, 0, 0.8, 0.25])
    point, start, end, radius = (ca.SX.sym(n, k) for n, k in (("p", 3), ("s", 3), ("e", 3), ("r", 1)))
    function = ca.Function("f", [point, start, end, radius], [*kernels.smooth_surface(point, start, end, radius)])
    for at in np.random.default_rng(0).normal(size=(200, 3)):
        distance, normal = function(at, capsule[:3], capsule[3:6], capsule[6])
        expected, outward = surface(at, capsule)
        assert float(distance) == pytest.approx(expected, abs=1e-5)
        np.testing.assert_allclose(np.asarray(normal).ravel(), outward, atol=3e-3)
