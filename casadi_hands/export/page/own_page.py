"""A folder's page, opened only if it is what the folder's other files give.

A page runs its scripts in the browser, and one that came with a folder can be anybody's. The data it is made of run
nowhere, so the page is made again from them, and replaces what is not the same byte for byte.
"""

from __future__ import annotations

import logging
import os
import re
import tempfile
import webbrowser
from collections.abc import Sequence
from contextlib import suppress
from html import unescape
from pathlib import Path

from casadi_hands.errors import DesignError
from casadi_hands.export.design import Design
from casadi_hands.export.page.page import MenuEntry, page_text
from casadi_hands.export.page.pair import pair_text
from casadi_hands.problem.stored import read_bytes

_LOG = logging.getLogger(__name__)
PAGE = "viewer.html"
PAIR = "viewer-pair.html"
_LARGEST = 256 << 20  # bytes; a page holds what draws it, which takes two millions
_MENU = re.compile(r'<nav id="menu" aria-label="[\w ]*">((?:<a [^<>]*>[^<>]*</a>)*)</nav>')
_ENTRY = re.compile(r'<a (?:aria-current="page"|href="((?:alternatives/|\.\./)seed\d+/viewer\.html)")>([^<>]*)</a>')


def open_page(directory: Path) -> Path:
    """Open a result folder's page in the browser.

    It, and those that its menu leads to, are made anew where they are not what the folder's other files give.

    Args:
        directory: a result folder.

    Returns:
        The page's path.

    Raises:
        DesignError: the folder cannot be read, its page is another and cannot be replaced, or there is no browser.
    """
    for entry in _own(directory):
        if entry.address is not None:
            _own((directory / entry.address).parent)
    return _opened(directory / PAGE)


def open_pair(one: Path, other: Path, out: Path | None = None) -> Path:
    """Write the page of two result folders side by side, and open it in the browser.

    Args:
        one: a result folder.
        other: another.
        out: the file to write; ``viewer-pair.html`` in the first folder if not given.

    Returns:
        The page's path.

    Raises:
        DesignError: a folder cannot be read, the page cannot be written, or there is no browser.
    """
    names = one.resolve(), other.resolve()
    short = [path.name if names[0].name != names[1].name else f"{path.parent.name}/{path.name}" for path in names]
    text = pair_text(Design.load(one), Design.load(other), (short[0], short[1]))
    page = out or one / PAIR
    _replace(page, text.encode("utf-8"), f"{page}: the page of both cannot be written")
    return _opened(page)


def _opened(page: Path) -> Path:
    if not webbrowser.open(page.resolve().as_uri()):
        raise DesignError(f"no browser found; open {page.resolve()} in one yourself", "")
    return page


def _own(directory: Path) -> list[MenuEntry]:
    """Make a folder's page anew if it is another, and return its menu."""
    page, design = directory / PAGE, Design.load(directory)
    found = b""
    if page.is_file() and not page.is_symlink():
        with suppress(DesignError):
            found = read_bytes(page, _LARGEST)
    menu = _menu(found.decode("utf-8", errors="replace"))
    text = page_text(design, menu=menu).encode("utf-8")
    if found != text:
        _replace(
            page, text, f"{page}: not the page that the folder's files give, so it is not opened; it cannot be replaced"
        )
        if found:
            _LOG.warning("%s was another version's page, or a stranger's: made anew from the folder's files", page)
    return menu


def _menu(text: str) -> list[MenuEntry]:
    """The menu of a page, of entries as an exploration writes them."""
    found = _MENU.search(text)
    entries: Sequence[tuple[str, str]] = _ENTRY.findall(found[1]) if found else []
    return [MenuEntry(unescape(words), address or None) for address, words in entries]


def _replace(page: Path, text: bytes, failed: str) -> None:
    """Put a page in the place of what is there, and never through a link; else say what failed."""
    try:
        descriptor, beside = tempfile.mkstemp(dir=page.parent, prefix=f".{PAGE}-")
        try:
            with os.fdopen(descriptor, "wb") as file:
                file.write(text)
            os.chmod(beside, 0o644)
            os.replace(beside, page)
        except BaseException:
            Path(beside).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise DesignError(f"{failed}: {error}", "copy the folder to where you may write, and view it there") from None
