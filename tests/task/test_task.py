import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from casadi_hands.task import Task, parse_task, task_to_yaml

CAPSULE = """\
object:
  mass: {mass}
  shapes:
    - capsule: {{start: [0, 0, {low}], end: [0, 0, {high}], radius: {r2}}}
palm: {{position: [0, 0, {h}], facing: [1, 0, 0]}}
motion:
  - {{at: 0, position: [{near}, 0, {h}]}}
  - {{at: 2, position: [{far}, 0, {h}], rotation: {{axis: [1, 0, 0], degrees: 20}}}}
fingers:
  thumb: {{touches: [0, {r2}, 0]}}
  index: {{touches: [0, -{r2}, 0]}}
gravity: [0, 0, {g}]
"""


def capsule(scale: float = 1.0, more: str = "") -> Task:
    lengths = {"low": -0.04, "high": 0.04, "r2": 0.02, "h": 0.3, "near": 0.1, "far": 0.15, "g": -9.81}
    return parse_task(CAPSULE.format(mass=0.1, **{name: scale * value for name, value in lengths.items()}) + more)


def test_default_lengths_scale_with_the_file() -> None:
    small, large = capsule(), capsule(10)
    for name in ("radius", "thickness"):
        assert getattr(large.palm, name) == pytest.approx(10 * getattr(small.palm, name), rel=1e-14)
    assert large.hand.link_radius == pytest.approx(10 * small.hand.link_radius, rel=1e-14)
    assert large.hand.link_length == pytest.approx([10 * length for length in small.hand.link_length], rel=1e-14)
    assert large.force_unit == pytest.approx(10 * small.force_unit)


def test_default_lengths_are_as_documented() -> None:
    task = capsule()
    radius = 1.2 * 0.06
    contacts = ScipyRotation.from_euler("x", 20, degrees=True).apply([[0, 0.02, 0], [0, -0.02, 0]])
    reach = np.linalg.norm(contacts + np.array([0.15, 0, 0]), axis=1).max()
    assert task.palm.radius == pytest.approx(radius)
    assert task.palm.thickness == pytest.approx(0.2 * radius)
    assert task.hand.link_radius == pytest.approx(0.13 * radius)
    assert task.hand.link_length == pytest.approx((0.39 * radius, radius + reach))
    assert task.hand.hinge_length == pytest.approx(2.1 * 0.13 * radius)
    assert task.duration == 2


@pytest.mark.parametrize(
    ("given", "hinge"),
    [
        ("link_radius: 0.01", 0.021),
        ("link_radius: 0.01, link_length: [0.03, 0.1]", 0.021),
        ("link_radius: 0.01, link_length: [0.0211, 0.1]", 0.021),
        ("link_radius: 0.01, link_length: [0.021, 0.1]", 0.0),
        ("link_radius: 0.01, link_length: [0.012, 0.1]", 0.0),
        ("link_radius: 0.01, link_length: [0.03, 0.1], hinge_length: 0.029", 0.029),
        ("link_radius: 0.01, link_length: [0.03, 0.1], hinge_length: 0", 0.0),
    ],
)
def test_hinges_have_room_where_the_shortest_link_does(given: str, hinge: float) -> None:
    task = capsule(more=f"hand: {{{given}}}\n")
    assert task.hand.hinge_length == pytest.approx(hinge, rel=1e-12)
    assert parse_task(task_to_yaml(task)) == task


def test_fingertips_are_as_thick_as_links_unless_told_otherwise() -> None:
    task = capsule()
    assert task.fingertip.radius == task.hand.link_radius
    hand, radius = task.hand, task.fingertip.radius
    assert (hand.hinge_of(radius), hand.shortest_of(radius)) == (hand.hinge_length, hand.link_length[0])


@pytest.mark.parametrize("hinge", [0.021, 0.0])
def test_thick_fingertips_have_a_longer_hinge_and_twist_as_large_ones_do(hinge: float) -> None:
    hand = f"hand: {{link_radius: 0.01, link_length: [0.03, 0.1], hinge_length: {hinge}}}\n"
    task, thin = capsule(more=f"{hand}fingertip: {{radius: 0.015}}\n"), capsule(more=hand)
    assert task.fingertip.torsion == pytest.approx(1.5 * thin.fingertip.torsion)
    assert task.hand.hinge_of(0.015) == pytest.approx(1.5 * hinge)
    # The body beyond the hinge is as long as before.
    assert task.hand.shortest_of(0.015) - task.hand.hinge_of(0.015) == pytest.approx(0.03 - hinge)
    assert task.hand == thin.hand
    assert task.limits == thin.limits
    assert parse_task(task_to_yaml(task)) == task
    changed = thin.changed(fingertip={"radius": 0.015})
    assert changed == task


def test_force_unit_with_gravity_off() -> None:
    task = capsule().model_copy(update={"gravity": (0.0, 0.0, 0.0)})
    assert task.force_unit == pytest.approx(0.981)


def test_nothing_can_be_changed() -> None:
    with pytest.raises(ValueError, match="frozen"):
        capsule().friction = 1.0  # type: ignore[misc]


def test_ground_defaults() -> None:
    text = CAPSULE.format(mass=1, low=-0.04, high=0.04, r2=0.02, h=0.3, near=0.1, far=0.15, g=-9.81)
    task = parse_task(text + "ground: {}\nfriction: 0.4\n")
    assert task.ground is not None
    assert (task.ground.height, task.ground.friction) == (0, 0.4)
    assert task.ground.touches == pytest.approx((0, 0, -0.06))
    assert parse_task(text + "ground: none\n").ground is None


def test_goal_poses_of_a_drawing() -> None:
    text = CAPSULE.format(mass=1, low=-0.04, high=0.04, r2=0.02, h=0.3, near=0.1, far=0.15, g=-9.81)
    text = text.replace("position: [0.1", "tool_at: [0.1").replace("position: [0.15", "tool_at: [0.15")
    text = text.replace(", rotation: {axis: [1, 0, 0], degrees: 20}", "") + "tool: [0, 0, -0.06]\n"
    task = parse_task(text)
    assert task.draws
    times, positions, vectors = zip(*task.goal_poses(), strict=True)
    assert times == (0, 2)
    assert np.array(positions) == pytest.approx(np.array([[0.1, 0, 0.36], [0.15, 0, 0.36]]))
    assert not np.any(vectors)
    assert parse_task(task_to_yaml(task)) == task


def test_whole_hand_inherits_the_floating_weights() -> None:
    text = CAPSULE.format(mass=1, low=-0.04, high=0.04, r2=0.02, h=0.3, near=0.1, far=0.15, g=-9.81)
    weights = parse_task(
        text + "weights: {floating: {task: 7, slip_on_object: 3}, whole_hand: {raw_force: 2}}\n"
    ).weights
    assert weights.floating.task == weights.whole_hand["task"] == 7
    # Table 2.4 names this one, so it does not follow the floating stage.
    assert (weights.floating["slip_on_object"], weights.whole_hand.slip_on_object) == (3, 10)
    assert (weights.floating.raw_force, weights.whole_hand.raw_force) == (0.01, 2)
    assert dict(weights.synthesis)["tip_target"] == (50, 10, 50)
    with pytest.raises(KeyError):
        weights.floating["keys"]


def test_every_field_is_described() -> None:
    from casadi_hands.task.structure import walk

    assert [path for path, field, _ in walk(Task) if not field.description or not field.description.endswith(".")] == []
