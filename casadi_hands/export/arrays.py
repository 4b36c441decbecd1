"""``motion.npz``: a motion's arrays, the same bytes for the same motion."""

from __future__ import annotations

import zipfile
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.stored import LARGEST_NUMBER, check_samples, read_arrays

if TYPE_CHECKING:
    from casadi_hands.task import Task

_NAMES = ("joint_names", "contact_names", "contact_link")
# Shapes as the result format gives them: S samples, J joints, C contacts.
_SHAPES: dict[str, tuple[str | int, ...]] = {
    "time": ("S",),
    "object_position": ("S", 3),
    "object_orientation": ("S", 4),
    "base_position": ("S", 3),
    "base_orientation": ("S", 4),
    "joint_angles": ("S", "J"),
    "joint_names": ("J",),
    "contact_names": ("C",),
    "contact_link": ("C",),
    "contact_active": ("S", "C"),
    "contact_force": ("S", "C", 3),
    "contact_point_object": ("S", "C", 3),
    "contact_point_link": ("S", "C", 3),
    "external_force": ("S", 3),
    "external_torque": ("S", 3),
    "joint_velocities": ("S", "J"),
    "joint_torques": ("S", "J"),
    "joint_commands": ("S", "J"),
    "motor_positions": ("S", "N"),
    "contact_moment": ("S", "C", 3),
    "contact_force_disturbed": ("S", "C", 3),
    "external_force_disturbed": ("S", 3),
    "external_torque_disturbed": ("S", 3),
    "attachment_position": ("S",),
    "attachment_velocity": ("S",),
    "attachment_friction": ("S",),
}
_OPTIONAL = frozenset(item.name for item in fields(Motion) if item.default is None)
_NO_TURN = 1e-3
_FIRST_DATE = (1980, 1, 1, 0, 0, 0)  # the earliest a zip file can hold: a stamp that says nothing


def save_motion(motion: Motion, path: Path) -> None:
    """Write a motion; equal motions give equal bytes.

    Args:
        motion: the arrays.
        path: the file to write.

    Raises:
        DesignError: an array has the wrong shape, or a number is not finite.
    """
    arrays = _arrays(motion)
    _check(arrays, path)
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, array in arrays.items():
            entry = zipfile.ZipInfo(f"{name}.npy", date_time=_FIRST_DATE)
            entry.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)


def load_motion(path: Path, task: Task | None = None) -> Motion:
    """Read a motion that `save_motion` wrote.

    Args:
        path: the file to read.
        task: of which it is a motion, which says how many samples it can have.

    Raises:
        DesignError: the file cannot be read, or an array is missing, has the wrong type or shape, or holds what is not
            finite or too large.
    """
    stored = read_arrays(path, _SHAPES)
    missing = [name for name in _SHAPES if name not in stored and name not in _OPTIONAL]
    if missing:
        raise DesignError(f"{path}: the motion lacks {', '.join(missing)}")
    _check(stored, path)
    if task is not None:
        check_samples(path, len(stored["time"]), task)
    _check_motion(stored, path)
    floats = {name: array.astype(np.float64) for name, array in stored.items() if array.dtype.kind in "fiu"}
    entries: dict[str, Any] = {name: {**stored, **floats}.get(name) for name in _SHAPES}
    entries |= {name: tuple(str(item) for item in stored[name]) for name in _NAMES}
    return Motion(**entries)


def _check_motion(arrays: dict[str, np.ndarray], path: Path) -> None:
    """Raise `DesignError` unless arrays are of their types, numbers of a size that things have, and times increase."""
    for name, array in arrays.items():
        kinds = {"contact_active": "b", **dict.fromkeys(_NAMES, "U")}.get(name, "fiu")
        if array.dtype.kind not in kinds:
            raise DesignError(f"{path}: {name} holds {array.dtype}, which it must not")
        if array.dtype.kind in "fiu" and np.any(np.abs(array.astype(np.float64)) > LARGEST_NUMBER):
            raise DesignError(f"{path}: {name} holds a number too large for anything of a hand")
    if len(arrays["time"]) < 2 or not np.all(np.diff(arrays["time"].astype(np.float64)) > 0):
        raise DesignError(f"{path}: time must hold at least two increasing samples")
    for name in ("object_orientation", "base_orientation"):
        if np.linalg.norm(arrays[name].astype(np.float64), axis=1).min() < _NO_TURN:
            raise DesignError(f"{path}: {name} is the zero quaternion at a sample")


def _arrays(motion: Motion) -> dict[str, np.ndarray]:
    """The motion's arrays with the types and the memory layout that the file has."""
    arrays: dict[str, np.ndarray] = {}
    for item in fields(motion):
        value = getattr(motion, item.name)
        if value is None:
            continue
        kind = np.str_ if item.name in _NAMES else np.bool_ if item.name == "contact_active" else np.float64
        arrays[item.name] = np.array(value, dtype=kind, order="C")
    return arrays


def _check(arrays: dict[str, np.ndarray], path: Path) -> None:
    """Raise `DesignError` unless every array has its shape and only finite numbers."""
    sizes: dict[str, int] = {}
    for name, shape in _SHAPES.items():
        if name not in arrays:
            continue
        array = arrays[name]
        expected = tuple(
            sizes.setdefault(size, array.shape[k] if k < array.ndim else -1) if isinstance(size, str) else size
            for k, size in enumerate(shape)
        )
        if array.shape != expected:
            wanted = ", ".join(f"{size}={sizes[size]}" if isinstance(size, str) else str(size) for size in shape)
            raise DesignError(f"{path}: {name} has shape {array.shape}; it must be ({wanted})")
        if array.dtype.kind == "f" and not np.isfinite(array).all():
            raise DesignError(f"{path}: {name} holds numbers that are not finite")
    if sizes["S"] == 0:
        raise DesignError(f"{path}: the motion has no samples")
