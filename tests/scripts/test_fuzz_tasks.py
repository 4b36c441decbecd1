from __future__ import annotations

import fuzz_tasks
import pytest
from fuzz_tasks import attempt
from nasty import mutant

import casadi_hands.cli.task_summary


def test_files_follow_from_their_number() -> None:
    assert mutant(7) == mutant(7)
    assert len({mutant(number) for number in range(200)}) > 190


@pytest.mark.parametrize("first", range(0, 300, 60))
def test_the_reader_answers_whatever_it_is_given(first: int) -> None:
    outcomes = [attempt(number, mutant(number)) for number in range(first, first + 60)]
    assert [each for each in outcomes if each.fails] == []
    assert {each.kind for each in outcomes} == {"task", "refused"}


GOOD = (fuzz_tasks.PROBLEMS / "circle.yaml").read_bytes()


@pytest.mark.parametrize(
    ("error", "kind"), [(KeyError("x"), "traceback"), (MemoryError(), "memory"), (SystemExit(1), "traceback")]
)
def test_what_is_no_answer_is_seen(error: BaseException, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(_task: object) -> None:
        raise error

    monkeypatch.setattr(casadi_hands.cli.task_summary, "check_summary", broken)
    assert attempt(0, GOOD).kind == kind


def test_what_takes_long_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    def endless(_task: object) -> None:
        while True:
            pass

    monkeypatch.setattr(casadi_hands.cli.task_summary, "check_summary", endless)
    monkeypatch.setattr(fuzz_tasks, "SECONDS", 0.2)
    assert attempt(0, GOOD).kind == "slow"


def test_children_answer_in_order() -> None:
    outcomes = list(fuzz_tasks.fuzz(range(3)))
    assert [each.number for each in outcomes] == [0, 1, 2]
    assert not any(each.fails for each in outcomes)
