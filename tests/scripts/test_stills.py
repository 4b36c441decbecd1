"""The pictures' bodies, beside those of the URDF file as the audit reads it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from stills import _bodies

from casadi_hands.export.design import Design
from casadi_hands.export.page.robot import Robot
from casadi_hands.export.page.timeline import design_timeline
from casadi_hands.export.urdf import hand_urdf
from casadi_hands.verify.reading.robot import read_robot
from tests.export.example import example_hand, example_motion, example_task


@pytest.mark.parametrize("hinge", [0.0, 0.02])
def test_links_and_the_palm_s_balls_are_drawn_where_they_collide(hinge: float, tmp_path: Path) -> None:
    hand = example_hand()
    fingers = [replace(f, links=tuple(replace(link, hinge=hinge) for link in f.links)) for f in hand.fingers]
    hand = replace(hand, fingers=tuple(fingers))
    design = Design(example_task(), "certified", hand=hand, motion=example_motion())
    (tmp_path / "hand.urdf").write_text(hand_urdf(hand))
    timeline = design_timeline(design, Robot(hand_urdf(hand)))
    drawn = [body for body in _bodies(design, timeline, 2) if hasattr(body, "radius") and hasattr(body, "start")]
    for name, link in read_robot(tmp_path / "hand.urdf").links.items():
        pose = timeline.palm[2] if name == "palm" else timeline.palm[2] @ timeline.links[name][2]
        assert len(link.capsules) == (len(fingers) * (hinge > 0) if name == "palm" else 1)
        for capsule in link.capsules:
            ends = [pose[:3, :3] @ end + pose[:3, 3] for end in (capsule.start, capsule.end)]
            assert any(
                body.radius == pytest.approx(capsule.radius) and np.allclose([body.start, body.end], ends, atol=1e-9)
                for body in drawn
            ), name
