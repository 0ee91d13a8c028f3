# SPDX-License-Identifier: MIT
"""The same tasks here, in processes, and on a Dask cluster."""

import importlib.metadata
import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from interrupts import interruptible, left_of_session
from threadpoolctl import threadpool_info

from ehsid.harness.base.parallel import (
    THREADS_UP_TO,
    on_cluster,
    run_tasks,
    run_threads,
    run_together,
    run_unordered,
    single_threaded_algebra,
    worker_count,
    workers,
)

distributed = pytest.importorskip("distributed")


@pytest.fixture(autouse=True)
def as_many_as_cores() -> Iterator[None]:
    """As in a program of a user, and not as in the other tests."""
    with workers(None):
        yield


def square(number: int, seconds: float = 0.0) -> tuple[int, int]:
    """With the process it was computed in."""
    time.sleep(seconds)
    return number**2, os.getpid()


def parts(number: int) -> tuple[list[int], set[int]]:
    """A task that has tasks of its own, on one core."""
    with workers(1):
        found = run_tasks([partial(square, one) for one in range(number)])
    return [value for value, _ in found], {process for _, process in found} | {os.getpid()}


def test_one_worker_is_this_process() -> None:
    with workers(1):
        assert worker_count() == 1
        assert run_tasks([partial(square, i) for i in range(3)]) == [
            (i**2, os.getpid()) for i in range(3)
        ]
    assert worker_count() == -1


@pytest.mark.slow
def test_processes_keep_the_order_and_tell_the_share() -> None:
    shares: list[float] = []
    with workers(2):
        # The first takes longest.
        tasks = [partial(square, i, 0.3 if i == 0 else 0.0) for i in range(4)]
        found = run_tasks(tasks, shares.append)
    assert [value for value, _ in found] == [0, 1, 4, 9]
    assert os.getpid() not in {process for _, process in found}
    assert shares == [0.25, 0.5, 0.75, 1.0]


def count_inside(_: int) -> tuple[int, int, int]:
    """Workers that a task may use itself, its process and its thread."""
    time.sleep(0.05)
    return worker_count(), os.getpid(), threading.get_ident()


def test_threads_keep_the_order_tell_the_share_and_have_one_core_each() -> None:
    shares: list[float] = []
    with workers(2):
        found = run_threads([partial(count_inside, i) for i in range(4)], shares.append)
        assert worker_count() == 2
    assert [(count, process) for count, process, _ in found] == [(1, os.getpid())] * 4
    assert len({thread for *_, thread in found} - {threading.get_ident()}) == 2
    assert shares == [0.25, 0.5, 0.75, 1.0]
    with workers(1):
        assert run_threads([partial(count_inside, 0)] * 2)[1][2] == threading.get_ident()


def test_tasks_on_the_same_data_are_threads_on_few_cores_and_processes_on_many() -> None:
    for count, here in ((2, True), (THREADS_UP_TO + 1, False)):
        with workers(count):
            found = run_together([partial(count_inside, i) for i in range(3)])
        assert {process == os.getpid() for _, process, _ in found} == {here}
        assert {inside for inside, *_ in found} == {1}


def test_after_an_error_no_further_thread_is_started() -> None:
    started = []

    def task(number: int) -> None:
        started.append(number)
        if number == 0:
            raise ValueError("number 0")
        time.sleep(0.2)

    with workers(2), pytest.raises(ValueError, match="number 0"):
        run_threads([partial(task, number) for number in range(20)])
    assert len(started) < 20


def test_linear_algebra_stays_in_its_thread_for_a_while() -> None:
    def threads() -> list[int]:
        return [each["num_threads"] for each in threadpool_info() if each["user_api"] == "blas"]

    before = threads()
    with single_threaded_algebra():
        assert threads() == [1] * len(before)
    assert threads() == before
    assert before


