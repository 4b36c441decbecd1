"""Parts of drawings as SVG, in px."""

from __future__ import annotations

from math import atan2, cos, pi, sin
from xml.etree.ElementTree import Element, SubElement


def canvas(width: float, height: float, title: str) -> Element:
    """An SVG element of a size, with a title for who cannot see it."""
    root = Element("svg", viewBox=f"0 0 {px(width)} {px(height)}", width=px(width), height=px(height), role="img")
    SubElement(root, "title").text = title
    return root


def part(root: Element, tag: str, kind: str, **attributes: str) -> Element:
    """An element of a class; none where it is empty."""
    given: dict[str, str] = {**({"class": kind} if kind else {}), **attributes}
    return SubElement(root, tag, given)


def capsule(start: tuple[float, float], end: tuple[float, float], radius: float) -> str:
    """Outline of a capsule seen from any side: that of the segment that is seen, as thick."""
    angle = atan2(end[1] - start[1], end[0] - start[0])
    dx, dy = radius * cos(angle + pi / 2), radius * sin(angle + pi / 2)
    corners = [
        (start[0] + dx, start[1] + dy),
        (start[0] - dx, start[1] - dy),
        (end[0] - dx, end[1] - dy),
        (end[0] + dx, end[1] + dy),
    ]
    a, b, c, d = (f"{px(x)} {px(y)}" for x, y in corners)
    arc = f"A{px(radius)} {px(radius)} 0 0 1"
    return f"M{a} {arc} {b} L{c} {arc} {d} Z"


def line(root: Element, a: tuple[float, float], b: tuple[float, float], kind: str, **style: str) -> None:
    """A line, drawn as its class in the page's style says."""
    part(root, "line", kind, x1=px(a[0]), y1=px(a[1]), x2=px(b[0]), y2=px(b[1]), **style)


def arrow(root: Element, a: tuple[float, float], b: tuple[float, float], kind: str) -> None:
    """A line with a head at its end."""
    line(root, a, b, kind)
    angle = atan2(b[1] - a[1], b[0] - a[0])
    corners = [b, *((b[0] - 8 * cos(angle + s), b[1] - 8 * sin(angle + s)) for s in (0.4, -0.4))]
    part(root, "polygon", f"{kind}-head", points=" ".join(f"{px(x)},{px(y)}" for x, y in corners))


def text(root: Element, at: tuple[float, float], words: str, anchor: str, kind: str) -> None:
    """A text with its ``text-anchor`` at a point."""
    element = part(root, "text", kind, x=px(at[0]), y=px(at[1]))
    element.set("text-anchor", anchor)
    element.text = words


def px(value: float) -> str:
    """A length with a tenth of a px."""
    return f"{value:.1f}"
