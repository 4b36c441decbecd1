"""``scene.xml``: what MuJoCo would be told, by a parser of its own that passes over nothing."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.verify.flat import Convex
from casadi_hands.verify.reading.geoms import Geom, read_geom
from casadi_hands.verify.reading.markup import called, name_of, number, numbers, only, positive, read_xml, strangers
from casadi_hands.verify.reading.mount import Mount, read_mount
from casadi_hands.verify.reading.points import hull_points
from casadi_hands.verify.reading.settings import Settings, read_settings, stiffness_problems

SHORTEST_STEP = 1e-4
"""s of the simulation; contacts that stiffen within 2 ms need no shorter ones."""

_SECTIONS = "compiler option statistic default worldbody contact equality tendon actuator keyframe visual asset"
_KEY = ("time", "qpos", "ctrl", "mpos", "mquat")


@dataclass(frozen=True)
class Hinge:
    """A joint that turns: axis (3,), reference angle and limits (2,), rad, and its rotor's inertia, kg·m²."""

    name: str
    axis: np.ndarray
    reference: float
    limits: np.ndarray
    armature: float


@dataclass(frozen=True)
class SceneBody:
    """A body of the scene.

    Attributes:
        parent: its parent's name; ``world`` at the top.
        position: (3,) m, in the parent's frame.
        orientation: (4,) [w, x, y, z], likewise.
        free, mocap: whether it floats freely, or is moved from outside.
        borne: the share of its weight that is taken off it.
        mass: kg; 0 where none is stated.
        center: (3,) m.
        inertia: (3, 3) kg·m².
    """

    parent: str
    position: np.ndarray
    orientation: np.ndarray
    free: bool
    mocap: bool
    borne: float
    mass: float
    center: np.ndarray
    inertia: np.ndarray
    hinges: tuple[Hinge, ...]
    mounts: tuple[Mount, ...]
    geoms: tuple[Geom, ...]


@dataclass(frozen=True)
class Servo:
    """A position actuator: its name, the joint it turns, gains, and (2,) limits of its torque, N·m."""

    name: str
    joint: str
    stiffness: float
    damping: float
    limits: np.ndarray


@dataclass(frozen=True)
class Spring:
    """A spring between a joint and the motors that share it: at rest where the sum of coefficient × angle is ``rest``.

    Attributes:
        name: the joint's.
        rest: rad.
        stiffness: N·m/rad.
        damping: N·m·s/rad.
        coefficients: by name of joint or motor.
    """

    name: str
    rest: float
    stiffness: float
    damping: float
    coefficients: dict[str, float]


@dataclass(frozen=True)
class Scene:
    """What ``scene.xml`` says.

    Attributes:
        settings: of the simulation.
        gravity: (3,) m/s².
        text: the file's content as it was read, comments left out.
        bodies: by name, in the file's order, which is that of MuJoCo's coordinates.
        planes: of the world.
        excluded: pairs of bodies that do not collide.
        welds: pairs of bodies that are held together.
        servos: in the file's order, which is that of MuJoCo's controls.
        springs: in the file's order.
        threads: of two joints and (5,) the coefficients of the first one's polynomial in the second.
        keys: name -> attribute -> its numbers.
        meshes: polytopes by name.
        strange: what the format does not have, a sentence each.
    """

    settings: Settings
    gravity: np.ndarray
    text: str
    bodies: dict[str, SceneBody] = field(default_factory=dict)
    planes: list[Geom] = field(default_factory=list)
    excluded: list[frozenset[str]] = field(default_factory=list)
    welds: list[tuple[str, str]] = field(default_factory=list)
    servos: list[Servo] = field(default_factory=list)
    springs: list[Spring] = field(default_factory=list)
    threads: list[tuple[str, str, np.ndarray]] = field(default_factory=list)
    keys: dict[str, dict[str, np.ndarray]] = field(default_factory=dict)
    meshes: dict[str, Convex] = field(default_factory=dict)
    strange: list[str] = field(default_factory=list)


