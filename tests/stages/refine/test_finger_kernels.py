"""The fingers' exact blocks against numeric Pinocchio, coal, and closed forms of rolling."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.stages.refine import finger_kernels
from tests.stages.blocks import (
    STEP,
    STILL,
    Place,
    between,
    check_block,
    frames,
    numbers,
    random_finger,
    shape,
    surface,
)
from tests.stages.example import STAND, PinFinger, folds_apart, nearest_on_axis, palm_apart

Array = np.ndarray
Block = tuple[dict[str, object], dict[str, object]]


# A contact, seen from both bodies.


class Contact:
    """A contact of a random finger and a random capsule, off both surfaces; its force leans out of the cone or not."""

    friction, radius, tip, hinge = 0.6, 0.15, 0.2, 0.4

    def __init__(self, joints: int, seed: int) -> None:
        rng = np.random.default_rng((joints, seed))
        self.finger, self.place = random_finger(joints, rng), Place(rng)
        self.capsule = np.r_[rng.normal(size=6), 0.3]
        self.point = rng.normal(size=3)
        self.off_object, self.normal = surface(self.point, self.capsule)
        self.force = 0.5 * rng.normal(size=3) - rng.uniform(0.5, 2) * self.normal
        self.wanted_point, self.wanted_force = rng.normal(size=(2, 3))
        self.tie = rng.uniform(0.1, 1)
        self.branch = rng.normal(size={2: 3, 3: 1}.get(joints, 0))
        self.standing = self.tip if joints == 1 else self.radius  # radius of the first link

    @property
    def scene(self) -> dict[str, object]:
        parameters = {"frames": frames(self.finger), **self.place.parameters}
        return {**parameters, "body": self.capsule, "radius": self.radius, "tip_radius": self.tip, "hinge": self.hinge}

    @property
    def contact(self) -> Block:
        """Variables and parameters of the contact's kernel."""
        variables = {"pose": self.place.pose, "point": self.point, "force": self.force, "angles": self.finger.angles[0]}
        wanted = {"wanted_point": self.wanted_point, "wanted_force": self.wanted_force}
        kept = {"margin_direction": self.branch} if self.branch.size else {}
        return {**shape(self.finger), **variables}, {
            **self.scene,
            "friction": self.friction,
            "tie": self.tie,
            **wanted,
            **kept,
        }

    @property
    def disturbed(self) -> Block:
        """The same of the kernel of a second force."""
        variables = {"pose": self.place.pose, "point": self.point, "angles": self.finger.angles[0], "force": self.force}
        return {**shape(self.finger), **variables}, {**self.scene, "friction": self.friction}

    @property
    def actuated(self) -> Block:
        """The same of the kernel of what no joint supplies."""
        return self.disturbed[0], self.scene


