"""What Python and notebooks show of a design."""

from __future__ import annotations

import json
from dataclasses import replace
from itertools import combinations
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from casadi_hands import Design
from casadi_hands.export.picture import picture
from casadi_hands.task import parse_task
from tests.export.example import example_design

BALL = """
name: <ball> & palm
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {radius: 0.06, thickness: 0.001, position: [0, 0, 0.3], facing: [1, 0, 0]}
motion: [{at: 0, position: [0.1, 0, 0.3]}, {at: 2, position: [0.12, 0, 0.3]}]
fingers: {thumb: {touches: [0, 0.03, 0]}, index: {touches: [0, -0.03, 0]}}
"""
SVG = "{http://www.w3.org/2000/svg}"


def corners(polygon: ElementTree.Element) -> np.ndarray:
    return np.array([[float(x) for x in pair.split(",")] for pair in polygon.get("points", "").split()])


def test_a_design_is_a_line() -> None:
    design = replace(example_design(), seconds={"total": 12.4, "refine": 9})
    joints = "+".join(str(len(finger.links)) for finger in design.hand.fingers)
    assert repr(design) == f"Design({design.task.name!r}, {design.status}, {joints} joints, 12 s)"
    assert repr(replace(design, hand=None, motion=None, seconds={})) == f"Design({design.task.name!r}, {design.status})"


def test_sizes_in_the_picture_are_in_proportion() -> None:
    """A disc is as wide as its diameter from wherever it is seen, a ball too."""
    root = ElementTree.fromstring(picture(Design(parse_task(BALL), "failed"), 600))
    (ball,), (palm,) = root.findall(f"{SVG}circle"), root.findall(f"{SVG}polygon")
    widest = max(float(np.linalg.norm(a - b)) for a, b in combinations(corners(palm), 2))
    assert widest / float(ball.get("r", "")) == pytest.approx(2 * 0.06 / 0.03, rel=0.01)


def test_everything_is_in_the_picture() -> None:
    for design in (example_design(), Design(parse_task(BALL), "failed")):
        root = ElementTree.fromstring(picture(design, 200))
        points = [corners(each) for each in root.findall(f"{SVG}polygon")]
        for ball in root.findall(f"{SVG}circle"):
            x, y, radius = (float(ball.get(name, "")) for name in ("cx", "cy", "r"))
            points.append(np.array([[x - radius, y - radius], [x + radius, y + radius]]))
        if design.task.ground is None:
            assert np.vstack(points).min() > 0
            assert np.vstack(points).max() < 200


def test_what_is_nearer_is_drawn_later() -> None:
    """From in front of the palm the ball hides a part of it; behind the palm, the palm would hide the ball."""
    names = [each.tag for each in ElementTree.fromstring(picture(Design(parse_task(BALL), "failed")))]
    assert names == [f"{SVG}polygon", f"{SVG}circle"]
    behind = BALL.replace("facing: [1, 0, 0]", "facing: [-1, 0, 0], up: [0, 0, 1]")
    names = [each.tag for each in ElementTree.fromstring(picture(Design(parse_task(behind), "failed")))]
    assert names == [f"{SVG}circle", f"{SVG}polygon"]


def test_the_card_has_the_picture_the_reason_and_every_figure() -> None:
    certificate = {
        "slip": {"value": 0.0142, "limit": 0.0002, "holds": False, "unit": "m", "where": ""},
        "spin": {"value": None, "limit": None, "holds": True, "unit": "deg", "where": ""},
    }
    design = replace(Design(parse_task(BALL), "feasible"), reason="slips by 14 mm > 0.2 mm", certificate=certificate)
    root = ElementTree.fromstring(design._repr_html_())
    text = " ".join(" ".join(root.itertext()).split())
    assert root.find(f".//{SVG}svg") is not None
    assert text.startswith("<ball> & palm : feasible slips by 14 mm > 0.2 mm")
    assert [[cell.text or "".join(cell.itertext()) for cell in row] for row in root.iter("tr")][1:] == [
        ["slip", "14.2 mm", "0.2 mm", "missed"],
        ["spin", "", "", ""],
    ]


def test_files_do_not_know_of_it(tmp_path: Path) -> None:
    example_design().save(tmp_path)
    assert "svg" not in json.loads((tmp_path / "result.json").read_text())
