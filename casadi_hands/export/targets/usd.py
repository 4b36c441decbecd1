"""OpenUSD: the hand, the object, and a scene of both, each file self-contained but for the scene's references.

urdf-usd-converter makes links, joints, masses and colliders of the URDF. Added here is what a URDF does not say: the
drives (USD's are per degree), what rotors and gears add to the joints' inertia, friction, and where the motion starts.
Links stand there, which is how UsdPhysics gives joints their first angle; the drives' targets are the set points that
press as planned.
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from importlib import import_module
from math import degrees, radians
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import HandsError
from casadi_hands.export.markup import document
from casadi_hands.export.meshes import mesh_files
from casadi_hands.export.targets.source import Source, write_texts
from casadi_hands.export.targets.target import Target
from casadi_hands.export.urdf import object_urdf
from casadi_hands.problem.motors import Motor, joint_motors

_MODULES = ("Gf", "Sdf", "Usd", "UsdGeom", "UsdPhysics", "UsdShade")
_COMMENT = "made by casadi-hands"


def write_usd(source: Source, out: Path) -> Path:
    """Write ``hand.usda`` (fixed to the world), ``object.usda`` (free) and ``scene.usda``.

    Args:
        source: the design.
        out: the folder.

    Returns:
        the folder.

    Raises:
        HandsError: urdf-usd-converter is not installed, the folder holds something else or cannot be written, or the
            object is attached to the world.
    """
    if source.task.object.attached is not None:
        raise HandsError(
            "usd: its object would be free; this one is attached to the world: give scene.xml to a reader of MJCF"
        )
    usd = _load()
    hand = _converted(usd, "hand", source.welded_urdf())
    _drive(usd, hand, source)
    _pose(usd, hand, source)
    _rub(usd, hand, hand.GetDefaultPrim(), source.task.friction)
    item = _converted(usd, "object", object_urdf(source.task), mesh_files(source.task))
    # What the converter adds to any robot that stands on nothing: a joint that fixes it to the world.
    item.RemovePrim("/object/Physics")
    _rub(usd, item, item.GetDefaultPrim(), source.task.friction)
    texts = {
        "hand.usda": _text(hand.GetRootLayer()),
        "object.usda": _text(item.GetRootLayer()),
        "scene.usda": _text(_scene(usd, source)),
    }
    write_texts(out, texts, mark="scene.usda")
    return out


def _load() -> Any:
    """The converter and USD's modules.

    Raises:
        HandsError: they are not installed.
    """
    try:
        converter, usdex = import_module("urdf_usd_converter"), import_module("usdex.core")
        return SimpleNamespace(
            converter=converter, usdex=usdex, **{name: import_module(f"pxr.{name}") for name in _MODULES}
        )
    except ImportError:
        raise HandsError("the export to usd needs urdf-usd-converter: pip install 'casadi-hands[usd]'") from None


def _converted(usd: Any, name: str, urdf: str, files: Mapping[str, str] | None = None) -> Any:
    """A stage in memory, of one layer, with what the converter makes of a robot called `name`.

    Args:
        usd: its modules.
        name: of the robot.
        urdf: its text.
        files: that it names, by their paths.
    """
    robot = ElementTree.fromstring(urdf)
    # For other readers; the converter would keep them as custom data.
    for element in [*robot.findall("mujoco"), *robot.findall("transmission")]:
        robot.remove(element)
    with tempfile.TemporaryDirectory() as scratch, _Quiet(usd.usdex):
        file = Path(scratch) / f"{name}.urdf"
        file.write_text(document(robot), encoding="utf-8")
        for path, text in (files or {}).items():
            (Path(scratch) / path).parent.mkdir(exist_ok=True)
            (Path(scratch) / path).write_text(text, encoding="utf-8")
        asset = usd.converter.Converter(scene=False).convert(str(file), str(Path(scratch) / name))
        stage = usd.Usd.Stage.Open(asset.path)
        # Instances would be written as prototypes whose names depend on the order in which threads find them.
        for prim in stage.Traverse():
            if prim.IsInstanceable():
                prim.SetInstanceable(False)
        return usd.Usd.Stage.Open(stage.Flatten(addSourceFileComment=False))


class _Quiet:
    """Keeps USD from reporting each step on the terminal, within a ``with``; warnings still come."""

    def __init__(self, usdex: Any) -> None:
        self._usdex = usdex

    def __enter__(self) -> None:
        self._active, self._level = self._usdex.isDiagnosticsDelegateActive(), self._usdex.getDiagnosticsLevel()
        self._usdex.activateDiagnosticsDelegate()
        self._usdex.setDiagnosticsLevel(self._usdex.DiagnosticsLevel.eWarning)

    def __exit__(self, *_: object) -> None:
        self._usdex.setDiagnosticsLevel(self._level)
        if not self._active:
            self._usdex.deactivateDiagnosticsDelegate()


def _drive(usd: Any, stage: Any, source: Source) -> None:
    """Give every joint its motor and its first angle: USD's angles are in degrees, so its gains are per degree."""
    motors = joint_motors(source.task, source.hand)
    starts = zip(source.motion.joint_angles[0].tolist(), source.commands[0].tolist(), strict=True)
    for name, motor, (angle, target) in zip(source.motion.joint_names, motors, starts, strict=True):
        joint = stage.GetPrimAtPath(f"/hand/Physics/{name}")
        _add_drive(usd, joint, motor, target, source.hand.effort)
        # Newton and PhysX take joints to be at zero unless told, each in its own words.
        for word in ("newton:angular:position", "state:angular:physics:position"):
            joint.CreateAttribute(word, usd.Sdf.ValueTypeNames.Float, custom=False).Set(degrees(angle))
        joint.AddAppliedSchema("PhysicsJointStateAPI:angular")


