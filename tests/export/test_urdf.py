"""The URDF as three independent readers see it."""

import warnings
from dataclasses import replace
from xml.etree import ElementTree

import mujoco
import numpy as np
import pinocchio as pin
import pytest
import yourdfpy
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError
from casadi_hands.export.urdf import hand_urdf, object_urdf
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.task import parse_task
from tests.export.example import LINK_RADIUS, example_hand, example_motion, example_task

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
    """Fingers of three, one and two joints about arbitrary axes, of bent links but for one."""
    rng = np.random.default_rng(4)
    bends = iter([(0.3, -1.2), (-0.9, 0.4), (0.0, 0.0), (1.4, 1.0), (-0.2, -0.5), (0.0, np.pi / 2)])

    def finger(name, joints):
        links = []
        for _ in range(joints):
            axis = rng.normal(size=3)
            axis /= np.linalg.norm(axis)
            links.append(Link(float(rng.uniform(0.02, 0.08)), 0.007, tuple(axis), next(bends)))
        return Finger(name, (*rng.uniform(-0.03, 0.03, 2), 0.0), tuple(links))

    return Hand(0.05, 0.01, (finger("a", 3), finger("b", 1), finger("c", 2)), -1.2, 1.4, 0.8, 5.0, 1200.0)


def turn(axis, angle):
    """Rodrigues' formula."""
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def chain(hand, angles):
    """Pose of every link in the palm, written out by hand: bend, turn about the axis, go on along z."""
    poses, remaining = {}, iter(angles)
    for i, finger in enumerate(hand.fingers):
        rotation, position = np.eye(3), np.array(finger.base)
        for j, link in enumerate(finger.links):
            size = np.hypot(*link.bend)
            bend = turn(np.array([*link.bend, 0.0]) / size, size) if size else np.eye(3)
            rotation = rotation @ bend @ turn(link.axis, next(remaining))
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


def test_a_straight_link_is_not_turned_and_a_bent_one_by_roll_pitch_and_yaw():
    robot = ElementTree.fromstring(hand_urdf(odd_hand()))
    turns = {joint.get("name"): joint.find("origin").get("rpy") for joint in robot.findall("joint")}
    assert turns["finger0_joint2"] == "0 0 0"
    for i, finger in enumerate(odd_hand().fingers):
        for j, link in enumerate(finger.links):
            roll, pitch, yaw = map(float, turns[f"finger{i}_joint{j}"].split())
            found = turn((0, 0, 1), yaw) @ turn((0, 1, 0), pitch) @ turn((1, 0, 0), roll)
            x, y = link.bend
            np.testing.assert_allclose(found, Rotation.from_rotvec([x, y, 0]).as_matrix(), atol=1e-12)


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


def touches(hand, pairs, angles):
    """Which of the pairs of links MuJoCo sees touch or overlap in the URDF, at joint angles by name."""
    model = mujoco.MjModel.from_xml_string(hand_urdf(hand))
    data = mujoco.MjData(model)
    for name, angle in angles.items():
        data.joint(name).qpos = angle
    mujoco.mj_kinematics(model, data)
    found = set()
    for one, other in pairs:
        geoms = [np.flatnonzero(model.geom_bodyid == model.body(name).id) for name in (one, other)]
        least = min(mujoco.mj_geomDistance(model, data, a, b, 1.0, None) for a in geoms[0] for b in geoms[1])
        found |= {(one, other)} if least <= 0 else set()
    return found


AT_PALM = [("palm", f"finger{i}_link0") for i in range(3)]


@pytest.mark.parametrize("toward", np.linspace(0, 2 * np.pi, 7))
def test_first_links_clear_the_palm_however_they_turn_above_it(toward):
    # About axes in the palm's plane links lie level at a right angle; about its normal they stand.
    for axis in (
        (np.cos(toward), np.sin(toward), 0.0),
        (0.0, 0.0, 1.0),
        (0.6 * np.cos(toward), 0.6 * np.sin(toward), 0.8),
    ):
        hand = turning_about(axis)
        for angle in np.linspace(-np.pi / 2, np.pi / 2, 9):
            joints = {f"finger{i}_joint0": angle for i in range(3)}
            assert not touches(hand, AT_PALM, joints), (axis, angle)
    # Below level they are in it, however little.
    joints = {f"finger{i}_joint0": np.pi / 2 + 0.1 for i in range(3)}
    assert touches(turning_about((np.cos(toward), np.sin(toward), 0.0)), AT_PALM, joints)


