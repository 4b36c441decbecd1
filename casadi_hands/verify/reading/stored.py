"""``motion.npz`` and ``result.json``, read so that nothing that is no number, or given twice, comes through."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.problem.motion import Motion
from casadi_hands.problem.stored import LARGEST_NUMBER, read_arrays, read_json

_WORDS = ("joint_names", "contact_names", "contact_link")
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
_ASKED = frozenset(name for name, item in Motion.__dataclass_fields__.items() if item.default is not None)


def read_motion(path: Path) -> Motion:
    """Read ``motion.npz``.

    Raises:
        DesignError: it cannot be read, lacks an array, or an array has another type or shape, or holds a number that is
            not finite.
    """
    arrays = read_arrays(path, _SHAPES)
    missing = [name for name in _SHAPES if name in _ASKED and name not in arrays]
    if missing:
        raise DesignError(f"{path}: no array {', '.join(missing)}")
    sizes = {"S": arrays["time"].size, "J": arrays["joint_names"].size, "C": arrays["contact_names"].size}
    sizes["N"] = arrays["motor_positions"].shape[-1] if arrays.get("motor_positions", np.zeros(0)).ndim == 2 else 1
    for name, array in arrays.items():
        shape = tuple(sizes[size] if isinstance(size, str) else size for size in _SHAPES[name])
        if array.shape != shape:
            raise DesignError(f"{path}: {name} has shape {array.shape}, not {shape}")
        arrays[name] = _checked(path, name, array)
    if sizes["S"] < 3 or not np.all(np.diff(arrays["time"]) > 0):
        raise DesignError(f"{path}: time must hold at least three increasing samples")
    if sizes["J"] == 0:
        raise DesignError(f"{path}: joint_names is empty; a hand has joints")
    if min(np.linalg.norm(arrays[f"{who}_orientation"], axis=1).min() for who in ("object", "base")) < 1e-3:
        raise DesignError(f"{path}: an orientation is the zero quaternion")
    words = {name: tuple(str(word) for word in arrays[name]) for name in _WORDS}
    for name in ("joint_names", "contact_names"):
        twice = sorted({word for word in words[name] if words[name].count(word) > 1})
        if twice:
            raise DesignError(f"{path}: {name} has {', '.join(twice)} twice")
    entries: dict[str, Any] = {**arrays, **words}
    return Motion(**entries)


def _checked(path: Path, name: str, array: np.ndarray) -> np.ndarray:
    """Return the array in the type that the format has for it.

    Raises:
        DesignError: it has another, or holds what is not finite.
    """
    if name in _WORDS or name == "contact_active":
        kind, what = ("b", "true and false") if name == "contact_active" else ("U", "words")
        if array.dtype.kind != kind:
            raise DesignError(f"{path}: {name} holds {array.dtype}, not {what}")
        return array
    if array.dtype.kind not in "fiu":
        raise DesignError(f"{path}: {name} holds {array.dtype}, not real numbers")
    if not np.all(np.isfinite(array)):
        raise DesignError(f"{path}: {name} holds a number that is not finite")
    if np.any(np.abs(array.astype(np.float64)) > LARGEST_NUMBER):
        raise DesignError(f"{path}: {name} holds a number too large for anything of a hand")
    return array.astype(np.float64)


def read_record(path: Path) -> dict[str, Any]:
    """Read ``result.json``.

    Raises:
        DesignError: it is not JSON, gives a name twice, holds a number that is not finite, or is of another format.
    """
    record = read_json(path)
    if not isinstance(record, dict) or record.get("format") != 1 or isinstance(record.get("format"), bool):
        raise DesignError(f"{path}: not a result of format 1")
    return record


def as_array(value: Any, shape: tuple[int, ...]) -> np.ndarray | None:
    """Return what JSON holds as an array of this shape, or None where it is anything else.

    Args:
        value: from a record.
        shape: ``()`` for one number.
    """
    if not shape:
        good = isinstance(value, int | float) and not isinstance(value, bool) and abs(value) <= LARGEST_NUMBER
        return np.array(float(value)) if good else None
    if not isinstance(value, list) or len(value) != shape[0]:
        return None
    rows = [as_array(item, shape[1:]) for item in value]
    return None if any(row is None for row in rows) else np.array(rows, dtype=float)


def entry(value: Any, *names: str | int) -> Any:
    """Return what a record holds at a path of names and places, or None where it holds no such thing."""
    for name in names:
        if isinstance(name, int):
            value = value[name] if isinstance(value, list) and name < len(value) else None
        else:
            value = value.get(name) if isinstance(value, dict) else None
    return value


def brief(value: Any) -> str:
    """An entry in a few words, however long it is."""
    text = "none" if value is None else str(value)
    return text if len(text) <= 60 else f"{text[:57]}…"


def same(one: Any, other: Any, tolerance: float = 1e-6) -> bool:
    """Whether numbers or arrays agree to a share of the second's size; what is none agrees with nothing."""
    if one is None or other is None:
        return False
    b = np.asarray(other, dtype=float)
    a = np.asarray(one, dtype=float) if isinstance(one, np.ndarray | np.generic) else as_array(one, b.shape)
    if a is None or a.shape != b.shape:
        return False
    return bool(np.all(np.abs(a - b) <= tolerance * max(np.max(np.abs(b), initial=0.0), 1e-12)))
