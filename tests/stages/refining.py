"""A made-up hand and motion for the refine stage, which no equation holds for."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from unittest.mock import patch

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.nlp import Solution
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.stages.refine.result import Refined
from casadi_hands.stages.refine.settings import LAST_STEP
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin
from tests.stages.example import drawing, everything, made_up_finger, made_up_solution, project, rod

Array = np.ndarray


class MadeUp:
    """A stage for fingers of one and two joints, a motion out of order, and values away from where it starts.

    Args:
        model: of a task.
        contacts: of the two fingers.
        lifted: for a contact, the ground's the last, from which sample to which it does not touch.
        guarded: whether fingers are kept clear of each other between knots.
    """

    def __init__(
        self,
        model: Model,
        contacts: tuple[int, int],
        lifted: Mapping[int, tuple[int, int]],
        guarded: bool = False,
    ) -> None:
        self.model, rng = model, np.random.default_rng(0)
        count = len(model.schedule.samples)
        patches, capsules = model.patches, np.array([rod(body) for body in model.touched])
        self.active = np.ones((count, len(patches)), bool)
        for contact, (first, last) in lifted.items():
            self.active[first:last, contact] = False
        self.start = WholeHand(
            fingers=tuple(made_up_finger(model, n, 2, seed=n) for n in (1, 2)),
            contacts=contacts,
            angles=tuple(rng.uniform(-0.8, 0.8, (count, n)) for n in (1, 2)),
            palm_position=model.palm_position,
            palm_quaternion=model.palm_quaternion,
            position=rng.uniform(-0.5, 0.9, (count, 3)),
            vector=rng.uniform(-1, 1, (count, 3)),
            point=patches + 0.3 * capsules[:, 6:] * rng.normal(size=(count, len(patches), 3)),
            force=rng.normal(size=(count, len(patches), 3)),
            active=self.active,
            solution=made_up_solution({}),
        )
        self.stage = RefineStage(model, contacts, (1, 2), self.active, guarded)
        self.values = {
            name: value + 0.05 * rng.normal(size=np.shape(value))
            for name, value in self.stage.given.start(self.start).items()
        }
        # Contacts near their surfaces that press, in no balance; torques that do not whirl a thin object round.
        chosen = self.stage.structure.columns
        inward = np.array([-project(point, capsule)[1] for point, capsule in zip(patches, capsules, strict=True)])
        off = 0.1 * capsules[chosen, 6:] * rng.normal(size=(count, len(chosen), 3))
        self.values["point"] = (self.start.point[:, chosen] + off).reshape(count, -1)
        pressing = inward[chosen] + 0.2 * rng.normal(size=(count, len(chosen), 3))
        self.values["force"] = pressing.reshape(count, -1)
        for name in ("wrench", "middle_torque"):
            self.values[name] = 1e-4 * self.values[name]

    @property
    def touching(self) -> Array:
        """Flags (S, columns) of the contacts in use: held from each knot to the next, the first broken one too."""
        flags = self.active[:, self.stage.structure.columns]
        return np.array(
            [[flags[k, c] or (k > 0 and flags[k - 1, c]) for c in range(flags.shape[1])] for k in range(len(flags))]
        )

    @property
    def bearing(self) -> Array:
        """Flags (S, columns): active, and touching already at the knot before; the first knot bears at once."""
        flags = self.active[:, self.stage.structure.columns]
        return np.array([flags[k] & flags[max(k - 1, 0)] for k in range(len(flags))])

    def parameters(self, weights: Mapping[str, float], margin: Margin | None = None) -> dict[str, object]:
        given = self.stage.given.parameters(self.start, margin or Margin())
        terms = self.stage.problem.terms
        return {**given, **{f"weight.{name}": weight for name, weight in weights.items() if name in terms}}

    def constraints(self, weights: Mapping[str, float]) -> dict[str, Array]:
        """``kernel.constraint`` -> its values at ``values``, one row an instance."""
        problem = self.stage.problem
        x = problem.variables.pack(self.values, np.zeros(problem.variables.size))
        p = problem.parameters.pack(self.parameters(weights), np.zeros(problem.parameters.size))  # type: ignore[arg-type]
        g = np.asarray(self.stage.solver.functions["nlp"](x, p)[1]).ravel()
        return {name: g[rows] for name, rows in problem.constraint_rows.items()}

    def solution(self, excess: Mapping[str, Array] | None = None) -> Solution:
        """What a solver returns that ends at ``values`` and slips nowhere; by default nothing is violated."""
        rows = self.stage.problem.constraint_rows
        still = {name: np.zeros(rows[name].shape) for name in rows if name.endswith(".no_slip")}
        excess = dict(excess or {"wrench.sum": np.zeros(rows["wrench.sum"].shape)})
        return replace(made_up_solution(self.values), excess=excess, constraints=still)

    def refined(self, solution: Solution, margin: Margin | None = None) -> Refined:
        """What the stage makes of a solution that each of its solves returns."""
        with patch.object(self.stage.solver, "solve", return_value=solution):
            return self.stage.take(LAST_STEP, self.start, margin or Margin())

    @property
    def turns(self) -> list[Rotation]:
        """The object's orientations, by SciPy."""
        reference = Rotation.from_quat(self.model.reference, scalar_first=True)
        return [Rotation.from_rotvec(v) * reference for v in self.values["pose"][:, 3:]]

    @property
    def points(self) -> Array:
        """(S, columns, 3) object frame."""
        return self.values["point"].reshape(len(self.active), -1, 3)

    @property
    def forces(self) -> Array:
        """(S, columns, 3) object frame."""
        return self.values["force"].reshape(len(self.active), -1, 3)


def carrying(on_ground: int = 9) -> MadeUp:
    """Two of three fingers in use, the second lifted for a while; the ground bears load at ``on_ground`` samples."""
    return MadeUp(everything()[1], (0, 2), lifted={2: (4, 7), 3: (on_ground, 99)})


def sketching() -> MadeUp:
    """A drawing, without a ground and without disturbances; the second finger is lifted for a while."""
    return MadeUp(drawing()[1], (0, 1), lifted={1: (4, 7)})
