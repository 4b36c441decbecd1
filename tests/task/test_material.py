"""What links are made of, and that the usual hinge bears what its limits say."""

import numpy as np
import pytest

from casadi_hands.errors import TaskError
from casadi_hands.task import parse_task, task_to_yaml
from casadi_hands.task.material import DEFAULT_MATERIAL, MATERIALS, SAFETY, Material, hinge_loads

TEXT = """\
object: {mass: 0.1, shapes: [{sphere: {center: [0, 0, 0], radius: 0.03}}]}
palm: {position: [0, 0, 0.3], facing: [0, 0, -1]}
motion: [{at: 0, position: [0, 0, 0.2]}, {at: 2, position: [0, 0, 0.2]}]
fingers: {thumb: {touches: [0.03, 0, 0]}, index: {touches: [-0.03, 0, 0]}}
"""
OWN = "{density: 1100, stiffness: 1.9e9, strength: 4.6e7}"


@pytest.mark.parametrize("name", [*MATERIALS, OWN, None])
def test_density_and_limits_follow_the_material_and_it_survives_saving(name: str | None) -> None:
    task = parse_task(TEXT + (f"hand: {{material: {name}}}" if name else ""))
    due = (
        Material(density=1100, stiffness=1.9e9, strength=4.6e7) if name == OWN else MATERIALS[name or DEFAULT_MATERIAL]
    )
    assert task.hand.material == due
    assert task.hand.density == due.density
    assert task.limits.link_stress == due.strength / SAFETY
    force, moment = hinge_loads(due, SAFETY, task.hand.link_radius)
    assert (task.limits.bearing_force, task.limits.bearing_moment) == (force, moment)
    text = task_to_yaml(task)
    assert f"material: {name or DEFAULT_MATERIAL}" in text or name == OWN
    assert parse_task(text) == task


def test_a_density_and_limits_of_its_own_stay() -> None:
    task = parse_task(TEXT + "hand: {material: ABS, density: 600}\nlimits: {link_stress: 1.0e+6}")
    assert (task.hand.density, task.limits.link_stress) == (600, 1e6)
    assert task.hand.material == MATERIALS["ABS"]


@pytest.mark.parametrize(
    ("given", "words"),
    [
        ("material: wood", "hand.material: given 'wood'; allowed: PLA, PETG, ABS, PA12, aluminium-6061, or "),
        ("material: {density: 1000, stiffness: 2.0, strength: 4.0e7}", "is this one in MPa or GPa?"),
        ("material: {density: 1000, stiffness: 2.0e9, strength: 40}", "is this one in MPa or GPa?"),
        ("material: {density: 1000, stiffness: 2.0e9}", "hand.material.strength"),
        ("safety_factor: 0.5", "hand.safety_factor"),
    ],
)
def test_what_is_no_material_is_refused(given: str, words: str) -> None:
    with pytest.raises(TaskError) as refused:
        parse_task(TEXT + f"hand: {{{given}}}")
    assert words in str(refused.value)
    assert "\n" not in str(refused.value)


@pytest.mark.parametrize("name", MATERIALS)
@pytest.mark.parametrize("radius", [0.004, 0.01])
def test_the_usual_hinge_bears_its_loads_at_once(name: str, radius: float) -> None:
    """Sums over thin slices of a hinge: a tongue of 1.15 r, cheeks of 0.425 r cut from a round bar, a pin of r/2."""
    material = MATERIALS[name]
    force, moment = hinge_loads(material, SAFETY, radius)
    pin, tongue = 0.5 * radius, 1.15 * radius
    cheek = radius - tongue / 2
    most = material.strength / SAFETY
    # The tongue is pressed evenly one way on one half and the other way on the other, and by the force all over.
    assert 0.5 * most < moment / (pin * (tongue / 2) ** 2) + force / (pin * tongue) < most or most > 80e6
    # A cheek bears half of the force, and of the moment what a couple of both cheeks makes, at its root a radius away.
    x = np.linspace(tongue / 2, radius, 20001)
    modulus = float(np.trapezoid((2 * np.sqrt(radius**2 - x**2)) ** 2 / 6, x))
    pressed = moment / (tongue + cheek) + force / 2
    assert pressed * radius / modulus < 1.03 * most
    assert pressed / (pin * cheek) < most
    # The pin: from its end inwards, cheek and tongue press on it.
    x, step = np.linspace(-radius, radius, 40001, retstep=True)
    inside = np.abs(x) < tongue / 2
    load = np.where(inside, np.sign(x) * moment / (tongue / 2) ** 2 + force / tongue, 0.0)
    load -= np.where(~inside, (np.sign(x) * moment / (tongue + cheek) + force / 2) / cheek, 0.0)
    bent = np.cumsum(np.cumsum(load)) * step**2
    stress = np.abs(bent).max() / (np.pi * pin**3 / 32)
    assert stress < 1.02 * 500e6 / SAFETY
