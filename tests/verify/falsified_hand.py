"""Hands that are not those of the task, and bodies that are hidden."""

from __future__ import annotations

from tests.verify.falsify import (
    BALL,
    HAND,
    JOINT,
    LINK,
    MASS,
    NEXT,
    OBJECT,
    SCENE,
    Cases,
    added,
    attribute,
    both,
    copied,
    edited,
    links_of,
    only,
    record,
    removed,
    task,
    text,
    whole,
)

HAND_AGAINST_TASK: Cases = {
    "limits of 1000 rad in one joint": (
        attribute(HAND, JOINT + "/limit", "upper", "1000"),
        r"joint finger0_joint1: its limits",
    ),
    "limits of 1000 rad everywhere": (
        both(
            edited(HAND, ".//limit", lambda e, p: e.attrib.update(lower="-1000", upper="1000"), every=True),
            edited(SCENE, ".//joint", lambda e, p: e.set("range", "-1000 1000"), every=True),
            record("hand", "joint_lower", value=-1000.0),
            record("hand", "joint_upper", value=1000.0),
        ),
        r"joint finger0_joint0: its limits in hand\.urdf are -1000 and 1000 rad, the task's -2\.618",
    ),
    "a hand that is a number": (record("hand", value=-1), r"hand: result\.json has no list of fingers"),
    "a stated limit": (record("hand", "joint_upper", value=3.0), r"joint_upper: joint finger0_joint0"),
    "narrower limits in the task": (task("[-150.0, 150.0]", "[-40.0, 40.0]"), r"its limits in hand\.urdf"),
    "a palm of 10 mm": (
        both(
            edited(HAND, "link[@name='palm']//cylinder", lambda e, p: e.set("radius", "0.01"), every=True),
            edited(SCENE, ".//geom[@name='palm']", lambda e, p: e.set("size", "0.01 0.005")),
            record("hand", "palm", "radius", value=0.01),
        ),
        r"the palm: hand\.urdf has a disc of 10 mm × 10 mm, the task one of 50 mm",
    ),
    "a palm of 30 mm under bases 38 mm out": (
        task("radius: 0.05\n", "radius: 0.03\n"),
        r"stands 38 mm out, off the palm of 30 mm",
    ),
    "a thinner palm": (
        record("hand", "palm", "thickness", value=0.001),
        r"palm: result\.json says 0\.001 m of thickness",
    ),
    "a palm that is no disc": (removed(HAND, "link[@name='palm']/collision"), r"palm"),
    "a palm that is lower": (
        edited(HAND, "link[@name='palm']//origin", lambda e, p: e.set("xyz", "0 0 -0.05"), every=True),
        r"the palm: its disc in hand\.urdf is not behind the face",
    ),
    "a base elsewhere": (
        record("hand", "fingers", 0, "base", 0, value=0.03),
        r"its joint in hand\.urdf is not at its base",
    ),
    "a finger that floats": (task("link_radius: 0.006", "link_radius: 0.003"), r"above the palm's face, not on it"),
    "other link radii": (
        both(
            task("link_radius: 0.006", "link_radius: 0.007"),
            task("fingertip: {radius: 0.006", "fingertip: {radius: 0.007"),
        ),
        r"finger 'one' \(link 0\) has a radius of 6 mm, the task 7 mm",
    ),
    "shorter links only": (
        lambda folder: links_of(folder, 0.012, 0.05),
        r"finger 'one' \(link 1\) is 60\.11 mm long; the task allows 12 to 50 mm",
    ),
    "longer links only": (
        lambda folder: links_of(folder, 0.05, 0.16),
        r"finger 'one' \(link 0\) is 26\.81 mm long",
    ),
    "one joint a finger": (task("max_joints: 3", "max_joints: 1"), r"finger 'one' has 2 joints; the task allows 1"),
    "a lighter material": (task("density: 1240.0", "density: 500.0"), r"is not its volume times the task's density"),
    "a stated density": (record("hand", "density", value=500.0), r"density: result\.json says 500"),
    "a ground through the object": (task("ground: {height: 0.0", "ground: {height: 0.24"), r"above the ground"),
    "a ground through the palm": (task("ground: {height: 0.0", "ground: {height: 0.195"), r"ground"),
    "a stated ground elsewhere": (
        record("ground_height", value=-1.0),
        r"ground_height: result\.json says -1\.0, task\.yaml says 0",
    ),
    "no stated ground": (record("ground_height", value=None), r"ground_height: result\.json says none"),
    "another friction of the ground": (record("ground_friction", value=0.1), r"ground_friction"),
    "weaker motors in the task": (
        task("torque: 0.5", "torque: 0.1"),
        r"its effort limit in hand\.urdf is 0\.5 N·m, the task's motor's 0\.1",
    ),
    "effort too small": (
        attribute(HAND, JOINT + "/limit", "effort", "0.01"),
        r"joint finger0_joint1: its effort limit",
    ),
    "effort below zero": (attribute(HAND, JOINT + "/limit", "effort", "-1"), r"effort limit .*not above zero"),
    "speed of zero": (attribute(HAND, JOINT + "/limit", "velocity", "0"), r"velocity limit .*not above zero"),
    "effort below what the motion needs, without a motor": (
        both(
            task("torque: 0.5, speed: 5.0, ", ""),
            edited(HAND, ".//limit", lambda e, p: e.set("effort", "0.05"), every=True),
            edited(SCENE, ".//position", lambda e, p: e.set("forcerange", "-0.05 0.05"), every=True),
            record("hand", "effort", value=0.05),
        ),
        r"its effort limit of 0\.05 N·m is below the 0\.\d+ it needs",
    ),
    "another finger's name": (
        record("hand", "fingers", 0, "name", value="thumb"),
        r"finger 0 is 'thumb' in result\.json",
    ),
    "a finger that the task has not": (
        task("one: {touches", "thumb: {touches"),
        r"the task has no finger of that name",
    ),
    "a finger less": (
        record("hand", "fingers", value=lambda fingers: fingers[:2]),
        r"link finger2_link0 is not in result\.json",
    ),
    "a link less": (
        record("hand", "fingers", 0, "links", value=lambda links: links[:1]),
        r"link finger0_link1 is not in result\.json",
    ),
}

