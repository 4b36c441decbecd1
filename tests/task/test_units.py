"""Units: what is refused, what is asked about, and extremes that are neither."""

from __future__ import annotations

from pathlib import Path

import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task.loader import load_questioned, parse_questioned

PROBLEMS = sorted((Path(__file__).parents[2] / "problems").rglob("*.yaml"))


def ball(
    scale: float = 1.0,
    mass: float = 0.06,
    radius: float = 0.022,
    palm: tuple[float, float] = (0.0264, 0.3),
    goals: tuple[float, float] = (0.2, 0.19),
    more: str = "",
) -> str:
    """A ball below a palm (radius, height), lengths but the palm's and the goals' times a scale."""
    r = radius * scale
    return f"""
object: {{mass: {mass}, shapes: [{{sphere: {{center: [0, 0, 0], radius: {r}}}}}]}}
palm: {{radius: {palm[0] * scale}, position: [0, 0, {palm[1] * scale}], facing: [0, 0, -1]}}
motion: [{{at: 0, position: [0, 0, {goals[0] * scale}]}}, {{at: 3, position: [0, 0, {goals[1] * scale}]}}]
fingers: {{a: {{touches: [{r}, 0, 0]}}, b: {{touches: [{-r}, 0, 0]}}, c: {{touches: [0, {r}, 0]}}}}
{more}
"""


def asked(text: str) -> str:
    return "\n".join(parse_questioned(text)[1])


def refused(text: str) -> str:
    with pytest.raises(TaskError) as caught:
        parse_questioned(text)
    return str(caught.value)


@pytest.mark.parametrize("path", PROBLEMS, ids=lambda path: path.stem)
def test_of_tasks_in_metres_nothing_is_asked(path: Path) -> None:
    assert load_questioned(path)[1] == []


@pytest.mark.parametrize(
    ("scale", "mass", "asks"),
    [
        (1e3, 0.06, "is the file in millimetres?"),
        (1e3, 60, "is the file in millimetres and grams, or centimetres?"),  # an 0.44 m ball of 60 kg, too
        (1e2, 0.06, "is the file in millimetres and grams, or centimetres?"),  # 4.4 mm of 0.06 g, too
        (1 / 0.0254, 0.06, "is the file in inches?"),
    ],
)
def test_objects_lighter_than_any_matter_are_refused(scale: float, mass: float, asks: str) -> None:
    text = refused(ball(scale, mass))
    assert "object.shapes: given an object " in text
    assert text.endswith(asks)


@pytest.mark.parametrize(("scale", "unit"), [(1e2, "centimetres and grams"), (1 / 0.0254, "inches and grams")])
def test_a_file_in_small_units_and_grams_has_a_density_and_is_asked_about(scale: float, unit: str) -> None:
    text = asked(ball(scale, 60))
    assert f"the object is {0.044 * scale:.3g} m long; is the file in " in text
    assert unit in text


def test_a_palm_far_from_its_object() -> None:
    text = asked(ball(palm=(0.0264, 2.4)))
    assert "palm.position: the palm is 2.21 m from the object, 50 times its length; is the file in millimetres" in text
    assert asked(ball(palm=(0.0264, 0.9))) == ""
    assert "given a palm 300 m from its object, which is 0.044 m long" in refused(ball(palm=(0.0264, 300)))
    assert "palm.position" in asked(ball(goals=(20, 19)))
    assert "given a palm 200 m" in refused(ball(goals=(200, 190)))


@pytest.mark.parametrize(
    ("more", "text"),
    [
        ("hand: {link_length: [20, 200]}", "hand.link_length: this is 200 m, for an object 0.044 m long; is the file"),
        ("hand: {link_radius: 3}", "hand.link_radius: this is 3 m, for an object 0.044 m long; is the file in milli"),
        (
            "hand: {link_length: [0.03, 9]}\nfingertip: {radius: 3}",
            "fingertip.radius: this is 3 m, for an object 0.044 m long; is the file in milli",
        ),
        ("hand: {joint_limits: [-1.57, 1.57]}", "hand.joint_limits: joints turn by 3.14°; are these radians?"),
        ("gravity: [0, 0, -9810]", "gravity: gravity of 9810 m/s²; is it in mm/s² or cm/s²?"),
        (
            "hand: {axes: {from_link: [1.0, 1.57]}}",
            "hand.axes.from_link: axes are within 1.57° of their links; are these",
        ),
        ("hand: {bend: 1.5708}", "hand.bend: a bend of 1.5708° is 90° in radians; is it in radians?"),
        ("hand: {density: 1.2}", "hand.density: links of 1.2 kg/m³ are lighter than foam; is it in g/cm³?"),
        ("actuator: {torque: 40}", "actuator.torque: 40 N·m, where the object weighs on the hand with 0."),
        ("fingertip: {torsion: 0.5}", "fingertip.torsion: 0.5 m is more than a tip of 5.9 mm radius can have"),
        ("limits: {slip: 5}", "limits.slip: this is 5 m, for an object 0.044 m long; is the file in millimetres"),
        ("limits: {goal_angle: 400}", "limits.goal_angle: no object is more than 180° from a goal, so 400° is always"),
        ("gravity: [0, 0, 9.81]", "gravity: gravity points up, and world z is up; is its sign wrong?"),
    ],
)
def test_single_fields_in_other_units(more: str, text: str) -> None:
    assert f": {text}" in asked(ball(more=more))


