"""What the stages bind their kernels to: of two arguments that could be taken for each other, none is.

Problems are built and not solved, of tasks that together have everything, so that every kernel is bound.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest

import casadi_hands.stages
from casadi_hands.nlp import Kernel, Parameter, Problem, Rows
from casadi_hands.nlp.arguments import Argument, arguments_by_name
from casadi_hands.problem.model import Model
from casadi_hands.problem.regrasp import Regrasp
from casadi_hands.problem.si import build_model
from casadi_hands.problem.strength import Strength
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.floating.stage import FloatingStage
from casadi_hands.stages.refine.problem import RefineProblem
from casadi_hands.stages.synthesis.stage import SynthesisStage
from casadi_hands.stages.synthesis.target import target_of
from casadi_hands.stages.whole_hand.stage import WholeHandStage
from casadi_hands.task import load_task
from tests.stages.example import drawing, everything, made_up_floating


@dataclass(frozen=True)
class Call:
    """What ``Problem.bind`` was called with, sequences spread."""

    kernel: Kernel
    bounds: Any
    given: dict[str, Argument]

    def again(self, given: dict[str, Argument]) -> None:
        """Bind the same kernel to something else, in a problem of its own."""
        Problem().bind(self.kernel, self.bounds, "", **given)


@contextmanager
def recorded() -> Iterator[list[Call]]:
    calls: list[Call] = []
    original = Problem.bind

    def bind(self: Problem, kernel: Kernel, bounds: Any = None, block: str = "", /, **arguments: Any) -> None:
        calls.append(Call(kernel, bounds, arguments_by_name(kernel, arguments)))
        original(self, kernel, bounds, block, **arguments)

    with patch.object(Problem, "bind", bind):
        yield calls


def regrasping(model: Model) -> Model:
    """The first contact lifts at the second keyframe and touches elsewhere from then on."""
    patches = model.keyframe_patches.copy()
    lifted = np.zeros(patches.shape[:2], bool)
    lifted[1, 0] = True
    patches[2:, 0] *= -1
    return replace(model, regrasp=Regrasp(lifted, patches))


def refine(model: Model, contacts: tuple[int, ...], joints: tuple[int, ...]) -> RefineProblem:
    """The first contact lifts for a while, from before a disturbance until it is nearly over."""
    count = len(model.schedule.samples)
    active = np.ones((count, model.contacts + (model.ground is not None)), bool)
    active[2:7, contacts[0]] = False
    return RefineProblem(Structure.of(model, contacts, joints, active), guarded=True)


def turned_on_its_shaft() -> Model:
    """An object that a hinge holds to the world."""
    return build_model(load_task(Path(__file__).parents[2] / "problems" / "objects" / "knob.yaml"))


# The task with everything has a ground, primitives, disturbances, a palm that moves, limits of torque and speed.
# Fingers of equally many joints can be taken for each other; of two and three joints, angles for bases, points and
# forces; and the wrench of two contacts for their points and forces.
BUILD: dict[str, Callable[[], object]] = {
    "floating": lambda: FloatingStage(everything()[1]),
    "floating, drawing": lambda: FloatingStage(drawing()[1]),
    "floating, regrasp": lambda: FloatingStage(regrasping(everything()[1])),
    "synthesis": lambda: SynthesisStage(
        target_of(everything()[1], made_up_floating(everything()[1])), (0, 1, 2), (2, 2, 3)
    ),
    "synthesis, one joint": lambda: SynthesisStage(
        target_of(drawing()[1], made_up_floating(drawing()[1])), (0, 1), (1, 1)
    ),
    "whole hand": lambda: WholeHandStage(everything()[1], (0, 1, 2), (2, 2, 3), palm_moves=True),
    "whole hand, given palm": lambda: WholeHandStage(regrasping(everything()[1]), (0, 2), (3, 3), palm_moves=False),
    "whole hand, drawing": lambda: WholeHandStage(drawing()[1], (0, 1), (1, 1), palm_moves=False),
    "refine": lambda: refine(everything()[1], (0, 1, 2), (2, 2, 3)),
    "refine, one finger": lambda: refine(everything()[1], (1,), (3,)),
    "refine, sliding": lambda: refine(replace(everything()[1], sliding=0.4), (0, 1, 2), (2, 2, 3)),
    "synthesis, servos": lambda: SynthesisStage(
        target_of(replace(everything()[1], servo=0.4), made_up_floating(everything()[1])), (0, 1), (2, 2)
    ),
    "whole hand, servos": lambda: WholeHandStage(
        replace(everything()[1], servo=0.4), (0, 1, 2), (2, 2, 3), palm_moves=True
    ),
    "refine, servos": lambda: refine(replace(everything()[1], servo=0.4), (0, 1, 2), (2, 2, 3)),
    "refine, shared motors": lambda: refine(replace(everything()[1], motors=2), (0, 1, 2), (2, 2, 3)),
    "refine, what it bears": lambda: refine(
        replace(everything()[1], strength=Strength(0.5, 90.0, 0.02, 4e4)), (0, 1, 2), (2, 2, 3)
    ),
    "refine, on a joint": lambda: refine(turned_on_its_shaft(), (0, 1, 2), (2, 2, 3)),
    "refine, drawing": lambda: refine(drawing()[1], (0, 1), (3, 3)),
    "refine, one joint": lambda: refine(drawing()[1], (1, 0), (1, 1)),
}


@cache
def calls_of(problem: str) -> list[Call]:
    with ExitStack() as stack:
        for stage in ("floating", "synthesis", "whole_hand"):  # that build a solver, which takes long
            stack.enter_context(patch(f"casadi_hands.stages.{stage}.stage.Solver"))
        calls = stack.enter_context(recorded())
        BUILD[problem]()
    return calls


def same(one: Argument, other: Argument) -> bool:
    """Whether a kernel reads the same from both."""
    if isinstance(one, Parameter) and isinstance(other, Parameter):
        return np.array_equal(one.positions, other.positions)
    if not (isinstance(one, Rows) and isinstance(other, Rows)) or one.count != other.count:
        return False
    width = max(rows.matrix.shape[1] for rows in (one, other))
    matrices = [rows.matrix.copy() for rows in (one, other)]
    for matrix in matrices:
        matrix.resize((matrix.shape[0], width))
    return (matrices[0] != matrices[1]).nnz == 0 and np.array_equal(one.offset, other.offset)


def width(argument: Argument) -> int:
    return argument.width if isinstance(argument, Rows) else argument.shape[1]


def confusable(call: Call) -> list[tuple[str, str]]:
    """Names of arguments of the same width from which a kernel reads something else."""
    pairs = itertools.combinations(call.given.items(), 2)
    return [(n, m) for (n, a), (m, b) in pairs if width(a) == width(b) and not same(a, b)]


@pytest.mark.parametrize("problem", BUILD)
def test_no_argument_can_be_given_for_another(problem: str) -> None:
    accepted, tried = [], 0
    for call in calls_of(problem):
        for one, other in confusable(call):
            tried += 1
            try:
                call.again({**call.given, one: call.given[other], other: call.given[one]})
            except ValueError:
                continue
            accepted.append(f"{call.kernel.name}: {one} and {other}")
    assert tried > 50
    assert accepted == []


def test_every_kernel_of_the_stages_is_bound() -> None:
    folder = Path(casadi_hands.stages.__file__).parent
    declared = {name for file in folder.rglob("*.py") for name in re.findall(r'\bKernel\("(\w+)"', file.read_text())}
    assert {"dynamics", "follow", "touch", "physics", "anchor"} <= declared
    calls = [call for problem in BUILD for call in calls_of(problem)]
    assert declared <= {call.kernel.name.removesuffix("_perturbed") for call in calls}
    assert {call.kernel.name for call in calls if call.kernel.name.endswith("_perturbed")} == {
        f"{name}_perturbed" for name in ("dynamics", "contact", "ground")
    }


@pytest.mark.parametrize("problem", BUILD)
def test_a_missing_and_an_unknown_argument_are_told_with_all_names_there_are(problem: str) -> None:
    for call in calls_of(problem):
        names = ", ".join(call.kernel.locals)
        for name, argument in call.given.items():
            others = {other: given for other, given in call.given.items() if other != name}
            with pytest.raises(TypeError, match=f"^{call.kernel.name}: missing: {name}; its arguments are {names}$"):
                call.again(others)
            with pytest.raises(TypeError, match=f"^{call.kernel.name}: unknown: x{name}; its arguments are {names}$"):
                call.again({**others, f"x{name}": argument})


@pytest.mark.parametrize("problem", BUILD)
def test_an_argument_of_another_shape_is_told_by_its_name(problem: str) -> None:
    for call in calls_of(problem):
        for name, argument in call.given.items():
            narrow = argument.entries(0, width(argument) - 1)
            with pytest.raises(ValueError, match=rf"^{call.kernel.name}\.{name}: rows \(\d+, {width(narrow)}\), exp"):
                call.again({**call.given, name: narrow})
