"""Named variables, parameters, terms and constraints, assembled into one IPOPT solver with exact derivatives."""

from casadi_hands.nlp.kernel import Kernel
from casadi_hands.nlp.layout import Layout, Rows
from casadi_hands.nlp.problem import Problem
from casadi_hands.nlp.solver import Options, Solution, Solver

__all__ = ["Kernel", "Layout", "Options", "Problem", "Rows", "Solution", "Solver"]
