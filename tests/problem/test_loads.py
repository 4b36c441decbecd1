"""What the task's loads ask of contacts, against closed forms and SciPy's linear programmes on cones of their own."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linprog

from casadi_hands.problem.loads import USUAL_FORCE, hardest_load, usual_force_limit
from casadi_hands.problem.si import build_model
from casadi_hands.task import Task, parse_task

MASS, RADIUS, WEIGHT = 0.05, 0.03, 0.05 * 9.81
NARROWER = 0.006  # share by which a circumscribed cone may understate a force


def ball(
    contacts: list[tuple[float, float, float]],
    push: str = "",
    gravity: bool = False,
    friction: float = 0.4,
    more: str = "",
    height: float = 0.2,
    torsion: float = 0.0,
) -> Task:
    """A ball that stays where it is for a second; ``contacts`` in radii."""
    fingers = ", ".join(f"f{i}: {{touches: {[RADIUS * x for x in at]}}}" for i, at in enumerate(contacts))
    return parse_task(
        f"""
object: {{mass: {MASS}, shapes: [{{sphere: {{center: [0, 0, 0], radius: {RADIUS}}}}}]}}
palm: {{position: [0, 0, {height + 0.15}], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, {height}]}}, {{at: 1, position: [0, 0, {height}]}}]
fingers: {{{fingers}}}
gravity: [0, 0, {-9.81 if gravity else 0}]
friction: {friction}
fingertip: {{torsion: {torsion}}}
{f"perturbations: [{{from: 0.3, to: 0.6, {push}}}]" if push else ""}
{more}
"""
    )


def around(count: int) -> list[tuple[float, float, float]]:
    """Contacts on the equator, on both sides of the axes."""
    sides: list[tuple[float, float, float]] = [(1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)]
    return sides[:count]


@pytest.mark.parametrize("count", [2, 4])
@pytest.mark.parametrize("friction", [0.2, 0.7])
def test_a_torque_is_the_number_of_contacts_times_normal_force_friction_and_radius(count: int, friction: float) -> None:
    torque = 0.6
    model = build_model(ball(around(count), f"torque: [0, 0, {torque}]", friction=friction))
    load = hardest_load(model, 0.0)
    assert load is not None
    normal = torque / (count * friction * RADIUS) / WEIGHT
    assert normal * (1 - NARROWER) < load.least <= normal * (1 + 1e-9)
    assert 0.3 - 1e-9 <= load.time <= 0.6 + 1e-9
    assert np.linalg.norm(load.torque) * model.units.torque == pytest.approx(torque)


@pytest.mark.parametrize("seed", range(4))
def test_it_agrees_with_a_linear_programme_of_its_own(seed: int) -> None:
    rng = np.random.default_rng(seed)
    points = rng.normal(size=(4, 3))
    points /= np.linalg.norm(points, axis=1)[:, None]
    points[3] = -points[:3].sum(axis=0) / np.linalg.norm(points[:3].sum(axis=0))  # they surround the ball
    push = 5 * rng.normal(size=3)
    task = ball([tuple(p) for p in points.tolist()], f"force: {push.tolist()}", gravity=True, friction=0.8)
    load = hardest_load(build_model(task), 0.0)
    # Inscribed cones of 64 edges, drawn about each normal by a basis from QR.
    columns = []
    for point in points:
        basis = np.linalg.qr(np.column_stack([point, np.eye(3)]))[0][:, 1:3]
        for angle in np.linspace(0, 2 * np.pi, 64, endpoint=False):
            columns.append(np.concatenate([-point + 0.8 * basis @ [np.cos(angle), np.sin(angle)], point]))
    edges = np.array(columns)
    forces, places = edges[:, :3], edges[:, 3:]
    rows = np.kron(np.eye(4), np.ones(64))[:, :, None] * forces  # (4, 256, 3)
    components = np.moveaxis(rows, 2, 1).reshape(12, 256)
    wrench = np.append(-(push / WEIGHT - [0, 0, 1]), np.zeros(3))
    found = linprog(
        np.append(np.zeros(256), 1),
        A_ub=np.vstack([np.column_stack([sign * components, -np.ones(12)]) for sign in (1, -1)]),
        b_ub=np.zeros(24),
        A_eq=np.column_stack([np.vstack([forces.T, np.cross(places, forces).T]), np.zeros(6)]),
        b_eq=wrench,
    )
    assert load is not None
    assert found.status == 0
    assert found.fun * 0.99 < load.least <= found.fun * (1 + 1e-9)


def test_the_ground_carries_only_what_stands_on_it() -> None:
    pushed = 100 * WEIGHT
    push = f"force: [0, 0, {-pushed}]"
    standing, lifted = (
        build_model(ball(around(2), push, gravity=True, more="ground: {height: 0.0}", height=height))
        for height in (RADIUS, RADIUS + 0.01)
    )
    on_ground, in_air = hardest_load(standing, 0.0), hardest_load(lifted, 0.0)
    assert on_ground is not None
    assert in_air is not None
    # All press as hard as any: the ground by its normal force, two fingers by friction; in the air only the latter.
    assert on_ground.least == pytest.approx(101 / (1 + 2 * 0.4), rel=NARROWER)
    assert in_air.least == pytest.approx(101 / (2 * 0.4), rel=NARROWER)


def test_the_usual_limit_leaves_four_times_the_least_and_is_never_under_twenty_weights() -> None:
    least = 0.6 / (2 * 0.4 * RADIUS) / WEIGHT  # 51 weights
    loaded = build_model(ball(around(2), "torque: [0, 0, 0.6]"))
    assert loaded.force_limit == usual_force_limit(loaded)
    assert loaded.force_limit == pytest.approx(4 * least, rel=0.01)
    assert loaded.force_limit == round(loaded.force_limit)
    assert build_model(ball(around(2), "torque: [0, 0, 0.005]")).force_limit == USUAL_FORCE
    assert build_model(ball(around(2), gravity=True)).force_limit == USUAL_FORCE


def test_what_is_given_is_the_limit() -> None:
    given = ball(around(2), "torque: [0, 0, 0.6]", more="hand: {contact_force: 12.5}")
    assert build_model(given).force_limit == 12.5


def test_a_torque_about_the_line_through_two_contacts_is_borne_by_torsion_alone() -> None:
    model = build_model(ball(around(2), "torque: [0.6, 0, 0]", torsion=0.002))
    load = hardest_load(model, 0.0)
    assert load is not None
    assert load.least == pytest.approx(0.6 / (2 * 0.002) / WEIGHT, rel=1e-6)


def test_what_no_force_bears_says_nothing() -> None:
    # About the line through both contacts, which are hard points.
    model = build_model(ball(around(2), "torque: [0.6, 0, 0]"))
    assert hardest_load(model, 0.0) is None
    assert model.force_limit == USUAL_FORCE
