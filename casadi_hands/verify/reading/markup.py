"""URDF and MJCF text, read so that nothing in it goes unseen: no number that is none, nothing stated twice."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from xml.etree import ElementTree
from xml.etree.ElementTree import Element
from xml.parsers import expat

import numpy as np

from casadi_hands.errors import DesignError
from casadi_hands.problem.stored import LARGEST_NUMBER, read_text

MOST = 20_000
"""Elements of a file; a hand of eight fingers and thirty joints has about a thousand."""

DEEPEST = 64
"""No element is deeper in a file: a finger has few links."""

_OPENING = frozenset(("include", "extension", "plugin", "model", "attach", "replicate", "composite", "flexcomp"))
_FILES = frozenset(
    f"{name}{which}"
    for name in ("file", "filename", "meshdir", "texturedir", "assetdir", "url", "uri")
    for which in ("", "right", "left", "up", "down", "front", "back")
)
_NAMES = frozenset(("name", "model", "link", "joint", "body1", "body2"))
_NONE = frozenset(("nan", "inf", "infinity"))
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?")


def read_xml(path: Path, root: str) -> Element:
    """Return the root element of an XML file.

    Raises:
        DesignError: the file is missing, is not XML, declares entities, has another root, is larger than any hand's,
            or names another file.
    """
    text = read_text(path)
    _check_declared(path, text)
    try:
        tree = ElementTree.fromstring(text)
    except (ElementTree.ParseError, ValueError, LookupError, RecursionError) as error:
        raise DesignError(f"{path}: not XML: {error}") from None
    if tree.tag != root:
        raise DesignError(f"{path}: its root is <{tree.tag[:60]}>, not <{root}>")
    if sum(1 for _ in tree.iter()) > MOST:
        raise DesignError(f"{path}: has more than {MOST} elements, which no hand needs")
    level = [tree]
    for _ in range(DEEPEST):
        level = [child for element in level for child in element]
    if level:
        raise DesignError(f"{path}: nested too deeply")
    for element in tree.iter():
        _check_own(path, element)
        for name, text in element.items():
            if name not in _NAMES and not {word.lstrip("+-").lower() for word in text.split()}.isdisjoint(_NONE):
                raise DesignError(f"{path}: {called(element)}: {name} is '{text[:60]}', which is not finite")
    return tree


def _check_declared(path: Path, text: str) -> None:
    """Refuse what a reader of one kind heeds and another does not: document types, instructions, other encodings.

    Raises:
        DesignError: the text has one, or is not XML.
    """

    def refuse(words: str) -> None:
        raise DesignError(f"{path}: {words}")

    def declared(_version: str, encoding: str | None, _standalone: int) -> None:
        if encoding is not None and encoding.lower() not in ("utf-8", "us-ascii"):
            refuse(f"declares the encoding {encoding[:40]}; the format is UTF-8")

    parser = expat.ParserCreate("utf-8")
    parser.StartDoctypeDeclHandler = lambda *_: refuse("declares a document type; the format has none")
    parser.ProcessingInstructionHandler = lambda *_: refuse("has instructions for programs; the format has none")
    parser.XmlDeclHandler = declared
    try:
        parser.Parse(text.encode("utf-8"), True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise DesignError(f"{path}: not XML: {error}") from None


def _check_own(path: Path, element: Element) -> None:
    """Refuse what would have a reader open another file, or load other code.

    Raises:
        DesignError: the element does, or has an attribute that cannot be printed.
    """
    named = {} if element.tag == "mesh" and "file" not in element.attrib else element.attrib
    if element.tag in _OPENING or not _FILES.isdisjoint(named):
        raise DesignError(
            f"{path}: {called(element)} would have a reader open other files, run a plugin or make copies"
        )
    if not all(value.isprintable() for value in element.attrib.values()):
        raise DesignError(f"{path}: {called(element)} has an attribute with control characters")


def called(element: Element) -> str:
    """Return the element as a reader finds it in the file: ``<link name="palm">``."""
    tag, name = element.tag[:60], element.get("name")
    return f"<{tag}>" if name is None else f'<{tag} name="{name[:60]}">'


def numbers(path: Path, element: Element, name: str, count: int, default: str | None = None) -> np.ndarray:
    """Return an attribute's numbers (count,).

    Raises:
        DesignError: it is missing without a default, or anything but ``count`` finite numbers.
    """
    text = element.get(name, default)
    if text is None:
        raise DesignError(f"{path}: {called(element)} has no {name}")
    words = text.split()
    if len(words) != count or not all(_NUMBER.fullmatch(word) for word in words):
        what = "a finite number" if count == 1 else f"{count} finite numbers"
        raise DesignError(f"{path}: {called(element)}: {name} is '{text[:60]}', not {what}")
    values = np.array([float(word) for word in words])
    if np.any(np.abs(values) > LARGEST_NUMBER):
        raise DesignError(f"{path}: {called(element)}: {name} is '{text[:60]}', too large for anything of a hand")
    return values


def number(path: Path, element: Element, name: str, default: str | None = None) -> float:
    """Return an attribute that is one number; raises as `numbers`."""
    return float(numbers(path, element, name, 1, default)[0])


def positive(path: Path, element: Element, name: str) -> float:
    """Return an attribute that is one number above zero.

    Raises:
        DesignError: it is missing or anything else.
    """
    value = number(path, element, name)
    if value <= 0.0:
        raise DesignError(f"{path}: {called(element)}: {name} is {value:g}, not above zero")
    return value


def only(path: Path, element: Element, tag: str) -> Element | None:
    """Return the one child of this tag, or None.

    Raises:
        DesignError: there are several, of which a reader would take the first and another the last.
    """
    found = element.findall(tag)
    if len(found) > 1:
        raise DesignError(f"{path}: {called(element)} has {len(found)} elements <{tag}>; one would shadow the other")
    return found[0] if found else None


def name_of(path: Path, element: Element, taken: Mapping[str, object]) -> str:
    """Return an element's name.

    Raises:
        DesignError: it has none, or one of those that are taken.
    """
    name = element.get("name", "")
    if not name:
        raise DesignError(f"{path}: a <{element.tag}> has no name")
    if name in taken:
        raise DesignError(f'{path}: there are two <{element.tag} name="{name}">; one would shadow the other')
    return name


def strangers(element: Element, tags: str, attributes: str | None = None) -> Iterator[str]:
    """Yield what an element holds beside what the format has in it, a sentence each.

    Args:
        element: to look at.
        tags: names of children, separated by spaces.
        attributes: names of attributes, likewise; None for any.
    """
    for child in element:
        if child.tag not in tags.split():
            yield f"{called(child)} in {called(element)} is nothing that the format has there"
    for name in element.attrib if attributes is not None else ():
        if name not in (attributes or "").split():
            yield f"{called(element)}: the format has no attribute {name} there"
