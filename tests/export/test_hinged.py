"""A hand whose links begin a hinge's length from their joints: its bodies, their masses, and that none meet."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace
from xml.etree import ElementTree

import coal
import mujoco
import numpy as np
import pinocchio as pin
import pytest
import trimesh
from scipy.spatial.transform import Rotation

from casadi_hands.export.mjcf import scene_mjcf
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.hand import Finger, Hand, Link
from casadi_hands.problem.inertia import Inertial, body_inertials
from tests.export.example import example_motion, example_task

Array = np.ndarray
RADIUS = 0.006
HINGE = 2.1 * RADIUS
FOLD = np.degrees(np.arccos(-0.3))  # the sharpest turn from a link to the next that a design may have
DENSITY = 1240.0
PALM, THICK = 0.06, 0.012
# Links are as short as they may be, and long; fingers stand so far apart that none reaches another.
LENGTHS = ((3 * RADIUS, 3 * RADIUS), (0.05, 3 * RADIUS), (3 * RADIUS, 0.04))
BASES = ((0.055, 0.0), (-0.03, 0.05), (-0.03, -0.05))


def hand(seed: int = 0, tip: float = RADIUS, joints: int = 2) -> Hand:
    """Three fingers of some links, bent at zero angle, that turn about axes across their links.

    Args:
        seed: of axes and bends.
        tip: radius of the last links, m; where they are thicker, fingers stand farther apart.
        joints: of each finger.
    """
    rng = np.random.default_rng(seed)
    thick, spread = [*[RADIUS] * (joints - 1), tip], tip / RADIUS

    def link(length: float, radius: float) -> Link:
        toward = rng.uniform(0, 2 * np.pi)
        bend = rng.uniform(-0.5, 0.5, 2).tolist()
        hinge = HINGE * radius / RADIUS
        axis = np.cos(toward), np.sin(toward), 0.0
        return Link(length + hinge - HINGE, radius, axis, (bend[0], bend[1]), hinge)

    fingers = tuple(
        Finger(name, (x * spread, y * spread, 1.05 * thick[0]), tuple(map(link, lengths[-joints:], thick)))
        for name, (x, y), lengths in zip(("a", "b", "c"), BASES, LENGTHS, strict=True)
    )
    limit = np.radians(150)
    return Hand(spread * PALM, THICK, fingers, -limit, limit, 1.0, 5.0, DENSITY)


# Masses.


def solid(shape: trimesh.Trimesh) -> Inertial:
    shape.density = DENSITY
    return Inertial(float(shape.mass), np.asarray(shape.center_mass), np.asarray(shape.moment_inertia))


def check(found: Inertial, due: Inertial) -> None:
    # Of meshes whose facets leave a little of what is round.
    assert found.mass == pytest.approx(due.mass, rel=5e-3)
    assert found.center == pytest.approx(due.center, abs=3e-5)
    assert found.inertia == pytest.approx(due.inertia, rel=1e-2, abs=5e-3 * due.inertia.max())


def test_links_have_the_mass_of_a_capsule_from_their_hinge_on() -> None:
    found = body_inertials(hand())
    for i, (near, far) in enumerate(LENGTHS):
        for j, length in enumerate((near, far)):
            ball = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS).vertices
            ends = np.vstack([np.add(ball, [0, 0, z]) for z in (HINGE, length)])
            check(found[f"finger{i}_link{j}"], solid(trimesh.convex.convex_hull(ends)))


def test_the_palm_has_the_mass_of_its_disc_and_the_balls_of_first_joints() -> None:
    disc = trimesh.creation.cylinder(radius=PALM, height=THICK, sections=256)
    disc.apply_translation([0, 0, -THICK / 2])
    balls = [trimesh.creation.icosphere(subdivisions=4, radius=RADIUS) for _ in BASES]
    for ball, base in zip(balls, BASES, strict=True):
        ball.apply_translation([*base, 1.05 * RADIUS])
    # Bodies that stand apart: that of all is their sum.
    check(body_inertials(hand())["palm"], solid(trimesh.util.concatenate([disc, *balls])))


def test_without_hinges_the_palm_is_its_disc_alone() -> None:
    built = hand()
    shared = replace(
        built, fingers=tuple(replace(f, links=tuple(replace(x, hinge=0.0) for x in f.links)) for f in built.fingers)
    )
    assert shared.palm_balls == ()
    assert body_inertials(shared)["palm"].mass == pytest.approx(DENSITY * np.pi * PALM**2 * THICK)
    shapes = [
        len(ElementTree.fromstring(hand_urdf(h)).findall("link[@name='palm']/collision")) for h in (shared, built)
    ]
    assert shapes == [1, 4]


# Contacts.


def posed(built: Hand, angles: Array) -> tuple[list[float], float]:
    """Degrees between links and those before, but for first ones, and the lowest end of a link, m off the palm."""
    turns, lowest, remaining = [], np.inf, iter(angles)
    for finger in built.fingers:
        rotation, end = Rotation.identity(), np.array(finger.base)
        for j, link in enumerate(finger.links):
            before = rotation.apply([0, 0, 1])
            rotation *= Rotation.from_rotvec([*link.bend, 0]) * Rotation.from_rotvec(
                next(remaining) * np.array(link.axis)
            )
            along = rotation.apply([0, 0, 1])
            end = end + link.length * along
            lowest = min(lowest, end[2])
            turns += [float(np.degrees(np.arccos(along @ before)))] if j else []
    return turns, lowest


def drawn(built: Hand, kept: Callable[[list[float]], bool], count: int) -> list[Array]:
    """Random angles of a hand whose links stay off the palm's face and whose turns are of a kind."""
    rng, found = np.random.default_rng(7), []
    while len(found) < count:
        angles = rng.uniform(built.joint_lower, built.joint_upper, built.degrees_of_freedom)
        turns, lowest = posed(built, angles)
        # Ends of links keep as far off the palm as the links that meet there are thick.
        if lowest > 1.05 * built.fingers[0].links[-1].radius and kept(turns):
            found.append(angles)
    return found


