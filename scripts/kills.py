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
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from shared import options_of

from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.export.place import FILES, beside
from casadi_hands.verify import audit_files

AGAIN = 0.7  # share of those that went on that are killed, too
GRACE = 2.0  # s that processes may take to end
COMMAND = [sys.executable, "-c", "from casadi_hands.cli import main; main()", "solve"]
WAYS = {"SIGKILL": signal.SIGKILL, "SIGTERM": signal.SIGTERM}


def main() -> None:
    """Kill as often as asked for, print what came of it, and exit 1 where anything was not as it must be."""
    options = options_of(__doc__ or "")
    options.add_argument("task", type=Path, help="a task file, best one that solves in seconds")
    options.add_argument("--kills", type=int, default=100, help="of solves")
    options.add_argument("--workers", type=int, default=10, help="solves whose workers are killed")
    options.add_argument("--writes", type=int, default=300, help="kills during writing")
    options.add_argument("--longest", type=float, default=8.0, help="s after which a solve is killed, at most")
    options.add_argument("--seed", type=int, default=0)
    options.add_argument("--jobs", type=int, default=2)
    given = options.parse_args()
    rng = random.Random(given.seed)
    with tempfile.TemporaryDirectory() as work:
        root = Path(work)
        reference = root / "reference"
        subprocess.run([*COMMAND, given.task, "--out", reference, "--jobs", "1"], check=False, capture_output=True)
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
    for what, times in found.items():
        print(f"{times:5d}  {what}")
    sys.exit(any(what.startswith("BAD") for what in found))


def chained(task: Path, room: Path, reference: Path, given: Any, rng: random.Random, found: Counter[str]) -> None:
    """Kill a solve and what goes on from it, until one ends."""
    folder, scratch = room / "out", room / "tmp"
    scratch.mkdir(parents=True)
    environment = {**os.environ, "TMPDIR": str(scratch)}
    kills = 0
    while True:
        goes_on = (beside(folder) / "request.json").exists() and any(beside(folder).glob("units/*.npz"))
        what = ["--resume", str(folder)] if goes_on else [str(task), "--out", str(folder)]
        process = subprocess.Popen(
            [*COMMAND, *what, "--jobs", str(given.jobs)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
            start_new_session=True,
        )
        killed = found["kills"] < given.kills and (not kills or rng.random() < AGAIN)
        patience = rng.uniform(0, given.longest) if killed else None
        try:
            _, err = process.communicate(timeout=patience)
            break
        except subprocess.TimeoutExpired:
            way = rng.choice(list(WAYS))
            process.send_signal(WAYS[way])
            kills += 1
            found["kills"] += 1
            found[f"by {way}"] += 1
            judge(process, folder, scratch, way, found)
    if process.returncode not in (0, 1):
        found[f"BAD: exit status {process.returncode}: {err[-300:]}"] += 1
    elif beside(folder).exists():
        found["BAD: left beside a finished result"] += 1
    compare(folder, reference, "went on to the design of an uninterrupted solve" if kills else "not killed", found)
    shutil.rmtree(room)


def without_workers(
    task: Path, room: Path, reference: Path, given: Any, rng: random.Random, found: Counter[str]
) -> None:
    """Kill a worker of a solve now and then, no trial's more than twice."""
    process = subprocess.Popen(
        [*COMMAND, str(task), "--out", str(room), "--jobs", "2"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )
    for _ in range(2):
        time.sleep(rng.uniform(0.2, 0.5) * given.longest)
        if workers := [pid for pid, words in commands(process.pid) if "spawn_main" in words]:
            os.kill(rng.choice(workers), signal.SIGKILL)
            found["workers killed"] += 1
    _, err = process.communicate()
    if process.returncode not in (0, 1):
        found[f"BAD: exit status {process.returncode}: {err[-300:]}"] += 1
    compare(room, reference, "workers killed, and the same design", found)


def compare(folder: Path, reference: Path, good: str, found: Counter[str]) -> None:
    """Count whether a folder holds the design that another does."""
    different = [name for name in FILES if content(folder / name) != content(reference / name)]
    found[f"BAD: other {', '.join(different)}" if different else good] += 1


def judge(process: subprocess.Popen[str], folder: Path, scratch: Path, way: str, found: Counter[str]) -> None:
    """See what a kill has left."""
    began = time.monotonic()
    while left := [pid for pid, _ in commands(process.pid)]:
        if time.monotonic() - began > GRACE:
            found[f"BAD: {len(left)} processes are left {GRACE:g} s after {way}"] += 1
            for each in left:
                os.kill(each, signal.SIGKILL)
            break
        process.poll()
        time.sleep(0.02)
    found["slowest end, ms"] = max(found["slowest end, ms"], round(1e3 * (time.monotonic() - began)))
    process.communicate()
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
    """What two files of one design have in common: all but times, of `result.json`, and the page that shows them."""
    if not file.exists() or file.name == "viewer.html":
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