def read_scene(path: Path) -> Scene:
    """Read a scene.

    Raises:
        DesignError: the file is missing or is not XML; a name or a section is given twice; a number is missing or is
            not finite; angles are not in radians; a replay would take steps without end.
    """
    root = read_xml(path, "mujoco")
    section = {tag: only(path, root, tag) for tag in _SECTIONS.split()}
    option, world = section["option"], section["worldbody"]
    option = Element("option") if option is None else option
    if world is None:
        raise DesignError(f"{path}: no <worldbody>, so nothing is in the scene")
    if section["compiler"] is None or section["compiler"].get("angle") != "radian":
        raise DesignError(f"{path}: angles are not in radians")
    settings, odd = read_settings(path, option, section["default"])
    if settings.step < SHORTEST_STEP:
        raise DesignError(f"{path}: its timestep is {settings.step:g} s; a replay takes {SHORTEST_STEP:g} s at least")
    text = ElementTree.tostring(root, encoding="unicode")
    scene = Scene(settings, numbers(path, option, "gravity", 3, "0 0 -9.81"), text)
    scene.strange.extend((*strangers(root, _SECTIONS, "model"), *odd))
    allowed = {"compiler": ("", "angle"), "default": ("geom", ""), "contact": ("exclude", "")}
    allowed |= {"tendon": ("fixed", ""), "asset": ("mesh", ""), "statistic": ("", "extent center meansize")}
    allowed |= {"equality": ("weld joint", ""), "actuator": ("position", ""), "keyframe": ("key", "")}
    for tag, (tags, attributes) in allowed.items():
        if (element := section[tag]) is not None:
            scene.strange.extend(strangers(element, tags, attributes))
            for child in element:
                _read_entry(path, scene, child)
    if section["tendon"] is not None and not scene.springs:
        scene.strange.append("<tendon> in <mujoco> holds no spring")
    _read_body(path, scene, world, "world")
    shapes = [geom.shape for body in scene.bodies.values() for geom in body.geoms]
    unused = [name for name, mesh in scene.meshes.items() if not any(mesh is shape for shape in shapes)]
    scene.strange.extend(f'<mesh name="{name[:60]}"> is of no solid' for name in unused)
    return scene


def _read_entry(path: Path, scene: Scene, element: Element) -> None:
    """Read what stands in a section beside the bodies."""
    odd = scene.strange
    if element.tag == "exclude":
        scene.excluded.append(frozenset((element.get("body1", ""), element.get("body2", ""))))
        odd += strangers(element, "", "name body1 body2")
    elif element.tag == "weld":
        scene.welds.append((element.get("body1", ""), element.get("body2", "")))
        odd += (*strangers(element, "", "body1 body2 solref"), *stiffness_problems(path, element))
    elif element.tag == "joint":
        pair = element.get("joint1", ""), element.get("joint2", "")
        scene.threads.append((*pair, numbers(path, element, "polycoef", 5)))
        odd += strangers(element, "", "joint1 joint2 polycoef solref solimp")
        odd += stiffness_problems(path, element)
    elif element.tag == "position":
        joint = element.get("joint", "")
        kp, kv = positive(path, element, "kp"), number(path, element, "kv", "0")
        scene.servos.append(Servo(element.get("name", ""), joint, kp, kv, numbers(path, element, "forcerange", 2)))
        odd += strangers(element, "", "name joint kp kv forcelimited forcerange")
        if element.get("forcelimited") != "true":
            odd.append(f"{called(element)} limits no torque: forcelimited is not true")
    elif element.tag == "mesh":
        odd += strangers(element, "", "name vertex")
        name, words = name_of(path, element, scene.meshes), element.get("vertex", "").split()
        scene.meshes[name] = Convex(hull_points(path, numbers(path, element, "vertex", len(words))))
    elif element.tag == "fixed":
        scene.springs.append(_read_spring(path, scene, element))
    elif element.tag == "key":
        name = name_of(path, element, scene.keys)
        odd += strangers(element, "", " ".join(("name", *_KEY)))
        lengths = {key: len(text.split()) for key, text in element.items() if key in _KEY}
        scene.keys[name] = {key: numbers(path, element, key, length) for key, length in lengths.items()}


