"""Named variables, parameters, terms and constraints, assembled into one IPOPT solver with exact derivatives."""

from casadi_hands.declared import Constraint, Term, Weight
from casadi_hands.nlp.failure import SolverError
from casadi_hands.nlp.kernel import Kernel
from casadi_hands.nlp.layout import Layout, Parameter, Rows
from casadi_hands.nlp.problem import Problem
from casadi_hands.nlp.solution import Solution
from casadi_hands.nlp.solver import Options, Solver

__all__ = [
    "Constraint",
    "Kernel",
    "Layout",
    "Options",
    "Parameter",
    "Problem",
    "Rows",
    "Solution",
    "Solver",
    "SolverError",
    "Term",
    "Weight",
]
