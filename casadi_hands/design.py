"""The result of a solve as one object: the hand, its motion, and what was measured of them."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    import numpy as np

    from casadi_hands.task import Task


@dataclass(frozen=True)
class Link:
    """One finger segment: a capsule along its frame's z axis, from the joint to ``(0, 0, length)``.

    Attributes:
        length: length of the capsule's axis, m.
        radius: radius of the capsule, m.
        axis: (3,) unit vector of the joint at the segment's start, in the parent frame. At zero angle
            every link frame is parallel to the palm's.
    """

    length: float
    radius: float
    axis: tuple[float, float, float]


@dataclass(frozen=True)
class Finger:
    """A serial finger on the palm.

    Attributes:
        name: the task's name of the finger and its contact.
        base: (3,) position of the first joint in the palm frame, m; on the palm's surface, z = 0.
        links: segments from the palm outwards.
    """

    name: str
    base: tuple[float, float, float]
    links: tuple[Link, ...]


@dataclass(frozen=True)
class Hand:
    """A palm disc and its fingers; the palm's frame has its origin on the surface and z where fingers point.

    Attributes:
        palm_radius: m.
        palm_thickness: m; the disc reaches from z = -thickness to z = 0.
        fingers: in the order of the task's fingers.
        joint_lower, joint_upper: limits of every joint, rad.
        effort: torque limit of every joint, N·m.
        velocity: speed limit of every joint, rad/s.
        density: of links and palm, kg/m³, from which masses and inertias follow.
    """

    palm_radius: float
    palm_thickness: float
    fingers: tuple[Finger, ...]
    joint_lower: float
    joint_upper: float
    effort: float
    velocity: float
    density: float

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of the motion's angles."""
        return tuple(f"finger{i}_joint{j}" for i, finger in enumerate(self.fingers) for j in range(len(finger.links)))

    @property
    def degrees_of_freedom(self) -> int:
        """Number of joints in the hand."""
        return sum(len(finger.links) for finger in self.fingers)


@dataclass(frozen=True)
class Motion:
    """The arrays of ``motion.npz``: same names, shapes, units and frames (see ``docs/result-folder.md``).

    Commands are None until there is a hand, and in files of versions that did not write them; what is disturbed is None
    where the task names no perturbation.
    """

    time: np.ndarray
    object_position: np.ndarray
    object_orientation: np.ndarray
    base_position: np.ndarray
    base_orientation: np.ndarray
    joint_angles: np.ndarray
    joint_names: tuple[str, ...]
    contact_names: tuple[str, ...]
    contact_link: tuple[str, ...]
    contact_active: np.ndarray
    contact_force: np.ndarray
    contact_point_object: np.ndarray
    contact_point_link: np.ndarray
    external_force: np.ndarray
    external_torque: np.ndarray
    joint_velocities: np.ndarray | None = None
    joint_torques: np.ndarray | None = None
    joint_commands: np.ndarray | None = None
    contact_force_disturbed: np.ndarray | None = None
    external_force_disturbed: np.ndarray | None = None
    external_torque_disturbed: np.ndarray | None = None


@dataclass(frozen=True)
class Design:
    """A designed hand, the motion it makes, and how it came about.

    Attributes:
        task: the task as solved, every default filled in.
        status: ``certified``, ``feasible`` or ``failed``.
        reason: why, in the user's terms, when not certified; else empty.
        hand: None when no stage has designed one.
        motion: None when no stage has computed one.
        costs: stage -> term -> ``{"weight": w, "value": weighted value}``.
        certificate: figure -> ``{"value": v, "limit": l, "holds": bool}``.
        replays: one entry for each physics engine that played the design; see ``docs/result-folder.md``.
        stages: one entry for each solver run.
        seconds: wall time by stage, and ``total``.
    """

    task: Task
    status: str
    reason: str = ""
    hand: Hand | None = None
    motion: Motion | None = None
    costs: dict[str, dict[str, dict[str, float]]] = field(default_factory=dict)
    certificate: dict[str, dict[str, Any]] = field(default_factory=dict)
    replays: list[dict[str, Any]] = field(default_factory=list)
    stages: list[dict[str, Any]] = field(default_factory=list)
    seconds: dict[str, float] = field(default_factory=dict)

    @property
    def missed(self) -> set[str]:
        """The figures of the certificate that do not hold."""
        return {name for name, figure in self.certificate.items() if not figure["holds"]}

    @property
    def missed_in_replays(self) -> set[str]:
        """Those of them that replays measured: all else may hold, and the hand still not work."""
        return {name for name in self.missed if name.startswith("replay_")}

    @property
    def drops(self) -> int | None:
        """Perturbed replays that drop the object; all where the one as planned does, None where there were none."""
        if not self.replays:
            return None
        first = self.replays[0]
        return int(first["of"] if first["dropped_as_planned"] else first["dropped"])

    @property
    def replay_words(self) -> str:
        """What the replays said, in a line; empty where there were none."""
        if not self.replays:
            return ""
        first = self.replays[0]
        planned = "drops the object as planned"
        if not first["dropped_as_planned"]:
            planned = f"{first['mean']['mm']:.2g} mm and {first['mean']['degrees']:.2g}° off plan on average"
        return f"in MuJoCo {planned}, {first['dropped']} of {first['of']} perturbed replays drop it"

    def save(self, directory: str | Path) -> None:
        """Write the result folder; a partial design writes the files for which there is something to write.

        Args:
            directory: made if it does not exist; files of an earlier design in it are replaced.

        Raises:
            DesignError: the folder cannot be written, or the design holds what cannot be.
        """
        # The writers know the data types above, not the other way round; hence the late import.
        from casadi_hands.export.folder import save_design

        save_design(self, Path(directory))

    @classmethod
    def load(cls, directory: str | Path) -> Design:
        """Read a result folder that `save` wrote.

        Args:
            directory: the folder.

        Raises:
            DesignError: there is no such folder, it is incomplete, or of another format.
        """
        from casadi_hands.export.folder import load_design

        return load_design(Path(directory))
