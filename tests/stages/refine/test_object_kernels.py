"""The object's exact blocks against SciPy's integrator and rotations, coal, and closed forms of rolling."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.stages.refine import newton_euler
from casadi_hands.stages.refine import object_kernels as body
from tests.stages.blocks import STEP, STILL, Place, check_block, coal_distance, numbers, segment, surface
from tests.stages.example import palm_apart

Array = np.ndarray
Block = tuple[dict[str, object], dict[str, object]]

# Physics.

LENGTH, MASS, INERTIA = 0.04, 0.3, np.array([[3e-4, 4e-5, 0], [4e-5, 2e-4, -2e-5], [0, -2e-5, 1e-4]])
WEIGHT, GRAVITY = MASS * 9.81, np.array([0, 0, -9.81])


class Carried:
    """A body in SI that contacts push from one knot to the next, integrated by SciPy.

    Args:
        seed: of where it is and what pushes it.
        share: of a step between the knots; as much less do forces and points change.
    """

    def __init__(self, seed: int, share: float = 1.0) -> None:
        rng = np.random.default_rng(seed)
        self.step = share * STEP
        self.points, self.forces = 0.03 * rng.normal(size=(2, 3, 3)), 0.1 * rng.normal(size=(2, 3, 3))
        for pair in (self.points, self.forces):
            pair[1] = (1 - share) * pair[0] + share * pair[1]
        self.reference = Rotation.random(rng=rng)
        self.start = rng.normal(size=3), Rotation.from_rotvec(0.5 * rng.normal(size=3)) * self.reference
        self.rate = 0.2 * rng.normal(size=3), 2.0 * rng.normal(size=3)
        turn = self.start[1].as_quat(scalar_first=True)
        state = np.concatenate([self.start[0], turn, *self.rate])
        end = solve_ivp(self._slope, (0, self.step), state, method="DOP853", rtol=1e-13, atol=1e-15).y[:, -1]
        self.end = end[:3], Rotation.from_quat(end[3:7], scalar_first=True)
        self.end_rate = end[7:10], end[10:]

    def _slope(self, t: float, state: Array) -> Array:
        """Forces and points linear in time in the body's frame; the spin is the body's too."""
        s = t / self.step
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
            "middle_torque": middle,
        }
        parameters = {
            "reference": self.reference.as_quat(scalar_first=True),
            "step": self.step,
            "gravity": [0, 0, -1],
            "inertial": LENGTH / 9.81,
            "inertia": inertia,
            "inverse": np.linalg.inv(inertia),
        }
        return variables, parameters


@pytest.mark.parametrize("seed", range(4))
def test_physics_is_that_of_scipy_s_integrator(seed: int) -> None:
    defects = []
    for share in (1.0, 0.5, 0.25):
        variables, parameters = Carried(seed, share).physics()
        change = (variables["rate1"] - variables["rate0"]) / (share * STEP)
        assert np.abs(change[3:]).max() > 5  # rad/s²; the torques change all the way in one step
        found = numbers(newton_euler.physics(), variables, parameters)
        np.testing.assert_allclose(found["object_acceleration"], change @ change, rtol=1e-12)
        defects.append(np.abs(found["defect"]).max())
    assert defects[0] < 1e-3
    # Sixth order, which is the seventh power of the step in each step, towards what SciPy found.
    assert defects[0] / defects[2] > 4**6
    assert defects[2] < 2e-7


def test_physics_names_what_is_off() -> None:
    variables, parameters = Carried(1).physics()
    plain = numbers(newton_euler.physics(), variables, parameters)["defect"]
    pushed = {**variables, "wrench1": variables["wrench1"] + [0.02, 0, 0, 0, 0, 0]}
    moved = numbers(newton_euler.physics(), pushed, parameters)["defect"] - plain
    # Half the step's mean of 0.02 m·g more: a change of speed of 0.01 g·step, and nothing turns.
    speed = 0.01 * STEP / parameters["inertial"]  # type: ignore[operator]
    assert np.linalg.norm(moved[6:9]) == pytest.approx(speed, rel=0.1)
    np.testing.assert_allclose(moved[[3, 4, 5, 9, 10, 11]], 0, atol=1e-12)
    slower = numbers(newton_euler.physics(), {**variables, "rate0": variables["rate0"] * 0.99}, parameters)["defect"]
    np.testing.assert_allclose(slower[:3] - plain[:3], 0.01 * STEP * variables["rate0"][:3], atol=2e-4)


def test_wrenches_are_sums_over_the_contacts() -> None:
    carried, rng = Carried(2), np.random.default_rng(0)
    points, forces = carried.points / LENGTH, carried.forces / WEIGHT
    total = rng.normal(size=6)
    found = numbers(body.wrench(3, False), {"wrench": total, "point": points[0], "force": forces[0]}, {})
    np.testing.assert_allclose(found["sum"], carried.wrench(carried.points[0], carried.forces[0]) - total, atol=1e-12)
    ends = {"point0": points[0], "force0": forces[0], "point1": points[1], "force1": forces[1]}
    found = numbers(body.middle_torque(3, False), {"middle_torque": total[:3], **ends}, {})
    halfway = carried.wrench(carried.points.mean(axis=0), carried.forces.mean(axis=0))[3:]
    np.testing.assert_allclose(found["sum"], halfway - total[:3], atol=1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_a_second_set_of_forces_holds_the_object_against_a_push(seed: int) -> None:
    # Statics in the world, solved here: the weight held by one set, weight and push together by another.
    rng = np.random.default_rng(seed)
    place, points, weight = Place(rng), rng.normal(size=(4, 3)), np.array([0, 0, -1.0])
    force, torque = rng.normal(size=(2, 3))
    arms = place.turn.apply(points)
    columns = [np.r_[e, np.cross(arm, e)] for arm in arms for e in np.eye(3)]
    grasp = np.column_stack(columns)

    def hold(push: Array) -> Array:
        """Forces (4, 3), object frame, that with the weight and a push leave nothing."""
        found = np.linalg.lstsq(grasp, -push - np.r_[weight, np.zeros(3)], rcond=None)[0]
        return place.turn.inv().apply(found.reshape(4, 3))

    alone, pushed = hold(np.zeros(6)), hold(np.r_[force, torque])
    total = np.r_[alone.sum(axis=0), np.cross(points, alone).sum(axis=0)]
    variables = {"pose": place.pose, "wrench": total, "point": points, "force": pushed}
    external = {"reference": place.parameters["reference"], "external_force": force, "external_torque": torque}
    found = numbers(body.disturbed(4, False), variables, external)
    np.testing.assert_allclose(found["sum"], 0, atol=1e-12)
    np.testing.assert_allclose(found["force_regularisation"], (pushed**2).sum(), rtol=1e-12)
    # The first forces do not hold the push as well: it is what is missing, in the object's frame.
    found = numbers(body.disturbed(4, False), {**variables, "force": alone}, external)
    unheld = place.turn.inv().apply([force, torque]).ravel()
    np.testing.assert_allclose(found["sum"], unheld, atol=1e-12)


def test_what_keeps_the_motion_smooth_and_near() -> None:
    rng = np.random.default_rng(0)
    before, after = rng.normal(size=(2, 6))
    found = numbers(body.force_change(2), {"force0": before, "force1": after}, {})
    np.testing.assert_allclose(found["force_change"], ((after - before) ** 2).sum(), rtol=1e-12)
    pose, wanted = rng.normal(size=(2, 6))
    found = numbers(body.near_path(), {"pose": pose}, {"wanted_pose": wanted})
    np.testing.assert_allclose(found["stay_path"], ((pose - wanted) ** 2).sum(), rtol=1e-12)
    found = numbers(body.meet_goal(), {"pose": pose}, {"goal_pose": wanted})
    np.testing.assert_allclose(found["goal"], ((pose - wanted) ** 2).sum(), rtol=1e-12)


# The ground.

CAPSULE = np.array([-0.5, 0.2, 0.1, 0.7, 0.2, -0.2, 0.3])  # start, end, radius; object frame
HEIGHT, MU = -0.35, 0.4


class Lying:
    """A capsule that touches the ground: its axis' two ends in the world, and how it is turned about its axis."""

    def __init__(self, seed: int = 0) -> None:
        rng = np.random.default_rng(seed)
        self.reference = Rotation.random(rng=rng)
        self.turn = Rotation.align_vectors([[1.0, 0, 0]], [CAPSULE[3:6] - CAPSULE[:3]])[0]
        self.turn = Rotation.from_rotvec([0, 0, rng.uniform(-3, 3)]) * self.turn
        self.lift(0.0)
        self.position[:2] = rng.normal(size=2)

    def lift(self, by: float) -> None:
        """Put the axis' start a radius above the ground, and ``by`` more."""
        start = self.turn.apply(CAPSULE[:3])
        self.position = np.r_[0, 0, HEIGHT + CAPSULE[6] + by] - np.r_[0, 0, start[2]]

    @property
    def pose(self) -> Array:
        return np.r_[self.position, (self.turn * self.reference.inv()).as_rotvec()]

    @property
    def quaternion(self) -> Array:
        return self.reference.as_quat(scalar_first=True)

    def axis_point(self, share: float) -> Array:
        """World, on the axis between its ends."""
        return self.turn.apply((1 - share) * CAPSULE[:3] + share * CAPSULE[3:6]) + self.position

    def beneath(self, share: float) -> Array:
        """The lowest surface point there, object frame."""
        return self.turn.inv().apply(self.axis_point(share) - [0, 0, CAPSULE[6]] - self.position)

    def moved(self, turn: Rotation, about: Array, by: tuple[float, float] = (0.0, 0.0)) -> Lying:
        """The same capsule turned about a point of the world, then moved along the ground."""
        other = Lying.__new__(Lying)
        other.reference, other.turn = self.reference, turn * self.turn
        other.position = turn.apply(self.position - about) + about + [*by, 0]
        return other


