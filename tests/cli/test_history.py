"""The time left: as honest as the record of earlier solves allows."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from casadi_hands.cli.history import FEWEST, Clock, Kind, Solve, kind_of, remember, remembered, words
from tests.export.example import example_task

KIND = Kind("1.0", "refine", 1, 4, False, "independent", 3, True, False, 40)


class Time:
    """A clock that tests set."""

    def __init__(self) -> None:
        self.now = 1000.0

    def __call__(self) -> float:
        return self.now


def solves(totals: list[float], kind: Kind = KIND) -> list[Solve]:
    return [Solve(kind, total, {"": 0.0, "floating": 0.0, "refine": total / 2}) for total in totals]


def test_nothing_is_said_before_there_is_news_and_without_enough_like_it() -> None:
    time = Time()
    few = solves([60.0] * (FEWEST - 1))
    other = solves([60.0] * 9, replace(KIND, fingers=4))
    for earlier in ([], few, other, few + other):
        clock = Clock(KIND, earlier, time)
        clock.hear("floating", 0.0)
        assert clock.left() is None
    assert Clock(KIND, solves([60.0] * FEWEST), time).left() is None
    assert words(None) == ""


def test_the_time_left_is_that_of_solves_alike_less_what_is_spent() -> None:
    time = Time()
    clock = Clock(KIND, solves([100.0, 110.0, 120.0]), time)
    clock.hear("floating", 0.0)
    time.now += 5
    clock.hear("floating", 5.0)
    assert clock.left() == pytest.approx((102 - 5, 118 - 5))  # a tenth from either end, along straight lines
    time.now += 20
    assert clock.left() == pytest.approx((102 - 25, 118 - 25))
    # From a stage's begin on it is that stage, and what follows, that counts: half of the whole in these.
    clock.hear("refine", 25.0)
    assert clock.left() == pytest.approx((51, 59))
    time.now += 52
    assert clock.left() is None  # two of them had ended by then


def test_many_seeds_have_no_stages_of_their_own() -> None:
    time, kind = Time(), replace(KIND, seeds=3)
    clock = Clock(kind, solves([100.0] * 3, kind), time)
    clock.hear("refine", 0.0)
    assert clock.left() == pytest.approx((100, 100))


def test_four_of_five_solves_end_within_what_is_said() -> None:
    rng, time = np.random.default_rng(3), Time()
    durations = rng.lognormal(4.0, 0.7, (400, 31))
    inside = told = 0
    for *earlier, mine in durations.tolist():
        time.now = 0.0
        clock = Clock(KIND, solves(earlier), time)
        clock.hear("floating", 0.0)
        time.now = rng.uniform(0, mine)
        left = clock.left()
        if left is not None:
            told += 1
            inside += left[0] <= mine - time.now <= left[1]
    assert told > 350
    assert 0.6 < inside / told < 0.9


@pytest.mark.parametrize(
    ("left", "said"),
    [
        ((1.0, 2.0), "about 5 s left"),
        ((12.0, 28.0), "10 s to 30 s left"),
        ((61.0, 64.0), "about 60 s left"),
        ((80.0, 400.0), "80 s to 7 min left"),
        ((600.0, 7200.0), "10 min to 2.0 h left"),
    ],
)
def test_words(left: tuple[float, float], said: str) -> None:
    assert words(left) == said


def test_likeness() -> None:
    assert KIND.is_like(replace(KIND, samples=60))
    assert not KIND.is_like(replace(KIND, samples=61))
    for changes in ({"version": "1.1"}, {"until": "floating"}, {"jobs": 2}, {"warm": True}, {"motors": "fewest"}):
        assert not KIND.is_like(replace(KIND, **changes))


def test_a_task_s_kind() -> None:
    task = example_task()
    kind = kind_of(task, version="1.0", until="refine", seeds=1, jobs=4, warm=False)
    assert (kind.fingers, kind.motors, kind.placed, kind.attached) == (len(task.fingers), "independent", True, False)
    assert kind.samples == round(task.duration / task.time_step)


def test_the_record_is_kept_short_and_read_as_it_was_written(tmp_path: Path) -> None:
    path = tmp_path / "not there yet" / "solves.jsonl"
    assert remembered(path) == []
    for number in range(305):
        remember(replace(solves([1.0 + number])[0]), path)
    assert [each.total for each in remembered(path)] == [6.0 + number for number in range(300)]
    assert remembered(path)[-1] == solves([305.0])[0]
    assert [each.name for each in path.parent.iterdir()] == ["solves.jsonl"]


def test_what_is_no_record_is_passed_over(tmp_path: Path) -> None:
    path = tmp_path / "solves.jsonl"
    remember(solves([7.0])[0], path)
    text = path.read_text()
    path.write_text("{\n[1]\n" + text + text.replace('"warm"', '"hot"') + '{"kind": 3}\n')
    assert [each.total for each in remembered(path)] == [7.0]
    path.write_bytes(bytes(range(256)))
    assert remembered(path) == []
    remember(replace(solves([7.0])[0], total=0.0), path)
    assert path.read_bytes() == bytes(range(256))
    remember(solves([7.0])[0], tmp_path)  # a folder: cannot be written, and that is no harm
