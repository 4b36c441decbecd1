"""The documents as pages: they build without a warning, every link leads somewhere, and nothing is fetched."""

from __future__ import annotations

import os
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote

import pytest

import casadi_hands
from tests.documents import PAGES, README, ROOT, read

pytest.importorskip("mkdocs")
pytest.importorskip("mkdocstrings")


class Found(HTMLParser):
    """What a page links to, what it loads, where links can lead to within it, and its words."""

    def __init__(self, file: Path) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.words: list[str] = []
        self.feed(file.read_text(encoding="utf-8"))

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        known = {name: value or "" for name, value in attrs}
        self.anchors |= {known[name] for name in ("id", "name") if name in known}
        if tag == "a" and "href" in known:
            self.links.append(known["href"])
        if "src" in known:
            self.loads.append(known["src"])
        if tag == "link" and known.get("rel") != "canonical":
            self.loads.append(known["href"])

    def handle_data(self, data: str) -> None:
        self.words.append(data)


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    command = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", str(folder)]
    environment = {**os.environ, "NO_MKDOCS_2_WARNING": "1"}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr
    return folder


@pytest.fixture(scope="module")
def pages(site: Path) -> dict[Path, Found]:
    return {file: Found(file) for file in site.glob("**/*.html")}


def test_every_document_is_a_page_that_says_its_title(site: Path) -> None:
    for page in PAGES:
        if page == README:
            continue
        name = page.relative_to(ROOT / "docs").with_suffix(".html").as_posix().replace("README", "index")
        title = read(page).partition("\n")[0].lstrip("# ").replace("`", "")
        assert title in "".join(Found(site / name).words), name


def test_no_link_is_dead(site: Path, pages: dict[Path, Found]) -> None:
    count = 0
    for file, found in pages.items():
        for link in found.links + found.loads:
            path, _, anchor = unquote(link).partition("#")
            if "://" in path or path.startswith(("mailto:", "data:")) or (file.name == "404.html" and path[:1] == "/"):
                continue
            target = (file.parent / path).resolve() if path else file
            assert target.is_file(), f"{file.relative_to(site)}: {link}"
            assert not anchor or target not in pages or anchor in pages[target].anchors, f"{file.name}: {link}"
            count += 1
    assert count > 1000


def test_nothing_is_loaded_from_elsewhere(pages: dict[Path, Found]) -> None:
    assert [load for found in pages.values() for load in found.loads if "//" in load] == []


def test_the_api_has_every_public_name_with_its_docstring(site: Path) -> None:
    found = Found(site / "api.html")
    text = " ".join(" ".join(found.words).split())
    for name in casadi_hands.__all__:
        assert f" casadi_hands.{name} " in text, name
        thing = getattr(casadi_hands, name)
        assert {f"casadi_hands.{name}", f"{thing.__module__}.{thing.__qualname__}"} & found.anchors, name
        assert f"casadi_hands.{name}.{name}" not in found.anchors  # the module of that name
        docstring = thing.__doc__
        assert docstring.partition("\n")[0].split("`")[0].strip().rstrip(".") in text, name


def test_files_that_pages_link_to_are_pages_too(site: Path) -> None:
    text = "".join(Found(site / "source/examples/play.py.html").words)
    assert read(ROOT / "examples/play.py") in text
    assert "pill_turn.yaml" in "".join(Found(site / "source/problems.html").words)
