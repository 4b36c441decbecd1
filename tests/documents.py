"""What the README and the pages of docs/ hold: links, blocks of code, commands."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

ROOT = Path(__file__).parents[1]
README = ROOT / "README.md"
PAGES = (README, *sorted((ROOT / "docs").glob("**/*.md")))


def read(page: Path) -> str:
    """The text of a file."""
    return page.read_text(encoding="utf-8")


def blocks(page: Path, language: str) -> list[str]:
    """The fenced blocks of a language."""
    return re.findall(rf"^```{language}\n(.*?)^```", read(page), re.DOTALL | re.MULTILINE)


def links(page: Path) -> list[str]:
    """Targets of links and pictures."""
    return re.findall(r"\]\(([^)]+)\)", read(page))


def heading_anchors(page: Path) -> set[str]:
    """What links can lead to within a page: headings in lower case, without punctuation, joined by hyphens."""
    headings = re.findall(r"^#+ (.*)$", read(page), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


def commands(page: Path) -> list[list[str]]:
    """The commands of a page in words: lines of its blocks for a shell, and what of its inline code begins as one."""
    lines = [line for block in blocks(page, "sh") for line in block.splitlines() if line]
    prose = re.sub(r"^```.*?^```", "", read(page), flags=re.DOTALL | re.MULTILINE)
    spans = [" ".join(span.split()) for span in re.findall(r"`([^`]+)`", prose)]
    lines += [span for span in spans if re.match(r"(casadi-hands|python scripts/\w+\.py|dask) \S", span)]
    found = [shlex.split(each) for line in lines for each in line.split("&&")]
    return [[word for i, word in enumerate(words) if i or "=" not in word] for words in found]
