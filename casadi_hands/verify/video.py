"""A film of a replay."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from casadi_hands.errors import HandsError
from casadi_hands.verify.folder import Folder, read_folder
from casadi_hands.verify.perturb import Perturbation
from casadi_hands.verify.replay import Replay, replay

FRAMES = 30
"""Per second."""

SIZE = (480, 640)
"""Height and width, pixels."""


def film(directory: str | Path, file: str | Path, perturbation: Perturbation | None = None) -> Replay:
    """Replay a result folder once and write what it looks like to a video or GIF file.

    Raises:
        HandsError: MuJoCo cannot draw here, or imageio is not installed; the message says which.
        DesignError: as `replay`.
    """
    try:
        imageio = import_module("imageio")
    except ImportError:
        raise HandsError("a video needs imageio: pip install imageio imageio-ffmpeg; replay works without") from None
    camera = _Camera(read_folder(directory))
    try:
        outcome = replay(directory, perturbation, camera)
    finally:
        camera.close()
    try:
        imageio.mimsave(file, camera.frames, fps=FRAMES)
    except (OSError, ValueError) as error:
        raise HandsError(f"{file}: cannot be written as a video: {error}") from None
    return outcome


class _Camera:
    """Draws the scene thirty times a second, from the side and far enough to see palm and object."""

    def __init__(self, folder: Folder) -> None:
        import mujoco

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
            self._renderer = _renderer(model)
        self._renderer.update_scene(data, self._view)
        self.frames.append(self._renderer.render())

    def close(self) -> None:
        """Give the graphics context back."""
        if self._renderer is not None:
            self._renderer.close()


def _renderer(model: Any) -> Any:
    import mujoco

    try:
        return mujoco.Renderer(model, *SIZE)
    # What a missing OpenGL raises depends on the platform and on MuJoCo's backend.
    except Exception as error:
        message = f"MuJoCo cannot draw here ({error}); try MUJOCO_GL=egl or MUJOCO_GL=osmesa; replay works without"
        raise HandsError(message) from None
