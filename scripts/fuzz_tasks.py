"""Feed the reader of task files with files that are wrong, and count what it does but answer.

    python scripts/fuzz_tasks.py --count 20000 --out results/fuzz

Each file follows from its number alone: one of problems/, changed as text, as a structure, or by what YAML allows and
nobody expects (`nasty.py`). A child process with bounded memory reads it, checks it, prints what `check` prints, and
where it is a task writes it and reads it again. A file fails if that raises anything but a refusal, if it takes longer
than 5 s or 1 GB, if a message is longer than 2 kB or has control characters, or if the task does not come back
the same. Files that fail stay in ``--out``, with what happened in ``fuzz.json``. Exits 1 if any does.
"""

from __future__ import annotations

import argparse
import io
import json
import multiprocessing
import resource
import signal
import sys
import time
import traceback
import unicodedata
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType

from nasty import PROBLEMS, mutant

SECONDS, BYTES, LONGEST = 5.0, 10**9, 2000
"""What a file may take, and bytes of a message."""
_PATIENCE = 12 * SECONDS  # before a child is ended that does not come back


@dataclass(frozen=True)
class Outcome:
    """What a file led to.

    Attributes:
        number: of the file.
        kind: ``task``, ``refused``, or what went wrong.
        detail: the message, or where it went wrong.
        seconds: that it took, of the process's own time.
    """

    number: int
    kind: str
    detail: str
    seconds: float

    @property
    def fails(self) -> bool:
        """Whether the reader did anything but answer."""
        return self.kind not in ("task", "refused")


def main() -> None:
    """Run the files that the arguments ask for."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--count", type=int, default=20000, help="files to try")
    parser.add_argument("--first", type=int, default=0, help="number of the first one")
    parser.add_argument("--out", type=Path, default=Path("results/fuzz"), help="folder for files that fail")
    options = parser.parse_args()
    started, counts, failed = time.monotonic(), Counter[str](), []
    slowest = Outcome(-1, "", "", 0.0)
    for outcome in fuzz(range(options.first, options.first + options.count)):
        counts[outcome.kind] += 1
        slowest = max(slowest, outcome, key=lambda each: each.seconds)
        if outcome.fails:
            failed.append(outcome)
            options.out.mkdir(parents=True, exist_ok=True)
            (options.out / f"{outcome.number}.yaml").write_bytes(mutant(outcome.number))
            print(f"{outcome.number}: {outcome.kind}: {outcome.detail.strip().splitlines()[-1][:200]}", flush=True)
        if sum(counts.values()) % 1000 == 0:
            print(dict(counts), f"{time.monotonic() - started:.0f} s", flush=True)
    print(dict(counts), f"slowest: {slowest.seconds:.2f} s, number {slowest.number}")
    if failed:
        (options.out / "fuzz.json").write_text(json.dumps([asdict(each) for each in failed], indent=1))
    sys.exit(1 if failed else 0)


def fuzz(numbers: range) -> Iterator[Outcome]:
    """Outcomes of files in order; a child that dies or hangs is one, and is replaced."""
    left = numbers
    while left:
        ours, theirs = multiprocessing.Pipe()
        child = multiprocessing.get_context("spawn").Process(target=_child, args=(theirs, left), daemon=True)
        child.start()
        theirs.close()
        try:
            patience = 10 * _PATIENCE  # it has to import first
            while left and ours.poll(patience):
                yield ours.recv()
                left, patience = left[1:], _PATIENCE
            if left:
                yield Outcome(left[0], "hang", f"no answer within {_PATIENCE:g} s", _PATIENCE)
        except EOFError:
            child.join()
            yield Outcome(left[0], "death", f"exit status {child.exitcode}", 0.0)
        child.kill()
        child.join()
        left = left[1:]


def _child(connection: Connection, numbers: range) -> None:
    """Send the outcome of each file."""
    attempt(-1, (PROBLEMS / "circle.yaml").read_bytes())  # imports what memory shall not count
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + BYTES
    resource.setrlimit(resource.RLIMIT_AS, (most, most))
    for number in numbers:
        connection.send(attempt(number, mutant(number)))


class _TooSlow(BaseException):
    """Not to be caught by what is tried."""


@contextmanager
def _within(seconds: float) -> Iterator[None]:
    """Raise `_TooSlow` after this much of the process's own time: others may be busy, too."""

    def ring(_signal: int, _frame: FrameType | None) -> None:
        raise _TooSlow

    before = signal.signal(signal.SIGPROF, ring)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)


def attempt(number: int, data: bytes) -> Outcome:
    """Read, check, print, write and read again one file."""
    started = time.process_time()

    def outcome(kind: str, detail: str) -> Outcome:
        return Outcome(number, kind, detail, time.process_time() - started)

    try:
        with _within(SECONDS):
            kind, detail = _read(data)
    except _TooSlow:
        return outcome("slow", traceback.format_exc(limit=-6))
    except MemoryError:
        return outcome("memory", traceback.format_exc(limit=-6))
    except (Exception, SystemExit):
        return outcome("traceback", traceback.format_exc(limit=-6))
    return outcome(kind, detail)


def _controls(text: str) -> bool:
    """Whether a text has what a terminal or XML would not take for text."""
    kinds = {unicodedata.category(each) for each in text.replace("\n", "")}
    return bool(kinds & {"Cc", "Cs", "Zl", "Zp"}) or any(each in text for each in "\u202e\u2066\ufffe\uffff")


def _read(data: bytes) -> tuple[str, str]:
    """What the package says of a file: kind and detail of its outcome."""
    from rich.console import Console

    from casadi_hands.cli.task_summary import check_summary
    from casadi_hands.errors import TaskError
    from casadi_hands.task import parse_task, task_to_yaml
    from casadi_hands.task.textfile import decode

    try:
        task = parse_task(decode(data, "fuzzed.yaml"), "fuzzed.yaml")
    except TaskError as error:
        message = str(error)
        if len(message.encode(errors="replace")) > LONGEST:
            return "long message", message
        if _controls(message):
            return "control characters", ascii(message)
        return ("refused" if message.strip() else "no message"), message
    printed = io.StringIO()
    Console(file=printed, width=100).print(check_summary(task)[0])
    if _controls(printed.getvalue()):
        return "control characters", ascii(printed.getvalue())
    written = task_to_yaml(task)
    written.encode()
    if parse_task(written) != task:
        return "changed", written
    return "task", ""


if __name__ == "__main__":
    main()
