# SPDX-License-Identifier: MIT
"""A session with a target over a line that goes wrong: the results are those of a sound line."""

import math
import os
import random
import socket
import struct
import threading
import time
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace

import pytest
from hil_line import Seeded
from hil_runs import PATIENT, TIMEOUT_S, configuration, estimates, run, sample, wait_until
from hil_target import FakeDevice, Target
from hypothesis import given, settings
from hypothesis import strategies as st

import ehsid
from ehsid.harness.firmware import ServoSettings
from ehsid.harness.models.identification import ArxOrders
from ehsid.hil import session as session_module
from ehsid.hil.answers import Done, Result
from ehsid.hil.faults import FAULTS, TO_HOST, TO_TARGET, Passing, Relay, fault, relayed, undisturbed
from ehsid.hil.frames import HilError, TargetReset, encode
from ehsid.hil.messages import MOST_LOST, Resume, Sample
from ehsid.hil.session import Session
from ehsid.hil.transport import Line, open_line

SAMPLES = 8


class Bench:
    """A fake target behind a relay, and a line to it."""

    def __init__(self, relay: Relay, device: FakeDevice, line: Line) -> None:
        self.relay, self.device, self.line = relay, device, line
        self.said: list[str] = []

    @property
    def target(self) -> Target:
        return self.device.target

    def session(self, attempts: int = PATIENT) -> Session:
        """On a sound line, with a target that has just been switched on."""
        self.relay.disturb(undisturbed)
        self.target.carried_out.clear()
        self.target.configurations.clear()
        self.target.version = 3
        self.device.reset()
        self.said.clear()
        return Session(self.line, timeout_s=TIMEOUT_S, attempts=attempts, on_event=self.said.append)

    def running(self, first: int = 0) -> Session:
        """The same, with a run that begins at this sample."""
        session = self.session()
        session.hello()
        session.configure(configuration())
        session.start(first=first)
        return session


@pytest.fixture(scope="module")
def bench() -> Iterator[Bench]:
    device = FakeDevice(Target())
    with relayed(device) as relay, open_line(relay.port) as line:
        yield Bench(relay, device, line)


@pytest.fixture(scope="module")
def sound(bench: Bench) -> list[object]:
    """What a run on a sound line gives."""
    return [*estimates(run(bench.session(), SAMPLES))]


def test_a_sound_line(bench: Bench) -> None:
    session = bench.session()
    results = run(session, SAMPLES)
    assert bench.target.carried_out == list(range(SAMPLES))
    assert bench.target.configurations == [configuration().body()]
    assert bench.target.state == 1
    assert [result.number for result in results] == list(range(SAMPLES))
    assert session.identity is not None
    assert session.identity.board == "fake"
    assert bench.said == []
    last = results[-1]
    positions = [float(sample(number).position_m) for number in range(SAMPLES)]
    assert last.innovation_m == pytest.approx(sum(positions), rel=1e-6)  # SAMPLES float32
    assert (last.gain_v_m, last.resets, last.theta) == (20.0, 2, (1.0, 2.0, SAMPLES - 1))
    assert (last.converged, last.gain_estimated, last.limited) == (True, False, True)


@pytest.mark.slow
@pytest.mark.parametrize("kind", FAULTS)
@pytest.mark.parametrize("direction", [TO_TARGET, TO_HOST])
def test_one_fault_after_the_other(
    bench: Bench, sound: list[object], kind: str, direction: str
) -> None:
    """Every third frame of one direction, so that each kind of request and answer meets it."""
    session = bench.session()
    rng = random.Random(0)

    def every_third(way: str, number: int, frame: bytes) -> Passing:
        if way != direction or number % 3 != 2:
            return undisturbed(way, number, frame)
        return fault(kind, frame, rng, 2 * TIMEOUT_S)

    bench.relay.disturb(every_third)
    assert estimates(run(session, SAMPLES)) == sound
    assert bench.target.carried_out == list(range(SAMPLES))
    assert len(bench.target.configurations) == 1
    assert bench.target.state == 1


@pytest.mark.thorough
@settings(max_examples=15)
@given(st.integers(0, 2**32 - 1), st.sets(st.sampled_from(FAULTS), min_size=1))
def test_faults_of_all_kinds_in_both_directions(
    bench: Bench, sound: list[object], seed: int, kinds: set[str]
) -> None:
    session = bench.session()
    bench.relay.disturb(Seeded(seed, sorted(kinds), 0.25, 1.5 * TIMEOUT_S))
    assert estimates(run(session, SAMPLES)) == sound
    assert bench.target.carried_out == list(range(SAMPLES))
    assert len(bench.target.configurations) == 1


