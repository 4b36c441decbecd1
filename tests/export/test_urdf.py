"""The URDF as three independent readers see it."""

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yourdfpy

from casadi_hands.design import Finger, Hand, Link
from casadi_hands.errors import DesignError
from casadi_hands.export.urdf import hand_urdf, object_urdf
from casadi_hands.task import parse_task
from tests.export.example import example_hand, example_task

TURNED = """
name: turned
object:
  mass: 0.3
  inertia: [[3e-4, 1e-5, 2e-5], [1e-5, 4e-4, 3e-5], [2e-5, 3e-5, 5e-4]]
  center_of_mass: [0, 0, 0]
  shapes:
    - capsule: {start: [0.01, -0.02, 0.03], end: [-0.04, 0.02, -0.01], radius: 0.02}
    - sphere: {center: [-0.01, 0.02, 0.0], radius: 0.03}
palm: {radius: 0.06, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion: [{at: 0, position: [0.2, 0, 0.3]}, {at: 1, position: [0.25, 0, 0.3]}]
fingers:
  thumb: {touches: [-0.01, 0.05, 0.0]}
  index: {touches: [-0.01, 0.02, -0.03]}
  middle: {touches: [-0.01, 0.02, 0.03]}
"""


def odd_hand() -> Hand:
    """Fingers of three, one and two joints about arbitrary axes."""
    rng = np.random.default_rng(4)

    def finger(name, joints):
        links = []
        for _ in range(joints):
            axis = rng.normal(size=3)
            links.append(Link(float(rng.uniform(0.02, 0.08)), 0.007, tuple(axis / np.linalg.norm(axis))))
        return Finger(name, (*rng.uniform(-0.03, 0.03, 2), 0.0), tuple(links))

    return Hand(0.05, 0.01, (finger("a", 3), finger("b", 1), finger("c", 2)), -1.2, 1.4, 0.8, 5.0, 1200.0)


