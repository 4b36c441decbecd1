"""Physics of an object that presses on the world, against SciPy's integrator and the statics of rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from casadi_hands.stages.refine import newton_euler
from tests.stages.blocks import check_block, numbers
from tests.stages.refine.test_object_kernels import INERTIA, LENGTH, MASS, WEIGHT, Carried

Array = np.ndarray


class Pressing(Carried):
    """The same body with a force (N) and a torque (N·m) of the world's on it, linear in time in the world."""

    def __init__(self, seed: int, share: float = 1.0) -> None:
        rng = np.random.default_rng(100 + seed)
        self.answer = np.stack([0.5 * rng.normal(size=(2, 3)), 2e-3 * rng.normal(size=(2, 3))])
        self.answer[:, 1] = (1 - share) * self.answer[:, 0] + share * self.answer[:, 1]
        super().__init__(seed, share)

    def _slope(self, t: float, state: Array) -> Array:
        s = t / self.step
        force, torque = ((1 - s) * ends[0] + s * ends[1] for ends in self.answer)
        slope = super()._slope(t, state)
        slope[7:10] += force / MASS
        turned = Rotation.from_quat(state[3:7], scalar_first=True).inv().apply(torque)
        slope[10:] += np.linalg.solve(INERTIA, turned)
        return slope

    def physics(self) -> tuple[dict[str, Array], dict[str, object]]:
        variables, parameters = super().physics()
        for i in range(2):
            parameters[f"planned_force{i}"] = self.answer[0, i] / WEIGHT
            parameters[f"planned_torque{i}"] = self.answer[1, i] / (WEIGHT * LENGTH)
        return variables, parameters


@pytest.mark.parametrize("seed", range(3))
def test_what_is_exerted_is_answered_as_scipy_has_it(seed: int) -> None:
    defects = []
    for share in (1.0, 0.5, 0.25):
        found = numbers(newton_euler.physics(exerting=True), *Pressing(seed, share).physics())
        defects.append(np.abs(found["defect"]).max())
    # Of the same order as without.
    assert defects[0] / defects[2] > 4**6
    assert defects[2] < 2e-7


def test_derivatives_of_pressing() -> None:
    check_block(newton_euler.physics(exerting=True), *Pressing(0).physics())


def test_rest_bears_the_world_s_answer() -> None:
    rng = np.random.default_rng(5)
    reference, vector = Rotation.random(rng=rng), rng.uniform(-1, 1, 3)
    turn = Rotation.from_rotvec(vector) * reference
    force, torque = rng.normal(size=(2, 3))
    total = np.r_[turn.inv().apply(-np.array([0, 0, -1.0]) - force), turn.inv().apply(-torque)]
    variables = {"pose": np.r_[np.zeros(3), vector], "wrench": total}
    given = {"reference": reference.as_quat(scalar_first=True), "gravity": [0, 0, -1]}
    answer = {"planned_force": force, "planned_torque": torque}
    found = numbers(newton_euler.equilibrium(exerting=True), variables, {**given, **answer})["sum"]
    np.testing.assert_allclose(found, 0, atol=1e-12)
