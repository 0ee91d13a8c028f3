# SPDX-License-Identifier: MIT
"""Runs independent tasks on all cores or on the workers of a Dask cluster."""

from __future__ import annotations

import asyncio
import concurrent.futures
import importlib.metadata
import itertools
import logging
import os
import pickle
import shlex
import signal
import socket
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from typing import Any, TypeVar
from urllib.parse import urlsplit

T = TypeVar("T")
K = TypeVar("K")
Progress = Callable[[float], None]

PACKAGE = "ehsid"
CONNECT_S = 10.0
THREADS_UP_TO = 4  # cores that `run_together` uses with threads
WATCH_S = 0.5  # between two looks, of a worker process at its parent or at a task of a cluster
NO_WORKERS_S = 30.0  # a cluster without workers for so long has lost them

_WORKERS: ContextVar[int] = ContextVar("_WORKERS", default=-1)
_THREADS_ONLY: ContextVar[bool] = ContextVar("_THREADS_ONLY", default=False)
_CLUSTER: ContextVar[Any] = ContextVar("_CLUSTER", default=None)  # Dask client of the cluster


class NoWorkersError(ChildProcessError):
    """A cluster has lost all of its workers."""


def worker_count() -> int:
    """Number of processes that `run_tasks` uses; -1 means one for each core."""
    return _WORKERS.get()


@contextmanager
def workers(count: int | None) -> Iterator[None]:
    """Sets how many processes `run_tasks` uses in this context; None means one for each core."""
    token = _WORKERS.set(-1 if count is None else count)
    try:
        yield
    finally:
        _WORKERS.reset(token)


