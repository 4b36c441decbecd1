"""The result of a solve: the hand, its motion, and what was measured of them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from casadi_hands.task import Task
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.motion import Motion


@dataclass(frozen=True)
class Result:
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
        placement: where the program placed contacts, the sets it chose from and why, and where it placed the palm, how
            that stands; empty where all was given.
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
    placement: dict[str, Any] = field(default_factory=dict)

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
        return int(first["of"] if self.drops_as_planned else first["dropped"])

    @property
    def drops_as_planned(self) -> bool:
        """Whether the object is dropped even with nothing perturbed."""
        return bool(self.replays) and bool(self.replays[0]["dropped_as_planned"])

    @property
    def least_stiffness(self) -> float:
        """Stiffness of the joints, N·m/rad, that the planned grasp asks for; 0 where that was not measured."""
        return float(self.certificate.get("least_stiffness", {}).get("value") or 0.0)

    @property
    def share_of_torque(self) -> float:
        """Of what the task's motors give, that the plan asks for at most; 0 where the task names no motors' torque."""
        figure = self.certificate.get("torque", {})
        return float(figure.get("value") or 0.0) if figure.get("unit") == "share" else 0.0

    @property
    def replay_angle(self) -> float:
        """Degrees by which the object is off a goal at most in the replay as planned; 0 where there was none."""
        return float(self.certificate.get("replay_angle", {}).get("value") or 0.0)

    @property
    def replay_words(self) -> str:
        """What the replays said, in a line; empty where there were none."""
        if not self.replays:
            return ""
        first = self.replays[0]
        planned = "drops the object as planned"
        if not self.drops_as_planned:
            mean = {unit: math.nan if value is None else value for unit, value in first["mean"].items()}
            planned = f"{mean['mm']:.2g} mm and {mean['degrees']:.2g}° off plan on average"
        dropping = [name for name, each in first.get("perturbed", {}).items() if each["dropped"]]
        return (
            f"in MuJoCo {planned}, {first['dropped']} of {first['of']} perturbed replays drop it{first_few(dropping)}"
        )


def first_few(names: Sequence[str], most: int = 3) -> str:
    """Names in brackets after a space, no more than so many of them; nothing of none."""
    return f" ({', '.join([*names[:most], *(['…'] if len(names) > most else [])])})" if names else ""
