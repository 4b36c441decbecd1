"""What stands where in a program, by name, with shapes, units, equations and magnitudes: data for JSON."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from casadi_hands.nlp.program import Program

Array = NDArray[np.float64]
ABOUT = {
    "nlp": "the objective and the constraints; what nlpsol takes",
    "grad_f": "the objective and its gradient",
    "jac_g": "the constraints and their Jacobian",
    "hess_lag": "the upper triangle of the Hessian of lam_f·f + lam_gᵀg; casadi.triu2symm makes it whole",
    "terms": "the objective, the constraints, and the weighted value of every term, in the order of 'terms'",
}


class Quantity(NamedTuple):
    """What a variable or parameter is, and its unit."""

    about: str
    unit: str


Quantities = Mapping[str, Quantity]


def program_index(program: Program, quantities: Quantities) -> dict[str, Any]:
    """All of a program but its functions and arrays.

    ``positions`` are nested as the named array is: ``x[positions]`` is that array.

    Args:
        program: described.
        quantities: what each variable and parameter is, by name; those left out are described by their name alone.
    """
    start = program.at_start
    return {
        "casadi": ca.CasadiMeta.version(),
        "sizes": _sizes(program),
        "start": {"objective": _finite(start.f), "violation": _finite(start.beyond.max(initial=0.0))},
        "functions": {
            name: {
                "file": f"{name}.casadi",
                "inputs": function.name_in(),
                "outputs": function.name_out(),
                "about": ABOUT[name],
            }
            for name, function in program.functions.items()
        },
        "terms": _terms(program),
        "variables": _variables(program, quantities),
        "constraints": _constraints(program),
        "parameters": {
            name: _array(name, program.problem.parameters[name], quantities)
            for name in program.problem.parameters.names()
        },
    }


def _sizes(program: Program) -> dict[str, int]:
    equations = program.lbg == program.ubg
    free = np.isinf(program.lbg) & np.isinf(program.ubg)
    return {
        "variables": len(program.x0),
        "fixed_variables": int((program.lbx == program.ubx).sum()),
        "parameters": len(program.p),
        "constraints": len(program.lbg),
        "equations": int(equations.sum()),
        "inequalities": int((~equations & ~free).sum()),
        "terms": len(program.problem.terms),
        "jacobian_nonzeros": program.functions["jac_g"].nnz_out("jac_g_x"),
        "upper_hessian_nonzeros": program.functions["hess_lag"].nnz_out("triu_hess_gamma_x_x"),
    }


def _array(name: str, positions: NDArray[np.int64], quantities: Quantities) -> dict[str, Any]:
    about, unit = quantities.get(name, Quantity("", ""))
    return {"about": about, "unit": unit, "shape": list(positions.shape), "positions": positions.tolist()}


def _terms(program: Program) -> dict[str, dict[str, Any]]:
    problem, found = program.problem, {}
    declared = problem.declared_terms
    for name in problem.terms:
        term = declared[name]
        found[name] = {
            "about": term.about,
            "equation": term.equation,
            "unit": term.unit,
            "form": term.form,
            "weight": float(program.p[problem.parameters[f"weight.{name}"][0]]),
            "value_at_start": _finite(program.at_start.terms[name]),
        }
    return found


def _variables(program: Program, quantities: Quantities) -> dict[str, dict[str, Any]]:
    """With magnitudes: of values and bounds, of the gradient, and of the Jacobian's columns at the start."""
    start, layout = program.at_start, program.problem.variables
    columns = _largest(start.jacobian.tocoo(), 1)
    found = {}
    for name in layout.names():
        at = layout[name]
        found[name] = {
            **_array(name, at, quantities),
            "lower": _finite(program.lbx[at].min(initial=np.inf)),
            "upper": _finite(program.ubx[at].max(initial=-np.inf)),
            "scale": {
                "value": _finite(np.abs(program.x0[at]).max(initial=0.0)),
                "gradient": _finite(np.abs(start.gradient[at]).max(initial=0.0)),
                "jacobian_column": _finite(columns[at].max(initial=0.0)),
            },
        }
    return found


def _constraints(program: Program) -> dict[str, dict[str, Any]]:
    """With magnitudes: the smallest and the largest of the Jacobian's rows at the start, each by its largest entry."""
    start = program.at_start
    rows = _largest(start.jacobian.tocoo(), 0)
    found = {}
    for name, at in program.problem.constraint_rows.items():
        declared = program.problem.declared_constraints[name]
        found[name] = {
            "equation": declared.equation,
            "unit": declared.unit,
            "cannot": declared.cannot,
            "shape": list(at.shape),
            "positions": at.tolist(),
            "equations": int((program.lbg[at] == program.ubg[at]).sum()),
            "violation_at_start": _finite(start.beyond[at].max(initial=0.0)),
            "scale": {
                "smallest_row": _finite(rows[at].min(initial=np.inf)),
                "largest_row": _finite(rows[at].max(initial=0.0)),
            },
        }
    return found


def _largest(matrix: Any, axis: int) -> Array:
    """Size of the largest entry of each row (axis 0) or column (axis 1); 0 of an empty one."""
    largest = np.zeros(matrix.shape[axis])
    with np.errstate(invalid="ignore"):
        np.maximum.at(largest, matrix.coords[axis], np.abs(matrix.data))
    return largest


def _finite(value: float) -> float | None:
    """A number as JSON knows it; None of an infinite one or of none."""
    return float(value) if np.isfinite(value) else None
