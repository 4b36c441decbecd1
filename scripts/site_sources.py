"""Hooks of mkdocs: files of the repository that pages link to, and that are not in docs/, become pages, too.

Links lead where they lead on the repository's own pages: to a file as it stands, to a folder's list of files. The
navigation gets the recipes in the order in which their index lists them.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
RECIPES = DOCS / "how-to"
PLACE = "source"
"""Folder of these pages."""
_LINK = re.compile(r"(\]\()([^)\s]+)(\))")
_FENCE = re.compile(r"(^ *```.*?^ *```|`[^`\n]+`)", re.DOTALL | re.MULTILINE)
_LANGUAGES = {".py": "python", ".yaml": "yaml", ".json": "json", ".toml": "toml"}


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Put every recipe that the recipes' index lists behind it in the navigation."""
    index = RECIPES / "README.md"
    (recipes,) = (section["Recipes"] for section in config.nav or () if "Recipes" in section)
    recipes += [address(page) for page in dict.fromkeys(_targets(index)) if page.parent == RECIPES and page != index]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add a page for every file outside of docs/ that a page links to, and for those that these link to."""
    new = [DOCS / name for name in files.src_uris if name.endswith(".md")]
    known: set[Path] = set(new)
    while new:
        origin = new.pop()
        for target in sorted(set(_targets(origin)) - known):
            known.add(target)
            if _is_page(target):
                continue
            if files.get_file_from_path(address(target)) is None:
                files.append(File.generated(config, address(target), content=_content(target)))
            if target.suffix == ".md" or target.is_dir():
                new.append(target)
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Let links lead to these pages."""
    return relinked(markdown, _origin(page.file.src_uri), page.file.src_uri)


def relinked(markdown: str, origin: Path, uri: str) -> str:
    """A page's text with links as they must be on the site.

    Args:
        markdown: the text, with links relative to ``origin``.
        origin: the file or folder of the repository that the text is of.
        uri: where its page is, relative to docs/.
    """

    def changed(link: re.Match[str]) -> str:
        path, mark, anchor = link[2].partition("#")
        if not path or "://" in path or path.startswith("mailto:"):
            return link[0]
        target = address(_resolved(origin, path))
        return f"{link[1]}{os.path.relpath(target, Path(uri).parent)}{mark}{anchor}{link[3]}"

    parts = _FENCE.split(markdown)  # every second one is code
    return "".join(part if k % 2 else _LINK.sub(changed, part) for k, part in enumerate(parts))


def address(target: Path) -> str:
    """Where a file or folder of the repository is on the site, relative to docs/."""
    if _is_page(target):
        inside = target.relative_to(DOCS)
        return (inside / "README.md" if target.is_dir() else inside).as_posix()
    name = target.relative_to(ROOT).as_posix()
    if target.suffix == ".md":
        return f"{PLACE}/{name.lower().replace('readme.md', 'about.md')}"  # README.md would be the folder's index
    return f"{PLACE}/{name}.md"


def _is_page(target: Path) -> bool:
    """Whether something is of the documents, not a record that they are written from."""
    if target.is_dir():
        return target == DOCS or (DOCS in target.parents and (target / "README.md").is_file())
    return DOCS in target.parents and target.suffix != ".json"


def _resolved(origin: Path, link: str) -> Path:
    base = origin if origin.is_dir() else origin.parent
    return Path(os.path.normpath(base / link))


def _targets(origin: Path) -> Iterator[Path]:
    """Files and folders that a page of the repository links to."""
    text = _content(origin)
    for k, part in enumerate(_FENCE.split(text)):
        if k % 2:
            continue
        for link in _LINK.finditer(part):
            path = link[2].partition("#")[0]
            if path and "://" not in path and not path.startswith("mailto:"):
                target = _resolved(origin, path)
                if target.exists() and ROOT in target.parents:
                    yield target


def _origin(uri: str) -> Path:
    """The file or folder that a page is of."""
    if not uri.startswith(f"{PLACE}/"):
        return DOCS / uri
    name = uri.removeprefix(f"{PLACE}/")
    for candidate in (ROOT / name.removesuffix(".md"), *ROOT.glob("*.md")):
        if candidate.exists() and address(candidate) == uri:
            return candidate
    return ROOT / name


def _content(target: Path) -> str:
    """The text of a page: Markdown as it stands, other files as code, a folder as its list."""
    if target.is_dir():
        names = sorted(each.name for each in target.iterdir() if each.is_file() and not each.name.startswith("."))
        lines = "\n".join(f"- [{name}]({name})" for name in names)
        return f"# {target.relative_to(ROOT).as_posix()}/\n\n{lines}\n"
    try:
        text = target.read_text(encoding="utf-8")
    except UnicodeDecodeError:
        text = "(no text)"
    if target.suffix == ".md":
        return text
    name = target.relative_to(ROOT).as_posix()
    return f"# {name}\n\n````{_LANGUAGES.get(target.suffix, '')}\n{text}\n````\n"