def _read_spring(path: Path, scene: Scene, element: Element) -> Spring:
    scene.strange.extend(strangers(element, "joint", "name springlength stiffness damping"))
    coefficients: dict[str, float] = {}
    for joint in element:
        scene.strange.extend(strangers(joint, "", "joint coef"))
        name = joint.get("joint", "")
        if name in coefficients:
            raise DesignError(f"{path}: {called(element)} pulls at joint '{name}' twice")
        coefficients[name] = number(path, joint, "coef")
    rest, damping = number(path, element, "springlength"), number(path, element, "damping", "0")
    return Spring(element.get("name", ""), rest, positive(path, element, "stiffness"), damping, coefficients)


def _read_body(path: Path, scene: Scene, element: Element, name: str) -> None:
    """Read what is on a body, and the bodies on it, in MuJoCo's order."""
    read = [read_geom(path, scene.meshes, geom) for geom in element.findall("geom")]
    geoms = tuple(geom for geom, _ in read)
    scene.strange.extend(what for _, strange in read for what in strange)
    if name == "world":
        scene.strange.extend(strangers(element, "body geom light camera"))
        scene.planes.extend(geoms)
    else:
        scene.strange.extend(strangers(element, "body geom inertial joint freejoint", "name pos quat gravcomp mocap"))
        inertial, free = only(path, element, "inertial"), only(path, element, "freejoint")
        scene.strange.extend(strangers(free, "", "name") if free is not None else ())
        mass, center, inertia, joints = 0.0, np.zeros(3), np.zeros((3, 3)), element.findall("joint")
        if inertial is not None:
            mass, center = positive(path, inertial, "mass"), numbers(path, inertial, "pos", 3)
            xx, yy, zz, xy, xz, yz = numbers(path, inertial, "fullinertia", 6)
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            scene.strange.extend(strangers(inertial, "", "pos mass fullinertia"))
        scene.bodies[name] = SceneBody(
            parent="",
            position=numbers(path, element, "pos", 3, "0 0 0"),
            orientation=numbers(path, element, "quat", 4, "1 0 0 0"),
            free=free is not None,
            mocap=element.get("mocap") == "true",
            borne=number(path, element, "gravcomp", "0"),
            mass=mass,
            center=center,
            inertia=inertia,
            hinges=() if name == "object" else tuple(_read_hinge(path, scene, joint) for joint in joints),
            mounts=tuple(read_mount(path, scene.strange, joint) for joint in joints) if name == "object" else (),
            geoms=geoms,
        )
    for child in element.findall("body"):
        own = name_of(path, child, {**scene.bodies, "world": None})
        _read_body(path, scene, child, own)
        scene.bodies[own] = _on(scene.bodies[own], name)


def _on(body: SceneBody, parent: str) -> SceneBody:
    return SceneBody(**{**vars(body), "parent": parent})


def _read_hinge(path: Path, scene: Scene, element: Element) -> Hinge:
    scene.strange.extend(strangers(element, "", "name axis ref limited range armature"))
    name, armature = element.get("name", ""), number(path, element, "armature", "0")
    axis, reference = numbers(path, element, "axis", 3), number(path, element, "ref", "0")
    if element.get("limited") == "false" and element.get("range") is None:
        return Hinge(name, axis, reference, np.array([-np.inf, np.inf]), armature)
    if element.get("limited") != "true":
        scene.strange.append(f"{called(element)} has no limits: limited is not true")
    return Hinge(name, axis, reference, numbers(path, element, "range", 2), armature)
