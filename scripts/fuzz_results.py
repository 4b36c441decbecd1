"""Spoil result folders thousands of times, read them in every way there is, and count what goes wrong.

``OMP_NUM_THREADS=1 python scripts/fuzz_results.py results/gallery/circle --count 2000``; ``--only N`` spoils as number
N does and says what becomes of it. Every reading is in a process of its own with limits on time and memory.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import resource
import shutil
import signal
import tempfile
import time
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from mutant_files import FILES
from mutants import mutate

from casadi_hands.errors import HandsError
from casadi_hands.export.design import Design
from casadi_hands.export.page.page import write_page
from casadi_hands.export.targets import export_design
from casadi_hands.pipeline.warm_start import kept_margin, warm_start
from casadi_hands.problem.si import build_model
from casadi_hands.task import Task, load_task
from casadi_hands.verify import audit_files
from casadi_hands.verify.audit import audit
from casadi_hands.verify.reading.folder import read_folder
from casadi_hands.verify.replays.engine import load_mujoco
from casadi_hands.verify.replays.perturb import Perturbation
from casadi_hands.verify.replays.plan import Plan
from casadi_hands.verify.replays.replay import ENGINES, Player

SECONDS, GIVEN_UP = 5.0, 40
"""CPU seconds that a reading may take, and wall seconds after which it is ended."""
MEGABYTES, ROOM = 1024.0, 3 << 30
"""Resident memory that it may take, and bytes of address space that it has beside what is loaded."""
LONGEST = 2000
"""Characters of a message."""


@dataclass(frozen=True)
class Reading:
    """What became of one way to read one folder.

    Attributes:
        way: one of `WAYS`.
        what: ``ok``, ``certified``, ``refused``, ``traceback``, ``ended``.
        message: of the error, or its last lines.
        seconds: of CPU.
    """

    way: str
    what: str
    message: str
    seconds: float

    @property
    def wrong(self) -> str:
        """Why it counts as a finding; empty where it does not."""
        if self.what in ("traceback", "ended"):
            return self.what
        if self.seconds > SECONDS:
            return "slow"
        if len(self.message) > LONGEST:
            return "long message"
        return "control characters" if not self.message.replace("\n", "").isprintable() else ""


def _audit(folder: Path, task: Task) -> str:
    return "certified" if audit(folder, replays=0).certified else "ok"


def _load(folder: Path, task: Task) -> str:
    Design.load(folder)
    return "ok"


def _view(folder: Path, task: Task) -> str:
    write_page(Design.load(folder), folder / "again.html")
    return "ok"


def _from(folder: Path, task: Task) -> str:
    earlier = Design.load(folder)
    warm_start(earlier, task, build_model(task))
    kept_margin(earlier)
    return "ok"


def _replay(folder: Path, task: Task, engine: str = "mujoco") -> str:
    player = Player(folder, engine)
    world = ENGINES[engine](player.folder, Perturbation())
    world.settle(Plan(player.folder, world.step), None)
    return "ok"


def _drake(folder: Path, task: Task) -> str:
    return _replay(folder, task, "drake")


def _export(folder: Path, task: Task) -> str:
    for target in ("csv", "urdf", "ros2"):
        export_design(folder, target)
    return "ok"


def _read(folder: Path, task: Task) -> str:
    read_folder(folder)
    return "ok"


Way = Callable[[Path, Task], str]
WAYS: dict[str, Way] = {
    "audit": _audit,
    "load": _load,
    "view": _view,
    "from": _from,
    "replay": _replay,
    "export": _export,
    "drake": _drake,
    "read": _read,
}


_DESIGN = ("task.yaml", "motion.npz", "result.json")
_READS = {way: _DESIGN for way in ("load", "view", "from", "export")}


@dataclass(frozen=True)
class Outcome:
    """What became of one spoilt folder: ``spoilt`` says how it was, ``megabytes`` is the memory its readings took."""

    number: int
    source: str
    spoilt: str
    readings: list[Reading]
    megabytes: float


@cache
def _loaded(source: Path) -> Task:
    """The task of a folder as it was; with all that is imported late, so that its cost is nobody's."""
    load_mujoco()
    audit_files(source)
    return load_task(source / "task.yaml")


