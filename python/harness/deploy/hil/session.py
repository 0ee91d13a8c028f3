# SPDX-License-Identifier: MIT
"""A run with a target: every request is answered once, whatever the line does to the frames."""

from __future__ import annotations

import secrets
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import NoReturn, TypeVar

from ehsid.harness.deploy.hil.answers import Answer, Done, Identity, Refused, Result, parse_answer
from ehsid.harness.deploy.hil.configuration import POLICIES, Configuration
from ehsid.harness.deploy.hil.errors import BadFrame, HilError, TargetReset
from ehsid.harness.deploy.hil.frames import decode, encode
from ehsid.harness.deploy.hil.messages import Reason, State, status_name
from ehsid.harness.deploy.hil.requests import Hello, Resume, Sample, Start, Stop
from ehsid.harness.deploy.hil.transport import Line

MOST_TRIPS = 10
START_UP_S = 5.0  # of a board that opening its port has reset
UNASKED = 0  # sequence

Request = Hello | Configuration | Start | Sample | Resume | Stop
A = TypeVar("A", Identity, Done, Result)

CHECK = (
    "is the target powered and the firmware of examples/firmware/servo on it? Is it this port, "
    "with this baud rate, and no other program on it?"
)


@dataclass
class Counters:
    """What went wrong on the line and was mended, as seen from here.

    Attributes
    ----------
    asked_again
        requests sent once more for want of an answer.
    late
        answers that came when they were no longer waited for, or twice.
    bad_frames
        frames received that were none.
    resumed
        times that the watchdog of the target had closed the valve and it was opened again.
    """

    asked_again: int = 0
    late: int = 0
    bad_frames: int = 0
    resumed: int = 0


class Session:
    """Talks to one target over one line.

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
        open; stays with the caller.
    timeout_s
        time to wait for an answer before asking again, s. Several times what a request takes
        there and back: 0.2 s at 9600 baud.
    attempts
        requests sent, the first one among them, before the run ends.
    on_event
        told in words of what a user may want to know: the valve opened again, answers missed.

    Attributes
    ----------
    counters
        see `Counters`.
    identity
        of the target that answered the last `hello`.
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
        self._timeout_s = timeout_s
        self._attempts = attempts
        self._on_event = on_event
        # Not always the same, so that nothing a run before left on the line is taken for an answer.
        self._sequence = secrets.randbelow(0xFFFF)

    def hello(self) -> Identity:
        """Asks who is there, for as long as a board takes to start, 5 s. The target goes idle.

        Raises
        ------
        HilError
            nothing answers, or it speaks another version; the line was closed.
        """
        attempts = max(self._attempts, round(START_UP_S / self._timeout_s))
        self.identity = self._ask(Hello(), Identity, "hello", attempts)
        return self.identity

    def configure(self, configuration: Configuration) -> None:
        """Makes a new estimator and controller on the target.

        Raises
        ------
        ValueError
            a setting out of its range, by name.
        HilError
            the firmware does not hold such an estimator; the target refuses, or does not answer.
        TargetReset
            the target has begun anew.
        """
        configuration.estimator.estimator()  # checks all ranges, and says which
        if self.identity is not None:
            self._check_held(configuration, self.identity)
        self._ask(configuration, Done, "the configuration")

    def start(self, first: int = 0) -> None:
        """Opens the valve; the next sample is number `first`.

        Raises
        ------
        HilError, TargetReset
            as `configure`.
        """
        self._ask(Start(first), Done, "the start of the run")

    def exchange(self, sample: Sample) -> Result:
        """Sends a sample; the target carries it out exactly once, whatever the line does.

        Where its watchdog had closed the valve meanwhile, this opens it again.

        Raises
        ------
        HilError
            no answer, refused, or the watchdog has tripped more than 10 times.
        TargetReset
            the target has begun anew: its estimate is gone. Call `hello`, `configure` and
            `start(first=sample.number)`, then ask again.
        ValueError
            a number beyond its type.
        """
        what = f"sample {sample.number}"
        while True:
            try:
                result = self._ask(sample, Result, what)
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
        """Closes the valve and ends the run; `start` begins another.

        Raises
        ------
        HilError, TargetReset
            as `configure`.
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
        """The answer to the request, which is sent until there is one."""
        self._sequence = self._sequence % 0xFFFF + 1  # 0 marks what comes unasked
        frame = encode(request.kind, self._sequence, request.body())
        attempts = attempts or self._attempts
        for attempt in range(attempts):
            if attempt > 0:
                self.counters.asked_again += 1
            self._line.send(frame)
            answer = self._answer(wanted, asked=request)
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

    def _answer(self, wanted: type[A], asked: Request) -> A | Refused | None:
        """What comes to the request in time; None for nothing."""
        deadline = time.monotonic() + self._timeout_s
        while True:
            # Once more after the deadline: where this process was held up, the answer is there.
            frame = self._line.receive(max(deadline - time.monotonic(), 0.0))
            if frame is None:
                return None
            try:
                packet = decode(frame)
                if packet.sequence not in (UNASKED, self._sequence):
                    self.counters.late += 1
                    continue
                answer = parse_answer(packet)
            except BadFrame:
                self.counters.bad_frames += 1
                continue
            if packet.sequence == UNASKED:
                self._unasked(answer, asked)
            elif isinstance(answer, (wanted, Refused)):
                return answer
            else:
                self.counters.late += 1

    def _unasked(self, answer: Answer, asked: Request) -> None:
        """News from the target. `Safe` is none: its answer to the next sample says the same."""
        if isinstance(answer, Identity) and not isinstance(asked, Hello):
            raise TargetReset(self._reset())

    def _refused(self, request: Request, answer: Refused, what: str) -> NoReturn:
        out_of_state = answer.reason is Reason.STATE
        if out_of_state and answer.state is State.IDLE:
            raise TargetReset(self._reset())
        if out_of_state and answer.state is State.SAFE and isinstance(request, Sample):
            raise _Tripped
        raise HilError(
            f"{self._line.name}: the target refused {what}: {_reason(answer)} "
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
    """The target is safe: the sample was not carried out."""


def _reason(answer: Refused) -> str:
    """Why, in words, and what to do."""
    match answer.reason:
        case Reason.STATE:
            return "it takes none in its state; end what else talks to it, and begin with hello"
        case Reason.ORDER:
            return f"it waits for sample {answer.expected}; numbers are consecutive"
        case Reason.UNKNOWN:
            return "it does not know this request; bring firmware and host to one release"
        case Reason.CONFIGURATION:
            return (
                f"{status_name(answer.status)} in the settings of its controller or estimator; "
                "ranges stand in examples/firmware/servo/controller.hpp and ehsid/c_api.h"
            )
        case Reason.NOT_HELD:
            return "its firmware has no estimator of this policy and number of parameters"
