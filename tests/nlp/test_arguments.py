"""What kernels are bound to: all of their symbols by name, and nothing that is something else."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pytest

from casadi_hands.nlp import Kernel, Parameter, Problem, Rows
from casadi_hands.nlp.arguments import Argument, arguments_by_name, check_arguments
from casadi_hands.nlp.layout import Label

ALL = "pose0, pose1, angles0, angles1, target, reference, step0, step1"


def rolling() -> Kernel:
    """Two knots, of each a pose and a finger's angles; steps around them, a target and what all share."""
    kernel = Kernel("rolling")
    for name, size in (("pose", 6), ("angles", 2)):
        for i in range(2):
            kernel.variable(f"{name}{i}", size, name, i)
    kernel.parameter("target", 2)
    kernel.parameter("reference", 4)
    for i in range(2):
        kernel.parameter(f"step{i}", 1, "step", i)
    return kernel


class Knots:
    """Four knots of an object and of two fingers, whose labels ``rolling`` asks for."""

    def __init__(self) -> None:
        self.problem = problem = Problem()
        self.pose = problem.variable("pose", (4, 6))
        self.angles = [problem.variable(f"angles{c}", (4, 2), quantity="angles", owner=c) for c in range(2)]
        self.step = problem.parameter("step", (5, 1))
        problem.parameter("reference", (1, 4))
        for c in range(2):
            problem.parameter(f"target{c}", (4, 2), quantity="target", owner=c)

    def arguments(self, **changes: Argument) -> dict[str, Argument]:
        """Of three instances, which all go from a knot to the next."""
        now, later = np.arange(3), np.arange(1, 4)
        both = {"pose": self.pose, "angles": self.angles[0]}
        moving = {f"{name}{i}": rows.take(k) for name, rows in both.items() for i, k in enumerate((now, later))}
        steps = {"step0": self.step.take(now), "step1": self.step.take(later)}
        target, reference = self.problem["target0"].take(now), self.problem["reference"]
        return {**moving, **steps, "target": target, "reference": reference, **changes}

    def refused(self, message: str, **changes: Argument) -> None:
        with pytest.raises(ValueError, match=message):
            check_arguments(rolling(), self.arguments(**changes))


@pytest.fixture
def knots() -> Knots:
    return Knots()


def test_arguments_are_known_by_their_names_in_any_order(knots: Knots) -> None:
    given = knots.arguments()
    assert arguments_by_name(rolling(), given) == given
    assert arguments_by_name(rolling(), dict(reversed(given.items()))) == given
    check_arguments(rolling(), given)


def test_sequences_are_spread(knots: Knots) -> None:
    given = knots.arguments()
    spread: dict[str, object] = {name: given[name] for name in ("target", "reference")}
    spread |= {name: (given[f"{name}0"], given[f"{name}1"]) for name in ("pose", "angles")}
    found = arguments_by_name(rolling(), {**spread, "step": [given["step0"], given["step1"]]})  # type: ignore[dict-item]
    assert found == given


def without(given: Mapping[str, Argument], *names: str) -> dict[str, Argument]:
    return {name: argument for name, argument in given.items() if name not in names}


def test_missing_and_unknown_arguments_are_told_with_all_there_are(knots: Knots) -> None:
    given = knots.arguments()
    with pytest.raises(TypeError, match=rf"^rolling: missing: pose1, target; its arguments are {ALL}$"):
        arguments_by_name(rolling(), without(given, "target", "pose1"))
    with pytest.raises(TypeError, match=rf"^rolling: unknown: goal, pose2; its arguments are {ALL}$"):
        arguments_by_name(rolling(), {**given, "pose2": given["pose0"], "goal": given["target"]})
    # Whoever misspells a name has one too many and one too few: the first is what was written.
    with pytest.raises(TypeError, match=r"unknown: tarte;"):
        arguments_by_name(rolling(), {**without(given, "target"), "tarte": given["target"]})
    # One too many in a sequence is a name too many.
    with pytest.raises(TypeError, match=r"unknown: step2;"):
        arguments_by_name(rolling(), {**without(given, "step0", "step1"), "step": [given["step0"]] * 3})


