"""Weights and solver options of the refinement, step by step."""

from __future__ import annotations

from dataclasses import replace

from casadi_hands.nlp import Options
from casadi_hands.terms.catalogue import single, terms_of

_NEAR = (("nlp_scaling_method", "none"), ("bound_push", 1e-6), ("bound_frac", 1e-6))
_MOST = 1e7  # of a multiplier; a regular one was seen to reach a tenth of that
# Barriers are monotone: an adaptive one was seen to leap away from good starts. Small ones stay near them, where a
# large one first wanders to the middle of all bounds and back; too small ones crawl along every bound they meet.
PENALTY = Options(150, tol=1e-3, acceptable_tol=1e-2, mu_init=1e-3, most_multiplier=_MOST, extra=_NEAR)
STIFF_PENALTY = replace(PENALTY, constr_viol_tol=1e-6, mu_init=1e-4)
MET = 1e-8  # largest violation with which a solve may end before it is optimal, where it must be exact
HARD_CONSTRAINTS = replace(
    STIFF_PENALTY,
    max_iter=300,
    tol=1e-4,
    acceptable_tol=1e-3,
    constr_viol_tol=1e-10,
    extra=(*_NEAR, ("acceptable_constr_viol_tol", MET)),
)
# From an exact motion of the same margins: a larger barrier would first push it off every bound that it rests on.
NEARBY = replace(HARD_CONSTRAINTS, max_iter=40, mu_init=1e-5)
# Where the best of all motions takes long to find, one that is good and nearly exact has an exact one very near it.
_LOOSE = (("dual_inf_tol", 1e3), ("compl_inf_tol", 1e-3))
GOOD = replace(NEARBY, max_iter=60, tol=0.3, acceptable_tol=0.3, constr_viol_tol=1e-4, extra=(*_NEAR, *_LOOSE))
RESTORATION = replace(NEARBY, max_iter=60)
ACCEPTED = 1e-7  # largest violation with which a refined motion is handed on
HOPELESS = 0.1  # lengths of slip: where stiff penalties leave more, rolling is out of the structure's reach
# Of the first penalty's slip: where the stiff one leaves more than hopeless, but less than this, it goes on.
FALLING = 0.5
WEIGHTS = {term.name: single(term.weights["refine"].default) for term in terms_of("refine")}
# Of soft fingertips, step by step: what spin weighs, and the rate (rad/s) beyond which contacts count as spinning.
# One that spins resists nothing more, so that errors turn the object as far as they like; but first it must roll.
SPIN_WEIGHT = {"penalty": 0.05, "stiff penalty": 0.2, "stiffer penalty": 0.2, "hard constraints": 0.2}
SPIN_SCALE = {"penalty": 0.5, "stiff penalty": 0.3, "stiffer penalty": 0.3, "hard constraints": 0.3}
# The same rate of hard constraints at first, sharpened once, and twice, where slow spins matter.
SHARP = (SPIN_SCALE["hard constraints"], 0.1, 0.03)
STIFF = {"slip": 100.0, "passive_force": 30.0}
STIFFER = STIFF | {"slip": 1000.0}
HARD = {"slip": 100.0}  # its tolerance is there for where it is needed
Step = tuple[str, dict[str, float], Options]
ALL_STEPS: tuple[Step, ...] = (
    ("penalty", WEIGHTS, PENALTY),
    ("stiff penalty", WEIGHTS | STIFF, STIFF_PENALTY),
    ("stiffer penalty", WEIGHTS | STIFFER, STIFF_PENALTY),
    ("hard constraints", WEIGHTS | HARD, HARD_CONSTRAINTS),
)
# From an exact motion to one nearby; the first step can be left out where joints can follow and actuate the forces.
NEARBY_STEPS: tuple[Step, ...] = (ALL_STEPS[1], ALL_STEPS[-1])
# From an exact motion of independent joints to one whose commands are on few lines; what takes longer is not near.
COUPLING_STEPS: tuple[Step, ...] = (
    ALL_STEPS[1],
    ("hard constraints", WEIGHTS | HARD, replace(HARD_CONSTRAINTS, max_iter=80)),
)
# To such a one from a motion that is not exact.
COUPLING_FROM_AFAR: tuple[Step, ...] = (ALL_STEPS[0], *COUPLING_STEPS)
LAST_STEP: tuple[Step, ...] = NEARBY_STEPS[-1:]
# Of the slip with which friction is on its cone: with penalties, and of hard constraints one after another from there.
VISCOUS = 100.0
SHARPER = (VISCOUS, 30.0, 10.0, 3.0, 1.0)
RENEWED_STEPS: tuple[Step, ...] = (("hard constraints", WEIGHTS | HARD, NEARBY),)


# Times of what commands may be off their lines at last, of hard constraints one after another.
CLOSER = (2000.0, 300.0, 30.0, 1.0)


def closing(steps: tuple[Step, ...]) -> tuple[tuple[Step, float], ...]:
    """Steps for joints that share motors, each with what multiplies how far commands may be off their lines."""
    return (*((step, 1.0) for step in steps[:-1]), *((steps[-1], scale) for scale in CLOSER))


def graded(steps: tuple[Step, ...]) -> tuple[tuple[Step, float], ...]:
    """Steps for contacts that may slide, each with what multiplies the slip with which friction is on its cone.

    Where nothing tells yet which contacts slide, and which way, friction is viscous at first and sharper step by step.
    """
    scales = SHARPER if len(steps) > 1 else SHARPER[-1:]
    last = steps[-1]
    return (*((step, VISCOUS) for step in steps[:-1]), *((last, scale) for scale in scales))