def turning_about(axis):
    """The example's hand, its first joints turned by another axis; they stand where solved hands' do."""
    hand = example_hand()
    fingers = (replace(f, links=(replace(f.links[0], axis=tuple(map(float, axis))), f.links[1])) for f in hand.fingers)
    return replace(hand, fingers=tuple(fingers))


def test_no_link_overlaps_the_palm_on_the_motion():
    hand, motion = example_hand(), example_motion()
    pairs = AT_PALM + [("palm", f"finger{i}_link1") for i in range(3)]
    for row in motion.joint_angles:
        assert not touches(hand, pairs, dict(zip(motion.joint_names, row, strict=True)))


def test_a_joint_at_the_palm_s_face_would_be_in_it():
    # What the height above the face is for.
    hand = example_hand()
    flat = replace(hand, fingers=tuple(replace(f, base=(*f.base[:2], 0.0)) for f in hand.fingers))
    assert touches(flat, AT_PALM, {}) == set(AT_PALM)
    assert min(finger.base[2] for finger in hand.fingers) > LINK_RADIUS


def test_every_joint_has_one_transmission():
    hand = odd_hand()
    root = ElementTree.fromstring(hand_urdf(hand))
    transmissions = root.findall("transmission")
    assert [item.find("joint").get("name") for item in transmissions] == list(hand.joint_names)
    assert len({item.get("name") for item in transmissions}) == len(transmissions)
    assert len({item.find("actuator").get("name") for item in transmissions}) == len(transmissions)
    for item in transmissions:
        assert item.find("type").text == "transmission_interface/SimpleTransmission"
        assert item.find("joint/hardwareInterface").text == "hardware_interface/PositionJointInterface"
        assert float(item.find("actuator/mechanicalReduction").text) == 1


HALF = np.sqrt(0.5)


@pytest.mark.parametrize(
    "orientation",
    [
        (1.0, 0.0, 0.0, 0.0),
        (0.0, HALF, 0.0, HALF),  # the example's, which faces along x: roll and yaw turn about one axis there
        (HALF, 0.0, HALF, 0.0),
        (HALF, 0.0, -HALF, 0.0),
        (0.5, 0.5, 0.5, -0.5),
        (0.0, 1.0, 0.0, 0.0),
        tuple(Rotation.from_euler("zyx", [0.7, np.pi / 2 - 1e-9, 0.2]).as_quat(scalar_first=True)),
        *(tuple(q) for q in Rotation.random(4, rng=np.random.default_rng(5)).as_quat(scalar_first=True)),
    ],
)
def test_a_palm_is_welded_to_the_world_where_it_is_told(orientation):
    hand, position = odd_hand(), (0.1, -0.2, 0.3)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        text = hand_urdf(hand, world=(position, orientation))
    model = pin.buildModelFromXML(text)
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    palm = data.oMf[model.getFrameId("palm")]
    assert palm.translation == pytest.approx(position, abs=1e-12)
    turn = Rotation.from_quat(orientation, scalar_first=True).as_matrix()
    assert palm.rotation == pytest.approx(turn, abs=1e-9)
    assert sorted(model.names)[:-1] == sorted(hand.joint_names)
    rigid = [joint.get("name") for joint in ElementTree.fromstring(text).iter("joint") if joint.get("type") == "fixed"]
    assert rigid == ["world_to_palm"]
    # The rest is what stands nowhere.
    alone = pin.buildModelFromXML(hand_urdf(hand))
    other = alone.createData()
    pin.framesForwardKinematics(alone, other, pin.neutral(alone))
    link = palm.actInv(data.oMf[model.getFrameId("finger0_link2")])
    assert link.translation == pytest.approx(other.oMf[alone.getFrameId("finger0_link2")].translation, abs=1e-12)


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
