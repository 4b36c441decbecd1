"""What URDF and MJCF writers share: numbers as text, colours, elements as a document."""

from __future__ import annotations

from collections.abc import Iterable
from math import isfinite
from xml.etree import ElementTree

from casadi_hands.errors import DesignError

Color = tuple[float, float, float]

PALM_COLOR = (0.62, 0.65, 0.70)
OBJECT_COLOR = (0.95, 0.75, 0.30)
PIN_COLOR: Color = (0.75, 0.75, 0.78)
SERVO_COLOR = (0.22, 0.23, 0.26)
GROUND_COLOR = (0.78, 0.80, 0.82)
_FINGER_COLORS = (
    (0.20, 0.47, 0.75),
    (0.80, 0.36, 0.58),
    (0.10, 0.58, 0.62),
    (0.50, 0.36, 0.72),
    (0.55, 0.42, 0.30),
    (0.36, 0.42, 0.50),
)


def finger_color(finger: int) -> Color:
    """Colour of a finger, RGB in 0..1."""
    return _FINGER_COLORS[finger % len(_FINGER_COLORS)]


def joint_color(finger: int) -> Color:
    """Colour of a finger's joints and tip: darker than the finger."""
    red, green, blue = (0.6 * part for part in finger_color(finger))
    return (red, green, blue)


def number(value: float) -> str:
    """The shortest text that reads back as the same float; no minus sign on zero.

    Raises:
        DesignError: the value is infinite or not a number, which neither URDF nor MJCF can hold.
    """
    if not isfinite(value):
        raise DesignError(f"a design cannot be written with the value {value} in it; every number must be finite", "")
    return repr(float(value) + 0.0)


def numbers(values: Iterable[float]) -> str:
    """Numbers separated by spaces, each exact."""
    return " ".join(number(value) for value in values)


def document(root: ElementTree.Element) -> str:
    """An indented XML document that ends with a newline."""
    ElementTree.indent(root)
    return '<?xml version="1.0"?>\n' + ElementTree.tostring(root, encoding="unicode") + "\n"
