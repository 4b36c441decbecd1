"""The motion as one table of text: a row for each sample, a column for each number of every array."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator

import numpy as np

from casadi_hands.export.markup import number
from casadi_hands.problem.motion import Motion

_UNITS = {
    "time": "s",
    "object_position": "m",
    "object_orientation": "",
    "base_position": "m",
    "base_orientation": "",
    "joint_angles": "rad",
    "joint_velocities": "rad/s",
    "joint_torques": "N m",
    "joint_commands": "rad",
    "motor_positions": "rad",
    "contact_active": "",
    "contact_force": "N",
    "contact_point_object": "m",
    "contact_point_link": "m",
    "contact_moment": "N m",
    "contact_force_disturbed": "N",
    "external_force": "N",
    "external_torque": "N m",
    "external_force_disturbed": "N",
    "external_torque_disturbed": "N m",
    # In rad, rad/s and N m, of a slider in m, m/s and N.
    "attachment_position": "",
    "attachment_velocity": "",
    "attachment_friction": "",
}
"""Every array with a row for each sample, in the order of the columns."""


def motion_table(motion: Motion) -> str:
    """The motion as CSV: a line of names, then one line for each sample, every number exact.

    A column is named as its array (see ``docs/result-folder.md``, which gives frames), then the joint or the contact,
    then the component, then the unit in brackets where there is one: ``contact_force/thumb/x [N]``. Whether a contact
    is active is 1 or 0. What is constant over the motion, the contacts' links, is left out, and so are arrays that the
    motion lacks.

    Args:
        motion: with or without the optional arrays.

    Raises:
        DesignError: a number is not finite.
    """
    columns = list(_columns(motion))
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(name for name, _ in columns)
    for k in range(len(motion.time)):
        writer.writerow(f"{values[k]:d}" if values.dtype == np.bool_ else number(values[k]) for _, values in columns)
    return stream.getvalue()


def _columns(motion: Motion) -> Iterator[tuple[str, np.ndarray]]:
    """Name and values (S,) of every column, in the order of `_UNITS`, what belongs to a contact side by side."""
    arrays = {name: values for name in _UNITS if (values := getattr(motion, name)) is not None}
    of_contacts = [name for name in arrays if name.startswith("contact_")]
    for name, values in arrays.items():
        if name == of_contacts[0]:
            for c, contact in enumerate(motion.contact_names):
                for each in of_contacts:
                    yield from _components(each, arrays[each][:, c], contact)
        elif name.startswith("joint_"):
            for joint, column in zip(motion.joint_names, values.T, strict=True):
                yield _title(name, joint), column
        elif name == "motor_positions":
            for m, column in enumerate(values.T):
                yield _title(name, f"motor{m}"), column
        elif name not in of_contacts:
            yield from _components(name, values)


def _components(array: str, values: np.ndarray, *parts: str) -> Iterator[tuple[str, np.ndarray]]:
    """Columns of a number (S,), a vector (S, 3) or a quaternion (S, 4)."""
    if values.ndim == 1:
        yield _title(array, *parts), values
    else:
        for component, column in zip("wxyz" if values.shape[1] == 4 else "xyz", values.T, strict=True):
            yield _title(array, *parts, component), column


def _title(array: str, *parts: str) -> str:
    unit = _UNITS[array]
    return "/".join((array, *parts)) + (f" [{unit}]" if unit else "")