@pytest.mark.parametrize("joints", [1, 2, 3, 4])
@pytest.mark.parametrize("seed", range(3))
def test_a_contact_s_numbers_are_those_of_numpy_and_pinocchio(joints: int, seed: int) -> None:
    case = Contact(joints, seed)
    finger, place, normal, force = case.finger, case.place, case.normal, case.force
    found = numbers(finger_kernels.contact(joints, Capsule, limited=True), *case.contact)
    chain, link = PinFinger(finger, case.standing).chain(finger.angles[0])
    on_link = link.T @ (place.in_palm(case.point) - chain[-2])
    # Kinks of capsules are rounded by a thousandth of their length.
    np.testing.assert_allclose(found["on_object"], case.off_object, atol=1e-5)
    axis = np.array([0, 0, case.hinge, 0, 0, finger.lengths[-1], case.tip])
    from_link = place.turn.inv().apply(place.palm.apply(link @ (on_link - nearest_on_axis(on_link, axis))))
    np.testing.assert_allclose(found["on_link"], from_link + case.tip * normal, atol=5e-3)
    pressing = -force @ normal
    np.testing.assert_allclose(found["pressing"], pressing, atol=2e-3)
    across = force + pressing * normal
    np.testing.assert_allclose(found["cone"], (case.friction * pressing) ** 2 - across @ across, atol=5e-3)
    # The fourth power of the friction in use: flat inside the cone, steep towards its edge.
    used = np.linalg.norm(across) / (case.friction * pressing + 0.1)
    np.testing.assert_allclose(found["friction_margin"], used**4, rtol=5e-2)
    jacobian = PinFinger(finger, case.standing).jacobian(finger.angles[0], on_link)
    in_palm = place.palm.inv().apply(place.turn.apply(force))
    left, singular, _ = np.linalg.svd(jacobian)
    kept = np.ones(3)
    kept[: len(singular)] = 0.06**4 / (singular**4 + 0.06**4)
    structural = left @ (kept * (left.T @ in_palm))
    np.testing.assert_allclose(found["structural"], structural, atol=1e-6)
    np.testing.assert_allclose(found["passive_force"], structural @ structural, atol=1e-6)
    np.testing.assert_allclose(found["torque"], jacobian.T @ in_palm, atol=1e-6)
    assert ("singularity_margin" in found) == (joints in (2, 3))
    if joints == 2:
        np.testing.assert_allclose(found["singularity_margin"], case.branch @ np.cross(*jacobian.T), atol=1e-6)
    if joints == 3:
        np.testing.assert_allclose(found["singularity_margin"], case.branch * np.linalg.det(jacobian), atol=1e-6)
    np.testing.assert_allclose(
        found["stay_point"], case.tie**2 * ((case.point - case.wanted_point) ** 2).sum(), rtol=1e-12
    )
    np.testing.assert_allclose(found["stay_force"], ((force - case.wanted_force) ** 2).sum(), rtol=1e-12)


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_a_link_ends_in_a_cap_about_its_hinge(joints: int) -> None:
    # Where a capsule from the joint on would still be, a hinged link is as far off as its cap is.
    case = Contact(joints, 8)
    chain, link = PinFinger(case.finger, case.standing).chain(case.finger.angles[0])
    for below in (0.0, 0.1, 0.4):
        touched = chain[-2] + link @ [case.tip, 0, case.hinge - below]
        case.place.position = case.place.palm.apply(touched) + case.place.palm_position
        case.place.position -= case.place.turn.apply(case.point)
        found = numbers(finger_kernels.contact(joints, Capsule, limited=True), *case.contact)
        normal = surface(case.point, case.capsule)[1]
        in_object = case.place.turn.inv() * case.place.palm
        from_axis = in_object.apply(link @ [case.tip, 0, -below])
        np.testing.assert_allclose(found["on_link"], from_axis + case.tip * normal, atol=5e-3)


@pytest.mark.parametrize(("share", "outside"), [(0.5, 1), (0.5, -1), (1.0, 1), (1.0, -1)])
@pytest.mark.parametrize("joints", [1, 2, 3])
def test_surfaces_touch_where_normals_are_opposed(joints: int, share: float, outside: int) -> None:
    # The object is put where a point of its cylinder is on the link's surface, or its cap's (share 1).
    case, rng = Contact(joints, 5), np.random.default_rng(6)
    start, end, thick = case.capsule[:3], case.capsule[3:6], case.capsule[6]
    across = np.cross(end - start, rng.normal(size=3))
    across /= np.linalg.norm(across)
    case.point = start + share * (end - start) + thick * across
    chain, link = PinFinger(case.finger, case.standing).chain(case.finger.angles[0])
    link_normal = link @ [0.6, 0.8, 0]
    on_axis = chain[-2] + share * (chain[-1] - chain[-2])
    turn = Rotation.align_vectors([-outside * case.place.palm.apply(link_normal)], [across])[0]
    case.place.vector = (turn * case.place.reference.inv()).as_rotvec()
    touched = case.place.palm.apply(on_axis + case.tip * link_normal) + case.place.palm_position
    case.place.position = touched - turn.apply(case.point)
    found = numbers(finger_kernels.contact(joints, Capsule, limited=True), *case.contact)
    np.testing.assert_allclose(found["on_object"], 0, atol=1e-5)
    # From within the object, the link's axis is a diameter away from where it should be.
    off = found["on_link"]
    np.testing.assert_allclose(off, 0 if outside == 1 else 2 * case.tip * across, atol=5e-3)


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_a_second_force_is_held_as_the_first(joints: int) -> None:
    case = Contact(joints, 7)
    first = numbers(finger_kernels.contact(joints, Capsule, limited=True), *case.contact)
    second = numbers(finger_kernels.disturbed_contact(joints, Capsule, limited=True), *case.disturbed)
    assert set(second) == {"pressing", "cone", "structural", "torque", "passive_force"}
    for name, value in second.items():
        np.testing.assert_allclose(value, first[name], rtol=1e-12, atol=1e-12)
    third = numbers(finger_kernels.actuated(joints, Capsule), *case.actuated)
    assert set(third) == {"structural", "passive_force"}
    for name, value in third.items():
        np.testing.assert_allclose(value, first[name], rtol=1e-12, atol=1e-12)
    # Turned about the normal, the force is as well within the cone; doubled, four times as far from its edge.
    turn = Rotation.from_rotvec(1.1 * case.normal)
    case.force = 2 * turn.apply(case.force)
    other = numbers(finger_kernels.disturbed_contact(joints, Capsule, limited=True), *case.disturbed)
    np.testing.assert_allclose(other["pressing"], 2 * second["pressing"], rtol=1e-3)
    np.testing.assert_allclose(other["cone"], 4 * second["cone"], rtol=1e-2)


