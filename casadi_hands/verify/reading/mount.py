"""The joint that holds the object in ``scene.xml``."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

import numpy as np

from casadi_hands.verify.reading.markup import number, numbers, strangers
from casadi_hands.verify.reading.settings import stiffness_problems

_ATTRIBUTES = "name type pos axis ref frictionloss stiffness damping springref solreffriction solimpfriction"


@dataclass(frozen=True)
class Mount:
    """A joint that holds the object to the world: its kind (``hinge``, ``slide``), place (3,) m, axis (3,).

    And what of it resists: dry friction, stiffness, damping, and where its spring and its coordinate begin.
    """

    name: str
    kind: str
    place: np.ndarray
    axis: np.ndarray
    reference: float
    rest: float
    friction: float
    stiffness: float
    damping: float


def read_mount(path: Path, strange: list[str], element: Element) -> Mount:
    """Read a joint of the object; what the format does not have is added to ``strange``.

    Raises:
        DesignError: a number is missing or is not finite.
    """
    strange.extend(strangers(element, "", _ATTRIBUTES))
    if "frictionloss" in element.attrib:
        strange.extend(stiffness_problems(path, element))
    return Mount(
        name=element.get("name", ""),
        kind=element.get("type", "hinge"),
        place=numbers(path, element, "pos", 3, "0 0 0"),
        axis=numbers(path, element, "axis", 3),
        reference=number(path, element, "ref", "0"),
        rest=number(path, element, "springref", "0"),
        friction=number(path, element, "frictionloss", "0"),
        stiffness=number(path, element, "stiffness", "0"),
        damping=number(path, element, "damping", "0"),
    )
