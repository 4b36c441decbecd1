"""The torsion of soft fingertips: kernels in numbers, and a ball that pivots between two of them under its weight."""

from __future__ import annotations

from dataclasses import dataclass

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.export.design import Design
from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.geometry.bodies.sphere import Sphere
from casadi_hands.pipeline.warm_start import warm_start
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.outcome import whole_hand_motion
from casadi_hands.problem.si import build_model, hand_of, joint_loads
from casadi_hands.stages.refine import torsion
from casadi_hands.stages.refine.continuation import Continuation
from casadi_hands.stages.refine.result import Refined
from casadi_hands.stages.refine.settings import SHARP
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task import Task, parse_task
from casadi_hands.terms import contact
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.figures.dynamics import shoot
from casadi_hands.verify.figures.torsion import spin_rates
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.report import Audit
from casadi_hands.verify.trajectory import build_trajectory
from tests.stages.blocks import check_block, numbers, packed, surface
from tests.stages.example import everything_text

pytestmark = pytest.mark.usefixtures("interpreted")

Array = np.ndarray
BODIES = [np.array([0.1, -0.2, -0.8, 0.0, 0.3, 0.9, 0.5]), np.array([0.3, 0.1, -0.2, 0.6])]  # a capsule, a sphere
KINDS = (Capsule, Sphere)


def normal_at(point: Array, body: Array) -> Array:
    """Outward normal of a capsule or a sphere."""
    capsule = body if len(body) == 7 else np.r_[body[:3], body[:3], body[3]]
    return surface(point, capsule)[1]


def near(body: Array, rng: np.random.Generator) -> Array:
    """A point near a body's surface."""
    middle = (body[:3] + body[3:6]) / 2 if len(body) == 7 else body[:3]
    way = rng.normal(size=3)
    point: Array = middle + 0.7 * way / np.linalg.norm(way)
    return point


def pressed(point: Array, body: Array, rng: np.random.Generator) -> Array:
    """A force that presses with about 2 and along the surface with some."""
    force: Array = -2.0 * normal_at(point, body) + 0.3 * rng.normal(size=3)
    return force


def most(force: Array, point: Array, body: Array, friction: float) -> float:
    """What a tip bears beside a force, over its radius."""
    normal = normal_at(point, body)
    along = force - (force @ normal) * normal
    return float(np.sqrt((force @ normal) ** 2 - along @ along / friction**2))


def test_the_torque_is_that_of_moments_about_the_outward_normals() -> None:
    rng = np.random.default_rng(0)
    points, torsions = [near(body, rng) for body in BODIES], rng.normal(size=2)
    total = rng.normal(size=3)
    variables = {"twist_torque": total}
    for i in range(2):
        variables |= {f"point{i}": points[i], f"torsion{i}": torsions[i]}
    parameters = {"torsion_radius": 0.07, "body0": BODIES[0], "body1": BODIES[1]}
    kernel = torsion.torque(KINDS)
    due = 0.07 * sum(t * normal_at(p, b) for t, p, b in zip(torsions, points, BODIES, strict=True))
    ((name, residual),) = kernel.constraints.items()
    # The cost of the torsion has the same name.
    function = ca.Function(name, [kernel.variables, kernel.parameters], [residual, kernel.terms[contact.TORSION.name]])
    made, cost = (np.asarray(value).ravel() for value in function(*packed(kernel, variables, parameters)))
    assert made == pytest.approx(due - total, abs=2e-6)  # normals are rounded where distances vanish
    assert cost == pytest.approx(torsions @ torsions)
    check_block(kernel, variables, parameters)


@pytest.mark.parametrize(("kind", "body"), list(zip(KINDS, BODIES, strict=True)))
def test_the_cone_has_room_while_force_and_moment_are_within_the_ellipse(kind: type, body: Array) -> None:
    rng = np.random.default_rng(1)
    for _ in range(5):
        point = near(body, rng)
        force, parameters = pressed(point, body, rng), {"body": body, "sliding_friction": 0.6}
        limit = most(force, point, body, 0.6)
        for share in (0.0, 0.9, 1.0, 1.1):
            variables = {"force": force, "point": point, "torsion": share * limit}
            (room,) = numbers(torsion.cone(kind), variables, parameters)["torsion_cone"]
            assert room == pytest.approx((1 - share**2) * limit**2, abs=2e-5)
        check_block(torsion.cone(kind), variables, parameters)