@pytest.mark.slow
def test_unordered_gives_what_is_there_and_takes_tasks_late() -> None:
    taken: list[int] = []

    def tasks() -> Iterator[partial[tuple[int, int]]]:
        for i in range(20):
            taken.append(i)
            yield partial(square, i, 1.0 if i == 0 else 0.02)

    with workers(2):
        results = run_unordered(tasks())
        first, _ = next(results)
        # One task is under way for each worker and one waits: joblib's pre_dispatch is 2 n_jobs.
        assert len(taken) < 10
        rest = [value for value, _ in results]
    assert first != 0
    assert sorted([first, *rest]) == [i**2 for i in range(20)]


@pytest.mark.slow
def test_a_worker_that_is_killed_is_one_message() -> None:
    tasks = [partial(os._exit, 1), *(partial(square, i) for i in range(3))]
    with workers(2), pytest.raises(ChildProcessError, match="a worker process was killed"):
        run_tasks(tasks)  # type: ignore[arg-type]
    with workers(2):
        assert [value for value, _ in run_tasks([partial(square, 3)] * 2)] == [9, 9]


WORKING_FOR_LONG = """
import functools, pathlib, sys, time
from ehsid.harness.base.parallel import run_tasks, workers

def work(path):
    path.touch()
    time.sleep(600)

if __name__ == "__main__":
    started = [pathlib.Path(sys.argv[1], name) for name in "ab"]
    with workers(2):
        run_tasks([functools.partial(work, path) for path in started])
"""


@pytest.mark.slow
def test_workers_end_when_their_parent_is_killed(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(WORKING_FOR_LONG, encoding="utf-8")
    with interruptible([sys.executable, str(program), str(tmp_path)]) as process:
        deadline = time.monotonic() + 60.0
        while not all((tmp_path / name).exists() for name in "ab"):
            assert process.poll() is None
            assert time.monotonic() < deadline, "two tasks are under way"
            time.sleep(0.1)
        process.send_signal(signal.SIGKILL)
        process.wait()
        assert left_of_session(process.pid, within_s=20.0) == []


@pytest.mark.slow
def test_a_cluster_gives_the_same(dask_cluster: str) -> None:
    tasks = [partial(square, i, 0.05) for i in range(12)]
    with on_cluster(dask_cluster):
        ordered = run_tasks(tasks)
        unordered = list(run_unordered(iter(tasks)))
    assert [value for value, _ in ordered] == [i**2 for i in range(12)]
    assert sorted(value for value, _ in unordered) == [i**2 for i in range(12)]
    processes = {process for _, process in [*ordered, *unordered]}
    assert len(processes) == 2
    assert os.getpid() not in processes
    with workers(1):
        assert run_tasks(tasks[:1]) == [(0, os.getpid())], "afterwards the tasks run here again"


def test_parts_of_a_task_stay_on_its_worker(dask_cluster: str) -> None:
    with on_cluster(dask_cluster):
        found = run_tasks([partial(parts, 5)] * 4)
    for values, processes in found:
        assert values == [0, 1, 4, 9, 16]
        assert len(processes) == 1


def test_errors_of_tasks_come_back(dask_cluster: str) -> None:
    tasks: list[Any] = [partial(divmod, 1, 0), partial(square, 2)]
    with on_cluster(dask_cluster):
        with pytest.raises(ZeroDivisionError):
            run_tasks(tasks)
        with pytest.raises(ZeroDivisionError):
            list(run_unordered(tasks))


def killed_once(marker: Path, number: int) -> int:
    """Ends its process at the first call, as the kernel does for want of memory."""
    if not marker.exists():
        marker.touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return number


def kill_own_process() -> int:
    time.sleep(1.0)  # a worker that is killed while it starts also ends its nanny
    os.kill(os.getpid(), signal.SIGKILL)
    return 0


@pytest.mark.thorough
def test_a_worker_of_a_cluster_that_is_killed_costs_no_result(
    mortal_cluster: str, tmp_path: Path
) -> None:
    tasks = [partial(killed_once, tmp_path / "killed", 7)]
    tasks += [partial(int, i) for i in range(7)]
    with on_cluster(mortal_cluster):
        assert sorted(run_unordered(tasks)) == list(range(8))
    assert (tmp_path / "killed").exists()


@pytest.mark.thorough
def test_a_task_that_kills_every_worker_does_not_stop_the_others(mortal_cluster: str) -> None:
    tasks: list[Any] = [kill_own_process, *(partial(int, i) for i in range(6))]
    found: list[int] = []
    with on_cluster(mortal_cluster):
        results = run_unordered(tasks)
        with pytest.raises(ChildProcessError, match="workers of the cluster were killed"):
            found.extend(one for one in results)
    assert sorted(found) == list(range(6))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ("tcp://127.0.0.1:1", "no Dask scheduler answers at 'tcp://127.0.0.1:1'"),
        ("10.0.0.5:8786", "not an address such as tcp://"),
        ("tcp://somewhere", "not an address such as tcp://"),
        ("", "not an address such as tcp://"),
        ("tcp://host.invalid:8786", "no Dask scheduler answers"),
    ],
)
def test_a_scheduler_that_is_not_there_is_one_message(wrong: str, words: str) -> None:
    with pytest.raises(ValueError, match=words), on_cluster(wrong):
        pytest.fail("there is no such cluster")