def within(turns: list[float]) -> bool:
    return max(turns, default=0.0) <= FOLD


def beyond(turns: list[float]) -> bool:
    return min(turns) > 109  # by a hinge of 2.1 radii capsules are clear of each other up to 107.7


ALIKE = {frozenset((f"finger{i}_link0", f"finger{i}_link1")) for i in range(3)}
AT_PALM = {frozenset(("palm", f"finger{i}_link0")) for i in range(3)}


def touching(text: str, names: tuple[str, ...], angles: Array) -> set[frozenset[str]]:
    """Which neighbours MuJoCo has contacts of in a model, at joint angles."""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    for name, angle in zip(names, angles, strict=True):
        joint = model.joint(name)
        data.qpos[joint.qposadr[0]] = angle
    mujoco.mj_forward(model, data)
    contacts = (data.contact.geom[k] for k in range(data.ncon))
    called = {frozenset(model.body(model.geom_bodyid[g]).name for g in pair) for pair in contacts}
    return {pair for pair in called if "object" not in pair and "world" not in pair}


def open_scene(built: Hand) -> str:
    """The scene without what keeps neighbours from colliding, and told to look at parents and children."""
    motion = example_motion()
    row = np.zeros((len(motion.time), built.degrees_of_freedom))
    last = f"_link{len(built.fingers[0].links) - 1}"
    links = tuple(link.replace("_link1", last) for link in motion.contact_link)
    motion = replace(motion, joint_angles=row, joint_names=built.joint_names, contact_link=links)
    motion = replace(motion, object_position=np.add(motion.object_position, [5.0, 0, 0]))
    root = ElementTree.fromstring(scene_mjcf(example_task(), built, motion))
    excluded = root.findall("contact/exclude")
    pairs = {frozenset((element.get("body1", ""), element.get("body2", ""))) for element in excluded}
    assert pairs >= AT_PALM | (ALIKE if len(built.fingers[0].links) > 1 else set())
    root.remove(root.find("contact"))
    option = root.find("option")
    flag = option.find("flag")
    (ElementTree.SubElement(option, "flag") if flag is None else flag).set("filterparent", "disable")
    return ElementTree.tostring(root, encoding="unicode")


SIZES = pytest.mark.parametrize(("tip", "joints"), [(RADIUS, 2), (1.5 * RADIUS, 2), (2 * RADIUS, 2), (2 * RADIUS, 1)])