HIDDEN: Cases = {
    "a link without geometry": (removed(HAND, NEXT + "/collision"), r"finger 'one' \(link 1\)|finger0_link1"),
    "a first link without geometry": (removed(HAND, LINK + "/collision"), r"finger0_link0|link 0"),
    "a thin link": (
        edited(HAND, LINK + "//*[@radius]", lambda e, p: e.set("radius", "0.0001"), every=True),
        r"finger 'one' \(link 0\) has a radius of 0\.1 mm",
    ),
    "a short link": (
        edited(HAND, LINK + "//cylinder", lambda e, p: e.set("length", "0.001"), every=True),
        r"finger 'one' \(link 0\)",
    ),
    "a radius that is no number": (
        attribute(HAND, NEXT + "//sphere", "radius", "nan"),
        r"radius is 'nan', which is not finite",
    ),
    "an infinite length": (
        attribute(HAND, NEXT + "//cylinder", "length", "inf"),
        r"length is 'inf', which is not finite",
    ),
    "a radius below zero": (
        attribute(HAND, NEXT + "//sphere", "radius", "-0.006"),
        r"radius is -0\.006, not above zero",
    ),
    "a radius of words": (
        attribute(HAND, NEXT + "//sphere", "radius", "wide"),
        r"radius is 'wide', not a finite number",
    ),
    "a number in other digits": (attribute(HAND, NEXT + "//sphere", "radius", "0_006"), r"radius is '0_006'"),
    "a huge number": (attribute(HAND, JOINT + "/origin", "xyz", "0 0 1e300"), r"too large"),
    "a palm further down": (added(HAND, ".", f"<link name='palm'>{MASS}</link>"), r"two <link name=\"palm\">"),
    "a link further down": (
        added(HAND, ".", f"<link name='finger1_link1'>{MASS}</link>"),
        r"two <link name=\"finger1_link1\">",
    ),
    "a joint further down": (
        lambda folder: copied(folder, HAND, JOINT),
        r"two <joint name=\"finger0_joint1\">",
    ),
    "a second origin": (added(HAND, JOINT, "<origin xyz='0 0 0'/>"), r"2 elements <origin>"),
    "a second geometry": (
        added(HAND, LINK + "/collision", "<geometry><sphere radius='0.001'/></geometry>", first=True),
        r"2 elements <geometry>",
    ),
    "a second mass": (added(HAND, LINK + "/inertial", "<mass value='0.001'/>"), r"2 elements <mass>"),
    "a mesh": (
        edited(HAND, LINK + "/collision/geometry", lambda e, p: only(e, "<mesh filename='none.stl'/>")),
        r"mesh 'none\.stl' is no \.obj file within the folder",
    ),
    "a link that looks fat": (
        attribute(HAND, LINK + "/visual//sphere", "radius", "0.02"),
        r"finger0_link0 looks other than it collides",
    ),
    "an extra link": (
        both(
            added(HAND, ".", f"<link name='rest'>{MASS}{BALL}{BALL.replace('collision', 'visual')}</link>"),
            added(
                HAND,
                ".",
                "<joint name='rest' type='revolute'><parent link='palm'/><child link='rest'/><axis xyz='0 0 1'/>"
                "<limit lower='0' upper='0' effort='0' velocity='0'/></joint>",
            ),
        ),
        r"rest",
    ),
    "a fixed extra link": (
        both(
            added(HAND, ".", f"<link name='rest'>{MASS}</link>"),
            added(HAND, ".", "<joint name='r' type='fixed'><parent link='palm'/><child link='rest'/></joint>"),
        ),
        r"joint r is of type 'fixed', not revolute",
    ),
    "a loose link": (added(HAND, ".", f"<link name='rest'>{MASS}</link>"), r"link 'rest' does not hang on one joint"),
    "extra geometry on a link": (
        both(
            added(
                HAND, NEXT, "<collision><origin xyz='0 0 .1'/><geometry><sphere radius='.006'/></geometry></collision>"
            ),
            added(HAND, NEXT, "<visual><origin xyz='0 0 .1'/><geometry><sphere radius='.006'/></geometry></visual>"),
        ),
        r"finger 'one' \(link 1\): hand\.urdf has more than the one capsule",
    ),
    "an element nobody knows": (added(HAND, ".", "<gazebo reference='palm'/>"), r"<gazebo> in <robot"),
    "a joint that mimics": (
        added(HAND, JOINT, "<mimic joint='finger0_joint0'/>"),
        r"it mimics finger0_joint0; by its motors",
    ),
    "a motor of no joint": (
        added(HAND, ".", "<transmission name='t'><joint name='finger9_joint0'/></transmission>"),
        r"turns joint 'finger9_joint0', which there is not",
    ),
    "a motor for one joint and none for others": (
        added(HAND, ".", "<transmission name='t'><joint name='finger0_joint0'/></transmission>"),
        r"joint finger0_joint1 has 0 transmissions, not one",
    ),
    "a gear": (
        added(
            HAND,
            ".",
            "<transmission name='t'><actuator><mechanicalReduction>9</mechanicalReduction></actuator></transmission>",
        ),
        r"reduces by 9",
    ),
    "an extra link in the object": (
        added(OBJECT, ".", f"<link name='wing'>{MASS}{BALL}</link>"),
        r"holds 'object', 'wing'",
    ),
    "two objects": (added(OBJECT, ".", f"<link name='object'>{MASS}{BALL}</link>"), r"two <link name=\"object\">"),
    "an object without geometry": (
        removed(OBJECT, "link/collision"),
        r"no link 'object' made of shapes of the kinds sphere, capsule",
    ),
    "a smaller object": (
        edited(OBJECT, ".//*[@radius]", lambda e, p: e.set("radius", "0.01"), every=True),
        r"shapes: object\.urdf has not the shapes of task\.yaml",
    ),
    "no mass": (attribute(OBJECT, ".//mass", "value", "0"), r"link object: its mass is 0 kg"),
    "a mass below zero": (attribute(HAND, NEXT + "//mass", "value", "-1"), r"link finger0_link1: its mass is -1 kg"),
    "no inertia": (
        edited(OBJECT, ".//inertia", lambda e, p: e.attrib.update(dict.fromkeys(e.attrib, "0"))),
        r"link object: its inertia is that of no solid body",
    ),
    "no inertial": (removed(HAND, NEXT + "/inertial"), r"link finger0_link1 has no mass"),
    "a link of foam": (
        attribute(HAND, NEXT + "//mass", "value", lambda v: str(0.1 * float(v))),
        r"not its volume times the task's density",
    ),
    "a link's inertia ten times": (
        edited(HAND, NEXT + "//inertia", lambda e, p: e.attrib.update({k: str(10 * float(v)) for k, v in e.items()})),
        r"finger 'one' \(link 1\): its inertia in hand\.urdf",
    ),
    "a centre of mass elsewhere": (
        attribute(HAND, NEXT + "/inertial/origin", "xyz", "0 0 0"),
        r"its centre of mass in hand\.urdf",
    ),
    "a document type in disguise": (
        text(SCENE, "<mujoco model=", '<?a <!-- ?><!DOCTYPE mujoco [<!ATTLIST option x CDATA "-->">]><mujoco model='),
        r"scene\.xml: has instructions for programs",
    ),
    "a document type behind a comment": (
        text(SCENE, "<mujoco model=", '<!-- a --><!DOCTYPE mujoco [<!ATTLIST option x CDATA "1">]><mujoco model='),
        r"scene\.xml: declares a document type",
    ),
    "another encoding": (
        whole(OBJECT, '<?xml version="1.0" encoding="utf-7"?><robot name="object"/>'),
        r"object\.urdf: declares the encoding utf-7",
    ),
    "a shape that is scaled": (
        edited(HAND, NEXT + "/collision/geometry/sphere", lambda e, p: e.set("scale", "2 2 2")),
        r"<sphere>: the format has no attribute scale there",
    ),
    "a mass in grams": (attribute(OBJECT, ".//mass", "unit", "g"), r"<mass>: the format has no attribute unit there"),
    "a frame that some turn": (
        attribute(HAND, JOINT + "/origin", "quat_xyzw", "1 0 0 0"),
        r"<origin>: the format has no attribute quat_xyzw there",
    ),
    "a document type": (
        text(HAND, "<robot", '<!DOCTYPE r [<!ENTITY a "0">]><robot'),
        r"declares a document type",
    ),
}