def test_a_scheduler_without_workers_is_one_message() -> None:
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=":0", silence_logs=40) as cluster,
        pytest.raises(ValueError, match="has no workers; start some with `dask worker tcp"),
        on_cluster(cluster.scheduler_address),
    ):
        pytest.fail("nobody is there to work")


def test_workers_of_another_version_are_one_message(
    dask_cluster: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # The workers ask for themselves; only here it is another one.
    monkeypatch.setattr("ehsid.harness.base.parallel._version", lambda: "99.0")
    has = importlib.metadata.version("ehsid")
    with (
        pytest.raises(ValueError, match=rf"needs ehsid 99\.0 and has version {has}"),
        on_cluster(dask_cluster),
    ):
        pytest.fail("its results would be of another program")


def test_without_dask_the_extra_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with (
        pytest.raises(ValueError, match=r"pip install 'ehsid\[dask\]'"),
        on_cluster("tcp://127.0.0.1:1"),
    ):
        pytest.fail("nothing to run on")


def run_and_lose(address: str, scheduler: subprocess.Popen[bytes]) -> None:
    with on_cluster(address):
        results = run_unordered(partial(square, i, 0.5) for i in range(20))
        next(results)
        scheduler.kill()
        list(results)


@pytest.mark.thorough
def test_a_scheduler_that_goes_is_one_message(tmp_path: Path) -> None:
    """In processes of their own, as on a cluster: the scheduler knows nothing of the tasks."""
    file = tmp_path / "scheduler.json"
    common = [f"--scheduler-file={file}", "--dashboard-address=:0"]
    tests = {"PYTHONPATH": os.pathsep.join([str(Path(__file__).parent), *filter(None, sys.path)])}
    scheduler, worker = (
        subprocess.Popen(
            [sys.executable, "-m", f"distributed.cli.dask_{what}", option, *common],
            stderr=subprocess.DEVNULL,
            env=os.environ | more,
        )
        for what, option, more in (("scheduler", "--port=0", {}), ("worker", "--nthreads=1", tests))
    )
    try:
        deadline = time.monotonic() + 60.0
        while not file.exists() and time.monotonic() < deadline:
            time.sleep(0.1)
        address = json.loads(file.read_text(encoding="utf-8"))["address"]
        with distributed.Client(address, set_as_default=False) as client:
            client.wait_for_workers(1, timeout=60)
        with pytest.raises(ChildProcessError, match="has gone"):
            run_and_lose(address, scheduler)
    finally:
        for process in (scheduler, worker):
            process.terminate()
            process.wait(timeout=30)