@pytest.mark.parametrize(
    ("moment", "words"), [(100, "more than that of all its mass"), (1e-9, "less than a hundredth")]
)
def test_inertia_of_no_body_of_this_size(moment: float, words: str) -> None:
    diagonal = f"[[{moment}, 0, 0], [0, {moment}, 0], [0, 0, {moment}]]"
    text = asked(ball().replace("mass: 0.06,", f"mass: 0.06, inertia: {diagonal},"))
    assert f"object.inertia: {moment:.3g} kg·m² is {words}" in text
    fine = "[[1.2e-5, 0, 0], [0, 1.2e-5, 0], [0, 0, 1.2e-5]]"
    assert asked(ball().replace("mass: 0.06,", f"mass: 0.06, inertia: {fine},")) == ""


def test_of_what_follows_from_a_field_nothing_is_asked() -> None:
    """The radius of fingertips and the length of links are taken from the links' radius."""
    assert asked(ball(more="hand: {link_radius: 8}")).count("is the file in") == 1


def test_a_pitch_in_millimetres_and_an_angle_in_radians_of_what_hangs_on_the_world() -> None:
    screw = "attached: {screw: {point: [0, 0, 0], axis: [0, 0, 1], pitch: 5}}"
    text = (
        ball()
        .replace("radius: 0.022}}]}", f"radius: 0.022}}}}], {screw}}}", 1)
        .replace("position: [0, 0, 0.19]", "angle: 1.5708")
    )
    assert "object.attached.screw.pitch: this is 5 m, for an object 0.044 m long" in asked(text)
    assert "motion[1].angle: a turn of 1.5708° is 90° in radians" in asked(text)


@pytest.mark.parametrize(("degrees", "means"), [("1.5708", 90), ("-0.7854", 45), ("3.14159", 180), ("6.283", 360)])
def test_turns_in_radians(degrees: str, means: int) -> None:
    turned = ball().replace("0.19]", f"0.19], rotation: {{axis: [0, 0, 1], degrees: {degrees}}}")
    assert f"is {means}° in radians; is it in radians?" in asked(turned)


@pytest.mark.parametrize("degrees", ["0", "1.5", "3.1", "90", "-45.5", "12.34"])
def test_turns_in_degrees(degrees: str) -> None:
    turned = ball().replace("0.19]", f"0.19], rotation: {{axis: [0, 0, 1], degrees: {degrees}}}")
    assert asked(turned) == ""


@pytest.mark.parametrize(
    ("radius", "mass", "above"),
    [(0.0005, 1e-6, 0.005), (0.0005, 0.001, 0.02), (0.5, 50, 1.2), (0.5, 0.001, 1.2), (0.022, 0.001, 0.1)],
)
def test_the_smallest_and_the_largest_objects_are_not_refused(radius: float, mass: float, above: float) -> None:
    text = asked(ball(radius=radius, mass=mass, palm=(1.2 * radius, 0.2 + above)))
    density = mass / (4 / 3 * 3.141592653589793 * radius**3)
    assert ("object.mass" in text) == (density < 1 or density > 25000)
    assert "object.shapes" not in text


def test_denser_than_metals_is_asked_about_and_ten_times_denser_refused() -> None:
    volume = 4 / 3 * 3.141592653589793 * 0.022**3
    assert asked(ball(mass=2.4e4 * volume)) == ""
    assert "is denser than metals, 2.6e+04 kg/m³; is the mass in grams?" in asked(ball(mass=2.6e4 * volume))
    assert refused(ball(mass=2.1e5 * volume)).endswith("200000 kg/m³ and less; is this one in grams?")
