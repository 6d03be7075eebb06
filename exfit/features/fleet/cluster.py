"""A Dask cluster that somebody else has started: its scheduler, and the workers that may be used.

The one module with `remote` that imports distributed. What it logs and warns of stays silent: what
matters becomes an error of exfit's.
"""

import asyncio
import logging
import re
import warnings
from collections.abc import Iterator, Mapping
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from exfit.errors import ExfitError
from exfit.features.fleet import remote

if TYPE_CHECKING:
    from distributed import Client

CONNECTED_WITHIN = 5.0  # s: what answers at all answers sooner
ANSWERED_WITHIN = 20.0  # s: a scheduler or a worker that is busy, or imports exfit for a first time
CLOSED_WITHIN = 2.0  # s
OF_SYSTEM = re.compile(r"\[Errno -?[0-9]+\] (.+)")
MISSING = re.compile("No module named '[^']*'")
LOGGERS = ("distributed", "tornado", "asyncio")
SETTINGS = {
    "distributed.comm.timeouts.connect": f"{CONNECTED_WITHIN:g}s",
    "distributed.admin.large-graph-warning-threshold": "1 TB",  # the limits are dispatch's
}


class ClusterError(ExfitError):
    """A cluster that cannot be used: its address, and what is wrong."""


@contextmanager
def connected(address: str) -> Iterator["Client"]:
    """Give a client of the scheduler at an address, closed in the end whatever happens.

    Raises ClusterError where dask.distributed is missing, or where no scheduler answers there
    within seconds.
    """
    try:
        import dask
        from distributed import Client
    except ImportError:
        text = 'needs the package distributed: pip install "exfit[cluster]"'
        raise ClusterError(f"--scheduler: {text}") from None
    with _silent(), dask.config.set(SETTINGS):
        with ThreadPoolExecutor(1) as apart:  # a notebook has a loop of its own in this thread
            kind = apart.submit(lambda: asyncio.run(_kind_at(address))).result()
        if kind != "Scheduler":
            text = f"a {kind} of Dask, not a scheduler" if kind else "not a scheduler of Dask"
            raise ClusterError(f"{address}: {text}")
        try:
            client = Client(address, timeout=CONNECTED_WITHIN, set_as_default=False)
        except (OSError, ValueError, RuntimeError, TypeError) as fault:
            raise ClusterError(f"{address}: no connection: {_reason(fault)}") from None
        try:
            yield client
        finally:
            with suppress(Exception):  # of a connection that is lost already
                client.close(timeout=CLOSED_WITHIN)


@contextmanager
def _silent() -> Iterator[None]:
    """Keep logs and warnings of distributed from standard error."""
    names = {name for name in logging.root.manager.loggerDict if name.split(".")[0] in LOGGERS}
    levels = {logger: logger.level for logger in map(logging.getLogger, {*LOGGERS, *names})}
    for logger in levels:
        logger.setLevel(logging.CRITICAL + 1)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


async def _kind_at(address: str) -> str:
    """Ask an address for its role in Dask; "" where something else answers."""
    from distributed.comm import connect
    from distributed.core import send_recv
    from distributed.security import Security

    options = Security().get_connection_args("client")
    try:
        comm = await connect(address, timeout=CONNECTED_WITHIN, **options)
    except (OSError, ValueError) as fault:
        raise ClusterError(f"{address}: no connection: {_reason(fault)}") from None
    except TypeError:  # nothing else names certificates that are missing
        text = "no certificates are configured for TLS (distributed.comm.tls of Dask's settings)"
        raise ClusterError(f"{address}: {text}") from None
    except Exception:  # whatever the answer of another program is taken for
        return ""
    try:
        answer = await asyncio.wait_for(send_recv(comm, op="identity"), CONNECTED_WITHIN)
        return str(answer["type"])
    except Exception:
        return ""
    finally:
        comm.abort()


def _reason(fault: BaseException) -> str:
    """Word the cause of a fault, as the system does where it has words."""
    cause: BaseException | None = fault
    while cause is not None:
        system = OF_SYSTEM.search(str(cause))
        if system is not None:
            return system[1]
        cause = cause.__cause__
    return (str(fault).splitlines() or [type(fault).__name__])[0]


def threads_of(client: "Client") -> dict[str, int]:
    """Return the addresses of the workers that are connected, each with its threads.

    Raises ClusterError where the scheduler is lost.
    """
    if client.status != "running":
        raise lost(client)
    try:
        threads: dict[str, int] = client.sync(
            client.scheduler.ncores, callback_timeout=ANSWERED_WITHIN
        )
    except (OSError, TimeoutError) as fault:
        raise lost(client, fault) from None
    return threads


def lost(client: "Client", fault: BaseException | None = None) -> ClusterError:
    """Return the error of a scheduler that does not answer any more."""
    reason = "" if fault is None else f": {_reason(fault)}"
    text = f"connection to the scheduler lost{reason}"
    return ClusterError(f"{client.scheduler.address}: {text}")


def asked(client: "Client", worker: str) -> "Future[Mapping[str, Any]]":
    """Ask a worker for its versions, and return what will have the answer."""
    call = client._run(remote.versions, workers=[worker], on_error="return")
    return asyncio.run_coroutine_threadsafe(call, client.loop.asyncio_loop)


def answered(worker: str, answer: "Future[Mapping[str, Any]]") -> str | None:
    """Read the reason to refuse a worker, "" for none; None where it was lost meanwhile.

    It has other versions than this computer, so that the results would not be the same, or no
    exfit.
    """
    try:
        there = answer.result()[worker]
    except (OSError, KeyError, CancelledError):
        return None
    if isinstance(there, OSError):
        return None
    if isinstance(there, BaseException):
        missing = MISSING.search(str(there))  # distributed keeps its text, not always its kind
        if missing is not None:
            return f"exfit is missing there, or is an earlier version: {missing[0]}"
        return f"{type(there).__name__}: {_reason(there)}"
    return ", ".join(
        f"{name} {there.get(name, 'missing')}, here {version}"
        for name, version in remote.versions().items()
        if there.get(name) != version
    )


def stop(client: "Client", workers: list[str], batch: str) -> None:
    """End the processes of a batch in workers; one that does not answer is not waited for."""
    if workers:
        call = client._run
        client.sync(
            call, remote.stop_batch, batch, workers=workers, on_error="ignore",
            callback_timeout=CLOSED_WITHIN,
        )  # fmt: skip
