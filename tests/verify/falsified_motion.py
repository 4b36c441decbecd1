"""Falsified disturbances, and numbers that are none."""

from __future__ import annotations

import numpy as np

from tests.verify.falsify import (
    DISTURBED,
    HAND,
    NPZ,
    SCENE,
    Cases,
    appended,
    arrays,
    attribute,
    both,
    entry,
    halved,
    plain_forces,
    record,
    squeezed,
    task,
    text,
    tipped,
    whole,
)

DISTURBANCES: Cases = {
    "the push is missing": (arrays(external_force_disturbed=lambda a: 0 * a), r"external_force_disturbed: at 0\.5 s"),
    "the push is half as strong": (arrays(external_force_disturbed=lambda a: a / 2), r"external_force_disturbed"),
    "the push is turned upward": (
        arrays(external_force_disturbed=lambda a: -a),
        r"\(-0\.1, -?0, 0\.3\) N; .* \(0\.1, 0, -0\.3\) N",
    ),
    "the push comes later": (
        arrays(external_force_disturbed=lambda a: np.roll(a, 3, axis=0)),
        r"external_force_disturbed: at (0\.8|0\.9|1|1\.1) s .*helped by what the task does not state",
    ),
    "the push lasts longer": (
        arrays(external_force_disturbed=entry(slice(9, 14), [0.1, 0, -0.3])),
        r"external_force_disturbed: .*helped by what the task does not state",
    ),
    "the torque is missing": (arrays(external_torque_disturbed=lambda a: 0 * a), r"external_torque_disturbed: at 1\.2"),
    "the torque is turned": (arrays(external_torque_disturbed=lambda a: -a), r"external_torque_disturbed"),
    "a torque nobody states": (
        arrays(external_torque_disturbed=entry(3, [0, 0, 1e-3])),
        r"external_torque_disturbed: at 0\.3 s .*does not state",
    ),
    "the second scenario is missing": (arrays(**dict.fromkeys(DISTURBED)), r"contact_force_disturbed: missing"),
    "a part of it is missing": (arrays(external_torque_disturbed=None), r"only a part of the arrays"),
    "the contacts do nothing against it": (
        both(arrays(contact_force_disturbed=lambda a: a), lambda folder: plain_forces(folder)),
        r"of the task's perturbations is borne by nothing at (0\.5|0\.6|0\.7|0\.8|1\.2) s",
    ),
    "the contacts do half of it": (lambda folder: plain_forces(folder, 0.5), r"is borne by nothing"),
    "other forces where nothing pushes": (
        arrays(contact_force_disturbed=entry(18, 0, scale=1.1)),
        r"contact_force_disturbed: at 1\.8 s .*nothing disturbs",
    ),
    "an idle contact bears the push": (
        arrays(contact_active=entry((6, 1), False)),
        r"bears .* under the task's perturbations, though not active|bears .* though not active",
    ),
    "the plan is carried by a push downward used upward": (
        arrays(external_force=entry(slice(5, 9), [-0.1, 0, 0.3])),
        r"external_force: at 0\.5 s",
    ),
    "the plan is helped": (arrays(external_force=entry(2, [0, 0, 0.98])), r"external_force: at 0\.2 s .*helped"),
    "the plan is helped to turn": (arrays(external_torque=entry(2, [0, 0, 1e-4])), r"external_torque: at 0\.2 s"),
    "the task states 1000 N": (
        task("force: [0.1, 0.0, -0.3]", "force: [0, 0, -1000.0]"),
        r"perturbations state \(0, 0, -1e\+03\) N",
    ),
    "the task states another time": (task("from: 0.45, to: 0.85", "from: 1.45, to: 1.85"), r"external_force_disturbed"),
    "disturbed forces pull": (
        lambda folder: squeezed(folder, -3.0),
        r"pulled with .* under the task's perturbations",
    ),
    "disturbed forces are beyond friction": (
        lambda folder: squeezed(folder, -0.9),
        r"exceeds friction by .* under the task's perturbations",
    ),
    "disturbed forces are beyond the motors": (
        lambda folder: squeezed(folder, 20.0),
        r"of the actuator's torque in joint finger\d_joint0 .* under the task's perturbations",
    ),
}

