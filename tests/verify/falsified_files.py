"""Facts that two files state differently."""

from __future__ import annotations

from tests.verify.falsify import (
    HAND,
    JOINT,
    KINEMATIC,
    Cases,
    arrays,
    attribute,
    both,
    emptied,
    entry,
    mistyped,
    record,
    text,
)

DISAGREEMENTS: Cases = {
    "another task": (
        text("task.yaml", "about: ''", "about: 'else'"),
        r"task_hash: task\.yaml is not the task that was solved",
    ),
    "another task's name": (record("task", value="else"), r"task: result\.json says else"),
    "a stated friction": (record("friction", value=0.5), r"friction: result\.json says 0\.5, task\.yaml says 0\.9"),
    "a stated gravity": (record("gravity", value=[0, 0, 0]), r"gravity: result\.json says"),
    "a stated mass": (record("object", "mass", value=0.2), r"mass: object\.urdf says 0\.1 kg, result\.json says 0\.2"),
    "a stated inertia": (record("object", "inertia", 0, 0, value=1.0), r"inertia of the object"),
    "a stated shape": (record("object", "shapes", 0, "radius", value=0.03), r"shapes: those of result\.json"),
    "a stated kind of shape": (record("object", "shapes", 0, "type", value="sphere"), r"shapes: those of result\.json"),
    "no stated shapes": (record("object", "shapes", drop=True), r"shapes: result\.json has not as many"),
    "a stated goal's time": (record("goals", 1, "time", value=0.9), r"goal 2 of result\.json"),
    "a stated goal's turn": (record("goals", 1, "orientation", value=[1, 0, 0, 0]), r"goal 2 of result\.json"),
    "a goal less": (record("goals", value=lambda goals: goals[:2]), r"goals: result\.json has 2, task\.yaml has 3"),
    "a status of its own": (record("status", value="approved"), r"status: result\.json says approved"),
    "degrees of freedom": (
        record("degrees_of_freedom", value=3),
        r"degrees_of_freedom: result\.json says 3, motion\.npz says 6",
    ),
    "samples": (record("samples", value=20), r"samples: result\.json says 20"),
    "an axis turned around": (
        record("hand", "fingers", 1, "links", 0, "axis", value=lambda axis: [-part for part in axis]),
        r"finger 'two' \(link 0\): its axis in hand\.urdf is not that of result\.json",
    ),
    "an axis that is no unit": (
        attribute(HAND, JOINT + "/axis", "xyz", "0 2 0"),
        r"joint finger0_joint1: its axis in hand\.urdf is not a unit vector",
    ),
    "a length": (record("hand", "fingers", 0, "links", 0, "length", value=0.05), r"hand\.urdf has a capsule of"),
    "a frame turned": (
        attribute(HAND, JOINT + "/origin", "rpy", "0 0 0.1"),
        r"finger 'one' \(link 1\): its frame in hand\.urdf is not turned at zero angle as result\.json has it bent",
    ),
    "a bend": (
        record("hand", "fingers", 0, "links", 1, "bend", value=[1e-4, 0.0]),
        r"finger 'one' \(link 1\): its frame in hand\.urdf is not turned at zero angle as result\.json has it bent",
    ),
    "a link on another finger": (
        attribute(HAND, JOINT + "/parent", "link", "finger1_link0"),
        r"it hangs on finger 'two' \(link 0\)",
    ),
    "a link in a ring": (
        attribute(HAND, "joint[@name='finger0_joint0']/parent", "link", "finger0_link1"),
        r"link 'finger0_link0' hangs in a ring",
    ),
    "the table's angle": (lambda folder: mistyped(folder), r"motion\.csv: .* at 0\.4 s is not that of motion\.npz"),
    "the table's columns": (text("motion.csv", "time [s]", "clock [s]"), r"column 'clock \[s\]' is not of motion\.npz"),
    "velocities": (
        arrays(joint_velocities=entry((4, 2), 1.0)),
        r"joint_velocities: 1 rad/s of joint finger1_joint0 at 0\.4 s",
    ),
    "torques": (arrays(joint_torques=lambda a: 0.5 * a), r"joint_torques"),
    "commands": (arrays(joint_commands=lambda a: a + 0.01), r"joint_commands"),
    "no commands": (arrays(**KINEMATIC), r"no array joint_velocities"),
    "an earlier version": (
        both(record("task_hash", drop=True), arrays(**KINEMATIC)),
        r"written by an earlier version \(no task_hash, no joint_commands\): `casadi-hands solve .*--from",
    ),
    "an earlier version, of straight links": (
        record("hand", "fingers", 0, "links", 1, "bend", drop=True),
        r"written by an earlier version \(no bend\): `casadi-hands solve .*--from",
    ),
    "a joint of the object": (
        record("attached", value={"joint": "hinge"}),
        r"attached: result\.json has a joint, task\.yaml has none",
    ),
    "a push on the world": (
        record("goals", 1, "exert", value={"force": [0, 0, 100], "torque": [0, 0, 0]}),
        r"goal 2 of result\.json is not that",
    ),
    "an empty table": (
        emptied,
        r"motion\.csv: not a table of numbers: empty",
    ),
    "torques off by little": (
        arrays(joint_torques=lambda a: a * (1 + 1e-5)),
        r"joint_torques: (?P<said>\S+) N·m .* need (?!(?P=said) )",
    ),
    "a later certificate": (record("certificate", value={"slip": {"value": 0.5, "limit": 0.0002}}), r"certificate"),
}