def touching(lying: Lying, point: Array, force: Array) -> Block:
    parameters = {"reference": lying.quaternion, "body": CAPSULE, "ground_height": HEIGHT, "friction": MU}
    wanted = {"wanted_point": point + 0.1, "wanted_force": force - [0, 0, 0.2]}
    return {"pose": lying.pose, "point": point, "force": force}, {**parameters, **wanted}


def slipping(before: Lying, point: Array, after: Lying, point_after: Array) -> Block:
    variables = {"pose0": before.pose, "point0": point, "pose1": after.pose, "point1": point_after}
    return variables, {"reference": before.quaternion, "body": CAPSULE, "step": STEP}


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
@pytest.mark.parametrize("seed", range(3))
def test_a_capsule_that_lies_on_the_ground_touches_it(seed: int, share: float) -> None:
    lying = Lying(seed)
    point, force = lying.beneath(share), lying.turn.inv().apply([0.2, -0.1, 0.7])
    found = numbers(body.ground_contact(Capsule), *touching(lying, point, force))
    np.testing.assert_allclose(found["on_surfaces"], 0, atol=1e-5)
    np.testing.assert_allclose(found["opposed"], 0, atol=1e-5)
    np.testing.assert_allclose(found["facing"], -1, atol=1e-9)
    np.testing.assert_allclose(found["pressing"], 0.7, atol=1e-12)
    np.testing.assert_allclose(found["cone"], (MU * 0.7) ** 2 - 0.2**2 - 0.1**2, atol=1e-12)
    np.testing.assert_allclose(found["stay_point"], 3 * 0.1**2, rtol=1e-9)
    np.testing.assert_allclose(found["stay_force"], 0.2**2, rtol=1e-9)
    # Higher up its point is as far above the ground, and on the object still; at its side it faces sideways.
    lying.lift(0.15)
    found = numbers(body.ground_contact(Capsule), *touching(lying, lying.beneath(share), force))
    np.testing.assert_allclose(found["on_surfaces"], [0, 0.15], atol=1e-5)
    lying.lift(0.0)
    along = lying.turn.apply(CAPSULE[3:6] - CAPSULE[:3]) / np.linalg.norm(CAPSULE[3:6] - CAPSULE[:3])
    aside = np.cross(along, [0, 0, 1])
    side = lying.turn.inv().apply(lying.axis_point(share) + CAPSULE[6] * aside - lying.position)
    found = numbers(body.ground_contact(Capsule), *touching(lying, side, force))
    np.testing.assert_allclose(found["on_surfaces"], [0, CAPSULE[6]], atol=1e-5)
    np.testing.assert_allclose(found["opposed"], aside[:2], atol=1e-5)
    np.testing.assert_allclose(found["facing"], 0, atol=1e-5)


