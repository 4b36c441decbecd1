"""Which bounds of a person's own a stage's solution misses, as reasons."""

from __future__ import annotations

from casadi_hands.diagnosis.moment import moment
from casadi_hands.diagnosis.reason import Reason
from casadi_hands.nlp import Solution
from casadi_hands.problem.model import Model
from casadi_hands.stages.own_terms import SOFTLY_MET, own_missed, own_terms


def unmet_bounds(
    model: Model, stage: str, solution: Solution, most: float = SOFTLY_MET, before: str = ""
) -> tuple[Reason, ...]:
    """One reason for each bound that is missed by more than ``most``, in the residual's unit.

    Args:
        model: the task, with the stage's samples.
        stage: that the solution is of.
        solution: the stage's.
        most: that a bound may be missed by.
        before: the subject of the reason; by default the stage.
    """
    missed, reasons = own_missed(solution, most), []
    for term in own_terms(model, stage):
        if term.name in missed:
            sample, by = missed[term.name]
            when = moment(model.schedule, float(model.schedule.samples[sample]))
            what = f"{before or f'the stage {stage}'} cannot meet '{term.name}' at {when}, by {by:.2g}"
            reasons.append(Reason(what, "wider bounds, or goals that leave room for them"))
    return tuple(reasons)
