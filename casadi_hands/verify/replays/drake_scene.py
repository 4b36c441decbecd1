"""What Drake is told of a result folder: motors, mechanics, and solid shapes with friction and softness."""

from __future__ import annotations

import platform
from dataclasses import dataclass
from importlib import import_module
from typing import Any
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.verify.reading.folder import Folder
from casadi_hands.verify.reading.markup import read_xml
from casadi_hands.verify.replays.engine import one_line
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.shapes import Shape

PRESS = 6.0
"""Of the object's weight: what presses a fingertip to a patch of PATCH, so that it gives as much as MuJoCo's."""

USUAL = 2.0
"""Of the object's weight: where contacts are planned to press with more, that much more presses them to this patch."""

PATCH = 0.375
"""Radius of that patch, of the fingertip's: (8/15) 0.375 = (2/3) 0.3, MuJoCo's torsion."""

RELAXATION = 0.02
"""s, of contacts at the depth of that patch."""

SAGITTA = 0.1
"""By how much of that depth the triangles of a contact surface may leave the true one."""

_MODULES = (
    *("common.value", "geometry", "math", "multibody.math", "multibody.parsing", "multibody.plant"),
    *("multibody.tree", "systems.analysis", "systems.framework"),
)


def load_drake() -> Any:
    """The package ``pydrake``, with the modules that a replay uses.

    Raises:
        HandsError: it is not installed, or cannot be loaded; the message says which.
    """
    try:
        for name in _MODULES:
            import_module(f"pydrake.{name}")
        return import_module("pydrake")
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "pydrake":
            raise HandsError(f"Drake cannot be loaded ({one_line(error)}); try --engine mujoco") from None
        system, machine = platform.system(), platform.machine()
        wheels = {("Linux", "x86_64"), ("Darwin", "arm64")}
        missing = f"; there is no wheel of it for {system} on {machine}" if (system, machine) not in wheels else ""
        raise HandsError(f"replay with Drake needs it: pip install 'casadi-hands[drake]'{missing}") from None
    except Exception as error:
        raise HandsError(f"Drake cannot be loaded ({one_line(error)}); try --engine mujoco") from None


@dataclass(frozen=True)
class Motor:
    """A position-controlled joint: N·m/rad, N·m·s/rad, kg·m², N·m."""

    stiffness: float
    damping: float
    armature: float
    effort: float


def read_motors(folder: Folder, perturbation: Perturbation) -> tuple[dict[str, Motor], bool]:
    """Return the motor of every joint in ``scene.xml``, perturbed, and whether the palm moves."""
    root, factor = _read(folder, "scene.xml"), perturbation.stiffness
    if folder.drive is not None:
        return _springs(folder, root, perturbation), _palm_moves(root)
    try:
        armature = {joint.get("name"): float(joint.get("armature", "0")) for joint in root.iter("joint")}
        motors = {
            name: Motor(
                stiffness=factor * float(drive.attrib["kp"]),
                damping=factor**0.5 * float(drive.attrib["kv"]),
                armature=armature[name],
                effort=perturbation.effort * float(drive.attrib["forcerange"].split()[1]),
            )
            for drive in root.iter("position")
            if (name := drive.get("joint", ""))
        }
    except (KeyError, IndexError, ValueError) as error:
        raise DesignError(f"{folder.path / 'scene.xml'}: a joint's motor is not as solve writes it: {error}") from None
    if any(name not in motors for name in folder.motion.joint_names):
        raise DesignError(f"{folder.path / 'scene.xml'}: it lacks a joint or an actuator of this hand")
    return motors, _palm_moves(root)


def _springs(folder: Folder, root: ElementTree.Element, perturbation: Perturbation) -> dict[str, Motor]:
    """Return what turns every joint where motors share them: its spring, about where they turn it."""
    factor = perturbation.stiffness
    try:
        armature = {joint.get("name"): float(joint.get("armature", "0")) for joint in root.iter("joint")}
        springs = {
            name: Motor(
                stiffness=factor * float(spring.attrib["stiffness"]),
                damping=factor**0.5 * float(spring.attrib["damping"]),
                armature=armature[name],
                effort=float("inf"),
            )
            for spring in root.iter("fixed")
            if (name := spring.get("name", ""))
        }
    except (KeyError, ValueError) as error:
        raise DesignError(f"{folder.path / 'scene.xml'}: a joint's spring is not as solve writes it: {error}") from None
    if any(name not in springs for name in folder.motion.joint_names):
        raise DesignError(f"{folder.path / 'scene.xml'}: it lacks a joint or a spring of this hand")
    return springs


