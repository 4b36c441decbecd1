"""Times in the task's terms."""

from casadi_hands.diagnosis.moment import moment
from casadi_hands.motion import Schedule


def test_times_are_told_by_their_goals() -> None:
    schedule = Schedule.of([0.0, 1.0, 3.0], 4.0, 1, 0.1)
    assert moment(schedule, 3.0) == "goal 3 (3 s)"
    assert moment(schedule, 1.5) == "1.5 s (between goals 2 and 3)"
    assert moment(schedule, 3.5) == "3.5 s (after the last goal)"
    assert moment(Schedule.of([0.5, 1.0], 1.0, 1, 0.1), 0.2) == "0.2 s"