@pytest.mark.parametrize("seed", range(3))
def test_a_ground_contact_s_numbers_are_those_of_scipy_s_rotations(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place, (point, force, wanted_point, wanted_force) = Place(rng), rng.normal(size=(4, 3))
    reference = place.parameters["reference"]
    parameters = {"reference": reference, "body": CAPSULE, "ground_height": HEIGHT, "friction": MU}
    wanted = {"wanted_point": wanted_point, "wanted_force": wanted_force}
    variables = {"pose": place.pose, "point": point, "force": force}
    found = numbers(body.ground_contact(Capsule), variables, {**parameters, **wanted})
    off_object, normal = surface(point, CAPSULE)
    outward, exerted = place.turn.apply(normal), place.turn.apply(force)
    np.testing.assert_allclose(found["on_surfaces"], [off_object, place.in_world(point)[2] - HEIGHT], atol=1e-5)
    np.testing.assert_allclose([*found["opposed"], *found["facing"]], outward, atol=2e-3)
    np.testing.assert_allclose(found["pressing"], exerted[2], atol=1e-12)
    np.testing.assert_allclose(found["cone"], (MU * exerted[2]) ** 2 - exerted[0] ** 2 - exerted[1] ** 2, atol=1e-12)
    np.testing.assert_allclose(found["stay_point"], ((point - wanted_point) ** 2).sum(), rtol=1e-12)
    np.testing.assert_allclose(found["stay_force"], ((force - wanted_force) ** 2).sum(), rtol=1e-12)
    np.testing.assert_allclose(found["ground_load"], exerted[2] ** 2, rtol=1e-12)
    second = numbers(
        body.disturbed_ground(), {"pose": place.pose, "force": force}, {"reference": reference, "friction": MU}
    )
    assert set(second) == {"pressing", "cone"}
    for name, value in second.items():
        np.testing.assert_allclose(value, found[name], rtol=1e-12)


def test_a_contact_that_moves_evenly_along_the_object_does_not_wander() -> None:
    steps, speed = {"step0": 0.1, "step1": 0.05}, np.array([0.02, -0.01, 0.03])
    even = {"point0": np.zeros(3), "point1": 0.1 * speed, "point2": 0.15 * speed}
    np.testing.assert_allclose(numbers(body.ground_wander(), even, steps)["ground_wander"], 0, atol=1e-20)
    off = np.array([1e-3, 0, -2e-3])
    found = numbers(body.ground_wander(), {**even, "point1": even["point1"] + off}, steps)["ground_wander"]
    assert found[0] == pytest.approx(np.sum((off / 0.1 + off / 0.05) ** 2), rel=1e-12)


@pytest.mark.parametrize("angle", [-0.5, -0.1, 0.05, 0.2, 0.5])
@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_a_capsule_that_rolls_on_the_ground_slips_only_to_fifth_order(angle: float, share: float) -> None:
    # About its axis by an angle a it moves by its radius times a. The mean of two rotations falls short by a²/8.
    before, radius = Lying(1), CAPSULE[6]
    along = before.axis_point(1.0) - before.axis_point(0.0)
    along /= np.linalg.norm(along)
    path = radius * angle * np.cross(along, [0, 0, 1])
    after = before.moved(Rotation.from_rotvec(angle * along), before.axis_point(0.0), path[:2])
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(share), after, after.beneath(share)))
    lack = radius * abs(angle) * 1.5 * (angle**2 / 8) ** 2
    assert np.linalg.norm(found["no_slip"]) == pytest.approx(lack, rel=0.1, abs=1e-7)
    # Without the path it spins in its place: its surface slides by the arc.
    spun = before.moved(Rotation.from_rotvec(angle * along), before.axis_point(0.0))
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(share), spun, spun.beneath(share)))
    slid = radius * abs(angle)
    assert np.linalg.norm(found["no_slip"]) == pytest.approx(slid, rel=2e-3)
    assert found["slip"][0] == pytest.approx((slid / STEP) ** 2, rel=4e-3)