def test_faults_are_counted(bench: Bench) -> None:
    session = bench.session()
    session.hello()
    before = replace(session.counters)

    lost: list[bytes] = []
    damaged: list[bytes] = []

    def faults(way: str, number: int, frame: bytes) -> Passing:
        kind = session_module.decode(frame).kind
        if kind == 0x02 and not lost:
            lost.append(frame)
            return Passing(b"")
        if kind == 0x82 and not damaged:
            damaged.append(frame)
            return Passing(b"\x05nonsense\0" + frame + b"\0" + frame + b"\0")
        return undisturbed(way, number, frame)

    bench.relay.disturb(faults)
    session.configure(configuration())
    session.start()  # meets the answer of before once more
    assert session.counters.asked_again >= before.asked_again + 1
    assert session.counters.bad_frames == before.bad_frames + 1
    assert session.counters.late >= before.late + 1
    assert session.counters.resumed == 0


def test_sequence_numbers_go_round_without_the_one_of_what_comes_unasked(bench: Bench) -> None:
    session = bench.session()
    session._sequence = 0xFFFF - 4
    seen: list[int] = []

    def note(way: str, number: int, frame: bytes) -> Passing:
        seen.append(session_module.decode(frame).sequence)
        return undisturbed(way, number, frame)

    session.hello()
    bench.relay.disturb(note)
    session.configure(configuration())
    session.start()
    for number in range(4):
        session.exchange(sample(number))
    assert sorted(set(seen) - {0xFFFC}) == [1, 2, 3, 0xFFFD, 0xFFFE, 0xFFFF]  # hello, perhaps twice
    assert bench.target.carried_out == [0, 1, 2, 3]


def test_values_that_are_not_finite_reach_the_target(bench: Bench) -> None:
    session = bench.running()
    result = session.exchange(Sample(0, math.nan, math.inf))
    assert result.status == ehsid.Status.invalid_input


# Watchdog


@pytest.mark.parametrize("answer_lost", [False, True], ids=["before", "after"])
@pytest.mark.parametrize("notice_lost", [False, True], ids=["heard", "unheard"])
def test_a_trip_of_the_watchdog_is_resumed(
    bench: Bench, sound: list[object], answer_lost: bool, notice_lost: bool
) -> None:
    """Before sample 3 was carried out, or after it where its answer was lost."""
    session = bench.session()
    tripped: list[bool] = []

    def trip(way: str, number: int, frame: bytes) -> Passing:
        packet = session_module.decode(frame)
        of_three = packet.body[:4] == b"\3\0\0\0" and packet.kind in (0x04, 0x84)
        if of_three and not tripped and (way == TO_HOST) == answer_lost:
            tripped.append(True)
            bench.device.trip()
            return Passing(b"") if answer_lost else undisturbed(way, number, frame)
        lost = notice_lost and packet.kind == 0x86
        return Passing(b"") if lost else undisturbed(way, number, frame)

    bench.relay.disturb(trip)
    assert estimates(run(session, SAMPLES)) == sound
    assert bench.target.carried_out == list(range(SAMPLES))
    assert bench.target.trips == session.counters.resumed == 1
    assert [text for text in bench.said if "asked" not in text] == [
        f"the watchdog had closed the valve before sample {3 + answer_lost}; opening it again"
    ]


def test_trips_without_end_end_the_run(bench: Bench) -> None:
    session = bench.session()

    def trip_always(way: str, number: int, frame: bytes) -> Passing:
        if session_module.decode(frame).kind == 0x04:
            bench.device.trip()
        return undisturbed(way, number, frame)

    bench.relay.disturb(trip_always)
    with pytest.raises(
        HilError, match=r"more than 10 times, the last time before sample 0: .*raise"
    ):
        run(session, SAMPLES)
    assert bench.target.carried_out == []
    assert bench.target.state == 3
    bench.relay.disturb(undisturbed)
    session.stop()
    assert bench.target.state == 1


# A target that begins anew


@pytest.mark.parametrize("notice_lost", [False, True], ids=["heard", "unheard"])
def test_a_reset_in_mid_run_is_told_and_the_run_goes_on(bench: Bench, notice_lost: bool) -> None:
    session = bench.running()
    for number in range(4):
        session.exchange(sample(number))

    def one_way_only(way: str, number: int, frame: bytes) -> Passing:
        """Either the target's notice is lost, or what is sent to it."""
        unasked = way == TO_HOST and session_module.decode(frame).sequence == 0
        lost = unasked if notice_lost else way == TO_TARGET
        return Passing(b"") if lost else undisturbed(way, number, frame)

    bench.relay.disturb(one_way_only)
    bench.device.reset()
    with pytest.raises(TargetReset, match="has begun anew"):
        session.exchange(sample(4))
    bench.relay.disturb(undisturbed)
    session.hello()
    session.configure(configuration())
    session.start(first=4)
    results = [session.exchange(sample(number)) for number in range(4, SAMPLES)]
    assert [result.number for result in results] == list(range(4, SAMPLES))
    assert bench.target.carried_out == list(range(SAMPLES))
    # What was summed before is gone with the reset.
    positions = [sample(number).position_m for number in range(4, SAMPLES)]
    assert results[-1].innovation_m == pytest.approx(sum(positions), rel=1e-6)


