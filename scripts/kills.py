"""Kill solves at random moments and see what is left, and whether they go on to the same design.

Chains: a solve is killed at a random moment, gone on with by ``--resume``, killed again, until one ends by itself; its
design must be that of a solve that nobody killed. After each kill the folder must hold a complete result or not exist,
and no process and no temporary folder may be left. Workers: those of a solve are killed, and it must end with that
design all the same. Writes: a process that does nothing but write two designs in turn into one folder is killed; the
folder must hold the one or the other, whole.
"""

from __future__ import annotations

import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from shared import options_of

import casadi_hands.pipeline.alternatives  # noqa: F401 (so that solves need not load it)
from casadi_hands.cli import main as main_of_package
from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.export.moving import FILES
from casadi_hands.export.place import beside
from casadi_hands.verify import audit_files

AGAIN = 0.7  # share of those that went on that are killed, too
GRACE = 2.0  # s that processes may take to end
WAYS = {"SIGKILL": signal.SIGKILL, "SIGTERM": signal.SIGTERM}


def main() -> None:
    """Kill as often as asked for, print what came of it, and exit 1 where anything was not as it must be."""
    options = options_of(__doc__ or "")
    options.add_argument("task", type=Path, help="a task file, best one that solves in seconds")
    options.add_argument("--kills", type=int, default=100, help="of solves")
    options.add_argument("--workers", type=int, default=10, help="solves whose workers are killed")
    options.add_argument("--writes", type=int, default=300, help="kills during writing")
    options.add_argument("--until", default="refine", help="the last stage of solves")
    options.add_argument("--longest", type=float, default=8.0, help="s after which a solve is killed, at most")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--jobs", type=int, default=2)
    given = options.parse_args()
    rng = random.Random(given.seed)
    # No TemporaryDirectory: solves are forked from here, and remove those of their process as they leave.
    root = Path(tempfile.mkdtemp())
    reference, scratch = root / "reference", root / "tmp"
    scratch.mkdir()
    Solve([given.task, "--out", reference, "--jobs", 1, "--until", given.until], scratch).wait(None)
    found = Counter[str]()
    if given.kills:
        for chain in range(given.kills):
            if found["kills"] >= given.kills:
                break
            chained(given.task, root / f"chain{chain}", reference, given, rng, found)
            print(dict(found), file=sys.stderr, flush=True)
    for turn in range(given.workers):
        without_workers(given.task, root / f"workers{turn}", reference, given, rng, found)
        print(dict(found), file=sys.stderr, flush=True)
    if given.writes:
        killed_writes(reference, root / "writes", given.writes, rng, found)
    shutil.rmtree(root)
    for what, times in found.items():
        print(f"{times:5d}  {what}")
    sys.exit(any(what.startswith("BAD") for what in found))


def chained(task: Path, room: Path, reference: Path, given: Any, rng: random.Random, found: Counter[str]) -> None:
    """Kill a solve and what goes on from it, until one ends."""
    folder, scratch = room / "out", room / "tmp"
    scratch.mkdir(parents=True)
    kills = 0
    while True:
        goes_on = (beside(folder) / "request.json").exists() and any(beside(folder).glob("units/*.npz"))
        what = ["--resume", folder] if goes_on else [task, "--out", folder, "--until", given.until]
        solve = Solve([*what, "--jobs", given.jobs], scratch)
        killed = found["kills"] < given.kills and (not kills or rng.random() < AGAIN)
        patience = rng.uniform(0, given.longest) if killed else None
        if solve.wait(patience) is not None:
            break
        way = rng.choice(list(WAYS))
        os.kill(solve.pid, WAYS[way])
        kills += 1
        found["kills"] += 1
        found[f"by {way}"] += 1
        judge(solve, folder, scratch, way, found)
    if solve.status not in (0, 1):
        found[f"BAD: exit status {solve.status}: {solve.words()}"] += 1
    elif beside(folder).exists():
        found["BAD: left beside a finished result"] += 1
    compare(folder, reference, "went on to the design of an uninterrupted solve" if kills else "not killed", found)
    shutil.rmtree(room)


def without_workers(
    task: Path, room: Path, reference: Path, given: Any, rng: random.Random, found: Counter[str]
) -> None:
    """Kill a worker of a solve now and then, no trial's more than twice."""
    room.mkdir()
    folder = room / "out"
    solve = Solve([task, "--out", folder, "--jobs", 2, "--until", given.until], room)
    for _ in range(2):
        solve.wait(rng.uniform(0.2, 0.5) * given.longest)
        if workers := [pid for pid, words in commands(solve.pid) if "spawn_main" in words]:
            os.kill(rng.choice(workers), signal.SIGKILL)
            found["workers killed"] += 1
    if solve.wait(None) not in (0, 1):
        found[f"BAD: exit status {solve.status}: {solve.words()}"] += 1
    compare(folder, reference, "workers killed, and the same design", found)


