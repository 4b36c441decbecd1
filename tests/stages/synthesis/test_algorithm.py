"""Algorithm 1: what grows, what is recombined, what is short; on made-up scores, then on a small task for real."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor

import numpy as np
import pytest

from casadi_hands.kinematics.morphology import FingerSeed
from casadi_hands.stages.synthesis import algorithm
from casadi_hands.stages.synthesis.algorithm import Found, Search
from casadi_hands.stages.synthesis.score import THRESHOLD
from casadi_hands.stages.synthesis.stage import Synthesised
from casadi_hands.stages.synthesis.target import Target
from tests.stages.synthesis.example import ball_target, ball_task, hand, pointing

Scores = Callable[[Synthesised], list[float]]


class MadeUp:
    """Stands in for the solves: fingers have as many joints as asked for, scores follow a rule."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, scores: Scores) -> None:
        self.grown: list[tuple[int, int, int]] = []
        self.combined: list[tuple[int, ...]] = []
        monkeypatch.setattr(algorithm, "design_finger", self.design)
        monkeypatch.setattr(algorithm, "combine_fingers", self.combine)
        monkeypatch.setattr(algorithm, "finger_scores", lambda _, result: np.array(scores(result)))

    def design(self, target: Target, contact: int, joints: int, stream: tuple[int, ...], _: object) -> Synthesised:
        trial = stream[3]
        self.grown.append((contact, joints, trial))
        assert stream[:3] == (4, contact, joints)
        finger = pointing(target, contact, [[1, 0, 0]] * joints)
        finger.base[0] = trial  # to tell fingers apart
        # Later trials are better: the last one leads its pool.
        return hand([finger], (contact,), tip_target=1.0 / (trial + 1), null_space=0.5 / (trial + 1))

    def combine(self, _: Target, contacts: tuple[int, ...], fingers: tuple[FingerSeed, ...], __: object) -> Synthesised:
        self.combined.append(tuple(int(f.base[0]) for f in fingers))
        return hand(list(fingers), contacts, objective=10.0 - len(self.combined))


def search(target: Target, progress: Callable[[str], None] = lambda _: None, **changes: object) -> Search:
    settings = {"trials": 3, "recombinations": 4, "max_joints": 3, "threshold": None, "seed": 4, "executor": None}
    weights = dict(ball_task().weights.synthesis)
    return Search(target, weights, progress=progress, **{**settings, **changes})  # type: ignore[arg-type]


def test_only_fingers_above_the_threshold_get_a_joint(monkeypatch: pytest.MonkeyPatch) -> None:
    # The left finger serves with one joint, the right one with two.
    made_up = MadeUp(monkeypatch, lambda h: [0.0, 0.0 if h.fingers[1].joints == 2 else 1.0])
    found = search(ball_target()).run()
    assert found.candidates[0].joints == (1, 2)
    assert found.short == ()
    assert made_up.grown == [(0, 1, 0), (0, 1, 1), (0, 1, 2), (1, 1, 0), (1, 1, 1), (1, 1, 2)] + [
        (1, 2, trial) for trial in range(3)
    ]


def test_fingers_are_saturated_at_the_most_joints_and_named_if_short(monkeypatch: pytest.MonkeyPatch) -> None:
    MadeUp(monkeypatch, lambda h: [1.0, 0.0])
    found = search(ball_target(), max_joints=2).run()
    assert found.candidates[0].joints == (2, 1)
    assert [(short.kind, short.contact) for short in found.short] == [("miss", 0)]


def test_how_far_the_worst_short_finger_is_from_its_contact(monkeypatch: pytest.MonkeyPatch) -> None:
    MadeUp(monkeypatch, lambda h: [1.0, 0.0])
    # A made-up finger stands upright, beside its contact of the start by its base; the ball moves 0.5 across that.
    found = search(ball_target(), max_joints=1).run()
    beside = found.candidates[0].hand.fingers[0].base[0]
    assert found.farthest == pytest.approx(np.hypot(beside, 0.5), abs=1e-9)


def test_the_best_hand_s_scores_decide(monkeypatch: pytest.MonkeyPatch) -> None:
    # Of two hands the last has the lowest objective; only it serves.
    MadeUp(monkeypatch, lambda h: [0.0, 0.0] if h.solution.objective < 9 else [1.0, 1.0])
    found = search(ball_target(), recombinations=4).run()
    assert found.candidates[0].joints == (1, 1)
    assert [c.hand.solution.objective for c in found.candidates] == sorted(
        c.hand.solution.objective for c in found.candidates
    )


def test_fingers_and_hands_that_fold_count_as_worse(monkeypatch: pytest.MonkeyPatch) -> None:
    # The last of three trials is the best, and the last of four hands: they fold.
    def singular_fingers(_: Target, given: Synthesised) -> int:
        return int(given.fingers[0].base[0] == 2) if len(given.contacts) == 1 else 2 * (given.solution.objective == 6)

    monkeypatch.setattr(algorithm, "singular_fingers", singular_fingers)
    orders = {}
    for share in (0.0, 0.4):
        monkeypatch.setattr(algorithm, "SINGULAR_FINGER", share)  # of scores 1.5, 0.75 and 0.5
        monkeypatch.setattr(algorithm, "SINGULAR_HAND", share / 2)
        made_up = MadeUp(monkeypatch, lambda h: [0.0, 0.0])
        found = search(ball_target()).run()
        orders[share] = made_up.combined[0], [c.hand.solution.objective for c in found.candidates]
    assert orders == {0.0: ((2, 2), [6, 7, 8, 9]), 0.4: ((1, 1), [7, 8, 6, 9])}