def test_resets_in_the_midst_of_faults(bench: Bench) -> None:
    """Each is told, and no sample is left out."""
    session = bench.session()
    resets = [5, 9]  # frames to the target
    faults = Seeded(3, ("drop", "flip", "repeat"), 0.2)

    def hook(way: str, number: int, frame: bytes) -> Passing:
        if way == TO_TARGET and resets and number >= resets[0]:
            resets.pop(0)
            bench.device.reset()
        return faults(way, number, frame)

    bench.relay.disturb(hook)
    done = 0
    while done < SAMPLES:
        try:
            session.hello()
            session.configure(configuration())
            session.start(first=done)
            while done < SAMPLES:
                assert session.exchange(sample(done)).number == done
                done += 1
        except TargetReset:
            continue
    assert resets == []
    assert faults.made
    # A sample whose answer was lost in the reset is asked of the new estimate once more.
    assert sorted(set(bench.target.carried_out)) == list(range(SAMPLES))
    assert bench.target.carried_out == sorted(bench.target.carried_out)


# What ends a run


@pytest.mark.parametrize("what", ["hello", "sample"])
def test_a_mute_target_ends_the_run_with_what_to_check(
    bench: Bench, monkeypatch: pytest.MonkeyPatch, what: str
) -> None:
    monkeypatch.setattr(session_module, "START_UP_S", 0.0)
    session = bench.session(attempts=3)
    sent: list[bytes] = []

    def mute(way: str, number: int, frame: bytes) -> Passing:
        if way == TO_TARGET:
            sent.append(frame)
        return Passing(b"")

    if what == "sample":
        session = bench.running()
        session._attempts = 3
    bench.relay.disturb(mute)
    with pytest.raises(
        HilError, match=rf"no answer to {what}.*, asked 3 times.*powered.*baud rate"
    ):
        _ = session.hello() if what == "hello" else session.exchange(sample(0))
    wait_until(lambda: len(sent) == 3)
    assert len(set(sent)) == 1  # the same bytes


@pytest.mark.slow
def test_hello_waits_for_a_board_to_start(bench: Bench) -> None:
    """The first 20 are lost; attempts of a run are fewer."""
    session = bench.session(attempts=2)

    def deaf(way: str, number: int, frame: bytes) -> Passing:
        return Passing(b"") if number < 20 and way == TO_TARGET else undisturbed(way, number, frame)

    bench.relay.disturb(deaf)
    assert session.hello().board == "fake"


def test_garbage_before_hello(bench: Bench) -> None:
    session = bench.session()
    bench.line.send(os.urandom(50) + b"\0\0\0" + encode(4, 9, bytes(20))[:-4])

    def with_garbage(way: str, number: int, frame: bytes) -> Passing:
        return Passing(bytes(range(1, 256)) * 20 + b"\0" + frame + b"\0")

    bench.relay.disturb(with_garbage)
    assert session.hello().firmware == (1, 2, 3)
    assert session.counters.bad_frames >= 1


def test_another_version(bench: Bench) -> None:
    session = bench.session()
    bench.target.version = 1
    with pytest.raises(HilError, match=r"speaks version 1 of the line, this host version 3: bring"):
        session.hello()


def test_a_target_that_does_not_know_the_request_of_a_servo(bench: Bench) -> None:
    """As firmware of another's that was written before the message: it refuses kind 7."""
    session = bench.session()
    session.hello()
    observed = replace(configuration(), servo=ServoSettings(0.001))
    with pytest.raises(
        HilError,
        match=r"refused the configuration: it does not know this request; bring firmware and host",
    ):
        session.configure(observed)
    session.configure(configuration())  # what it knows goes on
    session.start()
    assert isinstance(session.exchange(sample(0)), Result)


def test_settings_of_a_servo_out_of_range_are_not_sent(bench: Bench) -> None:
    session = bench.session()
    session.hello()
    with pytest.raises(ValueError, match="tolerance"):
        session.configure(replace(configuration(), servo=ServoSettings(0.001, tolerance=-1.0)))
    assert bench.target.configurations == []


def test_what_the_firmware_does_not_hold_is_not_sent(bench: Bench) -> None:
    session = bench.session()
    session.hello()
    made = configuration()
    other = replace(made.estimator, orders=ArxOrders(3, 2), forgetting=ehsid.Exponential())
    with pytest.raises(
        HilError,
        match=r"fake has no Exponential forgetting \(it holds Constant, FRatio\) and no estimator "
        r"of 5 parameters \(it holds 4, 6, 7\)",
    ):
        session.configure(replace(made, estimator=other))
    with pytest.raises(ValueError, match="variance0"):
        session.configure(replace(made, estimator=replace(made.estimator, variance0=-1.0)))
    assert bench.target.configurations == []
    assert session.counters.asked_again == 0


