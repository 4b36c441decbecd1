"""What fingers bear, as the stage has it, against the audit's own statics, which closed forms and beams check."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from casadi_hands.export.commands import commanded
from casadi_hands.export.design import Design
from casadi_hands.export.folder import write_files
from casadi_hands.geometry.bodies.capsule import Capsule
from casadi_hands.pipeline.warm_start import warm_start
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.outcome import whole_hand_motion
from casadi_hands.problem.resampling import resampled, resampled_model
from casadi_hands.problem.si import build_model, hand_of, joint_loads
from casadi_hands.problem.strength import Strength
from casadi_hands.problem.structure import Structure
from casadi_hands.stages.refine import strength
from casadi_hands.stages.refine.problem import RefineProblem
from casadi_hands.stages.refine.settings import ALL_STEPS
from casadi_hands.stages.refine.stage import RefineStage
from casadi_hands.stages.refine.values import Margin
from casadi_hands.task import parse_task
from casadi_hands.verify.audit import audit_files
from casadi_hands.verify.figures.structure import Bar, Load, bearing_loads, link_stress, tip_deflection
from casadi_hands.verify.report import Audit
from tests.pipeline.test_warm_start import HELD, earlier
from tests.stages.blocks import Place, check_block, frames, numbers, random_finger, shape
from tests.stages.example import PinFinger, everything, everything_text

Array = np.ndarray
RADIUS, TIP, YOUNG = 0.15, 0.2, 40.0
MOST = {"bearing_moment": 0.7, "link_stress": 90.0, "tip_deflection": 0.3, "flexibility": 4 / (np.pi * YOUNG)}


class Pressed:
    """A random finger that a force presses at a point of its last link."""

    def __init__(self, joints: int, seed: int, along: float) -> None:
        rng = np.random.default_rng((joints, seed))
        self.finger, self.place = random_finger(joints, rng), Place(rng)
        self.force = rng.normal(size=3)
        standing = PinFinger(self.finger, TIP if joints == 1 else RADIUS)
        chain, last = standing.chain(self.finger.angles[0])
        self.at = chain[-2] + last @ [TIP, 0, along * self.finger.lengths[-1]]
        self.bars = list(self._bars(standing, chain))
        place = self.place
        in_world = place.palm.apply(self.at) + place.palm_position
        self.point = place.turn.inv().apply(in_world - place.position)

    def _bars(self, standing: PinFinger, chain: Array) -> Iterator[Bar]:
        rotation, finger = np.eye(3), self.finger
        for j, (root, end) in enumerate(pairwise(chain)):
            rotation = (
                rotation @ pin.exp3(np.append(finger.bends[j], 0)) @ pin.exp3(finger.angles[0][j] * standing.axes[j])
            )
            length = float(np.linalg.norm(end - root))
            axis = rotation @ standing.axes[j]
            radius = TIP if j == finger.joints - 1 else RADIUS
            yield Bar("", "", root[None], end[None], (end - root)[None] / length, axis[None], length, radius)

    @property
    def block(self) -> tuple[dict[str, object], dict[str, object]]:
        variables = {"pose": self.place.pose, "point": self.point, "force": self.force}
        scene = {"frames": frames(self.finger), **self.place.parameters, "body": np.r_[np.zeros(6), 0.3]}
        return {**shape(self.finger), **variables, "angles": self.finger.angles[0]}, {
            **scene,
            "radius": RADIUS,
            "tip_radius": TIP,
            "hinge": 0.3,
            **MOST,
        }

    @property
    def loads(self) -> list[Load]:
        """As the audit has them, palm frame: the object is pressed with the force, so the finger bears its opposite."""
        bar = self.bars[-1]
        station = np.clip(np.sum((self.at - bar.root) * bar.along, axis=1), 0.0, bar.length)
        force = -self.place.palm.inv().apply(self.place.turn.apply(self.force))
        return [Load(len(self.bars) - 1, self.at[None], force[None], np.zeros((1, 3)), station)]


@pytest.mark.parametrize("along", [-0.05, 0.4, 0.9, 1.1])
@pytest.mark.parametrize("joints", [1, 2, 3])
@pytest.mark.parametrize("seed", range(3))
def test_the_stage_and_the_audit_find_the_same(joints: int, seed: int, along: float) -> None:
    case = Pressed(joints, seed, along)
    found = numbers(strength.borne(joints, Capsule), *case.block)
    for i, bar in enumerate(case.bars):
        moment = bearing_loads(case.bars, case.loads, i)[1][0]
        assert np.sqrt(found["bearing"][i]) * MOST["bearing_moment"] == pytest.approx(moment, rel=1e-6)
        stress = np.sqrt(found["stress"][2 * i : 2 * i + 2].max()) * MOST["link_stress"]
        assert stress == pytest.approx(link_stress(case.bars, case.loads, i)[0], rel=1e-4), bar
    away = np.linalg.norm(tip_deflection(case.bars, case.loads, YOUNG))
    assert np.sqrt(found["deflection"][0]) * MOST["tip_deflection"] == pytest.approx(away, rel=1e-5)


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_derivatives(joints: int) -> None:
    check_block(strength.borne(joints, Capsule), *Pressed(joints, 5, 0.8).block)


def test_forces_under_disturbances_are_held_to_it_as_well() -> None:
    model = replace(everything()[1], strength=Strength(0.5, 90.0, 0.02, 4e4))
    active = np.ones((len(model.schedule.samples), model.contacts + 1), bool)
    active[2:7, 0] = False
    built = RefineProblem(Structure.of(model, (0, 1, 2), (2, 2, 3), active))
    for i, c in enumerate(built.structure.contacts):
        pushed = built.disturbed[built.structure.active[built.disturbed, i]]
        assert len(pushed)
        np.testing.assert_array_equal(built.blocks[f"disturbed_borne{c}"].knots, pushed)


def test_limits_in_the_stages_numbers_are_those_of_the_task() -> None:
    task = parse_task(everything_text())
    units = build_model(task).units
    within = Strength.of(task, units)
    pressure = units.force / units.length**2
    assert within.moment * units.torque == pytest.approx(0.85 * task.limits.bearing_moment)
    assert within.stress * pressure == pytest.approx(0.85 * task.limits.link_stress)
    assert within.deflection * units.length == pytest.approx(0.85 * task.limits.tip_deflection)
    assert within.stiffness * pressure == pytest.approx(task.hand.material.stiffness)


def test_a_hand_held_to_less_than_it_bore_bears_less(tmp_path: Path) -> None:
    task = parse_task(HELD)
    model = build_model(task)
    whole, margin = warm_start(earlier(), task, model), Margin(normal_force=1.0)
    sparse = resampled_model(model, model.schedule.stepped(0.4))

    def held(model: Model, start: WholeHand, name: str) -> tuple[WholeHand, Audit]:
        joints = tuple(finger.joints for finger in start.fingers)
        found = RefineStage(model, start.contacts, joints, start.active).take(ALL_STEPS, start, margin)
        assert found.met
        hand = hand_of(task, model, found.hand.fingers, found.hand.contacts, *joint_loads(model, found.hand))
        motion = commanded(task, hand, whole_hand_motion(model, found.hand))
        (tmp_path / name).mkdir()
        write_files(Design(task, "feasible", hand=hand, motion=motion), tmp_path / name, page=False)
        return found.hand, audit_files(tmp_path / name)

    free, before = held(sparse, resampled(whole, model, sparse), "free")
    most = {name: 0.8 * before.figures[name].value for name in ("bearing_moment", "tip_deflection")}
    limited = task.changed(limits=most)
    _, after = held(replace(sparse, strength=Strength.of(limited, model.units)), free, "tight")
    for name, limit in most.items():
        assert after.figures[name].value <= limit