def test_torque_is_a_constraint_only_where_it_is_limited() -> None:
    assert "torque" in finger_kernels.contact(2, Capsule, limited=True).constraints
    assert "torque" not in finger_kernels.contact(2, Capsule, limited=False).constraints
    assert "torque" not in finger_kernels.disturbed_contact(2, Capsule, limited=False).constraints
    assert "speed" in finger_kernels.joint_motion(2, limited=True).constraints
    assert "speed" not in finger_kernels.joint_motion(2, limited=False).constraints


# Rolling.

REACH, TIP, BALL = 2.0, 0.15, 0.7  # of an upright finger of one joint that turns about y; the ball touches its cap
FOOT = np.array([0, 0, STAND * TIP])  # where the joint is
UPRIGHT = FingerSeed(
    base=np.zeros(2),
    lengths=np.array([REACH]),
    frames=np.array([[[1.0, 0, 0], [0, 0, 1], [0, -1, 0]]]),
    axes=np.zeros((1, 2)),
    bends=np.zeros((1, 2)),
    angles=np.zeros((1, 1)),
    tips=np.zeros((1, 2)),
)


Knot = tuple[Array, Rotation, Array, float]


def rolls(before: Knot, after: Knot) -> dict[str, Array]:
    """The rolling block of a ball at (position, orientation, contact in the palm frame, finger's angle) twice."""
    return numbers(finger_kernels.rolling(1, Sphere, False), *rolling_block(before, after))


def rolling_block(before: Knot, after: Knot) -> Block:
    knots, scenes = {}, {}
    for i, (position, turn, contact, angle) in enumerate((before, after)):
        point = turn.inv().apply(contact - position)
        knots |= {f"pose{i}": np.r_[position, turn.as_rotvec()], f"point{i}": point, f"angles{i}": angle}
        scenes |= {f"reference{i}": STILL, f"palm_position{i}": np.zeros(3), f"palm_quaternion{i}": STILL}
        scenes |= {f"body{i}": [0, 0, 0, BALL], f"radius{i}": 0.1, f"tip_radius{i}": TIP, f"hinge{i}": 0.1}
    across = np.cross(before[2] - before[0], [0, 1, 0])
    helper = before[1].inv().apply(across)
    parameters = {"frames": frames(UPRIGHT), **scenes, "helper": helper, "step": STEP}
    return {**shape(UPRIGHT), **knots}, parameters


def on_cap(phi: float, spin: float, lean: float = 0.0) -> Knot:
    """A ball that touches the finger's cap at an angle from the pole in the plane of x and z, turned about y."""
    centre = FOOT + REACH * np.array([np.sin(lean), 0, np.cos(lean)])
    out = np.array([np.sin(phi + lean), 0, np.cos(phi + lean)])
    return centre + (TIP + BALL) * out, Rotation.from_rotvec([0, spin + lean, 0]), centre + TIP * out, lean


def test_a_ball_that_rolls_over_a_cap_slips_only_to_fifth_order() -> None:
    # Rolling without slip it turns by the path over the cap's radius and its own.
    slips = []
    for phi in (0.4, 0.2, 0.1):
        found = rolls(on_cap(0.3, 0.0), on_cap(0.3 + phi, (1 + TIP / BALL) * phi))
        slips.append(np.linalg.norm(found["no_slip"]))
        assert found["spin"][0] < 1e-12
    assert slips[0] < 1e-3 * TIP
    assert slips[0] / slips[1] == pytest.approx(32, rel=0.1)
    assert slips[1] / slips[2] == pytest.approx(32, rel=0.1)


