"""The soft stages, one function each: solve, and put what came out into the record."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from typing import Any

from casadi_hands.diagnosis.own_terms import unmet_bounds
from casadi_hands.export.commands import commanded
from casadi_hands.pipeline.record import Record
from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.problem.outcome import drive_of, floating_motion, whole_hand_motion
from casadi_hands.problem.si import hand_of, joint_loads
from casadi_hands.stages.floating.stage import FloatingStage, solve_floating
from casadi_hands.stages.own_terms import own_weights
from casadi_hands.stages.synthesis.algorithm import Candidate, Found, Search, run_record
from casadi_hands.stages.synthesis.target import target_of
from casadi_hands.stages.whole_hand.stage import WholeHandStage


def run_floating(record: Record, model: Model) -> Floating:
    """Stage 1."""
    weights = _weights(record, model, "floating")
    with record.stage("floating", f"object's motion with {model.contacts} floating contacts"):
        result = record.journal.once("floating", lambda: solve_floating(model, weights))
    _add_floating_runs(record, result)
    record.set_costs("floating", result.solution, weights)
    record.set_unmet("floating", unmet_bounds(result.model, "floating", result.solution))
    record.update(motion=floating_motion(result.model, result))
    record.keep_unfinished("stopped before a hand was designed")
    return result


def run_shortened(record: Record, model: Model, whole: Floating) -> Floating:
    """Stage 1 over a share of the way to the goals, with the contacts that act over the whole of it."""
    with record.stage("floating", "object's motion over a part of the way, which fingers can surely go with it"):
        weights = _weights(record, model, "floating")
        result = record.journal.once("floating, a part", lambda: FloatingStage(model).solve_as(whole, weights))
    _add_floating_runs(record, result)
    return result


def _add_floating_runs(record: Record, result: Floating) -> None:
    seed = record.task.search.seed
    record.add_runs([run_record("floating", what, seed, what, solution) for what, solution in result.runs])


def prepare_search(record: Record, model: Model, floating: Floating, executor: Executor | None) -> Search:
    """Algorithm 1 with the task's settings, for a floating motion."""
    settings = record.task.search
    return Search(
        # Other processes get all that trials read, which a person's own terms are not of.
        target_of(replace(model, own_terms=()), floating),
        dict(record.task.weights.synthesis),
        trials=settings.trials,
        recombinations=settings.recombinations,
        max_joints=settings.max_joints,
        threshold=settings.threshold,
        seed=settings.seed,
        executor=executor,
        journal=record.journal,
        progress=lambda text: record.log("synthesis", text),
    )


def run_search(record: Record, model: Model, search: Search, least: Mapping[int, int] | None = None) -> Found:
    """Stage 2, from ``least`` joints a finger on; its best hand goes into the record."""
    with record.stage("synthesis", f"fingers for {len(search.contacts)} contacts"):
        found = search.run(least)
    best = found.candidates[0]
    record.add_runs(search.take_runs())
    record.set_costs("synthesis", best.hand.solution, dict(record.task.weights.synthesis))
    record.update(hand=hand_of(record.task, model, best.hand.fingers, best.hand.contacts, 1.0, 1.0), motion=None)
    joints = "+".join(map(str, best.joints))
    record.log("synthesis", f"best hand has {joints} joints, scores {', '.join(f'{s:.3f}' for s in best.scores)}")
    return found


def run_whole_hand(record: Record, model: Model, floating: Floating, candidate: Candidate) -> WholeHand:
    """Stage 3."""
    task, joints = record.task, "+".join(map(str, candidate.joints))
    weights = _weights(record, model, "whole_hand")
    with record.stage("whole_hand", f"object and hand of {joints} joints together"):
        hand = candidate.hand

        def solve() -> WholeHand:
            stage = WholeHandStage(model, hand.contacts, candidate.joints, task.palm.may_move)
            return stage.solve(floating, hand.fingers, weights)

        result = record.journal.once("whole hand", solve)
    record.add_runs([run_record("whole_hand", "hand", task.search.seed, "", result.solution)])
    take_up(record, model, result)
    return result


def take_up(record: Record, model: Model, result: WholeHand) -> None:
    """Make the outcome of stage 3 what the record goes on from."""
    record.set_costs("whole_hand", result.solution, _weights(record, model, "whole_hand"))
    record.set_unmet("whole_hand", unmet_bounds(model, "whole_hand", result.solution))
    adopt(record, model, result)
    record.keep_unfinished("stopped before the motion was refined")


def _weights(record: Record, model: Model, stage: str) -> dict[str, Any]:
    """The task's weights of a stage, and those of a person's own terms."""
    return dict(getattr(record.task.weights, stage)) | own_weights(model, stage)


def adopt(record: Record, model: Model, result: WholeHand) -> None:
    """Make a hand and its motion the record's."""
    torque, speed = joint_loads(model, result)
    hand = hand_of(record.task, model, result.fingers, result.contacts, torque, speed)
    motion = whole_hand_motion(model, result)
    if result.coupling is not None:
        hand = replace(hand, drive=drive_of(record.task, model, result))
        motion = replace(motion, motor_positions=result.coupling.positions[model.schedule.filled()[1]])
    record.update(hand=hand, motion=commanded(record.task, hand, motion))