def compare(folder: Path, reference: Path, good: str, found: Counter[str]) -> None:
    """Count whether a folder holds the design that another does."""
    different = [name for name in FILES if content(folder / name) != content(reference / name)]
    found[f"BAD: other {', '.join(different)}" if different else good] += 1


class Solve:
    """The command ``solve`` in a process and a session of its own, loaded already.

    Args:
        arguments: of the command.
        scratch: folder for temporary files; what the command says goes beside it.
    """

    def __init__(self, arguments: Sequence[Any], scratch: Path) -> None:
        self.status: int | None = None
        self._log = scratch.with_suffix(".log")
        self.pid = os.fork()
        if self.pid:
            return
        os.setsid()
        # As that of the program: its workers shall not load this script.
        sys.modules["__main__"] = ModuleType("__main__")
        log = os.open(self._log, os.O_CREAT | os.O_TRUNC | os.O_WRONLY)
        for stream in (1, 2):
            os.dup2(log, stream)
        os.environ["TMPDIR"] = tempfile.tempdir = str(scratch)
        sys.argv = ["casadi-hands", "solve", *map(str, arguments)]
        try:
            main_of_package()
        except SystemExit as ended:
            os._exit(ended.code if isinstance(ended.code, int) else 1)
        os._exit(0)

    def wait(self, patience: float | None) -> int | None:
        """The exit status, or minus the signal, of a solve that has ended; None of one that goes on after so many s."""
        last = time.monotonic() + (patience or 0.0)
        while self.status is None:
            pid, status = os.waitpid(self.pid, 0 if patience is None else os.WNOHANG)
            if pid:
                self.status = os.waitstatus_to_exitcode(status)
            elif time.monotonic() > last:
                break
            else:
                time.sleep(0.01)
        return self.status

    def words(self) -> str:
        """The last of what it said."""
        return self._log.read_text(encoding="utf-8", errors="replace")[-300:]


def judge(solve: Solve, folder: Path, scratch: Path, way: str, found: Counter[str]) -> None:
    """See what a kill has left."""
    began = time.monotonic()
    while left := [pid for pid, _ in commands(solve.pid)]:
        if time.monotonic() - began > GRACE:
            found[f"BAD: {len(left)} processes are left {GRACE:g} s after {way}"] += 1
            for each in left:
                os.kill(each, signal.SIGKILL)
            break
        solve.wait(0.02)
    found["slowest end, ms"] = max(found["slowest end, ms"], round(1e3 * (time.monotonic() - began)))
    solve.wait(None)
    if not folder.exists():
        found["left no folder"] += 1
    else:
        found[complete(folder)] += 1
    if any(scratch.iterdir()):
        found[f"BAD: temporary folders are left after {way}: {sorted(p.name for p in scratch.iterdir())}"] += 1


def commands(session: int) -> Iterator[tuple[int, str]]:
    """Processes of a session that have not ended, and their commands."""
    listed = subprocess.run(["ps", "-eo", "pid=,sess=,stat=,args="], capture_output=True, text=True, check=True).stdout
    for line in listed.splitlines():
        pid, of, state, words = line.split(maxsplit=3)
        if int(of) == session and not state.startswith("Z"):
            yield int(pid), words


def complete(folder: Path) -> str:
    """What a folder holds, in words."""
    try:
        design = Design.load(folder)
        if design.hand is not None and design.motion is not None:
            audit_files(folder)
    except HandsError as error:
        return f"BAD: {error}"
    return "left a complete result"


def content(file: Path) -> Any:
    """What two files of one design have in common: all but times, of `result.json`, and the pages that show them."""
    if not file.exists() or file.suffix == ".html":
        return file.exists()
    if file.name != "result.json":
        return file.read_bytes()
    record = json.loads(file.read_text(encoding="utf-8"))
    del record["seconds"]
    for run in record["stages"]:
        del run["seconds"]
    return record


def killed_writes(reference: Path, folder: Path, times: int, rng: random.Random, found: Counter[str]) -> None:
    """Kill a process that writes two designs in turn."""
    whole = Design.load(reference)
    designs = [whole, Design(task=whole.task, status="failed", reason="the other one", hand=whole.hand)]
    folder.mkdir()
    (folder / "notes.txt").write_text("mine")
    wanted = []
    for design in designs:
        design.save(folder)
        wanted.append(files_of(folder))
    for _ in range(times):
        writer = os.fork()
        if writer == 0:
            while True:
                for design in designs:
                    design.save(folder)
        time.sleep(rng.uniform(0.0, 0.3))
        os.kill(writer, signal.SIGKILL)
        os.waitpid(writer, 0)
        found["kills during writing"] += 1
        found["BAD: parts of two results" if files_of(folder) not in wanted else "left one result, whole"] += 1
        # Who writes next clears away what was left.
        designs[0].save(folder)
        if beside(folder).exists() or not (folder / "notes.txt").exists():
            found["BAD: something is left, or lost, after the next writing"] += 1


def files_of(folder: Path) -> dict[str, bytes]:
    """The files of a result."""
    return {name: (folder / name).read_bytes() for name in FILES if (folder / name).exists()}


if __name__ == "__main__":
    main()