@pytest.mark.parametrize("angle", [-1.0, 0.1, 0.6])
def test_a_capsule_that_tips_over_its_cap_rolls(angle: float) -> None:
    # Over the cap about its end's center, as a ball would; the other end rises.
    before, radius = Lying(2), CAPSULE[6]
    along = before.axis_point(1.0) - before.axis_point(0.0)
    across = np.cross([0, 0, 1], along / np.linalg.norm(along))
    tipped = Rotation.from_rotvec(-abs(angle) * across)
    path = radius * abs(angle) * np.cross(-across, [0, 0, 1])
    after = before.moved(tipped, before.axis_point(0.0), path[:2])
    assert after.axis_point(1.0)[2] > after.axis_point(0.0)[2] + 0.05
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(0.0), after, after.beneath(0.0)))
    lack = radius * abs(angle) * 1.5 * (angle**2 / 8) ** 2
    assert np.linalg.norm(found["no_slip"]) == pytest.approx(lack, rel=0.3, abs=1e-6)


@pytest.mark.parametrize("angle", [-2.0, 0.1, 1.0])
def test_a_capsule_that_pivots_slips_wherever_the_pivot_is_not(angle: float) -> None:
    before = Lying(3)
    turn = Rotation.from_rotvec([0, 0, angle])
    after = before.moved(turn, before.axis_point(0.3))
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(0.3), after, after.beneath(0.3)))
    np.testing.assert_allclose(found["no_slip"], 0, atol=1e-12)
    np.testing.assert_allclose(found["slip"], 0, atol=1e-20)
    # A point at a distance from the pivot moves by the chord of its turn.
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(0.8), after, after.beneath(0.8)))
    chord = 0.5 * np.linalg.norm(CAPSULE[3:6] - CAPSULE[:3]) * 2 * abs(np.sin(angle / 2))
    assert np.linalg.norm(found["no_slip"]) == pytest.approx(chord, rel=1e-9)


