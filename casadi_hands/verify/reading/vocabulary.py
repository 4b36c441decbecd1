"""What a URDF may say beside links and joints, and with which attributes, a sentence for what it says else."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from xml.etree.ElementTree import Element

from casadi_hands.verify.reading.markup import called, strangers

_ATTRIBUTES = {
    "origin": "xyz rpy",
    "geometry": "",
    "sphere": "radius",
    "cylinder": "radius length",
    "box": "size",
    "mesh": "filename",
    "visual": "name",
    "collision": "name",
    "inertial": "",
    "mass": "value",
    "inertia": "ixx ixy ixz iyy iyz izz",
    "parent": "link",
    "child": "link",
    "axis": "xyz",
    "limit": "lower upper effort velocity",
    "material": "name",
    "color": "rgba",
}
"""Of each element those that the format has: others might scale or turn what they are on, to some reader."""


def attribute_words(root: Element) -> Iterator[str]:
    """Yield which attributes elements of a URDF have that the format does not."""
    for element in root.iter():
        known = _ATTRIBUTES.get(element.tag, " ".join(element.attrib)).split()
        for name in sorted(set(element.attrib) - set(known)):
            yield f"{called(element)}: the format has no attribute {name[:60]} there"


def compiler_words(element: Element) -> list[str]:
    """Return what of MuJoCo's settings in a URDF is none of those that change nothing."""
    found = list(strangers(element, "compiler", ""))
    for compiler in element.findall("compiler"):
        found += strangers(compiler, "", "fusestatic discardvisual strippath")
    return found


def transmission_words(element: Element, joints: set[str | None]) -> list[str]:
    """Return what is wrong with a motor that does not turn one of the joints one to one."""
    found = list(strangers(element, "type joint actuator", "name"))
    turned = [joint.get("name") for joint in element.findall("joint")]
    found += [f"{called(element)} turns joint '{name}', which there is not" for name in turned if name not in joints]
    for ratio in element.iter("mechanicalReduction"):
        if (ratio.text or "").strip() not in ("1", "1.0"):
            found.append(f"{called(element)} reduces by {(ratio.text or 'nothing').strip()[:20]}, not by 1")
    return found


def motor_words(root: Element, driven: Sequence[str]) -> list[str]:
    """Return which joints have not one transmission each, where any has.

    Args:
        root: of a URDF.
        driven: the joints that follow no other, which must; another may.
    """
    turned = [joint.get("name") for each in root.findall("transmission") for joint in each.findall("joint")]
    counts = {str(name): turned.count(name) for name in dict.fromkeys([*driven, *turned])}
    return [
        f"joint {name} has {count} transmissions, not one" for name, count in counts.items() if turned and count != 1
    ]
