"""Drawings of a hand's dimensions as SVG: every finger from two sides, and the bases on the palm."""

from __future__ import annotations

from dataclasses import dataclass
from math import degrees, hypot
from xml.etree.ElementTree import Element, tostring

import numpy as np
from scipy.spatial.transform import Rotation

from casadi_hands.export.markup import finger_color
from casadi_hands.export.report.data import css
from casadi_hands.export.report.markup import signed
from casadi_hands.export.report.svg import arrow, canvas, capsule, line, part, px, text
from casadi_hands.problem.hand import Finger, Hand

WIDTH = 380.0
"""Of a drawing, px: phones show it nearly as large, so that its texts can be read."""
_TALLEST = 300.0  # px of the longest finger
_ROOM = 100.0  # px beside a finger for its texts
_LINE = 14.0  # px between lines of text
_ARROW = 34.0  # px of a joint's axis that is seen from its side


Label = tuple[float, float, list[str]]
"""Where a text is, px, and its lines."""


@dataclass(frozen=True)
class Placed:
    """A finger's link at zero angles, in the palm's frame.

    Attributes:
        joint: (3,) where its joint is, m.
        start, end: (3,) of its capsule's axis, m.
        axis: (3,) its joint's, unit length.
    """

    joint: np.ndarray
    start: np.ndarray
    end: np.ndarray
    axis: np.ndarray


def stretched(finger: Finger) -> list[Placed]:
    """Where a finger's links are at zero angles."""
    frame, origin = Rotation.identity(), np.array(finger.base)
    placed = []
    for link in finger.links:
        frame = frame * link.turn
        end = origin + frame.apply([0.0, 0.0, link.length])
        placed.append(Placed(origin, origin + frame.apply([0.0, 0.0, link.hinge]), end, frame.apply(link.axis)))
        origin = end
    return placed


def finger_drawings(hand: Hand, index: int) -> list[str]:
    """A finger at zero angles, seen with the palm's x axis to the right and with its y axis; all fingers in one scale.

    Args:
        hand: of the finger.
        index: of the finger.

    Returns:
        Two SVG elements.
    """
    finger = hand.fingers[index]
    scale = min(
        [_TALLEST / _extent(each, (0, 1, 2)) for each in hand.fingers]
        + [(WIDTH - 2 * _ROOM) / _extent(each, (across,)) for each in hand.fingers for across in (0, 1)]
    )
    return [
        _View(finger, css(finger_color(index)), scale, across).svg(
            f"{finger.name}, the palm's {name} axis to the right"
        )
        for across, name in enumerate("xy")
    ]


def _extent(finger: Finger, axes: tuple[int, ...]) -> float:
    """How far a finger at zero angles reaches along axes of the palm, m."""
    placed, radius = stretched(finger), max(link.radius for link in finger.links)
    points = np.array([finger.base, *(each.end for each in placed)])[:, axes]
    return float((points.max(axis=0) - points.min(axis=0)).max()) + 2 * radius


