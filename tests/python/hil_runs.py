# SPDX-License-Identifier: MIT
"""Runs over a relay, and what must be the same however the line was disturbed."""

import time
from collections.abc import Callable
from dataclasses import replace

import ehsid
from ehsid.harness.firmware import EstimatorConfiguration
from ehsid.harness.models.identification import ArxOrders
from ehsid.hil.answers import Result
from ehsid.hil.configuration import Configuration, ControllerSettings
from ehsid.hil.messages import Sample
from ehsid.hil.session import Session

TIMEOUT_S = 0.03
# A loaded machine may be late often; no test is about how many times that may be.
PATIENT = 100

CONTROLLER = ControllerSettings(0.001, 50.0, 20.0, 10.0, 30.0, 10.0, 90.0, 0.02, retune=False)
NEVER_MS = 60_000


def configuration(watchdog_ms: int = NEVER_MS) -> Configuration:
    estimator = EstimatorConfiguration(ArxOrders(3, 3), forgetting=ehsid.FRatio())
    return Configuration(estimator, CONTROLLER, watchdog_ms)


def sample(number: int) -> Sample:
    """A fixed signal; no two samples are alike."""
    return Sample(number, 0.001 * (number * 37 % 101), 0.001 * (number * 53 % 97), 0.01 * number)


def run(session: Session, samples: int, watchdog_ms: int = NEVER_MS) -> list[Result]:
    """A whole run, from hello to stop."""
    session.hello()
    session.configure(configuration(watchdog_ms))
    session.start()
    results = [session.exchange(sample(number)) for number in range(samples)]
    session.stop()
    return results


def estimates(results: list[Result]) -> list[Result]:
    """Without what counts the line's faults and the time."""
    return [replace(r, step_cycles=0, bad_frames=0, repeated=0, trips=0) for r in results]


def wait_until(true: Callable[[], bool]) -> None:
    """For what another thread is about to do; fails where it does not."""
    deadline = time.monotonic() + 60.0
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.001)
