"""A person's own terms in the stages: one kernel for all of a stage, evaluated at every sample after all else."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np
from casadi import SX
from numpy.typing import ArrayLike, NDArray

from casadi_hands.motion import rotation_matrix
from casadi_hands.motion.pose import placed
from casadi_hands.nlp import Kernel, Problem, Rows, Solution
from casadi_hands.problem.model import Model
from casadi_hands.terms.own import OWN_STAGES, Bound, Cost, Instant, OwnTerm

Array = NDArray[np.float64]
KERNEL = "own"
# By how much a soft stage's solution may miss a bound, in the residual's unit: all that such a stage asks for is soft.
SOFTLY_MET = 1e-3
_UNITS = "unit_length", "unit_force"


def own_terms(model: Model, stage: str) -> tuple[OwnTerm, ...]:
    """Those of a stage."""
    return tuple(term for term in model.own_terms if term.stage == stage)


def own_weights(model: Model, stage: str) -> dict[str, float]:
    """The weight of each cost of a stage."""
    return {term.name: float(term.weight) for term in own_terms(model, stage) if isinstance(term, Cost)}


def try_out(model: Model, most_joints: int) -> None:
    """Evaluate every residual once on symbols, so that mistakes in them show before hours of work, not after them.

    Args:
        model: the task with the terms.
        most_joints: of a finger, which each is taken to have.
    """
    for stage in OWN_STAGES:
        if terms := own_terms(model, stage):
            fingers = {} if stage == "floating" else dict.fromkeys(model.contact_names, most_joints)
            kernel = own_kernel(terms, contact_names(model), fingers, by_invariants=stage != "refine")
            # Refuses symbols that are no instant's.
            given = [kernel.variables, kernel.parameters]
            ca.Function("tried", given, [*kernel.terms.values(), *kernel.constraints.values()])


def contact_names(model: Model) -> tuple[str, ...]:
    """Of all contacts; the ground's, if any, is the last."""
    return model.contact_names if model.ground is None else (*model.contact_names, "ground")


def bind_own(
    problem: Problem,
    model: Model,
    stage: str,
    contacts: Sequence[str],
    angles: Mapping[int, Rows],
    **rows: Rows,
) -> Kernel | None:
    """Bind the terms of a stage to its samples, if there are any.

    Args:
        problem: all else is bound to.
        model: the task with the terms.
        stage: its name.
        contacts: names of those whose points and forces are read, in their order.
        angles: of each finger's joints, by the index of its contact.
        rows: ``pose`` (S, 6), ``point`` and ``force`` (S, 3C), and where forces act by them contact invariants
            ``invariant`` (S, C).

    Returns:
        The kernel, or None.
    """
    terms = own_terms(model, stage)
    if not terms:
        return None
    fingers = {model.contact_names[c]: each.width for c, each in angles.items()}
    kernel = own_kernel(terms, contacts, fingers, "invariant" in rows)
    problem.parameter("time", (rows["pose"].count, 1))
    for name in _UNITS:
        problem.parameter(name, (1, 1))
    problem.bind(
        kernel,
        {term.name: (_column(term.lower), _column(term.upper)) for term in terms if isinstance(term, Bound)},
        **rows,
        angles=list(angles.values()),
        **problem.given("reference", "time", *_UNITS),
    )
    return kernel


def own_values(problem: Problem, model: Model) -> dict[str, Array | float]:
    """Values of the parameters that ``bind_own`` declared, if it did."""
    if _UNITS[0] not in problem.parameters:
        return {}
    return {
        "time": model.schedule.samples[:, None],
        "unit_length": model.units.length,
        "unit_force": model.units.force,
    }


def own_missed(solution: Solution, most: float = SOFTLY_MET) -> dict[str, tuple[int, float]]:
    """Bounds that a solution misses by more than ``most``: the sample where that is worst, and by how much."""
    missed = {}
    for name, excess in solution.excess.items():
        block, _, bound = name.partition(".")
        if block == KERNEL and not excess.max(initial=0.0) <= most:
            by_sample = excess.max(axis=1)
            missed[bound] = int(by_sample.argmax()), float(by_sample.max())
    return missed


def own_kernel(
    terms: Sequence[OwnTerm], contacts: Sequence[str], fingers: Mapping[str, int], by_invariants: bool
) -> Kernel:
    """The terms at one sample.

    Args:
        terms: of one stage.
        contacts: their names.
        fingers: joints of each finger, by the name of its contact.
        by_invariants: whether forces act by contact invariants.

    Raises:
        TypeError: a residual is no expression.
        ValueError: a bound does not fit its residual.
    """
    kernel, count = Kernel(KERNEL), len(contacts)
    pose, reference = kernel.variable("pose", 6), kernel.parameter("reference", 4)
    points, forces = (ca.reshape(kernel.variable(name, 3 * count), 3, count) for name in ("point", "force"))
    invariant = kernel.variable("invariant", count) if by_invariants else SX.ones(count, 1)
    angles = {
        name: kernel.variable(f"angles{i}", joints, "angles", i) for i, (name, joints) in enumerate(fingers.items())
    }
    time, length, force = (kernel.parameter(name) for name in ("time", *_UNITS))
    position, quaternion = placed(pose, reference)
    rotation = rotation_matrix(quaternion)
    instant = Instant(
        time=time,
        position=length * position,
        rotation=rotation,
        points={name: length * points[:, i] for i, name in enumerate(contacts)},
        forces={name: force * invariant[i] * ca.mtimes(rotation, forces[:, i]) for i, name in enumerate(contacts)},
        angles=angles,
    )
    for term in terms:
        residual = _residual(term, instant)
        if isinstance(term, Cost):
            kernel.cost(term.declared, residual)
        else:
            kernel.constrain(term.declared, residual)
    return kernel


def _residual(term: OwnTerm, instant: Instant) -> SX:
    """A term's residual as a column (n,)."""
    given = term.residual(instant)
    if isinstance(given, list | tuple):
        given = ca.vertcat(*given)
    if not isinstance(given, SX) or given.is_empty():
        raise TypeError(f"the residual of '{term.name}' gives {given!r}, not an expression of the instant's symbols")
    column = ca.densify(ca.vec(given))
    if isinstance(term, Bound):
        for bound in (term.lower, term.upper):
            if np.size(bound) not in (1, column.numel()):
                raise ValueError(f"the bounds of '{term.name}' are for {np.size(bound)} entries, not {column.numel()}")
    return column


def _column(bound: ArrayLike) -> Array:
    """A bound of a residual's entries, column by column as these are."""
    return np.asarray(bound, float).reshape(-1, order="F")