def test_a_wheel_that_rolls_along_a_link_slips_only_to_fifth_order() -> None:
    # On the cylinder: a turn by a moves the wheel by its radius times a. The mean of two rotations falls short by a²/8.
    def rolled(angle: float) -> Knot:
        height = 0.6 + BALL * angle
        return np.array([TIP + BALL, 0, height]), Rotation.from_rotvec([0, -angle, 0]), np.array([TIP, 0, height]), 0.0

    for angle in (0.05, 0.2, 0.5):
        for way in (-1, 1):
            found = rolls(rolled(0.0), rolled(way * angle))
            lack = BALL * angle * 1.5 * (angle**2 / 8) ** 2
            assert np.linalg.norm(found["no_slip"]) == pytest.approx(lack, rel=0.1, abs=1e-8)


def test_a_ball_that_slides_slips_by_its_path() -> None:
    # Not turning, it sweeps the path of both surfaces: the sum of the radii times the angle.
    phi = 0.1
    found = rolls(on_cap(0.3, 0.0), on_cap(0.3 + phi, 0.0))
    path = (TIP + BALL) * phi * np.cos(phi / 2)  # seen across the normal at its start
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


RADIUS, THICK, PALM_RADIUS, GROUND = 0.1, 0.17, 1.2, -0.4
RADII = {"radius": RADIUS, "tip_radius": THICK}


def clearance_block(finger: FingerSeed, place: Place, primitives: Array) -> Block:
    parameters = {**RADII, "palm_radius": PALM_RADIUS, "ground_height": GROUND, "bodies": primitives.ravel()}
    variables = {**shape(finger), "pose": place.pose, "angles": finger.angles[0]}
    return variables, {"frames": frames(finger), **place.parameters, **parameters}


def pair_block(one: FingerSeed, other: FingerSeed) -> Block:
    variables = {**shape(one, "0"), "angles0": one.angles[0], **shape(other, "1"), "angles1": other.angles[0]}
    return variables, {"frames0": frames(one), "frames1": frames(other), **RADII}


@pytest.mark.parametrize(("touched", "grounded"), [(None, False), (1, False), (None, True), (0, True)])
def test_clearances_of_a_finger_are_those_of_coal(touched: int | None, grounded: bool) -> None:
    joints = 3
    for seed in range(5):
        rng = np.random.default_rng(seed)
        finger, place = random_finger(joints, rng), Place(rng)
        primitives = np.hstack([rng.normal(size=(2, 6)), [[0.2], [0.3]]])
        kernel = finger_kernels.apart(joints, (Capsule, Capsule), touched, grounded)
        block = numbers(kernel, *clearance_block(finger, place, primitives))
        found = block["clear"]
        links = PinFinger(finger, RADIUS).links(finger.angles[0])
        # The last link is thicker, from its joint on.
        middles = [(start + end) / 2 for start, end in links]
        marks = [(links[0][1], RADIUS), (middles[1], RADIUS), (links[1][1], THICK)]
        marks += [(middles[2], THICK), (links[2][1], THICK)]
        expected = [palm_apart(p, PALM_RADIUS) - radius for p, radius in marks]
        expected.append(between(links[0], links[2], RADIUS + THICK))
        if grounded:
            joints_and_tip = [links[0][0], *[end for _, end in links]]
            heights = [(place.palm.apply(p) + place.palm_position)[2] for p in joints_and_tip]
            radii = [RADIUS, RADIUS, THICK, THICK]
            expected += [height - GROUND - radius for height, radius in zip(heights, radii, strict=True)]
        seen = [(place.in_palm(c[:3]), place.in_palm(c[3:6])) for c in primitives]
        for (i, link), k in itertools.product(enumerate(links), range(2)):
            if i < joints - 1 or k != touched:
                expected.append(between(link, seen[k], (THICK if i == joints - 1 else RADIUS) + primitives[k, 6]))
        # Never too small; parallel or crossing segments are rounded off.
        np.testing.assert_allclose(found, expected, atol=6e-3)
        assert np.median(np.abs(found - expected)) < 1e-4
        np.testing.assert_allclose(block["unfolded"], folds_apart(links, RADIUS), atol=1e-5)


def test_clearances_of_two_fingers_are_those_of_coal() -> None:
    for seed in range(5):
        rng = np.random.default_rng(seed)
        one, other = random_finger(2, rng), random_finger(3, rng)
        found = numbers(finger_kernels.fingers_apart(2, 3), *pair_block(one, other))["clear"]
        links = [PinFinger(f, RADIUS).links(f.angles[0]) for f in (one, other)]
        thick = [[RADIUS, THICK], [RADIUS, RADIUS, THICK]]
        pairs = itertools.product(*[list(zip(*each, strict=True)) for each in zip(links, thick, strict=True)])
        expected = [between(a, b, radius + other) for (a, radius), (b, other) in pairs]
        np.testing.assert_allclose(found, expected, atol=6e-3)
        assert np.median(np.abs(found - expected)) < 1e-4