def read_in_every_way(folder: Path, task: Task, ways: dict[str, Way]) -> tuple[list[Reading], float]:
    """Read a folder in a process of its own, and return what became of it, and its resident memory, 2^20 bytes."""
    receiver, sender = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(receiver)
        _limit()
        with os.fdopen(sender, "w") as out:
            for way, read in ways.items():
                out.write(json.dumps({"way": way}) + "\n")
                out.flush()
                out.write(json.dumps(_tried(folder, task, read)) + "\n")
                out.flush()
        os._exit(0)
    os.close(sender)
    with os.fdopen(receiver) as file:
        lines = [json.loads(line) for line in file]
    _, status, usage = os.wait4(process, 0)
    readings = [Reading(begun["way"], **done) for begun, done in zip(lines[::2], lines[1::2], strict=False)]
    if len(lines) % 2:
        readings.append(Reading(lines[-1]["way"], "ended", f"by {status}", 0.0))
    return readings, usage.ru_maxrss / 1024


def _limit() -> None:
    with open("/proc/self/statm") as file:
        loaded = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (loaded + ROOM, loaded + ROOM))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    silence = os.open(os.devnull, os.O_WRONLY)
    os.dup2(silence, 1)
    os.dup2(silence, 2)


def _tried(folder: Path, task: Task, read: Way) -> dict[str, Any]:
    begun = time.process_time()
    signal.alarm(GIVEN_UP)
    try:
        what, message = read(folder, task), ""
    except HandsError as error:
        what, message = "refused", str(error)
    except BaseException:
        what, message = "traceback", traceback.format_exc()[-1500:]
    return {"what": what, "message": message[: 3 * LONGEST], "seconds": time.process_time() - begun}


def fuzz(sources: list[Path], numbers: Iterable[int], seed: int, ways: list[str]) -> Iterator[Outcome]:
    """Yield what became of each spoilt folder.

    Args:
        sources: result folders.
        numbers: of the mutants; each has its own seed.
        seed: of all of them.
        ways: to read, of `WAYS`; of these, those that look at a spoilt file.
    """
    for number in numbers:
        source = sources[number % len(sources)]
        task = _loaded(source)
        with tempfile.TemporaryDirectory() as scratch:
            folder = Path(scratch) / "result"
            folder.mkdir()
            for name in FILES:
                if (source / name).is_file():
                    shutil.copy(source / name, folder)
            spoilt = mutate(folder, random.Random(f"{seed}:{number}"))
            chosen = {way: WAYS[way] for way in ways if any(name in spoilt for name in _READS.get(way, FILES))}
            yield Outcome(number, source.name, spoilt, *read_in_every_way(folder, task, chosen))


def main() -> None:
    """Run, and print findings, what was certified, and counts."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folders", nargs="+", type=Path, help="result folders")
    parser.add_argument("--count", type=int, default=200, help="how many are spoilt")
    parser.add_argument("--first", type=int, default=0, help="number of the first")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--only", type=int, help="number of the one to spoil")
    parser.add_argument("--ways", default="audit,load,view,from,replay,export", help=f"of {', '.join(WAYS)}")
    options = parser.parse_args()
    one = options.only is not None
    numbers = range(options.only, options.only + 1) if one else range(options.first, options.first + options.count)
    counts: Counter[str] = Counter()
    most = {"seconds": 0.0, "megabytes": 0.0, "characters": 0.0}
    try:
        for each in fuzz(options.folders, numbers, options.seed, options.ways.split(",")):
            counts["folders"] += 1
            most["megabytes"] = max(most["megabytes"], each.megabytes)
            begin = f"{each.number} {each.source}: {each.spoilt}"
            if each.megabytes > MEGABYTES:
                counts["finding: large"] += 1
                print(f"{begin}: {each.megabytes:.0f} MB", flush=True)
            for reading in each.readings:
                counts[f"{reading.way}: {reading.what}"] += 1
                most["seconds"] = max(most["seconds"], reading.seconds)
                most["characters"] = max(most["characters"], len(reading.message))
                if reading.wrong:
                    counts[f"finding: {reading.wrong}"] += 1
                if reading.wrong or reading.what == "certified" or one:
                    words = reading.message if one else " ".join(reading.message[-300:].split())
                    how = f"{reading.way} {reading.what} {reading.wrong} in {reading.seconds:.1f} s"
                    print(f"{begin}: {how}: {words}", flush=True)
    finally:  # also of a run that is interrupted
        print(json.dumps({"counts": dict(sorted(counts.items())), "most": most}, indent=1))


if __name__ == "__main__":
    main()