class _View:
    """A finger projected on a plane through the palm's z axis.

    Args:
        finger: what is drawn.
        color: CSS.
        scale: px/m.
        across: the palm's axis that points to the right: 0 is x, 1 is y.
    """

    def __init__(self, finger: Finger, color: str, scale: float, across: int) -> None:
        self.finger, self.color, self.scale, self.across = finger, color, scale, across
        self.placed = stretched(finger)
        points = np.array([finger.base, *(each.end for each in self.placed)])
        self.radius = max(link.radius for link in finger.links)
        self.middle = float(points[:, across].min() + points[:, across].max()) / 2
        self.top = float(points[:, 2].max()) + self.radius
        self.bottom = min(0.0, float(points[:, 2].min()) - self.radius)
        self.height = scale * (self.top - self.bottom) + 78

    def svg(self, title: str) -> str:
        """The drawing, as an element with a title."""
        root = canvas(WIDTH, self.height, title)
        floor = self._at(np.zeros(3))[1]
        line(root, (12, floor), (WIDTH - 12, floor), "palm")
        text(root, (WIDTH - 12, floor + 15), "palm", "end", "small")
        for k in sorted(range(len(self.placed)), key=self._depth):
            self._link(root, k)
        for placed in self.placed:
            self._axis(root, placed)
        self._texts(root)
        x, y = 22.0, self.height - 12
        arrow(root, (x, y), (x + 30, y), "frame")
        arrow(root, (x, y), (x, y - 30), "frame")
        text(root, (x + 34, y + 4), "xy"[self.across], "start", "small")
        text(root, (x - 3, y - 33), "z", "middle", "small")
        return tostring(root, encoding="unicode")

    def _at(self, point: np.ndarray) -> tuple[float, float]:
        """Where a point (3,) of the palm's frame is on the drawing, px."""
        side = WIDTH / 2 + self.scale * (float(point[self.across]) - self.middle)
        return side, 12 + self.scale * (self.top - float(point[2]))

    def _depth(self, k: int) -> float:
        """How near to the viewer a link is: who looks along y has x to the right, along -x has y to the right."""
        middle = (self.placed[k].start + self.placed[k].end) / 2
        return float(-middle[1] if self.across == 0 else middle[0])

    def _link(self, root: Element, k: int) -> None:
        placed, link = self.placed[k], self.finger.links[k]
        ball = self.scale * (self.finger.links[k - 1].radius if k else link.radius)
        x, y = self._at(placed.joint)
        if link.hinge:
            line(root, (x, y), self._at(placed.start), "tongue")
        if k == 0:
            part(root, "circle", "ball", cx=px(x), cy=px(y), r=px(ball), fill=self.color)
        path = capsule(self._at(placed.start), self._at(placed.end), self.scale * link.radius)
        part(root, "path", "link", d=path, fill=self.color)

    def _axis(self, root: Element, placed: Placed) -> None:
        """A joint's axis as an arrow; where it points at the viewer, as an arrow's point or tail."""
        x, y = self._at(placed.joint)
        dx, dy = _ARROW * float(placed.axis[self.across]), -_ARROW * float(placed.axis[2])
        if hypot(dx, dy) > 0.3 * _ARROW:
            line(root, (x - 0.7 * dx, y - 0.7 * dy), (x, y), "axis")
            arrow(root, (x, y), (x + dx, y + dy), "axis")
            part(root, "circle", "axis-dot", cx=px(x), cy=px(y), r="2.5")
            return
        part(root, "circle", "axis", cx=px(x), cy=px(y), r="6")
        towards = float(-placed.axis[1] if self.across == 0 else placed.axis[0]) > 0
        if towards:
            part(root, "circle", "axis-dot", cx=px(x), cy=px(y), r="2")
        else:
            line(root, (x - 4, y - 4), (x + 4, y + 4), "axis")
            line(root, (x - 4, y + 4), (x + 4, y - 4), "axis")

    def _texts(self, root: Element) -> None:
        """Lengths with dimension lines on the right, joints with their bends on the left."""
        lengths, joints = [], []
        for k, (placed, link) in enumerate(zip(self.placed, self.finger.links, strict=True)):
            (x, y), (u, v) = self._at(placed.joint), self._at(placed.end)
            long = hypot(u - x, v - y) or 1.0
            right = (-(v - y) / long, (u - x) / long)  # of the link's direction, on a page whose y points down
            off = self.scale * link.radius + 10
            ends = [(x + off * right[0], y + off * right[1]), (u + off * right[0], v + off * right[1])]
            line(root, ends[0], ends[1], "dimension")
            for a, b in ends:
                line(root, (a - 4 * right[0], b - 4 * right[1]), (a + 4 * right[0], b + 4 * right[1]), "dimension")
            a, b = (ends[0][0] + ends[1][0]) / 2 + 8 * right[0], (ends[0][1] + ends[1][1]) / 2 + 8 * right[1]
            lengths.append((a, b + 4, [f"{1e3 * link.length:.1f} mm"]))
            bend = degrees(hypot(*link.bend))
            joints.append((x - off - 4, y + 4, [f"joint {k + 1}", *([f"bend {bend:.1f}°"] if bend >= 0.05 else [])]))
        tip, radius = self.placed[-1].end, self.finger.links[-1].radius
        x, y = self._at(tip)
        joints.append((x - self.scale * radius - 8, y - 2, [f"radius {1e3 * radius:.1f} mm"]))
        floor = self._at(np.zeros(3))[1] - 5
        for entries, anchor in ((_apart(lengths, floor), "start"), (_apart(joints, floor), "end")):
            for a, b, lines in entries:
                # Within the drawing, whatever the fonts.
                width = 8.6 * max(map(len, lines))
                a = min(a, WIDTH - 2 - width) if anchor == "start" else max(a, 2 + width)
                for n, words in enumerate(lines):
                    text(root, (a, b + n * (_LINE - 1)), words, anchor, "small" if n else "")


