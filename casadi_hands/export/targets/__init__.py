"""A design for other programs: each target writes a file or a folder that they read as it is.

A module of this folder that names its targets in ``TARGETS`` is found by itself.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

from casadi_hands.errors import HandsError
from casadi_hands.export.targets.source import Source
from casadi_hands.export.targets.target import Target

_MODULES = [import_module(f"{__name__}.{module.name}") for module in iter_modules(__path__)]
_FOUND: dict[str, Target] = {name: each for module in _MODULES for name, each in getattr(module, "TARGETS", {}).items()}
TARGETS = dict(sorted(_FOUND.items()))


def export_design(directory: str | Path, target: str, out: str | Path | None = None) -> Path:
    """Write a design for another program.

    Args:
        directory: a result folder.
        target: a name in `TARGETS`.
        out: the file (``csv``, ``urdf``) or the folder (``ros2``, ``usd``) to write; by default it is in
            ``directory/export``. An earlier export there is replaced.

    Returns:
        what was written: the file or the folder.

    Raises:
        DesignError: the folder is missing, incomplete or of an earlier version.
        HandsError: there is no such target, what it needs is not installed, or its place holds something else.
    """
    if target not in TARGETS:
        raise HandsError(f"there is no export to {target!r}; give one of {', '.join(TARGETS)}")
    kind = TARGETS[target]
    place = Path(out) if out is not None else Path(directory) / "export" / kind.default
    return kind.write(Source.read(Path(directory)), place)