def _palm_moves(root: ElementTree.Element) -> bool:
    return any(body.get("name") == "palm_target" for body in root.iter("body"))


def _read(folder: Folder, name: str) -> ElementTree.Element:
    return read_xml(folder.path / name, "mujoco" if name == "scene.xml" else "robot")


def read_mechanics(folder: Folder, name: str) -> str:
    """Return a URDF file's text without shapes and mimics, by which Drake would leave out the springs."""
    root = _read(folder, name)
    for joint in root.findall("joint"):
        for mimic in joint.findall("mimic"):
            joint.remove(mimic)
    for link in root.iter("link"):
        for shape in [*link.findall("visual"), *link.findall("collision")]:
            link.remove(shape)
    return ElementTree.tostring(root, encoding="unicode")


def transform(drake: Any, turn: Rotation, position: np.ndarray) -> Any:
    """Return a pose as Drake has it."""
    return drake.math.RigidTransform(drake.math.RotationMatrix(turn.as_matrix()), position)


class Shapes:
    """Collision geometry for Drake, with friction and softness.

    Args:
        drake: the package.
        plant: to add it to.
        folder: gives shapes, friction and ground.
        factor: of every friction coefficient.
    """

    def __init__(self, drake: Any, plant: Any, folder: Folder, factor: float) -> None:
        self._drake, self._plant, self._folder = drake, plant, folder
        tips = [shape.radius for name, body in folder.links.items() if name != "palm" for shape in body.capsules]
        thin = min(shape.radius for shape in folder.object.shapes)
        tip = max(tips, default=thin)
        relative = tip * thin / (tip + thin) if np.isfinite(thin) else tip
        self._depth = (PATCH * tip) ** 2 / (2 * relative)
        firmest = float(np.linalg.norm(folder.motion.contact_force, axis=2).max())
        press = PRESS * max(folder.weight, firmest / USUAL)
        self._gradient = press / (np.pi * relative * self._depth**2)
        self._mu = factor * folder.task.friction
        self._ground_mu = factor * folder.task.ground.friction if folder.task.ground is not None else 0.0
        # Drake combines coefficients to 2ab / (a + b): with the larger one on the object, there is a partner for both.
        self._own = max(self._mu, self._ground_mu)

    def add(self, hand: Any, item: Any) -> None:
        """Add the shapes of hand and object, and the ground."""
        folder, plant = self._folder, self._plant
        for name, link in folder.links.items():
            body, friction = plant.GetBodyByName(name, hand), self._partner(self._mu)
            for k, shape in enumerate(link.shapes):
                self._add_shape(body, f"{name}{k}", shape, friction, soft=name != "palm")
        for k, shape in enumerate(folder.object.shapes):
            self._add_shape(plant.GetBodyByName("object", item), f"object{k}", shape, self._own)
        if folder.ground is not None:
            for shape in folder.ground.shapes:
                self._add_shape(plant.world_body(), "ground", shape, self._partner(self._ground_mu), soft=False)

    def _partner(self, friction: float) -> float:
        """Return the coefficient that combines with the object's to this one."""
        return friction * self._own / (2 * self._own - friction) if self._own > 0 else 0.0

    def _add_shape(self, body: Any, name: str, shape: Shape, friction: float, soft: bool = True) -> None:
        geometry, edge = self._drake.geometry, shape.edge(SAGITTA * self._depth) if soft else 0.0
        properties = geometry.ProximityProperties()
        if soft:
            # Two gradients in series make one of half their size; a modulus is the pressure where it is deepest.
            geometry.AddCompliantHydroelasticProperties(edge, 2 * self._gradient * shape.depth, properties)
        else:
            geometry.AddRigidHydroelasticProperties(min(shape.radius, 1.0), properties)
        coulomb = self._drake.multibody.plant.CoulombFriction(friction, friction)
        geometry.AddContactMaterial(dissipation=RELAXATION / self._depth, friction=coulomb, properties=properties)
        turn, at = shape.pose
        place = transform(self._drake, Rotation.from_matrix(turn), at)
        self._plant.RegisterCollisionGeometry(body, place, shape.drake(geometry, edge), name, properties)