@pytest.mark.parametrize(("kind", "body"), list(zip(KINDS, BODIES, strict=True)))
@pytest.mark.parametrize("spin", [-30.0, -0.05, 0.0, 0.02, 4.0])
def test_the_law_leaves_moments_free_at_rest_and_none_where_contacts_spin(kind: type, body: Array, spin: float) -> None:
    rng = np.random.default_rng(2)
    points = [near(body, rng) for _ in range(2)]
    forces = [pressed(point, body, rng) for point in points]
    torsions, holding, scale = rng.uniform(-1, 1, 2), float(rng.uniform(-0.4, 0.4)), 0.05
    variables: dict[str, object] = {"spin": spin, "holding": holding}
    for i in range(2):
        variables |= {f"force{i}": forces[i], f"point{i}": points[i], f"torsion{i}": torsions[i]}
    parameters = {"body": body, "sliding_friction": 0.6, "spin_scale": scale, "torsion_radius": 0.07}
    off = numbers(torsion.law(kind), variables, parameters)["torsion_law"]
    limit = np.mean([most(f, p, body, 0.6) for f, p in zip(forces, points, strict=True)])
    share = spin / np.hypot(spin, scale)  # of the limit that acts against the spin
    due = -limit * share + limit * (1 - share**2) * holding
    assert off == pytest.approx([torsions.mean() - due], abs=1e-5)
    check_block(torsion.law(kind), variables, parameters)
    # Where it spins fast there is one moment: at the limit against the spin.
    if abs(spin) > 1.0:
        assert due == pytest.approx(-np.sign(spin) * limit, rel=1e-3)


@pytest.mark.parametrize(("kind", "body"), list(zip(KINDS, BODIES, strict=True)))
def test_a_contact_that_spins_slips_normal_to_the_ellipse_and_one_at_rest_does_not(kind: type, body: Array) -> None:
    rng, friction, radius, scale = np.random.default_rng(4), 0.6, 0.07, 0.05
    points = [near(body, rng) for _ in range(2)]
    forces = [pressed(point, body, rng) for point in points]
    normals = [normal_at(point, body) for point in points]
    across = np.mean([f - (f @ n) * n for f, n in zip(forces, normals, strict=True)], axis=0)
    limit = np.mean([most(f, p, body, friction) for f, p in zip(forces, points, strict=True)])

    def used(load: Array) -> float:
        return float(load[:3] @ load[:3] / friction**2 + load[3] ** 2 / radius**2)

    kernel = torsion.law(kind)
    terms = ca.Function("terms", [kernel.variables, kernel.parameters], [kernel.terms[contact.PIVOT_SLIP.name]])
    for spin, quickly in ((-3.0, 1.0), (0.0, 0.0), (5.0, 1.0), (scale, np.sqrt(0.5))):
        parameters = {"body": body, "sliding_friction": friction, "spin_scale": scale, "torsion_radius": radius}
        variables = {"spin": spin, "holding": 0.0}
        for i in range(2):
            variables |= {f"force{i}": forces[i], f"point{i}": points[i], f"torsion{i}": 0.0}
        cost = float(terms(*packed(kernel, variables, parameters)))
        # Forces on the object slow what the object does.
        load = np.append(across, -np.sign(spin) * radius * limit)
        steps = 1e-6 * np.eye(4)
        outward = np.array([used(load + step) - used(load - step) for step in steps]) / 2e-6
        slip = quickly * outward[:3] * (spin / outward[3] if spin else 0.0)
        # The limit is rounded by 0.05.
        assert np.sqrt(cost) == pytest.approx(np.linalg.norm(slip) * limit / (limit + 0.05), rel=1e-3)


# A ball with its centre of mass far below its centre hangs between two fingertips, tilted, and is let down: what turns
# it is its weight, and what keeps it from swinging is the torsion of both tips, all of it.
HANGING = """
name: hanging ball
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.02}}], center_of_mass: [0, 0, -0.015]}
palm: {radius: 0.05, position: [0, 0, 0.28], facing: [0, 0, -1], up: [1, 0, 0]}
motion:
  - {at: 0, position: [0, 0, 0.2], rotation: {axis: [1, 0, 0], degrees: 60}}
  - {at: 1.5, position: [0, 0, 0.2], rotation: {axis: [1, 0, 0], degrees: 25}}
fingers: {left: {touches: [-0.02, 0, 0]}, right: {touches: [0.02, 0, 0]}}
friction: 0.8
hand: {link_radius: 0.006}
fingertip: {torsion: 0.002}
"""
RADIUS, TIP, WEIGHT, RHO, DEPTH = 0.02, 0.006, 0.1 * 9.81, 0.002, 0.015