def palm_drawing(hand: Hand, numbers: bool = True) -> str:
    """The palm from where its fingers point, x to the right, with where their bases are.

    Args:
        hand: of the palm.
        numbers: write names and coordinates beside it.
    """
    width, height = (WIDTH, 230.0) if numbers else (160.0, 160.0)
    ends = [stretched(finger)[-1].end for finger in hand.fingers]
    reaches = [hypot(f.base[0], f.base[1]) + f.links[0].radius for f in hand.fingers]
    most = 94.0 if numbers else 70.0
    scale = most / max([hand.palm_radius, *reaches])
    x, y = width / 2, height / 2
    root = canvas(width, height, "the palm from where the fingers point")
    disc = scale * hand.palm_radius
    part(root, "circle", "palm-disc", cx=px(x), cy=px(y), r=px(disc))
    if numbers:
        for dx, dy, name in ((1, 0, "x"), (0, -1, "y")):
            arrow(root, (x, y), (x + 0.96 * dx * disc, y + 0.96 * dy * disc), "frame")
            text(root, (x + 0.88 * dx * disc - 8 * dy, y + 0.88 * dy * disc - 5 * dx), name, "middle", "small")
    labels: dict[bool, list[Label]] = {True: [], False: []}
    leaders = {}
    for i, (finger, end) in enumerate(zip(hand.fingers, ends, strict=True)):
        color = css(finger_color(i))
        base, tip = ((x + scale * float(p[0]), y - scale * float(p[1])) for p in (finger.base, end))
        radius = scale * finger.links[0].radius
        part(root, "circle", "ball", cx=px(base[0]), cy=px(base[1]), r=px(radius), fill=color)
        short = min(1.0, 0.6 * most / max(hypot(tip[0] - base[0], tip[1] - base[1]), 1e-9))
        tip = (base[0] + short * (tip[0] - base[0]), base[1] + short * (tip[1] - base[1]))
        line(root, base, tip, "reach", stroke=color)
        at = f"{signed(1e3 * finger.base[0], 1)}, {signed(1e3 * finger.base[1], 1)}"
        labels[finger.base[0] > 0].append((base[0], base[1] - 4, [_short(finger.name), at]))
        leaders[base] = (color, radius)
    for right, entries in labels.items() if numbers else ():
        edge, anchor = (width - 2, "end") if right else (2.0, "start")
        for (base_x, base_y, _), (_, v, words) in zip(
            sorted(entries, key=_height), _apart(entries, height - 4), strict=True
        ):
            color, radius = leaders[base_x, base_y + 4]
            inner = edge + (-1 if right else 1) * (8 * max(map(len, words)) + 4)
            side = radius if right else -radius
            line(root, (base_x + side, base_y + 4), (inner, v + 2), "leader", stroke=color)
            for n, word in enumerate(words):
                text(root, (edge, v + n * (_LINE - 1)), word, anchor, "small" if n else "")
    return tostring(root, encoding="unicode")


def _short(name: str) -> str:
    return name if len(name) <= 10 else f"{name[:9]}…"


def _apart(entries: list[Label], lowest: float) -> list[Label]:
    """Texts moved up until none is over another or below a height, from the lowest on."""
    moved = []
    for x, y, lines in sorted(entries, key=_height, reverse=True):
        last = (len(lines) - 1) * (_LINE - 1)
        y = min(y, lowest - last)
        lowest = y - _LINE - 2
        moved.append((x, y, lines))
    return moved[::-1]


def _height(label: Label) -> float:
    return label[1]
