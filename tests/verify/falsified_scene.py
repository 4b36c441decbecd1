"""Scenes that are not of the result."""

from __future__ import annotations

from tests.verify.falsify import (
    BODY,
    SCENE,
    THING,
    Cases,
    added,
    attribute,
    both,
    edited,
    hung,
    removed,
    task,
)

IN_THE_SCENE: Cases = {
    "no scene": (lambda folder: (folder / SCENE).unlink(), r"scene\.xml: missing"),
    "gravity": (attribute(SCENE, "option", "gravity", "0 0 0"), r"scene\.xml: gravity is"),
    "gravity switched off": (added(SCENE, "option", "<flag gravity='disable'/>"), r"<flag> in <option>"),
    "a step of a second": (attribute(SCENE, "option", "timestep", "1"), r"steps of 1 s are too long"),
    "steps that contacts cannot follow": (
        attribute(SCENE, "option", "timestep", "0.006"),
        r"steps of 0\.006 s are too long for contacts of 0\.0\d+ s; at most half",
    ),
    "stiff contacts": (
        attribute(SCENE, "default/geom", "solref", "0.002 1"),
        r"contacts push out what is in them in 0\.002 s, damped by 1 \(solref\); rubber fingertips do in 0\.0\d+ s",
    ),
    "contacts that are sprung": (attribute(SCENE, "default/geom", "solref", "0.02 0.1"), r"damped by 0\.1 \(solref\)"),
    "contacts as stiff as can be": (
        attribute(SCENE, "default/geom", "solimp", "0.99 0.999 0.001"),
        r"an impedance of 0\.99 to 0\.999 over 0\.001 m \(solimp\); at most 0\.9 to 0\.95",
    ),
    "contacts that stiffen at once": (attribute(SCENE, "default/geom", "solimp", "0.9 0.95 1e-6"), r"over 1e-06 m"),
    "contacts without torsion": (attribute(SCENE, "default/geom", "condim", "3"), r"have 3 dimensions \(condim\)"),
    "contacts without friction": (attribute(SCENE, "default/geom", "condim", "1"), r"have 1 dimensions \(condim\)"),
    "no default": (removed(SCENE, "default"), r"have 3 dimensions \(condim\)"),
    "two defaults": (added(SCENE, "default", "<geom condim='1'/>"), r"<default> says of solids 2 times what they are"),
    "a contact of its own": (
        attribute(SCENE, BODY + "/geom", "solref", "0.002 1"),
        r'<geom name="finger0_link1">: the format has no attribute solref there',
    ),
    "a ground without friction": (
        attribute(SCENE, ".//geom[@name='ground']", "condim", "1"),
        r"has friction of other than 3 dimensions",
    ),
    "pyramids for cones": (attribute(SCENE, "option", "cone", None), r"friction cones are pyramidal, not elliptic"),
    "friction of stone": (attribute(SCENE, "option", "impratio", "1e6"), r"friction is 1e\+06 times as hard"),
    "passes without end": (attribute(SCENE, "option", "noslip_iterations", "900"), r"with 900 passes against creep"),
    "fewer passes than none": (attribute(SCENE, "option", "noslip_iterations", "-5"), r"with -5 passes"),
    "another integrator": (attribute(SCENE, "option", "integrator", "RK4"), r"its integrator is RK4"),
    "a solver of its own": (attribute(SCENE, "option", "solver", "PGS"), r"no attribute solver"),
    "a tolerance of its own": (attribute(SCENE, "option", "tolerance", "1000"), r"no attribute tolerance"),
    "what is small": (attribute(SCENE, "statistic", "meaninertia", "1e6"), r"no attribute meaninertia"),
    "a loose weld": (attribute(SCENE, "equality/weld", "solref", "0.5 1"), r"<weld>: its solref is not 0\.0025 1"),
    "a link that is carried ten times": (
        attribute(SCENE, BODY, "gravcomp", "10"),
        r"the weight of finger 'one' \(link 1\) is not taken off it, as a hand carries itself",
    ),
    "a mesh in place of a shape": (attribute(SCENE, THING + "/geom", "mesh", "m"), r"no attribute mesh there"),
    "ends in place of a size": (
        both(
            attribute(SCENE, ".//geom[@name='palm']", "fromto", "0 0 -1 0 0 0"),
            attribute(SCENE, ".//geom[@name='palm']", "size", "0.05"),
        ),
        r"no attribute pos there",
    ),
    "a mesh of nothing": (
        added(SCENE, ".", "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset>"),
        r'<mesh name="m"> is of no solid',
    ),
    "an object that weighs nothing": (
        attribute(SCENE, THING, "gravcomp", "1"),
        r"the weight of the object is taken off",
    ),
    "an object that resists": (attribute(SCENE, THING + "/freejoint", "armature", "9"), r"no attribute armature"),
    "a motor under another name": (
        attribute(SCENE, ".//position", "name", "finger2_joint1"),
        r"the actuator of joint finger0_joint0 is called finger2_joint1",
    ),
    "few contacts": (added(SCENE, ".", "<size nconmax='1'/>"), r"<size> in <mujoco"),
    "thick air": (attribute(SCENE, "option", "viscosity", "10"), r"no attribute viscosity"),
    "gravity further down": (added(SCENE, ".", "<option gravity='0 0 0'/>"), r"2 elements <option>"),
    "degrees": (attribute(SCENE, "compiler", "angle", "degree"), r"angles are not in radians"),
    "the ground's height": (attribute(SCENE, ".//geom[@name='ground']", "pos", "0 0 -5"), r"the ground is at -5 m"),
    "the ground's friction": (
        attribute(SCENE, ".//geom[@name='ground']", "friction", "5 0 0"),
        r"the ground's friction",
    ),
    "no ground": (removed(SCENE, "worldbody/geom"), r"has 0 solids beside hand and object; the task has a ground"),
    "a wall": (
        added(SCENE, "worldbody", "<geom name='wall' type='capsule' fromto='0 0 0 0 0 1' size='0.01'/>"),
        r"has 2 solids beside hand and object",
    ),
    "the object's friction": (
        attribute(SCENE, THING + "/geom", "friction", "5 0.00108 0"),
        r"the friction of the object is 5",
    ),
    "a sticky fingertip": (
        attribute(SCENE, BODY + "/geom", "friction", "0.9 1 0"),
        r"finger 'one' \(link 1\) does not resist turning",
    ),
    "fingertips that twist freely": (
        edited(SCENE, BODY + "/geom", lambda e, p: e.set("friction", "0.9 0 0"), every=True),
        r"finger 'one' \(link 1\) does not resist turning",
    ),
    "an object that resists a twist twice as well": (
        attribute(SCENE, THING + "/geom", "friction", "0.9 0.00216 0"),
        r"the object does not resist turning",
    ),
    "the object's mass": (
        attribute(SCENE, THING + "/inertial", "mass", "0.01"),
        r"mass of the object is 0\.01 kg, in object\.urdf 0\.1",
    ),
    "the object's inertia": (
        attribute(SCENE, THING + "/inertial", "fullinertia", "1 1 1 0 0 0"),
        r"inertia or centre of mass of the object",
    ),
    "the object's size": (attribute(SCENE, THING + "/geom", "size", "0.03"), r"the solids of the object"),
    "the object's place": (
        attribute(SCENE, THING, "pos", "0 0 0.3"),
        r"the object does not stand as at the motion's first",
    ),
    "the object hangs on the palm": (lambda folder: hung(folder), r"the object"),
    "the object is held": (removed(SCENE, THING + "/freejoint"), r"the object is not free"),
    "a link's size": (attribute(SCENE, BODY + "/geom", "size", "0.001"), r"solids of finger 'one' \(link 1\)"),
    "a link that does not collide": (attribute(SCENE, BODY + "/geom", "contype", "0"), r"no attribute contype"),
    "a link's place": (attribute(SCENE, BODY, "pos", "0 0 0"), r"finger 'one' \(link 1\) does not stand as"),
    "a joint's axis": (attribute(SCENE, BODY + "/joint", "axis", "1 0 0"), r"joint finger0_joint1: its axis"),
    "a joint's limits": (attribute(SCENE, BODY + "/joint", "range", "-9 9"), r"joint finger0_joint1: its limits"),
    "a joint's reference": (attribute(SCENE, BODY + "/joint", "ref", "0"), r"its angle at the start"),
    "a joint without limits": (attribute(SCENE, BODY + "/joint", "limited", "false"), r"has no limits"),
    "a joint with a spring": (attribute(SCENE, BODY + "/joint", "stiffness", "9"), r"no attribute stiffness"),
    "a shelf that goes where the palm is led": (
        added(SCENE, ".//body[@name='palm_target']", "<geom type='sphere' size='0.1' friction='0.9 0.00108 0'/>"),
        r"the palm_target has solids or mass, and is only a place",
    ),
    "a weight there": (
        added(
            SCENE,
            ".//body[@name='palm_target']",
            "<inertial pos='0 0 0' mass='1' fullinertia='1 1 1 0 0 0'/>",
        ),
        r"the palm_target has solids or mass",
    ),
    "an extra body": (added(SCENE, "worldbody", "<body name='post'/>"), r"body post is in no other file"),
    "a body twice": (added(SCENE, "worldbody", "<body name='object'/>"), r"two <body name=\"object\">"),
    "bodies that pass through each other": (
        added(SCENE, "contact", "<exclude body1='object' body2='palm'/>"),
        r"the object and the palm do not collide, though they share no joint",
    ),
    "a weld of the object": (
        added(SCENE, "equality", "<weld body1='palm' body2='object'/>"),
        r"welds .*palm to object",
    ),
    "no weld of the palm": (removed(SCENE, "equality/weld"), r"welds nothing"),
    "strong motors": (
        edited(SCENE, ".//position", lambda e, p: e.set("forcerange", "-99 99"), every=True),
        r"torque of joint finger0_joint0 is not limited to its effort",
    ),
    "stiff motors": (
        edited(SCENE, ".//position", lambda e, p: e.set("kp", "1000"), every=True),
        r"joint_commands: .* motors of scene\.xml need",
    ),
    "motors twice as stiff as the task's": (
        edited(SCENE, ".//position", lambda e, p: e.set("kp", "2"), every=True),
        r"the motor of joint finger0_joint0 has 2 N·m/rad, the task's 1",
    ),
    "a motor softer than the task's": (
        attribute(SCENE, ".//position[@joint='finger1_joint0']", "kp", "0.9"),
        r"the motor of joint finger1_joint0 has 0\.9 N·m/rad, the task's 1",
    ),
    "the task names stiffer motors": (
        task("stiffness: 1.0}", "stiffness: 50.0}"),
        r"the motor of joint finger0_joint0 has 1 N·m/rad, the task's 50",
    ),
    "the task names other damping": (
        task("stiffness: 1.0}", "stiffness: 1.0, damping: 0.5}"),
        r"the motor of joint finger0_joint0 has a damping of 0\.\d+ N·m·s/rad, the task's 0\.5",
    ),
    "motors that brake harder": (
        edited(SCENE, ".//position", lambda e, p: e.set("kv", str(1.01 * float(e.get("kv", "")))), every=True),
        r"the motor of joint finger0_joint0 has a damping of 0\.\d+ N·m·s/rad, the critical one is 0\.\d+",
    ),
    "a motor that drives itself": (
        attribute(SCENE, ".//position", "kv", lambda v: f"-{v}"),
        r"the motor of joint finger0_joint0 has a damping of -0\.\d+",
    ),
    "a heavy rotor": (
        attribute(SCENE, BODY + "/joint", "armature", "1e-3"),
        r"joint finger0_joint1: its rotor has 0\.001 kg·m², on the task's stiffness it is 2\.5e-05",
    ),
    "no rotor": (
        attribute(SCENE, BODY + "/joint", "armature", None),
        r"joint finger0_joint1: its rotor has 0 kg·m²",
    ),
    "a motor less": (removed(SCENE, ".//position[@joint='finger2_joint1']"), r"its actuators turn"),
    "a motor on the object": (added(SCENE, "actuator", "<motor joint='object'/>"), r"<motor> in <actuator>"),
    "a tendon": (added(SCENE, ".", "<tendon/>"), r"<tendon> in <mujoco"),
    "a spring beside the motor": (
        added(
            SCENE,
            ".",
            "<tendon><fixed name='s' springlength='0' stiffness='1'><joint joint='finger0_joint0' coef='1'/></fixed>"
            "</tendon>",
        ),
        r"it has springs, though every joint has a motor of its own",
    ),
    "an included file": (
        added(SCENE, "worldbody", "<include file='x.xml'/>"),
        r"<include> would have a reader open other files",
    ),
    "a default of no collisions": (attribute(SCENE, "default/geom", "conaffinity", "0"), r"no attribute conaffinity"),
    "a keyframe's pose": (
        attribute(SCENE, ".//key[@name='goal2']", "qpos", lambda v: "1 " + v.partition(" ")[2]),
        r"keyframe goal2: qpos",
    ),
    "a keyframe's commands": (
        attribute(SCENE, ".//key[@name='goal1']", "ctrl", lambda v: "1 " + v.partition(" ")[2]),
        r"keyframe goal1: ctrl",
    ),
    "a keyframe's time": (attribute(SCENE, ".//key[@name='goal3']", "time", "9"), r"keyframe goal3: time"),
    "a keyframe less": (removed(SCENE, ".//key[@name='goal3']"), r"has no keyframe goal3"),
}