@SIZES
@pytest.mark.parametrize("seed", range(3))
def test_no_bodies_of_the_hand_meet_in_mujoco_within_the_fold(seed: int, tip: float, joints: int) -> None:
    built = hand(seed, tip, joints)
    text = open_scene(built)
    for angles in drawn(built, within, 20):
        assert touching(text, built.joint_names, angles) == set(), np.degrees(angles)
    # It would see them: folded sharper, all neighbours of a kind are in each other.
    for angles in drawn(built, beyond, 5) if tip == RADIUS else ():
        assert touching(text, built.joint_names, angles) >= ALIKE, posed(built, angles)


@SIZES
@pytest.mark.parametrize("seed", range(3))
def test_no_bodies_of_the_hand_meet_in_coal_within_the_fold(seed: int, tip: float, joints: int) -> None:
    built = hand(seed, tip, joints)
    text = hand_urdf(built)
    model = pin.buildModelFromXML(text)
    shapes = pin.buildGeomFromUrdfString(model, text, pin.GeometryType.COLLISION)
    data, placed = model.createData(), shapes.createData()
    bodies = [model.frames[shape.parentFrame].name for shape in shapes.geometryObjects]

    def meeting(angles: Array) -> set[frozenset[str]]:
        configuration = pin.neutral(model)
        for name, angle in zip(built.joint_names, angles, strict=True):
            configuration[model.joints[model.getJointId(name)].idx_q] = angle
        pin.updateGeometryPlacements(model, data, shapes, placed, configuration)
        found = set()
        for a, b in itertools.combinations(range(len(bodies)), 2):
            if bodies[a] != bodies[b]:
                pair = [
                    x
                    for k in (a, b)
                    for x in (
                        shapes.geometryObjects[k].geometry,
                        coal.Transform3s(placed.oMg[k].rotation, placed.oMg[k].translation),
                    )
                ]
                if coal.distance(*pair, coal.DistanceRequest(), coal.DistanceResult()) < 0:
                    found.add(frozenset((bodies[a], bodies[b])))
        return found

    for angles in drawn(built, within, 10):
        assert meeting(angles) == set(), np.degrees(angles)
    for angles in drawn(built, beyond, 3) if tip == RADIUS else ():
        assert meeting(angles) >= ALIKE, posed(built, angles)


# Looks.


@pytest.mark.parametrize("tip", [RADIUS, 2 * RADIUS])
def test_tongue_and_pin_reach_from_the_joint_to_the_body_and_across_it(tip: float) -> None:
    built = hand(1, tip)
    root = ElementTree.fromstring(hand_urdf(built))
    for i, finger in enumerate(built.fingers):
        for j, link in enumerate(finger.links):
            element = root.find(f"link[@name='finger{i}_link{j}']")
            collide, seen = (element.findall(role) for role in ("collision", "visual"))
            bars = [part for part in seen if part.find("geometry/cylinder") is not None]
            assert (len(collide), len(seen), len(bars)) == (3, 5, 3)
            ends = []
            for part in bars:
                origin, shape = part.find("origin"), part.find("geometry/cylinder")
                middle, rpy = (np.array(origin.get(word, "0 0 0").split(), dtype=float) for word in ("xyz", "rpy"))
                half = 0.5 * float(shape.get("length")) * Rotation.from_euler("xyz", rpy).as_matrix()[:, 2]
                ends.append((middle - half, middle + half, float(shape.get("radius"))))
            (body, tongue, pin_) = ends
            hinge = HINGE * (tip / RADIUS if j else 1)
            assert body[0] == pytest.approx([0, 0, hinge], abs=1e-12)
            assert body[1] == pytest.approx([0, 0, link.length], abs=1e-12)
            assert tongue[0] == pytest.approx(np.zeros(3), abs=1e-12)
            assert tongue[1] == pytest.approx([0, 0, hinge], abs=1e-12)
            assert np.cross(pin_[1] - pin_[0], link.axis) == pytest.approx(np.zeros(3), abs=1e-12)
            assert (pin_[0] + pin_[1]) == pytest.approx(np.zeros(3), abs=1e-12)
            # Of a thick link, too, they fit into the one before.
            assert tongue[2] < RADIUS > pin_[2]
            assert np.linalg.norm(pin_[1]) == pytest.approx(1.2 * RADIUS)