@pytest.mark.parametrize(("score", "grows"), [(THRESHOLD * 0.999, False), (THRESHOLD, True)])
def test_default_threshold(monkeypatch: pytest.MonkeyPatch, score: float, grows: bool) -> None:
    MadeUp(monkeypatch, lambda h: [score if h.fingers[0].joints == 1 else 0.0, 0.0])
    assert (search(ball_target()).run().candidates[0].joints == (2, 1)) == grows


def test_the_task_s_threshold_takes_its_place(monkeypatch: pytest.MonkeyPatch) -> None:
    MadeUp(monkeypatch, lambda h: [0.9, 0.9])
    assert search(ball_target(), threshold=1.0).run().candidates[0].joints == (1, 1)


def test_the_search_may_start_with_more_joints(monkeypatch: pytest.MonkeyPatch) -> None:
    made_up = MadeUp(monkeypatch, lambda h: [0.0, 0.0])
    assert search(ball_target()).run({1: 2}).candidates[0].joints == (1, 2)
    assert {(c, n) for c, n, _ in made_up.grown} == {(0, 1), (1, 2)}


def test_fingers_whose_joints_stay_are_not_designed_again(monkeypatch: pytest.MonkeyPatch) -> None:
    made_up = MadeUp(monkeypatch, lambda h: [0.0, 0.0])
    searching = search(ball_target())
    searching.run()
    first = searching.pools[0]
    assert searching.run({0: 1, 1: 2}).candidates[0].joints == (1, 2)
    assert [(c, n) for c, n, _ in made_up.grown] == [(0, 1)] * 3 + [(1, 1)] * 3 + [(1, 2)] * 3
    assert searching.pools[0] is first


def test_a_contact_that_never_acts_has_no_finger(monkeypatch: pytest.MonkeyPatch) -> None:
    made_up = MadeUp(monkeypatch, lambda h: [0.0])
    target = ball_target()
    target.active[:, 0] = False
    found = search(target).run()
    assert found.candidates[0].hand.contacts == (1,)
    assert {c for c, _, _ in made_up.grown} == {1}


def test_the_first_hand_is_of_the_best_fingers_and_none_is_made_twice(monkeypatch: pytest.MonkeyPatch) -> None:
    made_up = MadeUp(monkeypatch, lambda h: [0.0, 0.0])
    search(ball_target(), recombinations=30).run()
    assert made_up.combined[0] == (2, 2)
    assert len(set(made_up.combined)) == len(made_up.combined) > 1


def test_fingers_are_drawn_in_inverse_proportion_to_their_scores() -> None:
    finger = pointing(ball_target(), 0, [[1, 0, 0]])
    pool = [(0.1, finger), (0.2, finger), (0.4, finger), (0.0, finger)][:3]
    rng = np.random.default_rng(0)
    counts = np.bincount([algorithm._sample(pool, rng) for _ in range(7000)], minlength=3)
    np.testing.assert_allclose(counts / 7000, [4 / 7, 2 / 7, 1 / 7], atol=0.02)
    # A score of nothing does not divide by nothing.
    assert algorithm._sample([(0.0, finger), (1.0, finger)], rng) == 0


def test_records_and_words(monkeypatch: pytest.MonkeyPatch) -> None:
    MadeUp(monkeypatch, lambda h: [0.0, 0.0])
    words: list[str] = []
    growing = search(ball_target(), words.append, recombinations=1)
    growing.run()
    runs = growing.take_runs()
    assert growing.take_runs() == []
    assert len(runs) == 2 * 3 + 1
    assert runs[0]["stage"] == "synthesis"
    assert runs[0]["seed"] == 4
    assert runs[0]["what"] == "finger left, 1 joints, trial 0"
    assert words[2] == "finger left, 1 joint(s), trial 3/3, best score 0.500"


def search_ball(executor: Executor | None, progress: Callable[[str], None] = lambda _: None) -> Found:
    return search(ball_target(), progress, trials=3, recombinations=4, max_joints=2, executor=executor).run()


def test_a_small_search_for_real_grows_both_fingers_and_is_repeatable() -> None:
    one, other = search_ball(None), search_ball(None)
    # One joint cannot press along the motion and lift: two are needed.
    assert one.candidates[0].joints == (2, 2)
    assert one.candidates[0].hand.solution.objective == other.candidates[0].hand.solution.objective
    for a, b in zip(one.candidates[0].hand.fingers, other.candidates[0].hand.fingers, strict=True):
        np.testing.assert_array_equal(a.angles, b.angles)
    assert one.candidates[0].scores == other.candidates[0].scores