def _finger(name: str, side: float) -> tuple[Finger, list[float]]:
    """A finger of two joints in the plane of the contacts, and its angles."""
    base, target, length = np.array([0.04 * side, 1.05 * TIP]), np.array([(RADIUS + TIP) * side, 0.08]), 0.045
    reach = target - base
    first = np.arctan2(*reach) + side * np.arccos(np.linalg.norm(reach) / (2 * length))
    rest = reach - length * np.array([np.sin(first), np.cos(first)])
    links = (Link(length, TIP, (0.0, 1.0, 0.0)),) * 2
    angles = [float(first), float(np.arctan2(*rest) - first)]
    return Finger(name, (float(base[0]), 0.0, float(base[1])), links), angles


def hanging(task: Task, time: Array) -> Design:
    """The ball let down by fingers that stand still and press as hard as it takes, in quasi-static balance."""
    share = time / time[-1]
    tilt = np.deg2rad(60 - 35 * share**3 * (10 - 15 * share + 6 * share**2))
    turn = Rotation.from_rotvec(np.outer(tilt, [1.0, 0, 0]))
    fingers, angles = zip(*(_finger(name, side) for name, side in (("left", -1.0), ("right", 1.0))), strict=True)
    twist = WEIGHT * DEPTH * np.sin(tilt) / 2  # that each tip bears
    press = np.hypot(twist / RHO, WEIGHT / 2 / 0.8)
    count = len(time)
    force, moment, on_object, on_link = np.zeros((4, count, 2, 3))
    for c, side in enumerate((-1.0, 1.0)):
        force[:, c, 0], force[:, c, 2], moment[:, c, 0] = -side * press, WEIGHT / 2, twist
        on_object[:, c] = [side * RADIUS, 0.0, DEPTH]
        bent = Rotation.from_rotvec([0.0, sum(angles[c]), 0.0])
        on_link[:, c] = np.array([0.0, 0.0, 0.045]) + bent.apply([-side * TIP, 0.0, 0.0], inverse=True)
    hand = Hand(0.05, float(task.palm.thickness), fingers, -np.pi / 2, np.pi / 2, 1.0, 5.0, 1150.0)
    palm = Rotation.from_matrix(task.palm.rotation).as_quat(scalar_first=True)
    motion = Motion(
        time=time,
        object_position=np.array([0, 0, 0.2]) + turn.apply([0.0, 0.0, -DEPTH]),
        object_orientation=turn.as_quat(scalar_first=True),
        base_position=np.tile([0.0, 0.0, 0.28], (count, 1)),
        base_orientation=np.tile(palm, (count, 1)),
        joint_angles=np.tile(np.concatenate(angles), (count, 1)),
        joint_names=hand.joint_names,
        contact_names=("left", "right"),
        contact_link=("finger0_link1", "finger1_link1"),
        contact_active=np.ones((count, 2), bool),
        contact_force=force,
        contact_point_object=on_object,
        contact_point_link=on_link,
        external_force=np.zeros((count, 3)),
        external_torque=np.zeros((count, 3)),
        contact_moment=moment,
    )
    return Design(task, "feasible", hand=hand, motion=motion)


@dataclass(frozen=True)
class LetDown:
    """What the refinement makes of it, and what the audit says of the files."""

    refined: Refined
    folder: Folder
    motion: Motion
    verdict: Audit


@pytest.fixture(scope="module")
def let_down(tmp_path_factory: pytest.TempPathFactory) -> LetDown:
    task = parse_task(HANGING)
    model = build_model(task)
    whole = warm_start(hanging(task, model.schedule.samples), task, model)
    continuation = Continuation(model, whole.contacts, (2, 2), whole.active)
    refined = continuation.sharpened(continuation.solve(whole, Margin(), near=True), 1, Margin())
    built = hand_of(task, model, refined.hand.fingers, refined.hand.contacts, *joint_loads(model, refined.hand))
    design = Design(task, "feasible", hand=built, motion=whole_hand_motion(model, refined.hand))
    folder = tmp_path_factory.mktemp("let_down")
    design.save(folder)
    found = Design.load(folder).motion
    assert found is not None
    return LetDown(refined, read_folder(folder), found, audit_files(folder))


