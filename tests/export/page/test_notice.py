"""Pages and THIRD_PARTY.md name all that others made of them."""

from __future__ import annotations

import json
import re
from importlib.resources import files
from pathlib import Path

import pytest

from casadi_hands.export.page.notice import notice
from casadi_hands.export.page.page import page_text
from tests.export.example import example_design

THIRD_PARTY = (Path(__file__).parents[3] / "THIRD_PARTY.md").read_text(encoding="utf-8")
LISTED = files("meshcat").joinpath("viewer/dist/main.min.js.THIRD_PARTY_LICENSES.json")


def test_every_part_of_the_bundle_is_named_with_its_licence() -> None:
    parts = re.findall(r"^  (\S+) (\S+): ([^,\n]+)", notice(), re.MULTILINE)
    listed = json.loads(LISTED.read_text(encoding="utf-8")) if LISTED.is_file() else []
    assert parts == [(part["name"], part["version"], part["license"]) for part in listed]
    for name, _, licence in parts:
        assert f"[{name}](" in THIRD_PARTY
        assert f"| {licence} |" in THIRD_PARTY
    # Older bundles do not list these, and hold them, too.
    assert all(f"[{name}](" in THIRD_PARTY for name in ("three", "dat.gui"))


def test_parts_have_their_authors_without_addresses(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    parts = [
        {"name": "one", "version": "1.0", "license": "MIT", "licenseText": "The MIT License\nCopyright 2020 A\n"},
        {"name": "two", "version": "2.1", "license": "ISC", "licenseText": None, "author": "B <b@example.org>"},
        {"name": "three", "version": "3", "license": "BSD-3-Clause"},
    ]
    place = tmp_path / "viewer/dist/main.min.js.THIRD_PARTY_LICENSES.json"
    place.parent.mkdir(parents=True)
    place.write_text(json.dumps(parts), encoding="utf-8")
    monkeypatch.setattr("casadi_hands.export.page.notice.files", lambda _: tmp_path)
    told = notice.__wrapped__().splitlines()[1:]
    assert told == ["  one 1.0: MIT, Copyright 2020 A", "  two 2.1: ISC, B", "  three 3: BSD-3-Clause"]


def test_the_notice_stands_in_a_comment_at_the_top_of_a_page() -> None:
    page = page_text(example_design())
    begin, end = page.index("<!--"), page.index("-->")
    assert page.startswith("<!DOCTYPE html>")
    assert begin < page.index(notice()) < end < page.index("<head>")
    assert "--" not in notice()


def test_a_bundle_that_does_not_list_its_parts_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("casadi_hands.export.page.notice.files", lambda _: tmp_path)
    assert notice.__wrapped__() == "meshcat's viewer: MIT licence, (c) Robin Deits"
