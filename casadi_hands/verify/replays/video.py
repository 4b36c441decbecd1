"""A film of a replay."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import HandsError
from casadi_hands.verify.reading.folder import Folder, read_folder
from casadi_hands.verify.replays.engine import load_mujoco, one_line
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.replay import Replay, replay

FRAMES = 30
"""Per second."""

SIZE = (480, 640)
"""Height and width, pixels."""


def film(directory: str | Path, file: str | Path, perturbation: Perturbation | None = None) -> Replay:
    """Replay a result folder once and write what it looks like to a video or GIF file.

    Raises:
        HandsError: MuJoCo cannot be loaded or draw here, it or imageio is not installed, or the file cannot be
            written; the message says which.
        DesignError: as `replay`.
    """
    imageio, mujoco = _imageio(), load_mujoco()
    camera = _Camera(mujoco, read_folder(directory))
    try:
        outcome = replay(directory, perturbation, camera)
    finally:
        camera.close()
    try:
        imageio.mimsave(file, camera.frames, fps=FRAMES)
    # imageio passes on what its plugins raise: a LookupError for a still picture's format, say.
    except (OSError, ValueError, LookupError) as error:
        raise HandsError(
            f"{file}: cannot be written as a video: {one_line(error)}; try a .mp4 or .gif in another folder"
        ) from None
    return outcome


class _Camera:
    """Draws the scene thirty times a second, from the side and far enough to see palm and object."""

    def __init__(self, mujoco: Any, folder: Folder) -> None:
        self._mujoco = mujoco
        motion = folder.motion
        points = np.vstack([motion.object_position, motion.base_position])
        self.frames: list[np.ndarray] = []
        self._view = mujoco.MjvCamera()
        self._view.lookat[:] = 0.5 * (points.min(axis=0) + points.max(axis=0))
        self._view.distance = 1.6 * float(np.ptp(points, axis=0).max()) + 4.0 * folder.length
        self._view.azimuth, self._view.elevation = 120.0, -15.0
        self._renderer: Any = None

    def __call__(self, model: Any, data: Any) -> None:
        """Draw if the next frame is due."""
        if data.time * FRAMES < len(self.frames):
            return
        if self._renderer is None:
            self._renderer = _renderer(self._mujoco, model)
        self._renderer.update_scene(data, self._view)
        self.frames.append(self._renderer.render())

    def close(self) -> None:
        """Give the graphics context back."""
        if self._renderer is not None:
            self._renderer.close()


def _imageio() -> Any:
    try:
        return import_module("imageio")
    except ImportError:
        raise HandsError("a video needs imageio: pip install 'casadi-hands[video]'; replay works without") from None


def _renderer(mujoco: Any, model: Any) -> Any:
    try:
        return mujoco.Renderer(model, *SIZE)
    # What a missing OpenGL raises depends on the platform and on MuJoCo's backend.
    except Exception as error:
        raise HandsError(
            f"MuJoCo cannot draw here ({one_line(error)}); try MUJOCO_GL=egl or MUJOCO_GL=osmesa; replay works without"
        ) from None