def test_where_contacts_spin_their_moments_are_at_the_limit_against_the_spin(let_down: LetDown) -> None:
    motion = let_down.motion
    assert let_down.refined.exact
    assert let_down.refined.weights[contact.PIVOT_SLIP.name] > 0.0  # of a sharpened motion
    assert motion.contact_moment is not None
    limits, moments = np.zeros((2, len(motion.time), 2))
    for k, quaternion in enumerate(motion.object_orientation):
        turn = Rotation.from_quat(quaternion, scalar_first=True)
        for c in range(2):
            normal = turn.apply(motion.contact_point_object[k, c] - [0.0, 0.0, DEPTH]) / RADIUS
            force = motion.contact_force[k, c]
            along = force - (force @ normal) * normal
            limits[k, c] = RHO * np.sqrt((force @ normal) ** 2 - along @ along / 0.8**2)
            moments[k, c] = motion.contact_moment[k, c] @ normal
            assert np.linalg.norm(motion.contact_moment[k, c] - moments[k, c] * normal) < 1e-9
    assert np.all(np.abs(moments) <= limits * (1 + 1e-6))
    # It turns about -x: against the right contact's outward normal, and about the left one's.
    for side, c in ((-1.0, 0), (1.0, 1)):
        rates = spin_rates(let_down.folder, build_trajectory(let_down.folder, shoot(let_down.folder)), c)
        share = rates / np.hypot(rates, SHARP[-1])
        quick = np.abs(rates) > 0.3
        assert np.sum(quick) >= 6
        assert np.all(-side * rates[quick] > 0.0)
        mean = (moments[1:, c] + moments[:-1, c]) / (limits[1:, c] + limits[:-1, c])
        # What is left where it turns slowly is the margin's part.
        assert np.all(np.abs(mean + share) <= Margin().friction * (1 - share**2) + 0.01)
        assert mean[quick] == pytest.approx(np.full(np.sum(quick), side), abs=0.06)


def test_the_audit_agrees(let_down: LetDown) -> None:
    figures = let_down.verdict.figures
    for name in ("residual", "torsion_excess", "torsion_shortfall", "friction_excess", "slip", "gap"):
        assert figures[name].holds, figures[name].text
    assert figures["spin"].value > 30.0  # degrees
    assert figures["torsion_use"].value > 0.3


def test_hard_points_have_the_same_problem_as_ever() -> None:
    soft, hard = (
        RefineStage(model, (0, 1), (1, 2), np.ones((len(model.schedule.samples), 4), bool)).problem
        for model in (
            build_model(parse_task(everything_text() + f"fingertip: {{torsion: {radius}}}\n")) for radius in (0.001, 0)
        )
    )
    more = {"torsion", "twist_torque", "spin", "holding"}
    assert set(soft.variables.names()) - set(hard.variables.names()) == more
    assert set(hard.variables.names()) <= set(soft.variables.names())
    rows = {name.partition(".")[2] for name in set(soft.constraint_rows) - set(hard.constraint_rows)}
    assert rows == {"torsion", "torsion_cone", "torsion_law", "spin_rate"}
    assert set(hard.constraint_rows) <= set(soft.constraint_rows)
    assert set(soft.parameters.names()) - set(hard.parameters.names()) >= {"torsion_radius", "spin_scale"}
    assert contact.TORSION.name in soft.terms
    assert contact.TORSION.name not in hard.terms


@pytest.mark.parametrize(("holding", "rates"), [(3, [0.3, 0.1, 0.03]), (2, [0.1, 0.03, 0.03])])
def test_slower_spins_count_the_more_often_a_motion_is_sharpened(holding: int, rates: list[float]) -> None:
    model = build_model(parse_task(everything_text() + "fingertip: {torsion: 0.001}\n"))
    active = np.ones((len(model.schedule.samples), 4), bool)
    active[2, : 4 - holding] = False
    stage = RefineStage(model, (0, 1, 2), (1, 2, 2), active)
    assert [stage.given.spin_scale(sharpness) for sharpness in range(3)] == rates
    continuation = Continuation(model, (0, 1, 2), (1, 2, 2), active)
    assert continuation.sharpest == len(set(rates)) - 1
