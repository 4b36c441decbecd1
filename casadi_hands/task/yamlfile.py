"""A YAML file as plain data that remembers its lines."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache
from pathlib import Path as FilePath
from typing import Any

from ruamel.yaml import YAML
from ruamel.yaml.constructor import DuplicateKeyError
from ruamel.yaml.error import MarkedYAMLError, YAMLError

from casadi_hands.errors import TaskError

Path = tuple[str | int, ...]
"""Where a value stands in the file: names of fields, and numbers in lists."""


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
            TaskError: not YAML, empty, or not a mapping.
        """
        self.source = source
        self._tree = _parse(text, source)
        self.data: dict[str, Any] = _plain(self._tree)

    def line(self, path: Path) -> int:
        """Line of the value at ``path``, from 1; of the deepest part of the path that the file has."""
        node, line = self._tree, 1
        for step in path:
            # What is not written here, a default, a missing field or a value merged from an anchor, has no line.
            with suppress(AttributeError, KeyError, TypeError, IndexError):
                line = (node.lc.item(step) if isinstance(step, int) else node.lc.key(step))[0] + 1
            try:
                node = node[step]
            except (KeyError, TypeError, IndexError):
                break
        return line


def read(path: FilePath) -> str:
    """Text of a file.

    Raises:
        TaskError: there is none, or it is not text.
    """
    if not path.exists():
        raise TaskError(f"{path}: no such file; give the path of a task file")
    if path.is_dir():
        raise TaskError(f"{path}: is a directory; give the path of a task file in it")
    try:
        return path.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        raise TaskError(f"{path}: not a text file; a task file is YAML in UTF-8") from None
    except OSError as error:
        raise TaskError(f"{path}: cannot be read: {error.strerror}") from None


def _parse(text: str, source: str) -> Any:
    try:
        tree = _tree(text)
    except DuplicateKeyError as error:
        line = error.problem_mark.line + 1 if error.problem_mark else 1
        name = str(error.problem).split('"')[1]
        raise TaskError(f"{source}:{line}: {name}: given twice; each field may be given once") from None
    except MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        where = f"{source}:{mark.line + 1}" if mark else source
        raise TaskError(f"{where}: not YAML: {error.problem or error.context}") from None
    except YAMLError as error:
        raise TaskError(f"{source}: not YAML: {str(error).splitlines()[0]}") from None
    except RecursionError:
        raise TaskError(f"{source}: nested too deeply; a task file needs a few levels") from None
    if tree is None:
        raise TaskError(f"{source}: empty; a task file needs at least object, palm, motion and fingers")
    if not isinstance(tree, dict):
        given = "a list" if isinstance(tree, list) else repr(_plain(tree))
        wanted = "a task file is a mapping of fields such as object, palm, motion and fingers"
        raise TaskError(f"{source}:1: given {given}; {wanted}")
    return tree


@lru_cache(maxsize=4)
def _tree(text: str) -> Any:
    """The text with its lines; a solve reads the task that it wrote once for each audit."""
    return YAML(typ="rt").load(text)


def _plain(node: Any) -> Any:
    """Copy of a parsed tree in Python's own types."""
    if isinstance(node, dict):
        return {str(name): _plain(value) for name, value in node.items()}
    if isinstance(node, list):
        return [_plain(value) for value in node]
    for kind in (bool, int, float, str):
        if isinstance(node, kind):
            return kind(node)
    return node
