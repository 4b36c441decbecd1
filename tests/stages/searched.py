"""A hand that the stages before found, for tests of what follows them."""

from __future__ import annotations

from casadi_hands.problem.floating_motion import Floating
from casadi_hands.problem.hand_motion import WholeHand
from casadi_hands.problem.model import Model
from casadi_hands.stages.synthesis.algorithm import Search
from casadi_hands.stages.synthesis.target import target_of
from casadi_hands.stages.whole_hand.stage import WholeHandStage
from casadi_hands.task import Task


def whole_hand_of_two_joints(task: Task, model: Model, floating: Floating, trials: int) -> WholeHand:
    """Algorithm 1's best hand of two joints a finger, as the whole-hand stage moves it."""
    search = Search(
        target_of(model, floating),
        dict(task.weights.synthesis),
        trials=trials,
        recombinations=1,
        max_joints=2,
        threshold=None,
        seed=0,
        executor=None,
        progress=lambda _: None,
    )
    hand = search.run(dict.fromkeys(range(model.contacts), 2)).candidates[0].hand
    stage = WholeHandStage(model, hand.contacts, (2,) * model.contacts, palm_moves=False)
    return stage.solve(floating, hand.fingers, dict(task.weights.whole_hand))
