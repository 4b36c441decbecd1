"""Write the tables of the documents from the records of the runs that measured them.

    python scripts/measure.py problems/pill_turn.yaml --json docs/benchmarks
    python scripts/tables.py

A record is a file of ``docs/benchmarks``: the columns and rows of one table, and the commit, the day, the machine and
the command that they come from. Scripts that measure write their records themselves (``--json``). In a page a table
stands between ``<!-- table: NAME -->`` and ``<!-- end of table -->``; what is between them is written anew.
"""

from __future__ import annotations

import json
import os
import re
import shlex
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from datetime import date
from pathlib import Path

from shared import table_text

ROOT = Path(__file__).parents[1]
RECORDS = ROOT / "docs" / "benchmarks"
MEASURED = ("casadi_hands", "problems")
"""What a measurement is of: where this differs from the commit, a record says so."""
CHANGED = " with changes"
_TABLE = re.compile(r"(<!-- table: (\w+) -->\n).*?(<!-- end of table -->)", re.DOTALL)


@dataclass(frozen=True)
class Record:
    """One table, and where it comes from.

    Attributes:
        commit: of the program that was measured, abbreviated.
        date: of the measurement, or where it was not noted of the commit that reported it; ISO 8601.
        machine: cores, and what else ran.
        command: what to type to measure it again.
        columns: heads of the columns.
        rows: cells, as they are shown.
    """

    commit: str
    date: str
    machine: str
    command: str
    columns: Sequence[str]
    rows: Sequence[Sequence[str]]


def main() -> None:
    """Write the tables of all pages."""
    ArgumentParser(description=(__doc__ or "").partition("\n")[0]).parse_args()
    for page in sorted(ROOT.glob("docs/**/*.md")):
        text = page.read_text(encoding="utf-8")
        if (new := filled(text, RECORDS)) != text:
            page.write_text(new, encoding="utf-8")
            print(page.relative_to(ROOT))


def filled(text: str, records: Path) -> str:
    """The text of a page with every table as its record has it.

    Raises:
        FileNotFoundError: a table has no record.
    """
    return _TABLE.sub(lambda found: f"{found[1]}{shown(read_record(records / f'{found[2]}.json'))}{found[3]}", text)


def shown(record: Record) -> str:
    """A record in Markdown: where it comes from in a line, then the table."""
    source = f"Commit {record.commit}, {record.date}, {record.machine}: `{record.command}`"
    return f"\n{source}\n\n{table_text(record.columns, record.rows)}\n"


def read_record(file: Path) -> Record:
    """Read a record.

    Raises:
        FileNotFoundError: it is not there.
        TypeError: a key is missing, or one too many.
    """
    return Record(**json.loads(file.read_text(encoding="utf-8")))


def write_record(folder: Path | None, name: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Write what the running script has measured, with where it comes from, as ``NAME.json``; nothing without a folder.

    A row has a line of its own in the file, so that differences can be read.
    """
    if folder is None:
        return
    record = Record(commit_of(ROOT), date.today().isoformat(), f"{os.cpu_count()} cores", command(), columns, rows)
    text = {key: json.dumps(value, ensure_ascii=False) for key, value in asdict(record).items()}
    lines = ",\n  ".join(json.dumps(row, ensure_ascii=False) for row in rows)
    text["rows"] = f"[\n  {lines}\n ]"
    folder.mkdir(parents=True, exist_ok=True)
    pairs = ",\n".join(f' "{key}": {value}' for key, value in text.items())
    (folder / f"{name}.json").write_text(f"{{\n{pairs}\n}}\n", encoding="utf-8")


def commit_of(root: Path) -> str:
    """The commit that is checked out, abbreviated; says so where what is measured differs from it."""

    def git(*words: str) -> str:
        return subprocess.run(["git", *words], cwd=root, capture_output=True, text=True, check=True).stdout.strip()

    changed = git("status", "--porcelain", "--untracked-files=no", "--", *MEASURED)
    return git("rev-parse", "--short=7", "HEAD") + (CHANGED if changed else "")


def command() -> str:
    """The command line that is running, without the folders that it writes to."""
    words = iter(sys.argv[1:])
    kept = []
    for word in words:
        if word in ("--json", "--out"):
            next(words, None)
        elif not word.startswith(("--json=", "--out=")):
            kept.append(word)
    script = Path(sys.argv[0])
    called = f"{script.parent.name}/{script.name}" if script.parent.name else script.name
    return shlex.join(["python", called, *kept])


def add_json(parser: ArgumentParser) -> None:
    """Give a script the option to write its records."""
    parser.add_argument("--json", type=Path, metavar="DIR", help="also write records for scripts/tables.py there")


if __name__ == "__main__":
    main()