# What regularises.


def stay_block(finger: FingerSeed, wanted: FingerSeed) -> Block:
    return shape(finger), {f"wanted_{name}": value for name, value in shape(wanted).items()}


def test_smoothness_and_staying() -> None:
    rng = np.random.default_rng(0)
    times, angles = np.array([0.0, 0.05, 0.15, 0.21]), rng.normal(size=(4, 2))
    steps = {f"step{i}": step for i, step in enumerate(np.diff(times))}
    curve = [np.polynomial.Polynomial.fit(times[:3], column, 2) for column in angles[:3].T]
    found = numbers(
        finger_kernels.joint_motion(2, limited=True),
        {f"angles{i}": angles[i] for i in range(3)},
        {name: steps[name] for name in ("step0", "step1")},
    )
    speeds = np.diff(angles[:3], axis=0) / np.diff(times[:3])[:, None]
    np.testing.assert_allclose(found["speed"], speeds.ravel(), rtol=1e-12)
    np.testing.assert_allclose(found["joint_acceleration"], sum(c.deriv(2)(0.0) ** 2 for c in curve), rtol=1e-9)
    curve = [np.polynomial.Polynomial.fit(times, column, 3) for column in angles.T]
    found = numbers(finger_kernels.joint_jerk(2), {f"angles{i}": angles[i] for i in range(4)}, steps)
    np.testing.assert_allclose(found["joint_jerk"], sum(c.deriv(3)(0.0) ** 2 for c in curve), rtol=1e-9)
    finger, other = random_finger(2, rng), random_finger(2, rng)
    found = numbers(finger_kernels.near_design(2), *stay_block(finger, other))
    apart = [getattr(finger, name) - getattr(other, name) for name in ("base", "lengths", "axes", "bends")]
    np.testing.assert_allclose(found["stay_design"], sum((a**2).sum() for a in apart), rtol=1e-12)
    np.testing.assert_allclose(found["on_palm"], finger.base @ finger.base, rtol=1e-12)


# Derivatives.


def test_derivatives_agree_with_differences() -> None:
    rng = np.random.default_rng(3)
    one, other, place, case = random_finger(2, rng), random_finger(3, rng), Place(rng), Contact(2, 1)
    before, after = on_cap(0.3, 0.1, lean=0.1), on_cap(0.5, 0.4, lean=0.2)
    primitives = np.hstack([rng.normal(size=(2, 6)), [[0.2], [0.3]]])
    angles = rng.normal(size=(3, 2))
    for kernel, (variables, parameters) in (
        (finger_kernels.contact(2, Capsule, limited=True), case.contact),
        (finger_kernels.contact(3, Capsule, limited=True), Contact(3, 1).contact),
        (finger_kernels.disturbed_contact(2, Capsule, limited=True), case.disturbed),
        (finger_kernels.actuated(2, Capsule), case.actuated),
        (finger_kernels.rolling(1, Sphere, False), rolling_block(before, after)),
        (finger_kernels.apart(2, (Capsule, Capsule), 1, grounded=True), clearance_block(one, place, primitives)),
        (finger_kernels.fingers_apart(2, 3), pair_block(one, other)),
        (
            finger_kernels.joint_motion(2, limited=True),
            ({f"angles{i}": angles[i] for i in range(3)}, {"step0": STEP, "step1": 0.7 * STEP}),
        ),
        (finger_kernels.near_design(2), stay_block(one, random_finger(2, rng))),
    ):
        check_block(kernel, variables, parameters)


def test_derivatives_are_finite_where_nothing_moves_and_nothing_presses() -> None:
    # The object where its reference is, the finger straight up and on its seed axes, a contact with no force.
    knot = on_cap(0.3, 0.0)
    check_block(finger_kernels.rolling(1, Sphere, False), *rolling_block(knot, knot), h=1e-6)
    case = Contact(2, 0)
    case.finger = replace(case.finger, axes=np.zeros((2, 2)), angles=np.zeros((1, 2)))
    case.place.vector, case.force = np.zeros(3), np.zeros(3)
    check_block(finger_kernels.contact(2, Capsule, limited=True), *case.contact, h=1e-6)
    check_block(finger_kernels.disturbed_contact(2, Capsule, limited=True), *case.disturbed, h=1e-6)
