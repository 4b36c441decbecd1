import numpy as np
import pytest

from casadi_hands.task import Palm, Waypoint


def palm(facing: tuple[float, float, float], up: tuple[float, float, float] | None = None, **more: object) -> Palm:
    return Palm.model_validate({"radius": 0.05, "position": (0, 0, 0.3), "facing": facing, "up": up, **more})


@pytest.mark.parametrize("facing", [(1, 0, 0), (0, 0, -1), (0, 0, 3), (1, 2, -3), (0.01, 0, 1)])
@pytest.mark.parametrize("up", [None, (0, 1, 0.2)])
def test_frame(facing: tuple[float, float, float], up: tuple[float, float, float] | None) -> None:
    rotation = palm(facing, up).rotation
    assert rotation.T @ rotation == pytest.approx(np.eye(3), abs=1e-14)
    assert np.linalg.det(rotation) == pytest.approx(1)
    assert rotation[:, 2] == pytest.approx(np.array(facing) / np.linalg.norm(facing))
    if up:
        # x is the direction across the facing that leans most towards up, so y is level with respect to it.
        assert rotation[:, 1] @ np.array(up) == pytest.approx(0, abs=1e-14)
        assert rotation[:, 0] @ np.array(up) > 0


def test_default_roll() -> None:
    assert palm((1, 0, 0)).rotation == pytest.approx(np.array([[0, 0, 1], [0, -1, 0], [1, 0, 0]]))
    assert palm((0, 0, -1)).rotation == pytest.approx(np.diag([1, -1, -1]))


def test_thickness_follows_the_radius() -> None:
    assert palm((1, 0, 0)).thickness == pytest.approx(0.01)


def test_resting_palm_has_one_waypoint() -> None:
    ((time, position, rotation),) = palm((1, 0, 0)).waypoints
    assert (time, *position) == (0, 0, 0, 0.3)
    assert (rotation == palm((1, 0, 0)).rotation).all()


def test_waypoints_keep_the_roll() -> None:
    moving = palm(
        (1, 0, 0),
        motion=[{"at": 1, "position": (0, 0, 1)}, {"at": 2, "position": (0, 0, 2), "facing": (0, 5, 0)},
                {"at": 3, "position": (0, 0, 3), "facing": (0, -1, 0)}],
    )  # fmt: skip
    start, first, second, third = moving.waypoints
    assert [waypoint[0] for waypoint in moving.waypoints] == [0, 1, 2, 3]
    assert (first[2] == start[2]).all()
    # Turned about the vertical, up stays up; and it does when the palm then turns right round.
    for _, _, rotation in (second, third):
        assert rotation[:, 0] == pytest.approx([0, 0, 1])
        assert np.linalg.det(rotation) == pytest.approx(1)
    assert second[2][:, 2] == pytest.approx([0, 1, 0])
    assert third[2][:, 2] == pytest.approx([0, -1, 0])


def test_waypoints_follow_up() -> None:
    moving = palm((1, 0, 0), (0, 1, 0), motion=[{"at": 1, "position": (0, 0, 1), "facing": (0, 0, 1)}])
    assert moving.waypoints[1][2] == pytest.approx(np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]]))


def test_waypoint_is_closed_to_other_names() -> None:
    with pytest.raises(ValueError, match="speed"):
        Waypoint.model_validate({"at": 1, "position": (0, 0, 0), "speed": 1})
