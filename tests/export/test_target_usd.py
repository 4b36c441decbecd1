"""The OpenUSD files as USD itself sees them."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from pxr import Usd, UsdGeom, UsdPhysics, UsdShade
from scipy.spatial.transform import Rotation

from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.export.targets import export_design
from casadi_hands.problem.inertia import link_inertial, palm_inertial
from casadi_hands.problem.motors import joint_motors
from tests.export.example import example_design
from tests.export.test_urdf import chain


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    directory = tmp_path_factory.mktemp("design")
    example_design().save(directory)
    return directory


@pytest.fixture(scope="module")
def design(folder):
    return Design.load(folder)


@pytest.fixture(scope="module")
def out(folder):
    return export_design(folder, "usd")


@pytest.fixture
def hand(out):
    return Usd.Stage.Open(str(out / "hand.usda"))


def bodies(stage):
    return {prim.GetName(): prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.RigidBodyAPI)}


def joints(stage):
    return {prim.GetName(): prim for prim in stage.Traverse() if prim.IsA(UsdPhysics.RevoluteJoint)}


def pose(prim):
    """Rotation and position of a prim in the stage's world."""
    matrix = np.array(UsdGeom.Xformable(prim).ComputeLocalToWorldTransform(Usd.TimeCode.Default()))
    return Rotation.from_matrix(matrix[:3, :3].T), matrix[3, :3]


def turn(quaternion):
    return Rotation.from_quat([quaternion.GetReal(), *quaternion.GetImaginary()], scalar_first=True)


def joint_frames(stage, prim):
    """Rotation and position of a joint's frames on both of its bodies in the stage's world."""
    joint, frames = UsdPhysics.Joint(prim), []
    for body, local, place in (
        (joint.GetBody0Rel(), joint.GetLocalRot0Attr(), joint.GetLocalPos0Attr()),
        (joint.GetBody1Rel(), joint.GetLocalRot1Attr(), joint.GetLocalPos1Attr()),
    ):
        at, origin = pose(stage.GetPrimAtPath(body.GetTargets()[0]))
        frames.append((at * turn(local.Get()), origin + at.apply(np.array(place.Get()))))
    return frames


def test_units_are_those_of_the_design(out):
    for name in ("hand", "object", "scene"):
        stage = Usd.Stage.Open(str(out / f"{name}.usda"))
        assert UsdGeom.GetStageMetersPerUnit(stage) == 1.0
        assert UsdPhysics.GetStageKilogramsPerUnit(stage) == 1.0
        assert UsdGeom.GetStageUpAxis(stage) == UsdGeom.Tokens.z


def test_joints_have_the_hand_s_limits_and_motors_in_degrees(hand, design):
    found = joints(hand)
    assert set(found) == set(design.hand.joint_names)
    motors = joint_motors(design.task, design.hand)
    for j, (name, motor) in enumerate(zip(design.hand.joint_names, motors, strict=True)):
        joint, drive = UsdPhysics.RevoluteJoint(found[name]), UsdPhysics.DriveAPI(found[name], "angular")
        assert joint.GetLowerLimitAttr().Get() == pytest.approx(np.degrees(design.hand.joint_lower))
        assert joint.GetUpperLimitAttr().Get() == pytest.approx(np.degrees(design.hand.joint_upper))
        assert drive.GetTypeAttr().Get() == "force"
        assert drive.GetMaxForceAttr().Get() == pytest.approx(design.hand.effort)
        # The torque 10 degrees off, and that at 10 degrees a second, in N·m.
        assert drive.GetStiffnessAttr().Get() * 10 == pytest.approx(motor.stiffness * np.radians(10))
        assert drive.GetDampingAttr().Get() * 10 == pytest.approx(motor.damping * np.radians(10))
        assert np.radians(drive.GetTargetPositionAttr().Get()) == pytest.approx(
            design.motion.joint_commands[0, j], abs=1e-6
        )
        assert found[name].GetAttribute("newton:armature").Get() == pytest.approx(motor.armature)
        assert np.radians(found[name].GetAttribute("newton:velocityLimit").Get()) == pytest.approx(design.hand.velocity)


def test_links_stand_where_the_motion_starts(hand, design):
    """The turn between a joint's two frames is its angle, about x by definition."""
    links = bodies(hand)
    rotation, position = pose(links["palm"])
    np.testing.assert_allclose(position, design.motion.base_position[0], atol=1e-7)
    start = Rotation.from_quat(design.motion.base_orientation[0], scalar_first=True)
    assert (rotation * start.inv()).magnitude() < 1e-6
    for j, name in enumerate(design.hand.joint_names):
        prim = joints(hand)[name]
        frames = joint_frames(hand, prim)
        between = (frames[0][0].inv() * frames[1][0]).as_rotvec()
        np.testing.assert_allclose(between, [design.motion.joint_angles[0, j], 0.0, 0.0], atol=1e-5)
        np.testing.assert_allclose(frames[0][1], frames[1][1], atol=1e-6)
        for word in ("newton:angular:position", "state:angular:physics:position"):
            assert np.radians(prim.GetAttribute(word).Get()) == pytest.approx(between[0], abs=1e-5)


