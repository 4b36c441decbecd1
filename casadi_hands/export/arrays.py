"""``motion.npz``: a motion's arrays, the same bytes for the same motion."""

from __future__ import annotations

import zipfile
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.problem.motion import Motion

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
}
_OPTIONAL = frozenset(item.name for item in fields(Motion) if item.default is None)
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


def load_motion(path: Path) -> Motion:
    """Read a motion that `save_motion` wrote.

    Args:
        path: the file to read.

    Raises:
        DesignError: the file cannot be read, or an array is missing, has the wrong shape or is not finite.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            stored = {name: file[name] for name in file.files}
    except (OSError, ValueError, zipfile.BadZipFile) as error:
        raise DesignError(f"{path}: not a motion file: {error}") from error
    missing = [name for name in _SHAPES if name not in stored and name not in _OPTIONAL]
    if missing:
        raise DesignError(f"{path}: the motion lacks {', '.join(missing)}")
    _check(stored, path)
    entries: dict[str, Any] = {name: stored.get(name) for name in _SHAPES}
    entries |= {name: tuple(str(item) for item in stored[name]) for name in _NAMES}
    return Motion(**entries)


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
