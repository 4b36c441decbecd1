"""A YAML file as plain data that remembers its lines."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from ruamel.yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from casadi_hands.errors import TaskError
from casadi_hands.task.nodes import MOST_LEVELS, MOST_NODES, TooMuchError, compose, too_deep, too_many
from casadi_hands.task.problem import Problem
from casadi_hands.task.shown import escaped, shown, unprintable

Path = tuple[str | int, ...]
"""Where a value stands in the file: names of fields, and numbers in lists."""

_CORE = "tag:yaml.org,2002:"
_LONGEST_NUMBER = 400  # characters; Python reads no integer of more than 4300 digits
_UNTAGGED = "values without a tag"


class TaskFile:
    """The content of a task file.

    Attributes:
        source: the file's name as messages print it.
        data: mappings, lists, strings, numbers, booleans and None.
    """

    def __init__(self, text: str, source: str) -> None:
        """Parse the text.

        Args:
            text: YAML.
            source: name for messages.

        Raises:
            TaskError: not YAML, empty, not a mapping, or more than a task file may have.
        """
        self.source = source
        root = compose(text, source)
        try:
            data = None if root is None else _Content().of(root, ())
        except TooMuchError as much:
            raise TaskError(f"{source}:{much.line}: {much.what}") from None
        except _RefusedError as refused:
            raise TaskError(f"{source}:{refused.line}: {refused.problem}") from None
        if root is None or data is None:
            raise TaskError(f"{source}: empty; a task file needs at least object, palm, motion and fingers")
        if not isinstance(data, dict):
            given = "a list" if isinstance(data, list) else shown(data)
            wanted = "a task file is a mapping of fields such as object, palm, motion and fingers"
            raise TaskError(f"{source}:1: given {given}; {wanted}")
        self._root = root
        self._names: dict[int, dict[str, tuple[Node, Node]]] = {}  # by mapping node
        self.data: dict[str, Any] = data

    def line(self, path: Path) -> int:
        """Line of the value at ``path``, from 1; of the deepest part of the path that the file has.

        What is not written there, a default, a missing field or one merged from an anchor, has no line.
        """
        node, line = self._root, 1
        for step in path:
            found = self._below(node, step)
            if found is None:
                break
            line, node = found[0].start_mark.line + 1, found[1]
        return line

    def _below(self, node: Node, step: str | int) -> tuple[Node, Node] | None:
        """Where the value of a step begins, and the value."""
        if isinstance(node, SequenceNode) and isinstance(step, int) and step < len(node.value):
            return node.value[step], node.value[step]
        if not isinstance(node, MappingNode):
            return None
        if id(node) not in self._names:
            self._names[id(node)] = {key.value: (key, value) for key, value in reversed(node.value)}
        return self._names[id(node)].get(str(step))


class _RefusedError(Exception):
    """What YAML allows, and a task file does not."""

    def __init__(self, node: Node, path: Path, given: str, allowed: str) -> None:
        super().__init__(given)
        self.line, self.problem = node.start_mark.line + 1, Problem(path, given, allowed)


class _Content:
    """Plain data of nodes, each alias written out, as long as there are not too many."""

    def __init__(self) -> None:
        self._nodes = 0
        self._open: list[Node] = []

    def of(self, node: Node, path: Path) -> Any:
        """Copy of a node in Python's own types."""
        self._nodes += 1
        if any(node is each for each in self._open):
            raise _RefusedError(node, path, "an alias of what it stands in", "aliases of what is written elsewhere")
        if self._nodes > MOST_NODES:
            raise TooMuchError(too_many(), node.start_mark.line + 1)
        if len(self._open) >= MOST_LEVELS:
            raise TooMuchError(too_deep(), node.start_mark.line + 1)
        if isinstance(node, ScalarNode):
            return _scalar(node, path)
        if node.tag != _CORE + ("map" if isinstance(node, MappingNode) else "seq"):
            raise _RefusedError(node, path, f"the tag {_tag(node)}", _UNTAGGED)
        self._open.append(node)
        if isinstance(node, MappingNode):
            data: Any = self._mapping(node, path)
        else:
            data = [self.of(child, (*path, number)) for number, child in enumerate(node.value)]
        self._open.pop()
        return data

    def _mapping(self, node: MappingNode, path: Path) -> dict[str, Any]:
        own: dict[str, Any] = {}
        merged: dict[str, Any] = {}
        for key, value in node.value:
            if not isinstance(key, ScalarNode):
                kind = "mapping" if isinstance(key, MappingNode) else "list"
                raise _RefusedError(key, path, f"a {kind} for a name", "names of fields")
            self._nodes += 1
            if key.tag == f"{_CORE}merge":
                merged = {**self._merged(value, path), **merged}
                continue
            name = str(_scalar(key, path, str))
            if name in own:
                what = f"{escaped(name)}: given twice; each field may be given once"
                raise TooMuchError(what, key.start_mark.line + 1)
            own[name] = self.of(value, (*path, name))
        return own | {name: value for name, value in merged.items() if name not in own}

    def _merged(self, node: Node, path: Path) -> dict[str, Any]:
        """What `<<` takes over; of a list, from the first that has it."""
        data = self.of(node, (*path, "<<"))
        found: dict[str, Any] = {}
        for each in data if isinstance(data, list) else [data]:
            if not isinstance(each, dict):
                raise _RefusedError(node, (*path, "<<"), shown(each), "a mapping, or a list of mappings, to be merged")
            found |= {name: value for name, value in each.items() if name not in found}
        return found


def _number(text: str) -> int:
    """Integer of YAML 1.2, with the underscores and the binary ones of 1.1."""
    plain = text.replace("_", "").lower()
    base = {"0x": 16, "0o": 8, "0b": 2}.get(plain.lstrip("+-")[:2], 10)
    return int(plain, base)


def _decimal(text: str) -> float:
    plain = text.replace("_", "").lower()
    special = plain.lstrip("+-") in (".inf", ".nan")
    return float(plain.replace(".", "") if special else plain)


_FROM: dict[str, Callable[[str], Any]] = {
    "str": str,
    "int": _number,
    "float": _decimal,
    "bool": lambda text: {"true": True, "false": False}[text.lower()],
    "null": lambda text: {"": None, "~": None, "null": None}[text.lower()],
    # Dates, and a lone `=`, are text to a task.
    "timestamp": str,
    "value": str,
    "merge": str,
}


def _scalar(node: ScalarNode, path: Path, kind: Callable[[str], Any] | None = None) -> Any:
    """What a scalar says; as its tag has it, or of a kind."""
    text: str = node.value
    if unprintable(text):
        raise _RefusedError(node, path, shown(text), "text without control characters")
    tag = str(node.tag).removeprefix(_CORE)
    if tag not in _FROM:
        raise _RefusedError(node, path, f"{_tag(node)} {escaped(text)}", _UNTAGGED)
    if tag in ("int", "float") and len(text) > _LONGEST_NUMBER:
        raise _RefusedError(node, path, escaped(text), f"a number of at most {_LONGEST_NUMBER} digits")
    try:
        return (kind or _FROM[tag])(text)
    except (ValueError, KeyError, OverflowError):
        raise _RefusedError(
            node, path, f"{_tag(node)} {shown(text)}", "a value that fits its tag, or one without a tag"
        ) from None


def _tag(node: Node) -> str:
    """A tag as a file has it."""
    tag = str(node.tag)
    return escaped(f"!!{tag.removeprefix(_CORE)}" if tag.startswith(_CORE) else tag)