def test_refusals_in_words(bench: Bench) -> None:
    session = bench.session()
    session.hello()
    with pytest.raises(TargetReset):  # idle, where a run should be
        session.start()
    session.configure(configuration())
    with pytest.raises(
        HilError, match=r"refused sample 0: it takes none in its state.*\(it is ready\)"
    ):
        session.exchange(sample(0))
    session.start(first=5)
    with pytest.raises(
        HilError, match=r"refused sample 3: it waits for sample 5.*\(it is running\)"
    ):
        session.exchange(sample(3))
    with pytest.raises(HilError, match=r"refused the configuration: it takes none in its state"):
        session.configure(configuration())
    session.stop()
    assert bench.target.carried_out == []


def test_a_firmware_that_knows_no_lost_cycles_is_named(bench: Bench) -> None:
    session = bench.running(first=5)
    bench.target.most_lost = 0
    with pytest.raises(HilError, match=r"sample 5 and knows no lost cycles; bring its firmware to"):
        session.exchange(sample(6))
    bench.target.most_lost = MOST_LOST
    with pytest.raises(HilError, match=r"it waits for sample 5; numbers are consecutive"):
        session.exchange(sample(5 + MOST_LOST + 1))
    assert session.exchange(sample(5 + MOST_LOST)).number == 5 + MOST_LOST


def test_settings_that_the_target_refuses(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    session = bench.session()
    session.hello()
    body = bytearray(configuration().body())
    body[0], body[21:25] = 0, struct.pack("<f", 0.0)  # constant forgetting with lambda 0
    monkeypatch.setattr(session_module.Configuration, "body", lambda self: bytes(body))
    with pytest.raises(HilError, match=r"invalid argument in the settings.*\(it is idle\)"):
        session.configure(configuration())


def test_a_host_that_comes_new_finds_the_valve_closed(bench: Bench) -> None:
    bench.running().exchange(sample(0))  # and is never heard of again
    assert bench.target.state == 2
    other = Session(bench.line, timeout_s=TIMEOUT_S, attempts=PATIENT)
    other.hello()
    assert bench.target.state == 0


def test_the_result_of_another_sample_ends_the_run(bench: Bench) -> None:
    session = bench.running()

    def renumber(way: str, number: int, frame: bytes) -> Passing:
        packet = session_module.decode(frame)
        if packet.kind == 0x84:
            frame = encode(0x84, packet.sequence, b"\7" + packet.body[1:])[1:-1]
        return undisturbed(way, number, frame)

    bench.relay.disturb(renumber)
    with pytest.raises(HilError, match="sample 0 was answered with the result of 7"):
        session.exchange(sample(0))


def test_a_line_that_is_cut(bench: Bench) -> None:
    device = FakeDevice(Target())
    with relayed(device) as relay, open_line(relay.port) as line:
        session = Session(line, timeout_s=TIMEOUT_S, attempts=PATIENT)
        session.hello()
        relay.hang_up()
        with pytest.raises(HilError, match="the line was closed"):
            session.configure(configuration())


@pytest.mark.parametrize(("timeout_s", "attempts"), [(0.0, 3), (math.nan, 3), (0.1, 0)])
def test_settings_of_a_session(bench: Bench, timeout_s: float, attempts: int) -> None:
    with pytest.raises(ValueError, match="expected > 0 s and at least 1"):
        Session(bench.line, timeout_s=timeout_s, attempts=attempts)


# Targets that mean harm


@pytest.mark.parametrize("flood", [b"\x03ab\0", encode(0x81, 0x1234, b"?"), b"\1" * 700 + b"\0"])
def test_a_flood_of_frames_ends_like_silence(flood: bytes) -> None:
    with socket.create_server(("127.0.0.1", 0)) as listening:
        port = listening.getsockname()[1]
        with open_line(f"socket://127.0.0.1:{port}") as line:
            end, _ = listening.accept()

            def pour() -> None:
                with end, suppress(OSError):
                    while True:
                        end.sendall(flood * 1000)

            target = threading.Thread(target=pour)
            target.start()
            session = Session(line, timeout_s=TIMEOUT_S, attempts=2)
            began = time.monotonic()
            with pytest.raises(HilError, match="no answer to resume, asked 2 times"):
                session._ask(Resume(), Done, "resume")
            assert time.monotonic() - began < 5.0
            assert session.counters.bad_frames + session.counters.late > 0
        target.join(10.0)
        assert not target.is_alive()
