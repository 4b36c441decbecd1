"""How reasons are put into one text."""

from __future__ import annotations

from casadi_hands.diagnosis.reason import Reason, format_reasons, joints_of

SLIP = Reason("the thumb slips 3 mm", "more joints", frozenset(("slip", "residual")))
HEAVY = Reason("the motors are weak", "stronger motors", frozenset(("torque",)), root=True)


def test_each_reason_ends_with_what_to_try() -> None:
    assert (
        format_reasons([SLIP, SLIP]) == "the thumb slips 3 mm; try more joints. the thumb slips 3 mm; try more joints"
    )


def test_what_follows_from_a_cause_is_left_out_and_the_rest_comes_after_it() -> None:
    missed = [("slip", Reason("slip", "a")), ("speed", Reason("too fast", "slower goals"))]
    assert format_reasons([SLIP], missed) == "the thumb slips 3 mm; try more joints. too fast; try slower goals"


def test_beside_a_root_other_causes_are_not_told_but_what_they_explained_is() -> None:
    missed = [("slip", Reason("slip of 3 mm", "b")), ("torque", Reason("torque", "c"))]
    assert format_reasons([SLIP, HEAVY], missed) == "the motors are weak; try stronger motors. slip of 3 mm; try b"


def test_three_are_told_and_the_others_counted() -> None:
    missed = [(str(i), Reason(f"m{i}", "x")) for i in range(4)]
    assert format_reasons([SLIP], missed).split(". ")[1:] == [
        "m0; try x",
        "m1; try x",
        "2 more limits are missed, see the certificate",
    ]
    assert format_reasons([SLIP], missed[:3]).endswith("1 more limit is missed, see the certificate")
    assert format_reasons([], []) == ""


def test_joints() -> None:
    assert (joints_of(1), joints_of(2)) == ("1 joint", "2 joints")