def turn(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def chain(hand, angles):
    """Pose of every link in the palm, written out by hand: turn about the axis, go on along z."""
    poses, remaining = {}, iter(angles)
    for i, finger in enumerate(hand.fingers):
        rotation, position = np.eye(3), np.array(finger.base)
        for j, link in enumerate(finger.links):
            rotation = rotation @ turn(link.axis, next(remaining))
            poses[f"finger{i}_link{j}"] = (rotation, position)
            position = position + link.length * rotation[:, 2]
    return poses


@pytest.fixture
def angles():
    return np.random.default_rng(1).uniform(-1, 1, 6)


def test_pinocchio_reads_the_same_kinematics_limits_and_masses(angles):
    hand = odd_hand()
    model = pin.buildModelFromXML(hand_urdf(hand))
    assert sorted(model.names)[:-1] == sorted(hand.joint_names)
    data, configuration = model.createData(), pin.neutral(model)
    for name, angle in zip(hand.joint_names, angles, strict=True):
        configuration[model.joints[model.getJointId(name)].idx_q] = angle
    pin.framesForwardKinematics(model, data, configuration)
    for name, (rotation, position) in chain(hand, angles).items():
        pose = data.oMf[model.getFrameId(name)]
        assert pose.rotation == pytest.approx(rotation, abs=1e-12)
        assert pose.translation == pytest.approx(position, abs=1e-12)
    assert model.lowerPositionLimit == pytest.approx(np.full(6, -1.2))
    assert model.upperPositionLimit == pytest.approx(np.full(6, 1.4))
    assert model.upperEffortLimit == pytest.approx(np.full(6, 0.8))
    assert model.upperVelocityLimit == pytest.approx(np.full(6, 5.0))
    volume = sum(
        np.pi * link.radius**2 * (link.length + 4 / 3 * link.radius) for finger in hand.fingers for link in finger.links
    )
    assert sum(body.mass for body in model.inertias[1:]) == pytest.approx(1200 * volume)


def test_yourdfpy_reads_the_same_kinematics(angles, tmp_path):
    hand = odd_hand()
    path = tmp_path / "hand.urdf"
    path.write_text(hand_urdf(hand))
    robot = yourdfpy.URDF.load(str(path))
    robot.update_cfg(dict(zip(hand.joint_names, angles, strict=True)))
    assert robot.base_link == "palm"
    for name, (rotation, position) in chain(hand, angles).items():
        pose = robot.get_transform(name, "palm")
        assert pose[:3, :3] == pytest.approx(rotation, abs=1e-12)
        assert pose[:3, 3] == pytest.approx(position, abs=1e-12)


def test_mujoco_reads_the_same_kinematics(angles):
    hand = odd_hand()
    model = mujoco.MjModel.from_xml_string(hand_urdf(hand))
    data = mujoco.MjData(model)
    for name, angle in zip(hand.joint_names, angles, strict=True):
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    for name, (rotation, position) in chain(hand, angles).items():
        assert data.body(name).xmat.reshape(3, 3) == pytest.approx(rotation, abs=1e-12)
        assert data.body(name).xpos == pytest.approx(position, abs=1e-12)
    palm = 1200 * np.pi * 0.05**2 * 0.01
    assert model.body("palm").mass[0] == pytest.approx(palm)


def test_a_segment_is_a_capsule_from_its_joint_to_the_next(tmp_path):
    path = tmp_path / "hand.urdf"
    path.write_text(hand_urdf(example_hand()))
    robot = yourdfpy.URDF.load(str(path))
    for shapes in (robot.link_map["finger1_link0"].visuals, robot.link_map["finger1_link0"].collisions):
        spheres = sorted(shape.origin[2, 3] for shape in shapes if shape.geometry.sphere)
        (cylinder,) = (shape for shape in shapes if shape.geometry.cylinder)
        assert spheres == [0.0, 0.07]
        assert cylinder.origin[2, 3] == 0.035
        assert (cylinder.geometry.cylinder.length, cylinder.geometry.cylinder.radius) == (0.07, 0.008)


def test_the_object_keeps_its_mass_inertia_and_shapes():
    task = parse_task(TURNED)
    text = object_urdf(task)
    model = pin.buildModelFromXML(text, pin.JointModelFreeFlyer())
    body = model.inertias[1]
    assert body.mass == 0.3
    assert body.lever == pytest.approx(np.zeros(3), abs=1e-15)
    assert body.inertia == pytest.approx(np.array([[3e-4, 1e-5, 2e-5], [1e-5, 4e-4, 3e-5], [2e-5, 3e-5, 5e-4]]))
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION).geometryObjects
    assert len(shapes) == 4
    (cylinder,) = (item for item in shapes if hasattr(item.geometry, "halfLength"))
    half = cylinder.geometry.halfLength * cylinder.placement.rotation[:, 2]
    assert cylinder.placement.translation - half == pytest.approx([0.01, -0.02, 0.03], abs=1e-12)
    assert cylinder.placement.translation + half == pytest.approx([-0.04, 0.02, -0.01], abs=1e-12)
    centers = {tuple(np.round(item.placement.translation, 12)) for item in shapes if item is not cylinder}
    assert centers >= {(0.01, -0.02, 0.03), (-0.04, 0.02, -0.01), (-0.01, 0.02, 0.0)}


def test_the_object_loads_everywhere(tmp_path):
    text = object_urdf(example_task())
    path = tmp_path / "object.urdf"
    path.write_text(text)
    assert list(yourdfpy.URDF.load(str(path)).link_map) == ["object"]
    assert mujoco.MjModel.from_xml_string(text).body("object").mass[0] == pytest.approx(0.1)


def test_an_infinite_limit_is_refused():
    hand = Hand(0.05, 0.01, odd_hand().fingers, -1.2, 1.4, np.inf, 5.0, 1200.0)
    with pytest.raises(DesignError, match=r"value inf.*must be finite"):
        hand_urdf(hand)