TORSION: Cases = {
    "more of the moments": (arrays(contact_moment=lambda a: 1.1 * a), r"a torque of .* that nothing exerts moves"),
    "moments turned around": (arrays(contact_moment=lambda a: -a), r"a torque of .* that nothing exerts moves"),
    "no moments": (arrays(contact_moment=None), r"a torque of .* that nothing exerts moves"),
    "moments of hard fingertips": (
        lambda folder: tipped(folder, 0.0),
        r"a moment exceeds what the tip bears by .* at contact 'three' at 0\.5 s",
    ),
    "moments of fingertips too hard for them": (
        lambda folder: tipped(folder, 0.0001),
        r"a moment exceeds what the tip bears by .* at contact '(one|three)' at ",
    ),
}

NO_NUMBERS: Cases = {
    **{
        f"nan in {name}": (arrays(**{name: entry(5, np.nan)}), rf"{name} holds a number that is not finite")
        for name in (
            *("object_position", "base_orientation", "joint_angles", "contact_force", "contact_point_link"),
            "contact_moment",
            *("joint_velocities", "joint_torques", "joint_commands", *DISTURBED),
        )
    },
    "complex angles": (arrays(joint_angles=lambda a: a + 0j), r"joint_angles holds complex128, not real numbers"),
    "complex nan": (arrays(contact_force=lambda a: a + 1j * np.nan), r"contact_force holds complex128"),
    "times of words": (arrays(time=lambda a: a.astype(str)), r"time holds <U\d+, not real numbers"),
    "objects": (arrays(time=lambda a: a.astype(object)), r"time holds object, not real numbers"),
    "activity of numbers": (
        arrays(contact_active=lambda a: 0.5 * a),
        r"contact_active holds float64, not true and false",
    ),
    "huge forces": (arrays(contact_force=lambda a: 1e200 * a), r"contact_force holds a number too large"),
    "names of numbers": (arrays(joint_names=np.arange(6)), r"joint_names holds int64, not words"),
    "an array twice": (lambda folder: appended(folder, "time.npy"), r"holds time twice"),
    "half an archive": (lambda folder: halved(folder / NPZ), r"motion\.npz: not a NumPy archive"),
    "an empty archive": (whole(NPZ, b""), r"motion\.npz: not a NumPy archive"),
    "no archive": (whole(NPZ, "time"), r"motion\.npz: not a NumPy archive"),
    "an array too many dimensions": (arrays(time=lambda a: a[:, None]), r"time has shape"),
    "NaN in the record": (text("result.json", '"samples": 21', '"samples": NaN'), r"holds NaN, not a finite number"),
    "a name twice in the record": (
        text("result.json", '"samples": 21', '"samples": 21, "samples": 21'),
        r"gives 'samples' twice",
    ),
    "half a record": (lambda folder: halved(folder / "result.json"), r"result\.json: cannot be read"),
    "a list for a record": (whole("result.json", "[1]"), r"not a result of format 1"),
    "null for the hand": (record("hand", value=None), r"hand: result\.json has no list of fingers"),
    "null for a link": (record("hand", "fingers", 0, "links", 0, value=None), r"states no length and radius"),
    "null for the object": (record("object", value=None), r"mass: object\.urdf says 0\.1 kg, result\.json says None"),
    "null for a goal": (record("goals", 1, value=None), r"goal 2 of result\.json"),
    "words for a mass": (record("object", "mass", value="heavy"), r"result\.json says heavy kg"),
    "words for gravity": (record("gravity", value="down"), r"gravity: result\.json says down"),
    "half a hand": (lambda folder: halved(folder / HAND), r"hand\.urdf: not XML"),
    "nan in the scene": (attribute(SCENE, ".//option", "timestep", "nan"), r"timestep is 'nan', which is not finite"),
    "half a scene": (lambda folder: halved(folder / SCENE), r"scene\.xml: not XML"),
    "nan in the table": (text("motion.csv", "\n0.0,", "\nnan,"), r"motion\.csv: has not a row of finite numbers"),
    "nan in the task": (text("task.yaml", "friction: 0.9", "friction: .nan"), r"friction"),
}
