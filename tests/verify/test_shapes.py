"""Bodies as they are read from a URDF."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from casadi_hands.verify.reading.robot import read_robot

SPHERE = '<collision><origin xyz="{} {} 0"/><geometry><sphere radius="0.01"/></geometry></collision>'
CYLINDER = (
    '<collision><origin xyz="{} {} 0" rpy="{}"/><geometry><cylinder radius="0.01" length="0.1"/></geometry></collision>'
)
INERTIAL = '<inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial>'
ALONG_X, ALONG_Y = "0 1.5707963267948966 0", "-1.5707963267948966 0 0"
CORNERS = [(0, 0), (0.1, 0), (0.1, 0.1), (0, 0.1)]
SIDES = [
    CYLINDER.format(x, y, turn)
    for x, y, turn in ((0.05, 0, ALONG_X), (0.1, 0.05, ALONG_Y), (0.05, 0.1, ALONG_X), (0, 0.05, ALONG_Y))
]


@pytest.mark.parametrize("each", [1, 2])
def test_capsules_that_share_their_ends_are_told_apart(each: int, tmp_path: Path) -> None:
    # Four sides of a square; at a corner one sphere for both capsules, or one for each.
    shapes = [SPHERE.format(*corner) for corner in CORNERS for _ in range(each)] + SIDES
    file = tmp_path / "frame.urdf"
    file.write_text(f"<robot name='r'><link name='frame'>{INERTIAL}{''.join(shapes)}</link></robot>")
    body = read_robot(file).links["frame"]
    ends = {frozenset(tuple(np.round(p[:2], 9).tolist()) for p in (c.start, c.end)) for c in body.capsules}
    assert len(body.shapes) == len(body.capsules) == 4
    assert ends == {frozenset((CORNERS[i], CORNERS[(i + 1) % 4])) for i in range(4)}


def test_a_sphere_that_ends_no_cylinder_stays_a_sphere(tmp_path: Path) -> None:
    shapes = [SPHERE.format(0, 0), SPHERE.format(0.1, 0), SPHERE.format(0.1, 0.1), SIDES[0]]
    file = tmp_path / "bar.urdf"
    file.write_text(f"<robot name='r'><link name='bar'>{INERTIAL}{''.join(shapes)}</link></robot>")
    lengths = [float(np.linalg.norm(c.end - c.start)) for c in read_robot(file).links["bar"].capsules]
    assert sorted(lengths) == pytest.approx([0, 0.1])
