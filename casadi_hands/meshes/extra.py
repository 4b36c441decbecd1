"""Libraries that only some meshes need."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from casadi_hands.errors import MeshError


def needed(library: str, what: str) -> Any:
    """Import a library of the extra ``[mesh]``.

    Args:
        library: its module.
        what: of the user's needs it, for the message.

    Raises:
        MeshError: it is not installed.
    """
    try:
        return import_module(library)
    except ImportError:
        name = library.replace("_", "-")
        raise MeshError(what, f"with {name} installed: pip install 'casadi-hands[mesh]'") from None
