"""How ``scene.xml`` has MuJoCo compute contacts, joints of the world and steps: what replays depend on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree.ElementTree import Element

from casadi_hands.verify.reading.markup import called, number, numbers, strangers

_OPTIONS = "timestep gravity integrator cone impratio noslip_iterations"
_CONTACT = {"condim": "3", "solref": "0.02 1", "solimp": "0.9 0.95 0.001"}  # as MuJoCo has them where a file does not
_STIFF = {"solref": "0.002 1", "solimp": "0.99 0.999 0.0001"}
_DRY = {"solreffriction": "0.004 1", "solimpfriction": "0.9999 0.9999 0.001"}
_WELD = {"solref": "0.0025 1"}


@dataclass(frozen=True)
class Settings:
    """What is set for all of the scene.

    Attributes:
        step: of the simulation, s.
        integrator, cone: MuJoCo's words.
        hardness: how much harder friction is than normal forces (``impratio``).
        no_slip: passes that take out creep.
        dimensions: of contacts: 4 with torsional friction.
        time: s in which contacts push out what is in them; they give as its square.
        damping: ratio with which they do.
        impedance: of contacts that barely touch, of deep ones, and the depth between, m.
    """

    step: float
    integrator: str
    cone: str
    hardness: float
    no_slip: float
    dimensions: float
    time: float
    damping: float
    impedance: tuple[float, float, float]


def read_settings(path: Path, option: Element, default: Element | None) -> tuple[Settings, list[str]]:
    """Read ``<option>`` and what ``<default>`` says of solids, and what of them the format does not have.

    Raises:
        DesignError: a number is missing or is not finite.
    """
    strange = list(strangers(option, "", _OPTIONS))
    geoms: Sequence[Element] = [] if default is None else default.findall("geom")
    if len(geoms) > 1:
        strange.append(f"<default> says of solids {len(geoms)} times what they are")
    geom = geoms[0] if geoms else Element("geom")
    strange += strangers(geom, "", " ".join(_CONTACT))
    time, damping = numbers(path, geom, "solref", 2, _CONTACT["solref"]).tolist()
    low, high, width = numbers(path, geom, "solimp", 3, _CONTACT["solimp"]).tolist()
    settings = Settings(
        number(path, option, "timestep", "0.002"),
        option.get("integrator", "Euler"),
        option.get("cone", "pyramidal"),
        number(path, option, "impratio", "1"),
        number(path, option, "noslip_iterations", "0"),
        number(path, geom, "condim", _CONTACT["condim"]),
        time,
        damping,
        (low, high, width),
    )
    return settings, strange


def stiffness_problems(path: Path, element: Element) -> list[str]:
    """Return where an equation, or dry friction of a joint, is not as hard as the format has it."""
    due = _WELD if element.tag == "weld" else _DRY if "frictionloss" in element.attrib else _STIFF
    return [
        f"{called(element)}: its {name} is not {stated}"
        for name, stated in due.items()
        if name not in element.attrib or not _alike(path, element, name, stated)
    ]


def _alike(path: Path, element: Element, name: str, stated: str) -> bool:
    """Whether an attribute is these numbers."""
    words = stated.split()
    found = numbers(path, element, name, len(words))
    return all(abs(value / float(word) - 1) < 1e-9 for value, word in zip(found.tolist(), words, strict=True))
