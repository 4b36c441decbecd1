"""The order of quaternions, judged by all goals of a file."""

from __future__ import annotations

import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task.loader import parse_questioned

HALF = 0.7071


def said(*rotations: str) -> tuple[str, str]:
    """What is refused and what is asked of a ball that passes goals with these rotations; `` for none."""
    goals = [
        f"{{at: {3 * k}, position: [0, 0, 0.2]{f', rotation: {{{each}}}' if each else ''}}}"
        for k, each in enumerate(rotations)
    ]
    text = f"""
object: {{mass: 0.06, shapes: [{{sphere: {{center: [0, 0, 0], radius: 0.022}}}}]}}
palm: {{position: [0, 0, 0.3], facing: [0, 0, -1]}}
motion: [{", ".join(goals)}]
fingers: {{a: {{touches: [0.022, 0, 0]}}, b: {{touches: [-0.022, 0, 0]}}, c: {{touches: [0, 0.022, 0]}}}}
"""
    try:
        return "", "\n".join(parse_questioned(text)[1])
    except TaskError as error:
        return str(error), ""


def quaternion(*values: float) -> str:
    return f"quaternion: {list(values)}"


@pytest.mark.parametrize(
    "last",
    [
        (quaternion(0, 0, 0, 1), quaternion(0, 0, 0, 1)),
        (quaternion(0, 0, 0, -1), quaternion(0, 0, 0, -1)),
        (quaternion(0, 0, 0, 1), quaternion(0, 0, 0.2588, 0.9659)),
        (quaternion(0, 0, 0, 2), quaternion(0, 0, HALF, HALF)),
        (quaternion(0, 0, 0.0872, 0.9962), quaternion(0.2588, 0, 0, 0.9659)),
        ("", quaternion(0, 0, 0.5, 0.866)),
        ("", quaternion(0.0436, 0, 0, 0.999)),
    ],
    ids=str,
)
def test_half_turns_that_are_small_ones_in_the_other_order_are_refused(last: tuple[str, str]) -> None:
    refused, _ = said(*last)
    assert "rotation.quaternion" in refused
    assert "is the order of this one x, y, z, w, a turn by" in refused


@pytest.mark.parametrize(
    "perhaps",
    [
        ("", quaternion(0, 0, 0, 1)),  # nothing else says which way round, and nothing turns if it is
        ("", quaternion(0.0872, 0, 0, 0.9962)),  # 170° or 10°
        ("", quaternion(0, 0, HALF, HALF)),
    ],
    ids=str,
)
def test_what_is_less_certain_is_asked_about(perhaps: tuple[str, str]) -> None:
    refused, asked = said(*perhaps)
    assert refused == ""
    assert "is taken as [w, x, y, z]; is the order of this one x, y, z, w, a turn by" in asked


@pytest.mark.parametrize(
    "first",
    [
        (quaternion(1, 0, 0, 0), quaternion(0, 0, 0, 1)),
        (quaternion(1, 0, 0, 0), quaternion(0, 1, 0, 0)),
        (quaternion(1, 0, 0, 0), quaternion(HALF, 0, 0, HALF)),
        (quaternion(1, 0, 0, 0), quaternion(0.0872, 0, 0, 0.9962)),
        (quaternion(0.9659, 0, 0, 0.2588), quaternion(0.5, 0, 0, 0.866)),
        ("axis: [0, 0, 1], degrees: 90", quaternion(0, 1, 0, 0)),
        ("axis: [0, 0, 1], degrees: 0", "axis: [0, 0, 1], degrees: 180"),
        (quaternion(HALF, 0, HALF, 0), quaternion(0.5, 0.5, 0.5, 0.5)),
    ],
    ids=str,
)
def test_files_that_are_likelier_as_written_are_taken_so(first: tuple[str, str]) -> None:
    assert said(*first) == ("", "")


def test_the_sentence_gives_both_ways_to_write_it() -> None:
    refused, _ = said("", quaternion(0, 0, 0.5, 0.866))
    assert refused.endswith("Then write [0.866, 0, 0, 0.5]. If 180° are meant: {axis: [0, 0.5, 0.866], degrees: 180}")