def test_bent_links_stand_where_their_turns_take_them(tmp_path):
    design, bends = example_design(), iter([(0.3, -1.2), (-0.9, 0.4), (0.0, 0.0), (1.4, 1.0), (-0.2, -0.5), (0.0, 1.5)])
    fingers = tuple(
        replace(finger, links=tuple(replace(link, bend=next(bends)) for link in finger.links))
        for finger in design.hand.fingers
    )
    design = replace(design, hand=replace(design.hand, fingers=fingers))
    design.save(tmp_path / "design")
    stage = Usd.Stage.Open(str(export_design(tmp_path / "design", "usd") / "hand.usda"))
    found, palm = bodies(stage), Rotation.from_quat(design.motion.base_orientation[0], scalar_first=True)
    for name, (rotation, position) in chain(design.hand, design.motion.joint_angles[0]).items():
        turned, place = pose(found[name])
        assert (turned.inv() * palm * Rotation.from_matrix(rotation)).magnitude() < 1e-6
        np.testing.assert_allclose(place, design.motion.base_position[0] + palm.apply(position), atol=1e-6)
    # Their joints' frames, which the converter takes from the URDF, agree with where the bodies stand.
    for j, name in enumerate(design.hand.joint_names):
        one, other = joint_frames(stage, joints(stage)[name])
        between = (one[0].inv() * other[0]).as_rotvec()
        np.testing.assert_allclose(between, [design.motion.joint_angles[0, j], 0.0, 0.0], atol=1e-5)
        np.testing.assert_allclose(one[1], other[1], atol=1e-6)


def test_the_palm_is_fixed_to_the_world(hand, design):
    (weld,) = [prim for prim in hand.Traverse() if prim.IsA(UsdPhysics.FixedJoint)]
    joint = UsdPhysics.Joint(weld)
    assert [path.name for path in joint.GetBody1Rel().GetTargets()] == ["palm"]
    assert not any(
        hand.GetPrimAtPath(path).HasAPI(UsdPhysics.RigidBodyAPI) for path in joint.GetBody0Rel().GetTargets()
    )
    np.testing.assert_allclose(joint.GetLocalPos0Attr().Get(), design.motion.base_position[0], atol=1e-7)


def test_masses_and_inertias_are_the_hand_s(hand, design):
    found = bodies(hand)
    expected = {"palm": palm_inertial(design.hand)}
    for i, finger in enumerate(design.hand.fingers):
        expected |= {f"finger{i}_link{j}": link_inertial(each, 1150.0) for j, each in enumerate(finger.links)}
    assert set(found) == set(expected)
    for name, inertial in expected.items():
        mass = UsdPhysics.MassAPI(found[name])
        axes = turn(mass.GetPrincipalAxesAttr().Get()).as_matrix()
        inertia = axes @ np.diag(np.array(mass.GetDiagonalInertiaAttr().Get())) @ axes.T
        assert mass.GetMassAttr().Get() == pytest.approx(inertial.mass)
        np.testing.assert_allclose(mass.GetCenterOfMassAttr().Get(), inertial.center, atol=1e-7)
        np.testing.assert_allclose(inertia, inertial.inertia, rtol=1e-5, atol=1e-10)


def test_the_scene_holds_hand_object_and_ground_as_at_the_start(out, design):
    stage = Usd.Stage.Open(str(out / "scene.usda"))
    assert set(bodies(stage)) == {*bodies(Usd.Stage.Open(str(out / "hand.usda"))), "object"}
    item = bodies(stage)["object"]
    rotation, position = pose(item)
    np.testing.assert_allclose(position, design.motion.object_position[0])
    start = Rotation.from_quat(design.motion.object_orientation[0], scalar_first=True)
    assert (rotation * start.inv()).magnitude() < 1e-6
    assert UsdPhysics.MassAPI(item).GetMassAttr().Get() == pytest.approx(design.task.object.mass)
    held = [
        path
        for prim in stage.Traverse()
        if prim.IsA(UsdPhysics.Joint)
        for path in UsdPhysics.Joint(prim).GetBody1Rel().GetTargets()
    ]
    assert item.GetPath() not in held
    (physics,) = [UsdPhysics.Scene(prim) for prim in stage.Traverse() if prim.IsA(UsdPhysics.Scene)]
    pull = np.array(physics.GetGravityDirectionAttr().Get()) * physics.GetGravityMagnitudeAttr().Get()
    np.testing.assert_allclose(pull, design.task.gravity, rtol=1e-6)
    np.testing.assert_allclose(pose(stage.GetPrimAtPath("/World/ground"))[1], [0, 0, 0.2])


def test_every_collider_rubs_as_the_task_says(out, design):
    stage = Usd.Stage.Open(str(out / "scene.usda"))
    colliders = [prim for prim in stage.Traverse() if prim.HasAPI(UsdPhysics.CollisionAPI)]
    assert len(colliders) == 1 + 6 * 3 + 3 + 1
    for prim in colliders:
        (path,) = UsdShade.MaterialBindingAPI(prim).GetDirectBindingRel("physics").GetTargets()
        material = UsdPhysics.MaterialAPI(stage.GetPrimAtPath(path))
        expected = design.task.ground.friction if prim.GetName() == "ground" else design.task.friction
        assert material.GetStaticFrictionAttr().Get() == pytest.approx(expected)
        assert material.GetDynamicFrictionAttr().Get() == pytest.approx(expected)


def test_nothing_is_printed(folder, tmp_path, capfd):
    export_design(folder, "usd", tmp_path)
    assert capfd.readouterr() == ("", "")


def test_without_the_converter_the_error_says_what_to_install(folder, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "urdf_usd_converter", None)
    with pytest.raises(HandsError, match=r"needs urdf-usd-converter: pip install 'casadi-hands\[usd\]'"):
        export_design(folder, "usd", tmp_path)
