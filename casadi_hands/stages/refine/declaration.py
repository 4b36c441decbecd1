"""The variables and parameters of the refine stage's problem, and how blocks are bound to its knots."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from casadi_hands.geometry.bodies import width_of
from casadi_hands.kinematics.singularity import MARGIN_SIZES
from casadi_hands.kinematics.symbols import morphology_sizes
from casadi_hands.nlp import Kernel, Parameter, Problem, Rows
from casadi_hands.nlp.arguments import Argument
from casadi_hands.problem.model import Model
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.synthesis.stage import AXIS_RANGE

JOINT_MARGIN = 0.005  # rad, at most a quarter of the range: a smooth curve through the knots shall stay within it
HOLDING = 0.4  # share of its torsion that a contact at rest may need: tips differ, and age
JOINT_SIZES = {"turn_axis": 3, "joint_axis": 3, "pivot": 3, "joint_start": 3, "advance": 1, "freedom": 6}
JOINT_SIZES |= {"joint_mass": 1, "joint_friction": 1, "joint_stiffness": 1, "joint_damping": 1}
FREE = (-np.inf, np.inf)
IN_CONE = {"pressing": (0.0, np.inf), "cone": (0.0, np.inf)}
Knots = NDArray[np.int64]
Bounds = Mapping[str, tuple[ArrayLike, ArrayLike]]


@dataclass(frozen=True)
class Block:
    """A kernel bound to some knots.

    Attributes:
        kernel: bound.
        knots: the knot that each instance is at, or begins at; None where it has no time.
        contacts: indices of the contacts that it is about; none where it is the object's.
    """

    kernel: Kernel
    knots: Knots | None
    contacts: tuple[int, ...]


class Declaration:
    """The problem of one structure before its blocks are bound.

    Attributes:
        structure: it is built for.
        problem: its variables and parameters.
        knots: their number.
        disturbed: those at which the task's disturbances act.
        blocks: those with constraints, by name.
    """

    def __init__(self, structure: Structure) -> None:
        """Declare variables and parameters."""
        self.structure, self.problem = structure, Problem()
        self.blocks: dict[str, Block] = {}
        self.knots = len(structure.model.schedule.samples)
        self.disturbed = disturbed_knots(structure.model)
        self._declare_variables()
        self._declare_parameters()

    def _declare_variables(self) -> None:
        problem, structure, model = self.problem, self.structure, self.structure.model
        count, width, most = self.knots, 3 * len(structure.columns), model.force_limit
        self.pose = problem.variable("pose", (count, 6))
        self.rate = problem.variable("rate", (count, 6))
        self.point = problem.variable("point", (count, width))
        self.force = problem.variable("force", (count, width), -most, most)
        self.wrench = problem.variable("wrench", (count, 6))
        self.middle_torque = problem.variable("middle_torque", (count - 1, 3))
        fingers = len(structure.contacts)
        if model.torsion:
            self.torsion = problem.variable("torsion", (count, fingers))
            self.spin = problem.variable("spin", (count - 1, fingers))
            self.holding = problem.variable("holding", (count - 1, fingers), -HOLDING, HOLDING)
            self.twist_torque = problem.variable("twist_torque", (count, 3))
        if model.sliding:
            self.slip = problem.variable("slip", (count - 1, 2 * fingers))
            self.sticking = problem.variable("sticking", (count - 1, 2 * fingers))
        if len(self.disturbed):
            shape = (len(self.disturbed), width)
            self.force_disturbed = problem.variable("force_disturbed", shape, -most, most, quantity="force")
        lowest, highest = model.joint_limits
        margin, reach = min(JOINT_MARGIN, (highest - lowest) / 4), model.palm_radius
        limits = lowest + margin, highest - margin
        self.angles: list[Rows] = []
        self.shape: list[dict[str, Rows]] = []
        for c, n in zip(structure.contacts, structure.joints, strict=True):
            self.angles.append(problem.variable(f"angles{c}", (count, n), *limits, quantity="angles", owner=c))
            shapes: dict[str, tuple[int, ArrayLike, float]] = {
                "base": (2, -reach, reach),
                "lengths": (n, model.least_lengths(n), model.link_length[1]),
                "axes": (2 * n, -AXIS_RANGE, AXIS_RANGE),
                "bends": (2 * n, -model.bend, model.bend),
            }
            self.shape.append(
                {
                    name: problem.variable(f"{name}{c}", (1, size), low, high, quantity=name, owner=c)
                    for name, (size, low, high) in shapes.items()
                }
            )
        if model.motors:
            self._declare_coupling(model.motors)
        self.rows: dict[str, Rows] = {}
        if model.attachment is not None:
            for name, most in (("coordinate", np.inf), ("coordinate_speed", np.inf), ("drag", 1.0)):
                self.rows[name] = problem.variable(name, (count, 1), -most, most)

    def _declare_coupling(self, motors: int) -> None:
        """Variables of motors that share joints."""
        structure, variable = self.structure, self.problem.variable
        self.motors = variable("motors", (self.knots, motors))
        self.lines: list[dict[str, Rows]] = []
        for c, n in zip(structure.contacts, structure.joints, strict=True):
            sizes = {"ratios": n * motors, "offsets": n}
            self.lines.append({k: variable(f"{k}{c}", (1, w), quantity=k, owner=c) for k, w in sizes.items()})

    def _declare_parameters(self) -> None:
        problem, structure, count = self.problem, self.structure, self.knots
        widths = {"reference": 4, "gravity": 3, "inertial": 1, "inertia": 9, "inverse": 9, "radius": 1, "hinge": 1}
        widths |= {"tip_radius": 1, "palm_radius": 1, "ground_height": 1, "friction": 1}
        widths |= {"bodies": width_of(structure.model.kinds)}
        if structure.model.servo:
            widths |= {"servo_radius": 1}
        if structure.model.torsion:
            widths |= {"torsion_radius": 1, "sliding_friction": 1, "spin_scale": 1}
        if structure.model.sliding:
            widths |= {"sliding_friction": 1, "slide_margin": 1, "slip_scale": 1}
            problem.parameter("cone_friction", (1, 1), quantity="friction")
        if structure.model.motors:
            widths |= {"stiffness": 1}
        if structure.model.strength:
            widths |= dict.fromkeys(structure.model.strength.parameters, 1)
        if structure.model.attachment is not None:
            widths |= JOINT_SIZES
        for name, width in widths.items():
            problem.parameter(name, (1, width))
        if structure.model.attachment is not None or structure.model.exerted:
            for name in ("planned_force", "planned_torque"):
                problem.parameter(name, (count, 3))
        problem.parameter("step", (count - 1, 1))
        for name, width in (("palm_position", 3), ("palm_quaternion", 4), ("wanted_pose", 6)):
            problem.parameter(name, (count, width))
        for name, width in (("palm_position", 3), ("palm_quaternion", 4)):
            problem.parameter(f"{name}_between", (count - 1, width), quantity=name)
        for c in structure.columns:
            self._own("body", c, (1, structure.model.touched[c].width))
            for name in ("wanted_point", "wanted_force"):
                self._own(name, c, (count, 3))
        for c, n in zip(structure.contacts, structure.joints, strict=True):
            self._own("helper", c, (count, 3))
            if bounds := structure.model.touched[c].face_bounds:
                self._own("face_normals", c, (count, 3 * bounds))
                self._own("face_offsets", c, (count, bounds))
            self._own("tie", c, (1, 1))
            if n in MARGIN_SIZES:
                self._own("margin_direction", c, (count, MARGIN_SIZES[n]))
            self._own("frames", c, (1, 9 * n))
            for name, width in morphology_sizes(n).items():
                self._own(f"wanted_{name}", c, (1, width))

    def _own(self, name: str, contact: int, shape: tuple[int, int]) -> None:
        """Declare a parameter of one contact."""
        self.problem.parameter(f"{name}{contact}", shape, quantity=name, owner=contact)

    def at(self, knots: Knots, *names: str) -> dict[str, Parameter]:
        """Parameters that all contacts share, of those that differ from knot to knot only the rows of some knots."""
        return {name: self.problem[name].take(knots) for name in names}

    def of(self, contact: int, knots: Knots, *names: str) -> dict[str, Parameter]:
        """Parameters of one contact, likewise."""
        return {name: self.problem[f"{name}{contact}"].take(knots) for name in names}

    def between(self, knots: Knots) -> dict[str, Parameter]:
        """The palm's pose in the middle of the intervals that begin at some knots."""
        names = ("palm_position", "palm_quaternion")
        return {name: self.problem[f"{name}_between"].take(knots) for name in names}

    def steps(self, *intervals: Knots) -> list[Parameter]:
        """The times from knots to the next ones."""
        return [self.problem["step"].take(i) for i in intervals]

    def scene(self, contact: int, knots: Knots) -> dict[str, Parameter]:
        """What places object and palm for a contact at some knots."""
        names = ("reference", "palm_position", "palm_quaternion", "radius", "tip_radius", "hinge")
        return self.at(knots, *names) | self.of(contact, knots, "body")

    def bind(
        self,
        knots: Knots | None,
        kernel: Kernel,
        bounds: Bounds,
        contacts: tuple[int, ...] = (),
        block: str = "",
        /,
        **arguments: Argument | Sequence[Argument],
    ) -> None:
        """Bind a block with constraints, and keep what it is about."""
        self.problem.bind(kernel, bounds, block, **arguments)
        self.blocks[block or kernel.name] = Block(kernel, knots, contacts)


def disturbed_knots(model: Model) -> Knots:
    """Knots at which the task's disturbances act."""
    return np.flatnonzero(model.disturbance.acts) if model.disturbance else np.zeros(0, int)
