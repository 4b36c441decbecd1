"""What a finger that stays above the threshold cannot do, as a reason."""

from __future__ import annotations

from casadi_hands.diagnosis.moment import goal_at, moment
from casadi_hands.diagnosis.reason import Reason, joints_of
from casadi_hands.problem.model import Model
from casadi_hands.stages.synthesis.shortcoming import Shortcoming

# Figures that follow where a finger does not hold its contact, and where it is not even there.
WITHOUT_FORCE = frozenset(
    (
        "residual",
        "residual_between",
        "rest",
        "friction_excess",
        "torsion_excess",
        "torsion_shortfall",
        "slide_shortfall",
        "pull",
        "gap_between",
        "slip",
        "unsupplied_force",
        "disturbance_radius",
    )
)
# Stretched out for its contact a finger may well leave its joints' limits and, which is of the structure, the palm.
WITHOUT_CONTACT = WITHOUT_FORCE | {"gap", "penetration", "joint_limit", "structure"}


def shortcoming_reason(model: Model, found: Shortcoming) -> Reason:
    """Say what keeps a finger's score up."""
    who, joints = f"finger '{model.contact_names[found.contact]}'", joints_of(found.joints)
    length = 1e3 * model.units.length  # mm
    if found.kind == "press" or found.time is None:
        what = (
            f"{who} cannot press as its contact needs with {joints}: no joint actuates "
            f"{found.by:.2f} weights of the force, on average"
        )
        advice = "more joints (search.max_joints) or a contact that is pressed from another side"
        return Reason(what, advice, WITHOUT_FORCE)
    when = moment(model.schedule, found.time)
    if found.kind == "miss":
        what = f"{who} misses its contact by {found.by * length:.1f} mm at {when} with {joints}"
        advice = "more joints (search.max_joints), more trials or a contact nearer the palm"
        return Reason(what, advice, WITHOUT_CONTACT)
    where = when if goal_at(model.schedule, found.time) is not None else f"its contact at {when}"
    what = (
        f"{who} cannot reach {where} with {joints}: its contact is {found.by * length:.1f} mm beyond links of at most "
        f"{model.link_length[1] * length:.1f} mm each"
    )
    return Reason(what, "longer links (hand.link_length), a palm nearer by or a nearer goal", WITHOUT_CONTACT, True)