def test_a_capsule_that_slides_slips_by_its_path_and_one_that_lies_still_does_not() -> None:
    before, by = Lying(4), (0.03, -0.04)
    after = before.moved(Rotation.identity(), np.zeros(3), by)
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(0.5), after, after.beneath(0.5)))
    np.testing.assert_allclose(found["no_slip"], [-0.03, 0.04], atol=1e-12)
    np.testing.assert_allclose(found["slip"], (0.05 / STEP) ** 2, rtol=1e-9)
    # Its contact may wander along the line on which it lies.
    found = numbers(body.ground_rolling(Capsule), *slipping(before, before.beneath(0.2), before, before.beneath(0.7)))
    np.testing.assert_allclose(found["no_slip"], 0, atol=1e-12)


# Clearance and drawing.


def clear_block(place: Place, primitives: Array, palm_radius: float = 0.8, ground: float = -0.6) -> Block:
    sizes = {"palm_radius": palm_radius, "ground_height": ground, "bodies": primitives.ravel()}
    return {"pose": place.pose}, {**place.parameters, **sizes}


def seen_by_coal(place: Place, start: Array, end: Array, radius: float, palm_radius: float) -> tuple[float, float]:
    """Distances of a capsule from the palm's body, a long cylinder beneath its disc, and from the ground."""
    deep = 50.0
    center = place.palm.apply([0, 0, -deep / 2]) + place.palm_position
    palm = coal.Cylinder(palm_radius, deep), coal.Transform3s(place.palm.as_matrix(), center)
    ground = coal.Halfspace(np.array([0, 0, 1.0]), -0.6), coal.Transform3s()
    capsule = segment(place.in_world(start), place.in_world(end), radius)
    return coal_distance(capsule, palm), coal_distance(capsule, ground)


def test_the_object_s_clearances_are_those_of_coal() -> None:
    rng, apart = np.random.default_rng(0), []
    for _ in range(60):
        place = Place(rng)
        place.position *= 2
        starts, ends = rng.normal(size=(2, 2, 3))
        ends[0] = starts[0]  # a sphere
        radii = rng.uniform(0.1, 0.4, 2)
        primitives = np.hstack([starts, ends, radii[:, None]])
        found = numbers(body.object_apart((Capsule, Capsule), True), *clear_block(place, primitives))
        palm, ground = found["palm"].reshape(2, 3), found["ground"].reshape(2, 2)
        for k in range(2):
            from_palm, from_ground = seen_by_coal(place, starts[k], ends[k], radii[k], 0.8)
            # The ends of an axis say all about a plane; about a disc, ends and middle a little too much.
            assert ground[k].min() == pytest.approx(from_ground, abs=1e-6)
            if from_palm > 0.05:
                assert palm[k].min() > from_palm - 1e-5
            if k == 0 and from_palm > 0.05:
                apart.append(from_palm)
                np.testing.assert_allclose(palm[k], from_palm, atol=1e-5)
    assert len(apart) > 20


