"""Pages and THIRD_PARTY.md name all that others made of them."""

from __future__ import annotations

import json
from importlib.resources import files
from pathlib import Path

import pytest

from casadi_hands.export.page.notice import notice
from casadi_hands.export.page.page import page_text
from tests.export.example import example_design

THIRD_PARTY = (Path(__file__).parents[3] / "THIRD_PARTY.md").read_text(encoding="utf-8")
LISTED = files("meshcat").joinpath("viewer/dist/main.min.js.THIRD_PARTY_LICENSES.json")


@pytest.mark.skipif(not LISTED.is_file(), reason="this meshcat does not list the parts of its bundle")
def test_every_part_of_the_bundle_is_named_with_its_licence() -> None:
    parts = json.loads(LISTED.read_text(encoding="utf-8"))
    assert {"three", "dat.gui"} <= {part["name"] for part in parts}
    lines = notice().splitlines()
    assert len(lines) == 1 + len(parts)
    for part in parts:
        assert any(f"{part['name']} {part['version']}: {part['license']}, " in line for line in lines)
        assert f"[{part['name']}](" in THIRD_PARTY
        assert f"| {part['license']} |" in THIRD_PARTY


def test_the_notice_stands_in_a_comment_at_the_top_of_a_page() -> None:
    page = page_text(example_design())
    begin, end = page.index("<!--"), page.index("-->")
    assert page.startswith("<!DOCTYPE html>")
    assert begin < page.index(notice()) < end < page.index("<head>")
    assert "--" not in notice()


def test_a_bundle_that_does_not_list_its_parts_is_named(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr("casadi_hands.export.page.notice.files", lambda _: tmp_path)
    assert notice.__wrapped__() == "meshcat's viewer: MIT licence, (c) Robin Deits"
