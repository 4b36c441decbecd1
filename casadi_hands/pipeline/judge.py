"""The status that a design earns, by the audit of its files, and why it earns no better."""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

from casadi_hands.design import Design
from casadi_hands.pipeline.words import friction_reason, missed_figures, speed_reason, torque_reason
from casadi_hands.reasons import Reason, tell
from casadi_hands.stages.floating import Floating
from casadi_hands.stages.model import Model
from casadi_hands.verify import audit

FEASIBLE = {  # beyond these, where they are also beyond the limits, a motion is none: m, degrees, m·g
    "goal_position": 0.001,
    "goal_angle": 1.0,
    "residual": 0.1,
    "friction_excess": 0.05,
    "gap": 0.001,
    "penetration": 0.002,
}


class Judge:
    """Judges the designs of one solve.

    Args:
        model: the task.
        floating: the motion that all of its hands follow.
    """

    def __init__(self, model: Model, floating: Floating) -> None:
        self.model, self.floating = model, floating

    @cached_property
    def _friction(self) -> Reason | None:
        return friction_reason(self.model, self.floating)

    def judge(self, design: Design, causes: Sequence[Reason], planned: Design | None = None) -> Design:
        """The design with the audit's certificate, the status it earns, and the reasons.

        Args:
            design: with a hand and a motion.
            causes: what the stages found wanting.
            planned: the hand with its motion before it was refined in vain, which may have left it far from any
                motion: by this one motors are judged. The design itself by default.
        """
        with tempfile.TemporaryDirectory() as scratch:
            design.save(scratch)
            verdict = audit(scratch)
        certificate = verdict.as_certificate()
        if verdict.certified:
            return replace(design, status="certified", reason="", certificate=certificate)
        planned = planned or design
        first = [self._friction, torque_reason(self.model, planned), speed_reason(self.model, planned)]
        reason = tell([*filter(None, first), *causes], missed_figures(design, verdict))
        figures = {name: certificate[name] for name in FEASIBLE if name in certificate}
        possible = all(f["holds"] or (f["value"] is not None and f["value"] <= FEASIBLE[n]) for n, f in figures.items())
        return replace(design, status="feasible" if possible else "failed", reason=reason, certificate=certificate)
