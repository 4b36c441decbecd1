"""Tables of the documents are what records of measurements say."""

from __future__ import annotations

import json
import re
import subprocess
from pathlib import Path

import pytest
from tables import CHANGED, RECORDS, ROOT, Record, commit_of, filled, read_record, shown, write_record

PAGES = sorted(ROOT.glob("docs/**/*.md"))


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_pages_are_as_the_script_writes_them(page: Path) -> None:
    text = page.read_text(encoding="utf-8")
    assert filled(text, RECORDS) == text, "write it with: python scripts/tables.py"


def test_tables_of_the_benchmarks_are_all_written_by_the_script() -> None:
    for name in ("benchmarks.md", "outside.md"):
        text = (ROOT / "docs" / name).read_text(encoding="utf-8")
        assert "\n|" not in re.sub(r"<!-- table: .*?<!-- end of table -->", "", text, flags=re.DOTALL)


def test_every_record_is_of_a_commit_and_is_shown() -> None:
    text = "".join(page.read_text(encoding="utf-8") for page in PAGES)
    assert len(list(RECORDS.iterdir())) > 10
    for file in RECORDS.iterdir():
        record = read_record(file)
        assert re.fullmatch(r"[0-9a-f]{7}", record.commit), f"{file.name}: {record.commit}"
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", record.date)
        assert {len(row) for row in record.rows} == {len(record.columns)}, file.name
        assert f"<!-- table: {file.stem} -->" in text, file.name


def test_a_page_keeps_all_but_its_tables(tmp_path: Path) -> None:
    record = Record("1234567", "2026-11-27", "2 cores", "python a.py", ["task", "s"], [["ball", "3|4"]])
    (tmp_path / "one.json").write_text(json.dumps(record.__dict__))
    page = "# A\n\n<!-- table: one -->\nold\n| x |\n<!-- end of table -->\n\nB\n"
    new = filled(page, tmp_path)
    assert new == f"# A\n\n<!-- table: one -->\n{shown(record)}<!-- end of table -->\n\nB\n"
    assert "Commit 1234567, 2026-11-27, 2 cores: `python a.py`" in new
    assert "| ball | 3\\|4 |" in new
    assert filled(new, tmp_path) == new
    with pytest.raises(FileNotFoundError):
        filled("<!-- table: none -->\n<!-- end of table -->", tmp_path)


def test_what_is_written_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("tables.commit_of", lambda root: "1234567")
    given = ["scripts/measure.py", "problems/a b.yaml", "--json", str(tmp_path), "--out=x", "--seeds", "0", "1"]
    monkeypatch.setattr("sys.argv", given)
    write_record(tmp_path, "one", ("task", "s"), [["bälle", "1"], ["b", "2"]])
    found = read_record(tmp_path / "one.json")
    assert (found.commit, found.columns, found.rows) == ("1234567", ["task", "s"], [["bälle", "1"], ["b", "2"]])
    # Where results are put is nobody else's.
    assert found.command == "python scripts/measure.py 'problems/a b.yaml' --seeds 0 1"
    write_record(None, "two", ("task",), [["a"]])
    assert [file.name for file in tmp_path.iterdir()] == ["one.json"]


def test_a_commit_with_changes_says_so(tmp_path: Path) -> None:
    def git(*words: str) -> None:
        identity = ["-c", "user.name=a", "-c", "user.email=a@b.example"]
        subprocess.run(["git", *identity, *words], cwd=tmp_path, check=True, capture_output=True)

    (tmp_path / "casadi_hands").mkdir()
    source = tmp_path / "casadi_hands" / "a.py"
    source.write_text("1\n")
    git("init")
    git("add", ".")
    git("commit", "-m", "One")
    commit = commit_of(tmp_path)
    assert re.fullmatch(r"[0-9a-f]{7}", commit)
    (tmp_path / "notes").write_text("not measured\n")
    assert commit_of(tmp_path) == commit
    source.write_text("2\n")
    assert commit_of(tmp_path) == commit + CHANGED
