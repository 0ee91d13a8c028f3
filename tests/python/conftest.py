# SPDX-License-Identifier: MIT
"""Settings and fixtures that hold for all tests."""

import fcntl
import os
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import settings

# No test depends on the clock: on a slow or busy machine an example may take as long as it needs.
# The default level has a limit of time: 25 examples, where hypothesis would try 100. Other seeds
# come with every run, and script/fuzz goes on for hours.
settings.register_profile("ehsid", deadline=None, max_examples=25)
# For script/test --all.
settings.register_profile("thorough", deadline=None, max_examples=200)
settings.load_profile("ehsid")

# The workers of pytest-xdist and the processes that tests start take all cores. OpenBLAS would
# start a thread for each core in every one of them, and these wait for each other without sleeping.
# It reads this when numpy is first imported: after this file, and in the processes of tests.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


@pytest.fixture(scope="session", autouse=True)
def consistent_diagnoses() -> Iterator[None]:
    """Every diagnosis that a test makes in its own process breaks no rule of consistency."""
    import ehsid.harness.diagnosis.diagnosis as module
    from ehsid.harness.diagnosis.result import diagnosis_file
    from ehsid.lab.scoring.contradictions import contradictions

    made = module._diagnose

    def checked(*arguments: Any) -> Any:
        diagnosis = made(*arguments)
        assert contradictions(diagnosis_file(diagnosis, [], "rig.toml")) == ()
        return diagnosis

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "_diagnose", checked)
        yield


@pytest.fixture(scope="session")
def made_once(
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[str, Callable[[], Any]], Any]:
    """What takes long to make is made once a suite: by the worker that first asks for its name.

    The others wait for it, and each reads what was written.
    """
    folder = tmp_path_factory.getbasetemp()
    if "PYTEST_XDIST_WORKER" in os.environ:
        folder = folder.parent  # that of all workers

    def once(name: str, make: Callable[[], Any]) -> Any:
        made = folder / f"{name}.pickle"
        with (folder / f"{name}.lock").open("w") as lock:
            fcntl.flock(lock, fcntl.LOCK_EX)
            if not made.exists():
                made.write_bytes(pickle.dumps(make()))
        return pickle.loads(made.read_bytes())

    return once


@pytest.fixture
def blank_pictures(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pictures are written as ever, but with nothing drawn on them.

    For tests of what stands beside the pictures: to draw takes most of the time of a page.
    """
    monkeypatch.setattr("matplotlib.figure.Figure.draw", lambda figure, renderer: None)


@pytest.fixture
def no_plots(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pages of diagnoses without their zoomable plots, for the same reason."""
    for name in ("run_blocks", "next_plots"):
        monkeypatch.setattr(f"ehsid.harness.show.gap_page.{name}", lambda *_: [])


@pytest.fixture(scope="session", autouse=True)
def one_process() -> Iterator[None]:
    """What could be shared among processes is done in this one: to start others takes seconds."""
    from ehsid.harness.base.parallel import workers

    with workers(1):
        yield


@pytest.fixture
def two_processes() -> Iterator[None]:
    """For a test that has its work go to other processes and back."""
    from ehsid.harness.base.parallel import workers

    with workers(2):
        yield


def two_dask_workers() -> Iterator[str]:
    from ehsid.harness.base.parallel import workers

    distributed = pytest.importorskip("distributed")
    cluster = distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, dashboard_address=":0", silence_logs=40
    )
    with cluster, workers(None):  # one worker would be this process
        yield cluster.scheduler_address


@pytest.fixture(scope="module")
def dask_cluster() -> Iterator[str]:
    """Address of a cluster of two workers, which are processes of their own.

    It ends with its module: without any work it takes 7 % of a core.
    """
    yield from two_dask_workers()


@pytest.fixture
def mortal_cluster() -> Iterator[str]:
    """The same for one test, which may kill its workers."""
    yield from two_dask_workers()
