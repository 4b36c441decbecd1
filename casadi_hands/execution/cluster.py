"""A dask.distributed cluster as the place where trials run."""

from __future__ import annotations

import asyncio
import importlib.metadata
import logging
import os
import re
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError, Executor
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

from casadi_hands.errors import SolveError

if TYPE_CHECKING:
    from distributed import Client

PATIENCE = 5.0
"""s that a scheduler may take to answer, and then again its workers to turn up."""
_DECIDE_NUMBERS = ("casadi-hands", "casadi", "pin", "numpy", "scipy")


@contextmanager
def cluster(address: str) -> Iterator[Executor]:
    """An executor of the workers of a dask.distributed scheduler; what has not begun is cancelled at the end.

    Args:
        address: ``dask://HOST:PORT``, or ``dask+tls://HOST:PORT`` with the certificates that dask's own settings name.

    Raises:
        SolveError: the address is of another form, dask.distributed is not installed, nobody answers, a worker
            could give other numbers than this machine, or the cluster loses a trial.
    """
    match = re.fullmatch(r"dask(\+tls)?://([\w.-]+|\[[\da-fA-F:]+\]):(\d{1,5})", address)
    if not match:
        raise SolveError(f"executor: given {address!r}; allowed: dask://HOST:PORT, dask+tls://HOST:PORT")
    try:
        from distributed import KilledWorker
    except ImportError as error:
        raise SolveError(f"{address} needs dask.distributed: pip install 'casadi-hands[dask]'") from error
    # What ends the solve is told as one error; the client would log it with a traceback as well.
    logging.getLogger("distributed.client").setLevel(logging.CRITICAL)
    client = _connected(address, f"{'tls' if match[1] else 'tcp'}://{match[2]}:{match[3]}")
    try:
        _check_workers(address, client)
        # The same call twice is two calls, not one whose result is looked up.
        yield client.get_executor(pure=False)
    except (KilledWorker, CancelledError) as error:
        raise SolveError(
            f"{address} has lost a trial: a worker died with it, or the scheduler is gone; give "
            "workers more memory, or leave --executor out"
        ) from error
    finally:
        client.close()


def _connected(address: str, plain: str) -> Client:
    """A client of a scheduler that answers and has workers.

    Raises:
        SolveError: it does not answer in time, or has none.
    """
    from distributed import Client

    try:
        # A client would wait without end for one that takes the connection and says nothing.
        asyncio.run(asyncio.wait_for(_greet(plain), PATIENCE))
        client = Client(plain, timeout=PATIENCE, set_as_default=False)
    except (TypeError, RuntimeError) as error:
        # What distributed raises where settings name no certificates.
        raise SolveError(f"{address}: {error}; see docs/how-to/cluster.md for the settings of TLS") from error
    except (OSError, ValueError, MemoryError) as error:
        # MemoryError, because what another kind of server says is read as the length of a message.
        raise SolveError(f"{address}: no dask scheduler answers there; start one with: dask scheduler") from error
    try:
        client.wait_for_workers(1, timeout=PATIENCE)
    except TimeoutError as error:
        client.close()
        raise SolveError(f"{address}: this cluster has no workers; {_how_to_start(address)}") from error
    return client


async def _greet(plain: str) -> None:
    from distributed.comm.core import connect
    from distributed.security import Security

    comm = await connect(plain, timeout=PATIENCE, **Security().get_connection_args("client"))
    await comm.close()


def _check_workers(address: str, client: Client) -> None:
    """Refuse a cluster with a worker that could crash, or give other numbers than this machine.

    Raises:
        SolveError: there is one; the message says how to start it.
    """
    start = _how_to_start(address)
    for worker, threads in client.nthreads().items():
        if threads != 1:
            raise SolveError(
                f"{address}: worker {worker} has {threads} threads, and IPOPT can run in one thread of a process only; "
                f"{start}"
            )
    answers: Mapping[str, Any] = client.run(surroundings, on_error="return")
    here = surroundings()["versions"]
    for worker, answer in answers.items():
        if isinstance(answer, BaseException):
            raise SolveError(
                f"{address}: worker {worker} cannot run casadi-hands: {answer}; install it there"
            ) from answer
        if answer["versions"] != here:
            there = answer["versions"]
            differing = [f"{name} {there[name]} (here {here[name]})" for name in here if there[name] != here[name]]
            raise SolveError(
                f"{address}: worker {worker} has other versions: {', '.join(differing)}; install the same there"
            )
        if answer["threads"] != "1":
            raise SolveError(f"{address}: worker {worker} may use several threads of linear algebra; {start}")


def _how_to_start(address: str) -> str:
    scheduler = address.partition("://")[2]
    return f"start workers with: OMP_NUM_THREADS=1 dask worker {scheduler} --nthreads 1 --nworkers N"


def surroundings() -> dict[str, Any]:
    """What decides the numbers that a process gives: versions, and the threads of linear algebra it is told to use."""
    versions = {name: importlib.metadata.version(name) for name in _DECIDE_NUMBERS}
    return {"versions": versions, "threads": os.environ.get("OMP_NUM_THREADS")}