@contextmanager
def _workers_deaf_to_ctrl_c() -> Iterator[None]:
    """Makes processes that are started in this context ignore a keyboard interrupt.

    Otherwise each worker process prints its own traceback. This process ends the workers. A child
    process inherits an ignored signal (POSIX), even while it still imports modules. It is not
    enough to block the signal: the resource tracker of the workers unblocks it at its start. Only
    the main thread may set a signal handler; in other threads this context does nothing.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, before)


def end_with(parent: int) -> None:
    """Makes this process end soon after its parent process, whose id is given.

    A parent that was killed cannot end its workers, and they would finish tasks whose results
    nobody reads. A thread looks at the id of the parent, which changes when the parent has ended.
    On Windows it does not change: there a worker ends after five minutes without a task. Linux can
    send a signal instead (PR_SET_PDEATHSIG), but it does so already when the thread ends that has
    started the worker.
    """

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(WATCH_S)
        os._exit(1)

    threading.Thread(target=watch, name="end with the parent process", daemon=True).start()


@contextmanager
def threads_only() -> Iterator[None]:
    """Makes `run_together` use threads in this context: what its tasks use is in this process."""
    token = _THREADS_ONLY.set(True)
    try:
        yield
    finally:
        _THREADS_ONLY.reset(token)


@contextmanager
def on_cluster(address: str) -> Iterator[None]:
    """Makes `run_tasks` and `run_unordered` use the workers of a Dask cluster in this context.

    Parameters
    ----------
    address
        address of the scheduler, such as "tcp://10.0.0.5:8786".

    Raises
    ------
    ValueError
        dask.distributed is not installed, no scheduler answers at the address, or the workers
        cannot run the tasks; the message says what to do.
    ChildProcessError
        a task has repeatedly killed the worker that ran it, or the scheduler has ended.
    """
    try:
        from distributed import Client
    except ImportError:
        # Said here as everywhere, without the module for it: the independent generator imports this
        # one, and through it nothing else of ehsid.
        line = f"{shlex.quote(sys.executable)} -m pip install 'ehsid[dask]'"
        raise ValueError(f"a Dask cluster needs dask.distributed: {line}") from None
    try:
        _check_scheduler(address)
        client = Client(address, timeout=CONNECT_S, set_as_default=False)
    except (OSError, ValueError, TypeError) as error:
        raise ValueError(
            f"no Dask scheduler answers at '{address}': {error}; start one with `dask scheduler`, "
            "which prints its address (tcp://HOST:PORT)"
        ) from None
    with _quiet("distributed", "distributed.client"), client:
        _check_cluster(client, address)
        token = _CLUSTER.set(client)
        try:
            yield
        except (asyncio.CancelledError, concurrent.futures.CancelledError):
            raise ChildProcessError(
                f"the Dask scheduler at {address} has gone; start it and go on"
            ) from None
        finally:
            _CLUSTER.reset(token)


def is_on_cluster() -> bool:
    """Whether tasks run on the workers of a cluster, which need not see the files of this one."""
    return _CLUSTER.get() is not None


@contextmanager
def _quiet(*loggers: str) -> Iterator[None]:
    """Limits these loggers to critical messages, because errors are reported as exceptions."""
    before = {name: logging.getLogger(name).level for name in loggers}
    try:
        for name in loggers:
            logging.getLogger(name).setLevel(logging.CRITICAL)
        yield
    finally:
        for name, level in before.items():
            logging.getLogger(name).setLevel(level)


def _version() -> str:
    return importlib.metadata.version(PACKAGE)


def _check_scheduler(address: str) -> None:
    """Checks that a program listens at the address.

    This check fails at once where nothing listens; a Dask client would keep trying.
    """
    parts = urlsplit(address)
    if parts.scheme not in ("tcp", "tls") or not parts.hostname or not parts.port:
        raise ValueError("this is not an address such as tcp://10.0.0.5:8786")
    socket.create_connection((parts.hostname, parts.port), CONNECT_S).close()


def _check_cluster(client: Any, address: str) -> None:
    """Checks that the cluster has workers and that they have this version of the package."""
    here = _version()
    found = client.run(importlib.metadata.version, PACKAGE, on_error="return")
    if not found:
        raise ValueError(
            f"the Dask scheduler at {address} has no workers; start some with "
            f"`dask worker {address} --nthreads 1`"
        )
    for worker, version in found.items():
        if version != here:
            has = f"version {version}" if isinstance(version, str) else "none"
            raise ValueError(
                f"the Dask worker {worker} needs {PACKAGE} {here} and has {has}: install it there"
            )


def run_unordered(tasks: Iterable[Callable[[], T]]) -> Iterator[T]:
    """Yields each result as soon as it is available, in any order; each task must be picklable.

    The tasks are taken from the iterable only a few ahead of the workers, in any thread, so that a
    task with much data need not exist before its turn. The iterable must not raise.

    Raises
    ------
    ChildProcessError
        a worker process was killed. On a cluster: a task has killed each worker that tried it; this
        is raised when all other tasks are finished, and their results have been yielded.
    NoWorkersError
        a cluster has no workers left to find out which task kills them.
    """
    if worker_count() == 1:
        # This also holds for a task that itself runs on a cluster: its subtasks stay on its worker.
        yield from (task() for task in tasks)
        return
    client = _CLUSTER.get()
    if client is not None:
        yield from _on(client, tasks)
        return
    # Imported here because serial runs and runs on a cluster do not need joblib.
    import joblib
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    try:
        with _workers_deaf_to_ctrl_c():
            running = joblib.Parallel(
                n_jobs=worker_count(),
                return_as="generator_unordered",
                initializer=end_with,
                initargs=(os.getpid(),),
            )(joblib.delayed(_alone)(task) for task in tasks)
        yield from running
    except TerminatedWorkerError:
        raise ChildProcessError(
            "a worker process was killed, perhaps for want of memory; start again with fewer "
            "--workers"
        ) from None


def end_workers() -> None:
    """Ends the processes that wait for further tasks of this one.

    For a process that multiprocessing has started: at its end it would wait for them, and they for
    tasks, five minutes long.
    """
    if "joblib" in sys.modules:
        from joblib.externals.loky import get_reusable_executor

        get_reusable_executor().shutdown(wait=True, kill_workers=True)


def run_surviving(
    items: Sequence[K], task_of: Callable[[K], Callable[[], T]]
) -> Iterator[tuple[K, T | None]]:
    """Yields each item with its result, in any order; None where its task has killed its process.

    When a process is killed, all tasks that had begun run again, each alone, and the one that kills
    a second time is not tried further; the others go on. A cluster tries them alone by itself.

    Parameters
    ----------
    items
        what there is a task for.
    task_of
        makes the task of an item when its turn comes, in any thread; it must not raise, and the
        task must be picklable.

    Raises
    ------
    NoWorkersError
        a cluster has no workers left.
    """
    left = dict(enumerate(items))
    begun: set[int] = set()

    def tasks(places: Iterable[int]) -> Iterator[Callable[[], tuple[int, T]]]:
        for place in places:
            begun.add(place)
            yield partial(_placed, place, task_of(items[place]))

    def again(place: int) -> T | None:
        if is_on_cluster():
            return None
        try:
            ((_, result),) = run_unordered(tasks([place]))
        except ChildProcessError:
            return None
        return result

    while left:
        try:
            for place, result in run_unordered(tasks(list(left))):
                yield left.pop(place), result
        except NoWorkersError:
            raise
        except ChildProcessError:
            for place in sorted(begun & left.keys()):
                yield left.pop(place), again(place)


def _on(client: Any, tasks: Iterable[Callable[[], T]]) -> Iterator[T]:
    """Yields the results of tasks that run on a cluster, as `run_unordered` does.

    The function does not use joblib's own backend for Dask (as of 1.6). That backend waits for ever
    when the scheduler ends while results are taken in the order of completion. On a cluster of one
    core it runs all tasks in this process.
    """
    import cloudpickle
    from distributed import KilledWorker, as_completed

    def unpacked(task: bytes) -> Any:
        return pickle.loads(task)()

    def sent(task: Callable[[], T]) -> Any:
        with warnings.catch_warnings():
            # A task carries its records, whatever their size, because each is needed only once.
            warnings.filterwarnings("ignore", "Sending large graph", UserWarning)
            # The task is sent as bytes: the scheduler unpickles what it receives, and it need not
            # have this package. A nested function such as `unpacked` is sent by value.
            return client.submit(unpacked, cloudpickle.dumps(partial(_alone, task)), pure=False)

    def ahead() -> int:
        """Two tasks for each core, so that none waits for the next one; workers come and go."""
        try:
            cores: dict[str, int] = client.ncores()
            return 2 * sum(cores.values())
        except OSError:  # the scheduler has gone, as the next result will tell
            return 0

    waiting = iter(tasks)
    sent_tasks = {sent(task): task for task in itertools.islice(waiting, max(1, ahead()))}
    running = as_completed(list(sent_tasks), loop=client.loop)
    suspects = []
    for future in running:
        task = sent_tasks.pop(future)
        try:
            result = future.result()
        except KilledWorker:
            suspects.append(task)
        else:
            yield result
        for more in itertools.islice(waiting, max(1, ahead() - running.count())):
            following = sent(more)
            sent_tasks[following] = more
            running.add(following)
    # Dask blames every task that waits on a worker that is killed. Alone, each shows what it is. A
    # task that kills a worker at its start also ends its nanny, and perhaps no worker is left.
    guilty = ""
    for task in suspects:
        future, seen = sent(task), time.monotonic()
        while not future.done() and time.monotonic() - seen < NO_WORKERS_S:
            time.sleep(WATCH_S)
            seen = time.monotonic() if ahead() else seen
        try:
            if not future.done():
                raise NoWorkersError(
                    "the cluster has lost all of its workers; start some, and then this again"
                )
            result = future.result()
        except KilledWorker as error:
            guilty = str(error)
        else:
            yield result
    if guilty:
        raise ChildProcessError(f"workers of the cluster were killed: {guilty}")


def run_threads(tasks: Sequence[Callable[[], T]], progress: Progress | None = None) -> list[T]:
    """Returns the results in the order of the tasks, which run in threads of this process.

    For tasks that spend their time outside of Python. In a task of another call, which has one core
    to itself, they run one after the other. `progress` has the meaning it has in `run_tasks`.
    """
    if worker_count() == 1 or len(tasks) < 2:
        results = []
        for task in tasks:
            results.append(task())
            if progress is not None:
                progress(len(results) / len(tasks))
        return results
    count = worker_count() if worker_count() > 0 else os.cpu_count() or 1
    pool = concurrent.futures.ThreadPoolExecutor(count)
    try:
        futures = [pool.submit(_alone, task) for task in tasks]
        for done, future in enumerate(concurrent.futures.as_completed(futures), start=1):
            future.result()  # raises what the task raised
            if progress is not None:
                progress(done / len(tasks))
        return [future.result() for future in futures]
    finally:
        # After an error or Ctrl-C no further task is started.
        pool.shutdown(cancel_futures=True)


@contextmanager
def single_threaded_algebra() -> Iterator[None]:
    """Keeps numpy's linear algebra in the thread that calls it, in this whole process.

    The tasks use the cores themselves. More threads in small products only wait for each other.
    """
    # Imported here because commands that fit nothing do not need it.
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield


def part_of(progress: Progress | None, begin: float, end: float) -> Progress | None:
    """Returns the progress of a part of some work, as one of the whole work."""
    if progress is None:
        return None
    return lambda share: progress(begin + share * (end - begin))


def run_together(tasks: Sequence[Callable[[], T]], progress: Progress | None = None) -> list[T]:
    """Runs tasks on the same large data: in threads on few cores, else as `run_tasks`.

    Threads share the data and start at once, whereas a worker process first imports the package,
    which costs as much as a second of simulation. But Python code runs in one thread at a time. The
    tasks of a diagnosis spend a quarter of their time there, so that THREADS_UP_TO cores are used
    well and more are not.
    """
    count = worker_count() if worker_count() > 0 else os.cpu_count() or 1
    if _THREADS_ONLY.get():
        return run_threads(tasks, progress)
    if count > THREADS_UP_TO or _CLUSTER.get() is not None:
        return run_tasks(tasks, progress)
    return run_threads(tasks, progress)


def run_tasks(tasks: Sequence[Callable[[], T]], progress: Progress | None = None) -> list[T]:
    """Returns the results in the order of the tasks; each task must be picklable.

    `progress` is called with the share of completed tasks, 0 to 1.

    Raises
    ------
    ChildProcessError
        a worker process was killed.
    """
    results: dict[int, T] = {}
    for place, result in run_unordered([partial(_placed, i, task) for i, task in enumerate(tasks)]):
        results[place] = result
        if progress is not None:
            progress(len(results) / len(tasks))
    return [results[i] for i in range(len(tasks))]


def _alone(task: Callable[[], T]) -> T:
    """Runs a task that has a worker to itself, but not its neighbours' cores."""
    with workers(1):
        return task()


def _placed(place: int, task: Callable[[], T]) -> tuple[int, T]:
    return place, task()
