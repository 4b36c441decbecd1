"""MuJoCo, loaded where it is needed."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from casadi_hands.errors import HandsError


def load_mujoco() -> Any:
    """The module ``mujoco``.

    Raises:
        HandsError: it is not installed, or cannot be loaded; the message says which.
    """
    try:
        return import_module("mujoco")
    # With itself it loads the OpenGL that MUJOCO_GL names, which raises whatever it likes.
    except Exception as error:
        if isinstance(error, ModuleNotFoundError) and error.name == "mujoco":
            raise HandsError("replay needs MuJoCo: pip install mujoco") from None
        raise HandsError(
            f"MuJoCo cannot be loaded ({one_line(error)}); try MUJOCO_GL=egl or MUJOCO_GL=osmesa, or MUJOCO_GL=disable "
            "without a video"
        ) from None


def one_line(error: Exception) -> str:
    """An error's words without line breaks."""
    return " ".join(str(error).split())
