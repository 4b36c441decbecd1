"""From the text of a task file to YAML's nodes, which know their lines; bounded before anything is made of them."""

from __future__ import annotations

import re
from functools import lru_cache
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.composer import Composer
from ruamel.yaml.error import MarkedYAMLError, YAMLError
from ruamel.yaml.nodes import Node

from casadi_hands.errors import TaskError
from casadi_hands.task.shown import escaped, unprintable
from casadi_hands.task.textfile import LARGEST

MOST_NODES = 20_000
"""Values and names, those that aliases repeat included; a task of a hundred goals has two thousand."""
MOST_LEVELS = 20
"""Of lists and mappings within each other; a task has seven."""
_VERSION = re.compile(r"^%YAML[ \t]+(?!1\.2\b)(\S+)", re.MULTILINE)
_LONGEST = 300  # characters of what the parser says
_AS_YAML = "; mend that line or the one before"


class TooMuchError(Exception):
    """More than a task file may have.

    Attributes:
        what: is too much, and how much is allowed.
        line: from 1.
    """

    def __init__(self, what: str, line: int) -> None:
        super().__init__(what)
        self.what, self.line = what, line


class _Bounded(Composer):
    """Counts nodes and levels before it makes them."""

    def __init__(self, loader: Any = None) -> None:
        super().__init__(loader)
        self.warn_double_anchors = False
        self._nodes = self._level = 0

    def compose_node(self, parent: Any, index: Any) -> Any:
        self._nodes += 1
        self._level += 1
        line = self.parser.peek_event().start_mark.line + 1
        if self._nodes > MOST_NODES:
            raise TooMuchError(too_many(), line)
        if self._level > MOST_LEVELS:
            raise TooMuchError(too_deep(), line)
        node = super().compose_node(parent, index)
        self._level -= 1
        return node


def too_many() -> str:
    """What is said of a file with too many nodes."""
    return f"more than {MOST_NODES:,} values; a task file needs some hundred"


def too_deep() -> str:
    """What is said of a file with too many levels."""
    return f"nested too deeply, in more than {MOST_LEVELS} levels; a task file needs a few"


def compose(text: str, source: str) -> Node | None:
    """The root node of a text, or None where it is empty.

    Args:
        text: YAML.
        source: name for messages.

    Raises:
        TaskError: not YAML 1.2, or larger than a task file may be.
    """
    if len(text) > LARGEST:
        raise TaskError(f"{source}: given {len(text):,} characters; a task file has some thousand")
    if found := unprintable(text):
        line = text.count("\n", 0, found.start()) + 1
        raise TaskError(f"{source}:{line}: given the character {found[0]!a}; a task file is text")
    if version := _VERSION.search(text):
        line = text.count("\n", 0, version.start()) + 1
        raise TaskError(f"{source}:{line}: given YAML {escaped(version[1])}; a task file is YAML 1.2")
    try:
        return _root(text)
    except TooMuchError as much:
        raise TaskError(f"{source}:{much.line}: {much.what}") from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{source}:{mark.line + 1}" if mark else source
        raise TaskError(
            f"{where}: not YAML: {escaped(str(error.problem or error.context), _LONGEST)}{_AS_YAML}"
        ) from None
    except YAMLError as error:
        raise TaskError(f"{source}: not YAML: {escaped(str(error).splitlines()[0], _LONGEST)}{_AS_YAML}") from None
    except ValueError as error:  # a number after a backslash that is no character's
        raise TaskError(f"{source}: not YAML: {escaped(str(error), _LONGEST)}{_AS_YAML}") from None


@lru_cache(maxsize=4)
def _root(text: str) -> Node | None:
    """The root node; a solve reads the task that it wrote once for each audit."""
    yaml = YAML(typ="safe", pure=True)
    yaml.Composer = _Bounded
    root: Node | None = yaml.compose(text)
    return root