def test_an_argument_of_another_shape_is_told_with_both_shapes(knots: Knots) -> None:
    now, all_of_them = np.arange(3), np.arange(4)
    knots.refused(r"^rolling\.pose1: rows \(3, 5\), expected \(3, 6\)$", pose1=knots.pose.take(now).entries(0, 5))
    knots.refused(r"^rolling\.pose1: rows \(4, 6\), expected \(3, 6\)$", pose1=knots.pose.take(all_of_them))
    target = knots.problem["target0"]
    knots.refused(r"^rolling\.target: rows \(4, 2\), expected \(3, 2\)$", target=target)
    knots.refused(r"^rolling\.target: rows \(3, 1\), expected \(3, 2\)$", target=target.take(now).entries(0, 1))
    # One row serves all instances; two do not.
    shared = Parameter(target.positions[2:3], target.label)
    check_arguments(rolling(), knots.arguments(target=shared))
    knots.refused(r"^rolling\.target: rows \(2, 2\), expected \(3, 2\)$", target=target.take([0, 1]))


def test_variables_are_not_parameters(knots: Knots) -> None:
    rows = Rows.of(np.zeros((3, 2), int), 1, Label("target"))
    knots.refused(r"^rolling\.target: a parameter reads parameters, not rows of variables$", target=rows)
    positions = Parameter(np.zeros((3, 6), int), Label("pose"))
    knots.refused(r"^rolling\.pose1: a variable reads rows of variables, not a parameter$", pose1=positions)
    knots.refused(r"^rolling\.pose0: a variable reads rows of variables", pose0=positions)


def test_an_argument_that_is_something_else_is_told(knots: Knots) -> None:
    given = knots.arguments()
    angles = given["angles0"]
    assert isinstance(angles, Rows)
    force = Rows(angles.matrix, angles.count, angles.width, label=Label("force"))
    knots.refused(r"^rolling\.angles0: given 'force', expected 'angles'$", angles0=force)
    unlabelled = Rows(angles.matrix, angles.count, angles.width)
    knots.refused(r"^rolling\.angles0: given '', expected 'angles'$", angles0=unlabelled)


def test_what_is_at_one_place_is_one_owner_s(knots: Knots) -> None:
    kernel = Kernel("pair")
    for i in range(2):
        kernel.variable(f"angles{i}", 2, "angles", i)
        kernel.parameter(f"target{i}", 2, "target", i)
    angles, targets = knots.angles, [knots.problem[f"target{c}"] for c in range(2)]
    for first, second in ((0, 1), (1, 0), (0, 0)):
        # Which of them is first is nobody's business, but both are of it.
        arguments = {"angles": (angles[first], angles[second]), "target": (targets[first], targets[second])}
        check_arguments(kernel, arguments_by_name(kernel, arguments))
    swapped = arguments_by_name(kernel, {"angles": angles, "target": targets[::-1]})
    with pytest.raises(ValueError, match=r"^pair\.target0: is 1's, and angles0 is 0's$"):
        check_arguments(kernel, swapped)


def test_later_places_are_later(knots: Knots) -> None:
    now, later = np.arange(3), np.arange(1, 4)
    swapped = {"pose0": knots.pose.take(later), "pose1": knots.pose.take(now)}
    knots.refused(r"^rolling\.pose1: is not later than pose0$", **swapped)
    knots.refused(
        r"^rolling\.step1: is not later than step0$", step0=knots.step.take(later), step1=knots.step.take(now)
    )
    knots.refused(r"^rolling\.pose1: is not later than pose0$", pose1=knots.pose.take(now))
    # At times that are not told they are what they are said to be.
    check_arguments(rolling(), knots.arguments(pose0=knots.pose.combine(np.eye(4)[:3])))


def test_a_kernel_without_variables_is_refused() -> None:
    kernel = Kernel("constant")
    kernel.parameter("target", 2)
    with pytest.raises(
        ValueError, match=r"^constant: has no variables, so nothing tells how often it is to be evaluated$"
    ):
        check_arguments(kernel, {"target": Parameter(np.zeros((1, 2), int), Label("target"))})
