"""A dask cluster as the place where trials run: the numbers of this machine, and what is refused."""

from __future__ import annotations

import builtins
import os
import shutil
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import dask
import pytest
from distributed import Client, LocalCluster

from casadi_hands import solve
from casadi_hands.errors import SolveError
from casadi_hands.execution import cluster as module
from casadi_hands.execution.cluster import cluster, surroundings
from casadi_hands.execution.processes import run_all
from casadi_hands.task import parse_task
from tests.execution.test_processes import same
from tests.stages.synthesis.example import BALL
from tests.stages.synthesis.test_algorithm import search_ball

SEARCH = "search: {trials: 2, recombinations: 2, max_joints: 2}\n"
COMMAND = "import sys; from casadi_hands.cli import main; sys.argv[0] = 'casadi-hands'; main()"


@pytest.fixture(scope="module")
def workers() -> Iterator[LocalCluster]:
    with LocalCluster(n_workers=2, threads_per_worker=1, processes=True, dashboard_address=":0") as found:
        yield found


def address_of(workers: LocalCluster) -> str:
    return str(workers.scheduler_address).replace("tcp://", "dask://")


def wait(until: Callable[[], bool]) -> None:
    for _ in range(1200):
        if until():
            return
        time.sleep(0.05)
    pytest.fail("it never came about")


def test_a_search_finds_the_very_hand_that_this_process_finds(workers: LocalCluster) -> None:
    words: list[str] = []
    with cluster(address_of(workers)) as executor:
        away = search_ball(executor, words.append)
    here = search_ball(None)
    assert len(away.candidates) == len(here.candidates) > 1
    for one, other in zip(away.candidates, here.candidates, strict=True):
        assert (one.trial, one.scores) == (other.trial, other.scores)
        same(one.hand, other.hand)
    assert any("trial 3/3" in word for word in words)
    assert any("hand 2/" in word for word in words)


def pid(_: int) -> int:
    return os.getpid()


def test_trials_run_in_the_cluster_s_processes(workers: LocalCluster) -> None:
    with cluster(address_of(workers)) as executor:
        used = set(run_all(executor, pid, [(i,) for i in range(20)], lambda *_: None))
    assert used == {worker.pid for worker in workers.workers.values()}


def note(folder: Path, name: int, seconds: float) -> None:
    (folder / str(name)).touch()
    time.sleep(seconds)


def test_an_interruption_cancels_what_has_not_begun(workers: LocalCluster, tmp_path: Path) -> None:
    work = [(tmp_path, index, 0.3) for index in range(12)]

    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt), cluster(address_of(workers)) as executor:
        run_all(executor, note, work, interrupt)
    wait(lambda: not workers.scheduler.tasks)
    time.sleep(0.5)  # what a worker had been given when it was cancelled begins, on a busy machine after that
    begun = len(list(tmp_path.iterdir()))
    time.sleep(0.5)
    assert len(list(tmp_path.iterdir())) == begun < len(work)


def test_ctrl_c_of_the_command_leaves_nothing_on_the_cluster(workers: LocalCluster, tmp_path: Path) -> None:
    task = tmp_path / "ball.yaml"
    task.write_text(BALL + "search: {trials: 500, recombinations: 1, max_joints: 2}\n")
    arguments = ["solve", str(task), "--executor", address_of(workers), "--out", str(tmp_path / "out")]

    def heed_interrupts() -> None:
        signal.signal(signal.SIGINT, signal.default_int_handler)

    with subprocess.Popen(
        [sys.executable, "-c", COMMAND, *arguments], stderr=subprocess.PIPE, text=True, preexec_fn=heed_interrupts
    ) as process:
        wait(lambda: len(workers.scheduler.tasks) > 100 or process.poll() is not None)
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "what was computed is in" in err
    assert "Traceback" not in err
    wait(lambda: not workers.scheduler.tasks)


def refused(address: str) -> str:
    with pytest.raises(SolveError) as error, cluster(address):
        pass
    return str(error.value)


@pytest.mark.parametrize("address", ["ray://here:1", "dask://here", "dask://:8786", "tcp://here:1", "dask://a:1/b"])
def test_another_form_of_address_is_refused(address: str) -> None:
    assert refused(address) == f"executor: given {address!r}; allowed: dask://HOST:PORT, dask+tls://HOST:PORT"


