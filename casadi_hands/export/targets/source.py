"""What every export starts from: a design that is complete, and the folder that names it in messages."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from casadi_hands.errors import DesignError, HandsError
from casadi_hands.export.commands import commanded
from casadi_hands.export.design import Design
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.motion import Motion
from casadi_hands.task import Task

_COMMANDS = ("joint_velocities", "joint_torques", "joint_commands")


@dataclass(frozen=True)
class Source:
    """A design with a hand and a motion whose joints have commands.

    Attributes:
        task: what was solved.
        hand: designed for it.
        motion: of that hand.
        velocities: (S, J) of the joints, rad/s.
        commands: (S, J) set points of the joints, rad, each with a drive of its own, also where motors share them.
    """

    task: Task
    hand: Hand
    motion: Motion
    velocities: np.ndarray
    commands: np.ndarray

    @classmethod
    def read(cls, directory: Path) -> Source:
        """Read a result folder.

        Args:
            directory: what `casadi-hands solve` wrote.

        Raises:
            DesignError: there is no such folder, it holds no hand that moves, or an earlier version wrote it.
        """
        design = Design.load(directory)
        if design.hand is None or design.motion is None:
            raise DesignError(
                f"{directory}: the design has no hand that moves yet, so there is nothing to export",
                "solve its task again, to the last stage",
            )
        for name in _COMMANDS:
            if getattr(design.motion, name) is None:
                raise DesignError(
                    f"{directory}: motion.npz has no {name}; it was made by an earlier version; "
                    f"`casadi-hands solve {directory / 'task.yaml'} --from {directory}` makes it anew",
                    "",
                )
        commands, velocities = design.motion.joint_commands, design.motion.joint_velocities
        if design.hand.drive is not None:
            # Damped where it stands, unlike a spring's damper, a joint's own drive must be told to make up for that.
            commands = commanded(design.task, replace(design.hand, drive=None), design.motion).joint_commands
        assert velocities is not None
        assert commands is not None
        return cls(design.task, design.hand, design.motion, velocities, commands)

    def welded_urdf(self) -> str:
        """The hand as URDF text, its palm fixed to the link ``world`` where it is when the motion starts."""
        pose = self.motion.base_position[0].tolist(), self.motion.base_orientation[0].tolist()
        # Its controllers turn every joint, also where motors share them: nothing mimics anything.
        return hand_urdf(replace(self.hand, drive=None), world=pose)


def write_texts(folder: Path, texts: dict[str, str], mark: str) -> None:
    """Write the files of an export into a folder; what else it holds is left alone.

    Args:
        folder: made if it does not exist.
        texts: path within the folder -> text.
        mark: the file by which an earlier export is known; without it, a folder that holds anything is refused.

    Raises:
        HandsError: the folder holds other things than an export, or cannot be written.
    """
    try:
        if folder.is_dir() and any(folder.iterdir()) and not _is_ours(folder / mark):
            raise HandsError(
                f"{folder}: holds other things than an earlier export; give --out a new or an empty folder"
            )
        for name, text in texts.items():
            path = folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise HandsError(f"{folder}: cannot write the export here: {error}; give another --out") from error


def _is_ours(path: Path) -> bool:
    return path.is_file() and "casadi-hands" in path.read_text(encoding="utf-8", errors="replace")