def test_the_object_s_clearances_are_signed() -> None:
    rng = np.random.default_rng(1)
    for _ in range(20):
        place = Place(rng)
        start, end = (
            place.turn.inv().apply(place.palm.apply(p) + place.palm_position - place.position)
            for p in rng.uniform([-1, -1, -0.7], [1, 1, 0.3], (2, 3))
        )
        found = numbers(body.object_apart((Capsule,), False), *clear_block(place, np.r_[start, end, 0.2]))
        points = [place.in_palm(p) for p in (start, (start + end) / 2, end)]
        np.testing.assert_allclose(found["palm"], [palm_apart(p, 0.8) - 0.2 for p in points], atol=1e-5)
    assert "ground" not in found


def test_the_tool_is_where_the_object_carries_it() -> None:
    rng = np.random.default_rng(2)
    place, (tool, target) = Place(rng), rng.normal(size=(2, 3))
    parameters = {"reference": place.parameters["reference"], "tool": tool, "target": target}
    found = numbers(body.tool_point(), {"pose": place.pose}, parameters)
    off = place.in_world(tool) - target
    np.testing.assert_allclose(found["on_path"], off, atol=1e-12)
    np.testing.assert_allclose(found["goal"], off @ off, rtol=1e-12)


# Derivatives.


def test_derivatives_agree_with_differences() -> None:
    rng = np.random.default_rng(5)
    place, lying, (force, torque) = Place(rng), Lying(5), rng.normal(size=(2, 3))
    reference = {"reference": place.parameters["reference"]}
    after = lying.moved(Rotation.from_rotvec([0.1, 0.2, -0.1]), np.zeros(3), (0.1, 0.2))
    points, forces = rng.normal(size=(2, 12))
    ends = {"point0": points[:6], "force0": forces[:6], "point1": points[6:], "force1": forces[6:]}
    primitives = np.hstack([rng.normal(size=(2, 6)), [[0.2], [0.3]]])
    for kernel, (variables, parameters) in (
        (newton_euler.physics(), Carried(0).physics()),
        (body.wrench(2, False), ({"wrench": rng.normal(size=6), "point": points[:6], "force": forces[:6]}, {})),
        (body.middle_torque(2, False), ({"middle_torque": rng.normal(size=3), **ends}, {})),
        (
            body.disturbed(4, False),
            (
                {"pose": place.pose, "wrench": rng.normal(size=6), "point": points, "force": forces},
                {**reference, "external_force": force, "external_torque": torque},
            ),
        ),
        (body.force_change(2), ({"force0": forces[:6], "force1": forces[6:]}, {})),
        (body.near_path(), ({"pose": place.pose}, {"wanted_pose": rng.normal(size=6)})),
        (body.meet_goal(), ({"pose": place.pose}, {"goal_pose": rng.normal(size=6)})),
        (body.ground_contact(Capsule), touching(lying, lying.beneath(0.4) + 0.1, force)),
        (body.disturbed_ground(), ({"pose": place.pose, "force": force}, {**reference, "friction": MU})),
        (body.ground_rolling(Capsule), slipping(lying, lying.beneath(0.4), after, after.beneath(0.6))),
        (body.object_apart((Capsule, Capsule), True), clear_block(place, primitives)),
        (body.tool_point(), ({"pose": place.pose}, {**reference, "tool": force, "target": torque})),
    ):
        check_block(kernel, variables, parameters)


def test_derivatives_are_finite_where_nothing_moves_and_nothing_presses() -> None:
    lying = Lying(6)
    lying.reference = lying.turn
    assert np.abs(lying.pose[3:]).max() == 0
    point = lying.beneath(0.5)
    check_block(body.ground_contact(Capsule), *touching(lying, point, np.zeros(3)), h=1e-6)
    check_block(body.ground_rolling(Capsule), *slipping(lying, point, lying, point), h=1e-6)
    variables, parameters = Carried(0).physics()
    still = {name: np.zeros_like(value) for name, value in variables.items()}
    check_block(newton_euler.physics(), still, {**parameters, "reference": STILL}, h=1e-6)