def test_without_dask_the_message_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [name for name in sys.modules if name.partition(".")[0] == "distributed"]:
        monkeypatch.delitem(sys.modules, name)
    real = builtins.__import__

    def without(name: str, *rest: Any) -> Any:
        if name.partition(".")[0] == "distributed":
            raise ModuleNotFoundError("No module named 'distributed'")
        return real(name, *rest)

    monkeypatch.setattr(builtins, "__import__", without)
    assert refused("dask://here:1") == "dask://here:1 needs dask.distributed: pip install 'casadi-hands[dask]'"


@pytest.mark.parametrize("listens", [False, True])
def test_where_nobody_answers_the_wait_ends(listens: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PATIENCE", 0.5)
    # Dask's own patience would outlast the test's.
    with dask.config.set({"distributed.comm.timeouts.connect": "1h"}), socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        if listens:  # takes the connection, and says nothing
            taken.listen()
        address = f"dask://127.0.0.1:{taken.getsockname()[1]}"
        told: list[str] = []
        asking = threading.Thread(target=lambda: told.append(refused(address)), daemon=True)
        asking.start()
        asking.join(60)
        assert told == [f"{address}: no dask scheduler answers there; start one with: dask scheduler"]


def test_what_is_no_scheduler_does_not_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PATIENCE", 0.5)
    with socket.create_server(("127.0.0.1", 0)) as server:

        def chat() -> None:
            with server.accept()[0] as peer:
                peer.sendall(b"HTTP/1.1 400 Bad Request\r\n\r\n")
                time.sleep(0.1)

        threading.Thread(target=chat, daemon=True).start()
        address = f"dask://127.0.0.1:{server.getsockname()[1]}"
        assert refused(address).startswith(f"{address}: no dask scheduler answers there; ")


def test_a_cluster_without_workers_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "PATIENCE", 1.0)
    with LocalCluster(n_workers=0, dashboard_address=":0", processes=True) as empty:
        assert refused(address_of(empty)).startswith(
            f"{address_of(empty)}: this cluster has no workers; start workers "
        )


def test_a_worker_of_two_threads_is_refused_with_how_to_start_it() -> None:
    with LocalCluster(n_workers=1, threads_per_worker=2, processes=True, dashboard_address=":0") as threaded:
        address = address_of(threaded)
        told = refused(address)
        (worker,) = threaded.scheduler.workers
        place = address.removeprefix("dask://")
        assert told == (
            f"{address}: worker {worker} has 2 threads, and IPOPT can run in one thread of a process only; "
            f"start workers with: OMP_NUM_THREADS=1 dask worker {place} --nthreads 1 --nworkers N"
        )


def test_a_worker_of_other_versions_is_refused(workers: LocalCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    mine = surroundings()
    newer = {**mine["versions"], "casadi": "99.0"}

    def here() -> dict[str, Any]:
        return {**mine, "versions": newer}

    # Asked for by name, so that workers look up their own.
    here.__module__, here.__qualname__ = surroundings.__module__, surroundings.__qualname__
    monkeypatch.setattr(module, "surroundings", here)
    told = refused(address_of(workers))
    assert "has other versions: casadi " + mine["versions"]["casadi"] + " (here 99.0)" in told


def test_a_worker_with_threads_of_linear_algebra_is_refused(workers: LocalCluster) -> None:
    def several(threads: str | None) -> None:
        os.environ.pop("OMP_NUM_THREADS") if threads is None else os.environ.update(OMP_NUM_THREADS=threads)

    with Client(workers.scheduler_address, set_as_default=False) as client:
        client.run(several, None)
        try:
            assert "may use several threads of linear algebra; start workers with: OMP" in refused(address_of(workers))
        finally:
            client.run(several, "1")


def test_a_worker_without_the_program_is_refused(workers: LocalCluster, monkeypatch: pytest.MonkeyPatch) -> None:
    mine, here = surroundings(), os.getpid()

    def missing() -> dict[str, Any]:
        if os.getpid() == here:
            return mine
        raise ModuleNotFoundError("No module named 'casadi_hands'")

    monkeypatch.setattr(module, "surroundings", missing)
    assert "cannot run casadi-hands: No module named 'casadi_hands'" in refused(address_of(workers))


def die(_: int) -> None:
    os._exit(1)


def test_a_trial_that_takes_its_workers_down_is_one_message() -> None:
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0") as fragile:
        fragile.scheduler.allowed_failures = 0
        with pytest.raises(SolveError, match="has lost a trial"), cluster(address_of(fragile)) as executor:
            run_all(executor, die, [(0,)], lambda *_: None)


def test_a_scheduler_that_goes_away_is_one_message(tmp_path: Path) -> None:
    with LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=":0") as fleeting:
        leaving = threading.Thread(target=lambda: (wait(lambda: any(tmp_path.iterdir())), fleeting.close()))
        leaving.start()
        with pytest.raises(SolveError, match="the scheduler is gone"), cluster(address_of(fleeting)) as executor:
            run_all(executor, note, [(tmp_path, 0, 3.0)], lambda *_: None)
        leaving.join()


