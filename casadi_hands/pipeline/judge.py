"""The status that a design earns, by the audit of its files, and why it earns no better."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property
from pathlib import Path
from typing import Any

from casadi_hands.diagnosis.figures import (
    GRASP_ADVICE,
    friction_reason,
    missed_figures,
    motor_remedy,
    speed_reason,
    torque_reason,
)
from casadi_hands.diagnosis.impossible import LEAST_INERTIA
from casadi_hands.diagnosis.reason import Reason, format_reasons
from casadi_hands.export.design import Design
from casadi_hands.export.folder import write_files
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand import Hand
from casadi_hands.problem.model import Model
from casadi_hands.problem.motion import Motion
from casadi_hands.verify import audit_files, run_replays
from casadi_hands.verify.replays.simulation import UnplayableError
from casadi_hands.verify.report import Audit

STRAINED = 0.8  # of the motors' torque: a plan that asks for more leaves them little for what it does not know
# Beyond these, where they are also beyond the limits, a motion is none: characteristic lengths, degrees, m·g.
FEASIBLE = {
    "goal_position": 0.02,
    "goal_angle": 1.0,
    "residual": 0.1,
    "friction_excess": 0.05,
    "gap": 0.02,
    "penetration": 0.04,
}
_PLAYABLE = f"a larger or a heavier object: MuJoCo moves no body whose inertia is less than {LEAST_INERTIA:g} kg·m²"
_LENGTHS = ("goal_position", "gap", "penetration")


def counted(design: Design) -> Design:
    """The design, where its task asks for a number of motors, with its own in the certificate.

    Args:
        design: judged. With more motors it is certified no more, and the reason says so, unless it has another.
    """
    asked, hand = design.task.motors, design.hand
    if not isinstance(asked, int) or hand is None or not design.certificate:
        return design
    where, holds = f"the hand has {hand.motors} motors, the task asks for {asked} (motors)", hand.motors <= asked
    figure = {"value": float(hand.motors), "limit": float(asked), "holds": holds, "unit": "", "where": where}
    design = replace(design, certificate={**design.certificate, "motors": figure})
    if holds or design.status != "certified":
        return design
    return replace(design, status="feasible", reason=design.reason or where)


class Judge:
    """Judges the designs of one solve.

    Args:
        model: the task.
        floating: the motion that all of its hands follow.
        scratch: folder for files that are judged; the system's by default.
    """

    def __init__(self, model: Model, floating: Floating, scratch: Path | None = None) -> None:
        self.model, self.floating, self.scratch = model, floating, scratch
        self._last: tuple[Hand | None, Motion | None, Audit] | None = None

    @cached_property
    def _friction(self) -> Reason | None:
        return friction_reason(self.model, self.floating)

    def judge(self, design: Design, causes: Sequence[Reason], planned: Design | None = None) -> Design:
        """The design with the certificate of an audit of its files, the status it earns by that, and the reasons.

        Replays may still take `certified` from it.

        Args:
            design: with a hand and a motion.
            causes: what the stages found wanting.
            planned: the hand with its motion before it was refined in vain, which may have left it far from any
                motion: by this one motors are judged. The design itself by default.
        """
        verdict = self.audited(design)
        certificate = verdict.as_certificate()
        if verdict.certified:
            return replace(design, status="certified", reason="", certificate=certificate)
        planned = planned or design
        first = [self._friction, torque_reason(self.model, planned), speed_reason(self.model, planned)]
        reason = format_reasons([*filter(None, first), *causes], missed_figures(design, verdict))
        possible = all(self._feasible(name, certificate[name]) for name in FEASIBLE if name in certificate)
        return replace(design, status="feasible" if possible else "failed", reason=reason, certificate=certificate)

    def replayed(self, design: Design, jobs: int = 1) -> Design:
        """The design with what replays in MuJoCo say of it: more figures, and the status and reason that follow.

        Args:
            design: judged before.
            jobs: processes for the replays.
        """
        with tempfile.TemporaryDirectory(dir=self.scratch) as files:
            write_files(design, Path(files), page=False)
            try:
                tried = run_replays(files, jobs=jobs)
            except UnplayableError as error:
                reason = format_reasons([Reason(f"it cannot be replayed, as MuJoCo says: {error.words}", _PLAYABLE)])
                return design if design.status == "failed" else replace(design, status="feasible", reason=reason)
        figures = {figure.name: figure for figure in tried.figures()}
        seen = Audit(design.task.name, figures, ())
        judged = replace(design, certificate={**design.certificate, **seen.as_certificate()}, replays=[tried.record()])
        if design.status != "certified" or seen.certified:
            return judged
        causes = []
        if (lost := tried.dropped_before()) is not None:
            what, advice = f"{lost}, with nothing perturbed", GRASP_ADVICE
            if (share := design.share_of_torque) > STRAINED:
                what += f"; as planned the motors already give {100 * share:.0f} % of their torque"
                advice = f"stronger motors (actuator.torque), a lighter object, {advice}"
            causes = [Reason(what, advice, frozenset(figures))]
        return replace(judged, status="feasible", reason=format_reasons(causes, missed_figures(design, seen)))

    def concluded(self, design: Design, jobs: int = 1) -> Design:
        """The design as it is handed over: replayed, and where motors keep it from its goals, told which would do."""
        if design.status == "failed" or design.hand is None or design.motion is None:
            return design
        judged = design if design.replays else self.replayed(design, jobs)
        if not judged.missed_in_replays or judged.missed != judged.missed_in_replays:
            return judged
        with tempfile.TemporaryDirectory(dir=self.scratch) as files:
            write_files(judged, Path(files), page=False)
            remedy = motor_remedy(files, judged)
        return judged if remedy is None else replace(judged, reason=f"{judged.reason}. {remedy}")

    def audited(self, design: Design) -> Audit:
        """What the audit finds in a design's files; of the same hand and motion as the last time, what it found."""
        if self._last is None or self._last[0] is not design.hand or self._last[1] is not design.motion:
            with tempfile.TemporaryDirectory(dir=self.scratch) as scratch:
                write_files(design, Path(scratch), page=False)
                found = audit_files(scratch)
            # How many motors are asked for is counted at last: a hand with more is where fewer are looked for from.
            if "motors" in found.figures:
                others = {name: figure for name, figure in found.figures.items() if name != "motors"}
                found = replace(found, figures=others)
            self._last = design.hand, design.motion, found
        return self._last[2]

    def _feasible(self, name: str, figure: dict[str, Any]) -> bool:
        limit = FEASIBLE[name] * (self.model.units.length if name in _LENGTHS else 1.0)
        return bool(figure["holds"] or (figure["value"] is not None and figure["value"] <= limit))