def _add_drive(usd: Any, joint: Any, motor: Motor, target: float, effort: float) -> None:
    drive = usd.UsdPhysics.DriveAPI.Apply(joint, "angular")
    drive.CreateTypeAttr("force")
    drive.CreateStiffnessAttr(radians(motor.stiffness))  # N·m/rad times rad/deg
    drive.CreateDampingAttr(radians(motor.damping))
    drive.CreateMaxForceAttr(effort)
    drive.CreateTargetPositionAttr(degrees(target))
    joint.GetAttribute("newton:armature").Set(motor.armature)


def _pose(usd: Any, stage: Any, source: Source) -> None:
    """Turn every link to its joint's first angle."""
    angles = dict(zip(source.motion.joint_names, source.motion.joint_angles[0], strict=True))
    for i, finger in enumerate(source.hand.fingers):
        path = next(prim.GetPath() for prim in stage.Traverse() if prim.GetName() == "palm")
        for j, link in enumerate(finger.links):
            path = path.AppendChild(f"finger{i}_link{j}")
            turn = link.turn * Rotation.from_rotvec(angles[f"finger{i}_joint{j}"] * np.asarray(link.axis))
            orientation = usd.Gf.Quatf(*turn.as_quat(scalar_first=True).tolist())
            stage.GetPrimAtPath(path).GetAttribute("xformOp:orient").Set(orientation)
    purposes = [usd.UsdGeom.Tokens.default_, usd.UsdGeom.Tokens.render, usd.UsdGeom.Tokens.proxy]
    cache = usd.UsdGeom.BBoxCache(usd.Usd.TimeCode.Default(), [*purposes, usd.UsdGeom.Tokens.guide])
    model = usd.UsdGeom.ModelAPI(stage.GetDefaultPrim())
    model.SetExtentsHint(model.ComputeExtentsHint(cache))


def _rub(usd: Any, stage: Any, prim: Any, coefficient: float) -> None:
    """Give all colliders under a prim a coefficient of friction."""
    material = usd.UsdShade.Material.Define(stage, prim.GetPath().AppendChild("Friction"))
    friction = usd.UsdPhysics.MaterialAPI.Apply(material.GetPrim())
    friction.CreateStaticFrictionAttr(coefficient)
    friction.CreateDynamicFrictionAttr(coefficient)
    # Bound to each: UsdPhysics' own parser does not look further up.
    for collider in usd.Usd.PrimRange(prim):
        if collider.HasAPI(usd.UsdPhysics.CollisionAPI):
            binding = usd.UsdShade.MaterialBindingAPI.Apply(collider)
            binding.Bind(material, usd.UsdShade.Tokens.weakerThanDescendants, "physics")


def _scene(usd: Any, source: Source) -> Any:
    """The layer that stands hand, object and ground together, as when the motion starts."""
    task, motion = source.task, source.motion
    layer = usd.Sdf.Layer.CreateAnonymous(".usda")
    stage = usd.Usd.Stage.Open(layer)
    usd.UsdGeom.SetStageUpAxis(stage, usd.UsdGeom.Tokens.z)
    usd.UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    usd.UsdPhysics.SetStageKilogramsPerUnit(stage, 1.0)
    stage.SetDefaultPrim(usd.UsdGeom.Xform.Define(stage, "/World").GetPrim())
    physics = usd.UsdPhysics.Scene.Define(stage, "/World/PhysicsScene")
    pull = float(np.linalg.norm(task.gravity))
    down = np.asarray(task.gravity) / pull if pull else np.array([0.0, 0.0, -1.0])
    physics.CreateGravityDirectionAttr(usd.Gf.Vec3f(*down.tolist()))
    physics.CreateGravityMagnitudeAttr(pull)
    usd.UsdGeom.Xform.Define(stage, "/World/hand")
    usd.UsdGeom.Xform.Define(stage, "/World/object")
    place = usd.UsdGeom.Xformable(stage.GetPrimAtPath("/World/object"))
    place.AddTranslateOp().Set(usd.Gf.Vec3d(*motion.object_position[0].tolist()))
    place.AddOrientOp().Set(usd.Gf.Quatf(*motion.object_orientation[0].tolist()))
    if task.ground is not None:
        ground = usd.UsdGeom.Plane.Define(stage, "/World/ground")
        size = 40 * task.object.characteristic_length  # only to be seen: as a collider it has no end
        ground.CreateAxisAttr("Z")
        ground.CreateWidthAttr(size)
        ground.CreateLengthAttr(size)
        ground.AddTranslateOp().Set(usd.Gf.Vec3d(0.0, 0.0, task.ground.height))
        usd.UsdPhysics.CollisionAPI.Apply(ground.GetPrim())
        _rub(usd, stage, ground.GetPrim(), task.ground.friction)
    # A stage would look for the files, which are not written yet, and complain.
    del stage, physics, place
    for name in ("hand", "object"):
        layer.GetPrimAtPath(usd.Sdf.Path(f"/World/{name}")).referenceList.Prepend(usd.Sdf.Reference(f"./{name}.usda"))
    return layer


def _text(layer: Any) -> str:
    """The layer as text, saying in its first lines what made it."""
    layer.comment = _COMMENT
    text: str = layer.ExportToString()
    return text


TARGETS = {"usd": Target(write_usd, "usd")}