@pytest.mark.slow
def test_a_whole_task_gives_the_very_files_of_local_processes(workers: LocalCluster, tmp_path: Path) -> None:
    with cluster(address_of(workers)) as executor:
        solve(parse_task(BALL + SEARCH), jobs=2, out=tmp_path / "away", executor=executor)
    solve(parse_task(BALL + SEARCH), jobs=2, out=tmp_path / "here")
    for name in ("motion.npz", "hand.urdf", "scene.xml"):
        assert (tmp_path / "away" / name).read_bytes() == (tmp_path / "here" / name).read_bytes()


@pytest.fixture
def certificates(tmp_path: Path) -> dict[str, str]:
    """Settings of dask's TLS, with an authority and a certificate of this test's own."""
    openssl = shutil.which("openssl")
    if openssl is None:
        pytest.skip("no openssl to make certificates with")
    names = ["ca.key", "ca.pem", "own.key", "own.csr", "own.pem"]
    authority_key, authority, key, request, certificate = (str(tmp_path / name) for name in names)
    new = [openssl, "req", "-newkey", "rsa:2048", "-nodes", "-subj"]
    for command in (
        [*new, "/CN=authority", "-x509", "-days", "1", "-keyout", authority_key, "-out", authority],
        [*new, "/CN=own", "-keyout", key, "-out", request],
        [
            *(openssl, "x509", "-req", "-days", "1", "-in", request, "-CA", authority, "-CAkey", authority_key),
            *("-CAcreateserial", "-out", certificate),
        ],
    ):
        subprocess.run(command, check=True, capture_output=True)
    settings = {"distributed.comm.tls.ca-file": authority, "distributed.comm.require-encryption": "true"}
    for who in ("scheduler", "worker", "client"):
        settings |= {f"distributed.comm.tls.{who}.{what}": path for what, path in (("key", key), ("cert", certificate))}
    return settings


def test_a_cluster_is_reached_by_tls_and_not_without_its_certificates(certificates: dict[str, str]) -> None:
    variables = {
        f"DASK_{name.upper().replace('.', '__').replace('-', '_')}": each for name, each in certificates.items()
    }
    environment = {**os.environ, **variables, "OMP_NUM_THREADS": "1"}
    with socket.socket() as found:
        found.bind(("127.0.0.1", 0))
        port = found.getsockname()[1]
    python, address = [sys.executable, "-m"], f"tls://127.0.0.1:{port}"
    commands = (
        [*python, "distributed.cli.dask_scheduler", "--host", address, "--no-dashboard"],
        [*python, "distributed.cli.dask_worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard"],
    )
    running = [subprocess.Popen(each, env=environment, stderr=subprocess.DEVNULL) for each in commands]
    address = f"dask+{address}"
    try:
        with dask.config.set(certificates):
            for _ in range(30):
                try:
                    with cluster(address) as executor:
                        assert set(run_all(executor, pid, [(i,) for i in range(3)], lambda *_: None)) == {
                            running[1].pid
                        }
                    break
                except SolveError:
                    time.sleep(1.0)
            else:
                pytest.fail("no cluster answered")
        with pytest.raises(SolveError, match="TLS"), cluster(address):
            raise AssertionError
        with pytest.raises(SolveError, match="no dask scheduler answers"), cluster(address.replace("+tls", "")):
            raise AssertionError
    finally:
        for process in running:
            process.terminate()
            process.wait()
