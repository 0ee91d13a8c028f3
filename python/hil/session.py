# SPDX-License-Identifier: MIT
"""Session with a target: each request takes effect once, even if frames are lost or damaged."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn, TypeVar

from .answers import (
    Answer,
    Done,
    Identity,
    Refused,
    Result,
    SampleAnswer,
    ServoResult,
    parse_answer,
)
from .configuration import POLICIES, Configuration
from .frames import BadFrame, HilError, TargetReset, decode, encode
from .messages import MOST_LOST, Hello, Reason, Resume, Sample, Start, State, Stop, status_name
from .transport import Line

MOST_TRIPS = 10
# Largest number of frames that are read after the deadline. If this process was delayed, the answer
# may have arrived behind other frames; a target that floods the line must not gain time by it.
MOST_OVERDUE = 100
START_UP_S = 5.0  # start-up time of a board that was reset when its port was opened
UNREQUESTED = 0  # sequence number of a packet that the target sends without a request

Request = Hello | Configuration | Start | Sample | Resume | Stop
A = TypeVar("A", Identity, Done, Result, ServoResult)

CHECK = (
    "is the target powered and the firmware of examples/firmware/servo on it? Is it this port, "
    "with this baud rate, and no other program on it?"
)


@dataclass
class Counters:
    """Counts of the errors on the line that the host has corrected."""

    asked_again: int = 0
    """Requests sent again because no answer arrived."""
    late: int = 0
    """Answers that arrived when the host no longer waited for them, or arrived twice."""
    bad_frames: int = 0
    """Received frames that were not valid."""
    resumed: int = 0
    """Times the host opened the valve again after the watchdog of the target had closed it."""


class Session:
    """Sends requests to one target over one line and waits for the answers.

    >>> with open_line("/dev/ttyACM0") as line:
    ...     session = Session(line)
    ...     session.hello()
    ...     session.configure(configuration)
    ...     session.start()
    ...     result = session.exchange(Sample(0, position_m=0.0))
    ...     session.stop()

    Parameters
    ----------
    line
        open line; the caller closes it.
    timeout_s
        time to wait for an answer before the request is sent again, s. It should be several times
        the time of a request and its answer on the line, which is 0.2 s at 9600 baud.
    attempts
        number of times a request is sent, the first time included, before the run ends.
    on_event
        called with a sentence for the user when the valve is opened again or answers are missed.

    Attributes
    ----------
    counters
        counts of errors on the line, see `Counters`.
    identity
        identity of the target that answered the last `hello`; None before.
    """

    def __init__(
        self,
        line: Line,
        *,
        timeout_s: float = 0.5,
        attempts: int = 10,
        on_event: Callable[[str], None] | None = None,
    ) -> None:
        if not timeout_s > 0.0 or attempts < 1:
            raise ValueError(
                f"timeout_s = {timeout_s}, attempts = {attempts}: expected > 0 s and at least 1"
            )
        self.counters = Counters()
        self.identity: Identity | None = None
        self._line = line
        self._servo = False
        self._timeout_s = timeout_s
        self._attempts = attempts
        self._on_event = on_event
        # The first number is random, so that a packet of an earlier run that is still on the line
        # is not taken for an answer.
        self._sequence = secrets.randbelow(0xFFFF)

    def hello(self) -> Identity:
        """Requests the identity of the target; the target goes to the state idle.

        The request is repeated for at least 5 s, the time that a board needs to start.

        Raises
        ------
        HilError
            no target answers, it has another protocol version, or the line was closed.
        """
        attempts = max(self._attempts, round(START_UP_S / self._timeout_s))
        self.identity = self._ask(Hello(), Identity, "hello", attempts)
        return self.identity

    def configure(self, configuration: Configuration) -> None:
        """Makes a new estimator and controller on the target.

        Raises
        ------
        ValueError
            a setting is out of its range; the message names it.
        HilError
            the firmware has no such estimator, or the target refuses or does not answer.
        TargetReset
            the target was reset.
        """
        # This checks all ranges; the error names the setting.
        (configuration.servo or configuration.estimator).estimator()
        if self.identity is not None and configuration.servo is None:
            self._check_held(configuration, self.identity)
        self._ask(configuration, Done, "the configuration")
        self._servo = configuration.servo is not None

    def start(self, first: int = 0) -> None:
        """Opens the valve; the next sample is number `first`.

        Raises
        ------
        HilError, TargetReset
            as in `configure`.
        """
        self._ask(Start(first), Done, "the start of the run")

    def exchange(self, sample: Sample) -> SampleAnswer:
        """Sends a sample and returns the answer; the target carries the sample out exactly once.

        If the watchdog of the target has closed the valve, this method opens it again.

        Raises
        ------
        HilError
            the target does not answer or refuses the sample, or its watchdog has closed the valve
            more than 10 times in this session.
        TargetReset
            the target was reset and has lost its estimate. Call `hello`, `configure` and
            `start(first=sample.number)`, then send the sample again.
        ValueError
            a number does not fit its type.
        """
        what = f"sample {sample.number}"
        while True:
            try:
                result: SampleAnswer = (
                    self._ask(sample, ServoResult, what)
                    if self._servo
                    else self._ask(sample, Result, what)
                )
            except _Tripped:
                self._resume(sample.number)
                continue
            if result.number != sample.number:
                raise HilError(
                    f"{self._line.name}: {what} was answered with the result of {result.number}; "
                    "is another program on the line?"
                )
            return result

    def stop(self) -> None:
        """Closes the valve and ends the run; `start` begins another run.

        Raises
        ------
        HilError, TargetReset
            as in `configure`.
        """
        self._ask(Stop(), Done, "the end of the run")

    def _resume(self, number: int) -> None:
        self.counters.resumed += 1
        if self.counters.resumed > MOST_TRIPS:
            raise HilError(
                f"{self._line.name}: the watchdog of the target closed the valve more than "
                f"{MOST_TRIPS} times, the last time before sample {number}: this host is too slow "
                "for it or the line loses too much; raise the watchdog's time"
            )
        self._event(f"the watchdog had closed the valve before sample {number}; opening it again")
        self._ask(Resume(), Done, "resume")

    def _ask(self, request: Request, wanted: type[A], what: str, attempts: int | None = None) -> A:
        """Sends a request until the target answers, at most `attempts` times; returns the answer.

        `what` names the request in messages. `attempts` is that of the session by default.
        """
        self._sequence = self._sequence % 0xFFFF + 1  # 0 marks packets without a request
        frame = encode(request.message.kind, self._sequence, request.body())
        attempts = attempts or self._attempts
        for attempt in range(attempts):
            if attempt > 0:
                self.counters.asked_again += 1
            self._line.send(frame)
            answer = self._answer(wanted, request)
            if isinstance(answer, wanted):
                if attempt > 1:
                    self._event(f"{what} was asked {attempt + 1} times")
                return answer
            if isinstance(answer, Refused):
                self._refused(request, answer, what)
        raise HilError(
            f"{self._line.name}: no answer to {what}, asked {attempts} times in "
            f"{attempts * self._timeout_s:.3g} s ({self.counters.bad_frames} damaged frames came "
            f"in all): {CHECK}"
        )

    def _answer(self, wanted: type[A], request: Request) -> A | Refused | None:
        """Returns the answer to the request; None if no answer arrives within the timeout."""
        deadline = time.monotonic() + self._timeout_s
        overdue = 0
        while overdue <= MOST_OVERDUE:
            left = deadline - time.monotonic()
            overdue += left < 0.0
            frame = self._line.receive(max(left, 0.0))
            if frame is None:
                return None
            try:
                packet = decode(frame)
                if packet.sequence not in (UNREQUESTED, self._sequence):
                    self.counters.late += 1
                    continue
                answer = parse_answer(packet)
            except BadFrame:
                self.counters.bad_frames += 1
                continue
            if packet.sequence == UNREQUESTED:
                self._unrequested(answer, request)
            elif isinstance(answer, (wanted, Refused)):
                return answer
            else:
                self.counters.late += 1
        return None

    def _unrequested(self, answer: Answer, request: Request) -> None:
        """Raises TargetReset if the target announces a reset without a request.

        `Safe` needs no action, because the answer to the next sample reports the same state.
        """
        if isinstance(answer, Identity) and not isinstance(request, Hello):
            raise TargetReset(self._reset())

    def _refused(self, request: Request, answer: Refused, what: str) -> NoReturn:
        out_of_state = answer.reason is Reason.STATE
        if out_of_state and answer.state is State.IDLE:
            raise TargetReset(self._reset())
        if out_of_state and answer.state is State.SAFE and isinstance(request, Sample):
            raise _Tripped
        raise HilError(
            f"{self._line.name}: the target refused {what}: {_reason(answer, request)} "
            f"(it is {answer.state.name.lower()})"
        )

    def _reset(self) -> str:
        return f"{self._line.name}: the target has begun anew; was its supply interrupted?"

    def _check_held(self, configuration: Configuration, identity: Identity) -> None:
        n, names = configuration.estimator.orders.n_parameters, [p.__name__ for p in POLICIES]
        missing = []
        if configuration.policy not in identity.policies:
            held = ", ".join(names[i] for i in sorted(identity.policies) if i < len(names))
            missing.append(f"no {names[configuration.policy]} forgetting (it holds {held})")
        if n not in identity.parameters:
            held = ", ".join(map(str, sorted(identity.parameters)))
            missing.append(f"no estimator of {n} parameters (it holds {held})")
        if missing:
            raise HilError(
                f"the firmware on {identity.board} has {' and '.join(missing)}: choose one that "
                "it holds, or add the kernel to it, see docs/porting.md"
            )

    def _event(self, text: str) -> None:
        if self._on_event is not None:
            self._on_event(text)


class _Tripped(Exception):  # noqa: N818 -- never leaves this module
    """The target is in the state safe, so it has not carried out the sample."""


def _reason(answer: Refused, request: Request) -> str:
    """Returns the reason of a refusal in words, and what the user can do."""
    match answer.reason:
        case Reason.STATE:
            return "it takes none in its state; end what else talks to it, and begin with hello"
        case Reason.ORDER:
            if isinstance(request, Sample) and 0 < request.number - answer.expected <= MOST_LOST:
                return (
                    f"it waits for sample {answer.expected} and knows no lost cycles; bring its "
                    "firmware to the release of this host, or leave lost out of --cycles"
                )
            return f"it waits for sample {answer.expected}; numbers are consecutive"
        case Reason.UNKNOWN:
            return "it does not know this request; bring firmware and host to one release"
        case Reason.CONFIGURATION:
            return (
                f"{status_name(answer.status)} in the settings of its controller or estimator; "
                "ranges stand in examples/firmware/servo/controller.hpp and ehsid/c_api.h"
            )
        case Reason.NOT_IN_FIRMWARE:
            return "its firmware has no estimator of this policy and number of parameters"
