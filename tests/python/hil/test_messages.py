# SPDX-License-Identifier: MIT
"""Bodies of requests and answers, read and written here from the document, not from the code."""

import math
import struct
from dataclasses import astuple, fields, replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid
from ehsid.harness.firmware import EstimatorConfiguration, Seed, ServoSettings
from ehsid.harness.models.identification import ArxOrders
from ehsid.hil.answers import Done, Identity, Refused, Result, Safe, ServoResult, parse_answer
from ehsid.hil.configuration import Configuration, ControllerSettings
from ehsid.hil.frames import BadFrame, HilError, Packet
from ehsid.hil.messages import Hello, Reason, Resume, Sample, Start, State, Stop, status_name

LARGEST = float(np.finfo(np.float32).max)
reals = st.floats(-LARGEST, LARGEST)
anything32 = st.floats(width=32)
u16, u32 = st.integers(0, 2**16 - 1), st.integers(0, 2**32 - 1)
CONTROLLER = ControllerSettings(0.001, 50.0, 20.0, 10.0, 30.0, 10.0, 90.0, 0.02)


def above(least: float) -> st.SearchStrategy[float]:
    """Numbers from a little above `least` on, of all sizes that float32 has."""
    return st.floats(least + 1e-30, LARGEST, exclude_min=True)


def configuration(estimator: EstimatorConfiguration | None = None) -> Configuration:
    return Configuration(estimator or EstimatorConfiguration(ArxOrders(2, 2)), CONTROLLER, 200)


def observed(servo: ServoSettings | None = None) -> Configuration:
    return replace(configuration(), servo=servo or ServoSettings(0.01))


def seed(n: int) -> Seed:
    u = np.eye(n) + np.triu(np.arange(1.0, n * n + 1).reshape(n, n) / 7, 1)
    return Seed(np.arange(n) / 3, u, np.arange(1.0, n + 1), 0.25)


def single(value: float) -> bytes:
    return np.float32(value).tobytes()


class Reader:
    """Takes numbers off a body, in order."""

    def __init__(self, body: bytes) -> None:
        self.body = body

    def take(self, layout: str) -> tuple[Any, ...]:
        size = struct.calcsize("<" + layout)
        taken, self.body = self.body[:size], self.body[size:]
        return struct.unpack("<" + layout, taken)

    def singles(self, count: int) -> list[bytes]:
        taken, self.body = self.body[: 4 * count], self.body[4 * count :]
        assert len(taken) == 4 * count
        return [taken[i : i + 4] for i in range(0, len(taken), 4)]


# Requests. The sizes are counted by hand in docs/hil_protocol.md.


@pytest.mark.parametrize(
    ("request_", "kind", "size"),
    [
        (Hello(), 0x01, 2),
        (configuration(), 0x02, 5 + 4 * (4 + 8 + 2 + 6 + 3 + 2 + 8 + 1)),
        (Start(7), 0x03, 4),
        (Sample(7, 0.1), 0x04, 4 + 4 * 4),
        (Resume(), 0x05, 0),
        (Stop(), 0x06, 0),
        (observed(), 0x07, 2 + 4 * (2 + 8 + 1)),
    ],
)
def test_kinds_and_sizes_of_requests(request_: Any, kind: int, size: int) -> None:
    assert request_.message.kind == kind
    assert len(request_.body()) == size


@pytest.mark.parametrize("n", [2, 4, 6, 7, 12])
def test_size_of_a_configuration_with_an_estimate(n: int) -> None:
    orders = ArxOrders(n // 2, n // 2, offset=n % 2 == 1)
    made = configuration(EstimatorConfiguration(orders, seed=seed(n)))
    assert len(made.body()) == 141 + 4 * (n + n + n * (n - 1) // 2 + 1)


def test_hello_says_the_version() -> None:
    assert Hello().body() == b"\x03\x00"


@given(u32, st.tuples(*[anything32] * 4))
def test_samples(number: int, values: tuple[float, float, float, float]) -> None:
    assert Sample(number, *values).body() == struct.pack("<I", number) + b"".join(
        struct.pack("<f", value) for value in values
    )


def test_samples_that_are_not_finite_may_be_sent() -> None:
    values = struct.unpack("<I4f", Sample(0, math.nan, math.inf, -math.inf, 0.5).body())[1:]
    assert math.isnan(values[0])
    assert values[1:] == (math.inf, -math.inf, 0.5)


def test_a_sample_beyond_float32_is_refused() -> None:
    with pytest.raises(ValueError, match=r"reference_m = 1e\+39: beyond float32"):
        Sample(0, 0.0, reference_m=1e39).body()
    with pytest.raises(ValueError, match=r"number = 4294967296: .* from 0 to 4294967295"):
        Sample(2**32, 0.0).body()


POLICIES = [
    ehsid.Constant(0.98),
    ehsid.Exponential(0.97, 0.9),
    ehsid.ErrorDriven(80.0, 0.4, 1e-9),
    ehsid.FRatio(1.5, 4.0),
]
# lambda, lambda0, lambda_initial, memory, lambda_min, noise_variance, eta, critical_ratio:
# those of other policies are 0.
NUMBERS: list[dict[int, float]] = [
    {0: 0.98},
    {1: 0.97, 2: 0.9},
    {3: 80.0, 4: 0.4, 5: 1e-9},
    {6: 1.5, 7: 4.0},
]


@pytest.mark.parametrize("policy", range(4))
def test_policies(policy: int) -> None:
    made = configuration(EstimatorConfiguration(ArxOrders(2, 2), forgetting=POLICIES[policy]))
    body = made.body()
    assert body[0] == policy
    assert body[5 + 16 : 5 + 16 + 32] == b"".join(
        single(NUMBERS[policy].get(i, 0.0)) for i in range(8)
    )


@given(
    # Within the ranges that the bindings check.
    st.tuples(above(0), above(0), reals, reals),
    st.tuples(reals, above(0)),
    st.tuples(st.floats(1, 1e3), st.floats(1001, 1e6), above(9), st.floats(1, 8), above(0)),
    st.tuples(st.floats(0.001, 10.0), above(0), reals, reals),
    st.tuples(*[reals] * 8),
    st.tuples(st.integers(0, 2**31 - 1), st.integers(1, 2**31 - 1), u32),
    st.tuples(*[st.booleans()] * 5),
)
def test_configurations(
    scaling: tuple[float, ...],
    rls: tuple[float, ...],
    reset: tuple[float, ...],
    rest: tuple[float, ...],
    controller: tuple[float, ...],
    whole: tuple[int, int, int],
    flags: tuple[bool, ...],
) -> None:
    offset, resets, position_control, seeded, retune = flags
    cool_down, hold, watchdog = whole
    orders = ArxOrders(2, 3, 4, offset=offset)
    n = orders.n_parameters
    given_reset = ehsid.RmseResetOptions(
        short_window=reset[0],
        long_window=reset[1],
        trigger_ratio=reset[2],
        release_ratio=reset[3],
        cool_down=cool_down,
        floor=reset[4],
    )
    estimator = EstimatorConfiguration(
        orders,
        scaling=ehsid.Scaling(
            command_scale=scaling[0],
            position_scale=scaling[1],
            command_offset=scaling[2],
            position_offset=scaling[3],
        ),
        rls=ehsid.RlsOptions(information_margin=rls[0], covariance_ceiling=rls[1]),
        reset=given_reset if resets else None,
        convergence=ehsid.ConvergenceOptions(tolerance=rest[0], magnitude=rest[1], hold=hold),
        variance0=rest[2],
        input_limit=rest[3],
        seed=seed(n) if seeded else None,
    )
    settings = ControllerSettings(*controller, position_control, retune)
    read = Reader(Configuration(estimator, settings, watchdog).body())

    bits = offset | resets << 1 | position_control << 2 | seeded << 3 | retune << 4
    assert read.take("5B") == (3, 2, 3, 4, bits)
    assert read.singles(4) == [single(value) for value in scaling]
    read.singles(8)
    assert read.singles(2) == [single(value) for value in rls]
    if not resets:
        reset, cool_down = (10.0, 200.0, 3.0, 1.5, 1e-5), 50  # the defaults of RmseResetOptions
    assert read.singles(4) == [single(value) for value in reset[:4]]
    assert read.take("i") == (cool_down,)
    assert read.singles(1) == [single(reset[4])]
    assert read.singles(2) == [single(value) for value in rest[:2]]
    assert read.take("i") == (hold,)
    assert read.singles(2) == [single(value) for value in rest[2:]]
    assert read.singles(8) == [single(value) for value in controller]
    assert read.take("I") == (watchdog,)
    if seeded:
        start = seed(n)
        assert read.singles(n) == [single(value) for value in start.theta]
        assert read.singles(n) == [single(value) for value in start.d]
        for j in range(n):  # columns
            assert read.singles(j) == [single(start.u[i, j]) for i in range(j)]
        assert read.singles(1) == [single(start.noise_variance)]
    assert read.body == b""


@given(
    st.integers(1, 20),
    st.tuples(above(0), st.floats(0, LARGEST), above(0)),
    st.tuples(*[reals] * 8),
    u32,
    st.booleans(),
    st.booleans(),
)
def test_configurations_of_a_servo(
    delay: int,
    numbers: tuple[float, float, float],
    controller: tuple[float, ...],
    watchdog: int,
    position_control: bool,
    retune: bool,
) -> None:
    dt_s, drift, tolerance = numbers
    settings = ControllerSettings(*controller, position_control, retune)
    servo = ServoSettings(dt_s, delay, drift, tolerance)
    made = replace(configuration(), controller=settings, watchdog_ms=watchdog, servo=servo)
    read = Reader(made.body())
    assert read.take("2B") == (delay, position_control << 2 | retune << 4)
    assert read.singles(2) == [single(drift), single(tolerance)]
    # The sampling time is the estimator's: that of the controller cannot be another one.
    assert read.singles(8) == [single(value) for value in (dt_s, *controller[1:])]
    assert read.take("I") == (watchdog,)
    assert read.body == b""


@pytest.mark.parametrize(
    ("name", "value", "said"),
    [
        ("watchdog_ms", -1, "watchdog_ms = -1: expected a whole number from 0"),
        ("sample_time_s", math.nan, "sample_time_s = nan: expected a finite number"),
        ("gain_max_v_m", math.inf, "gain_max_v_m = inf: expected a finite number"),
        ("command_limit_v", -1e39, r"command_limit_v = -1e\+39: beyond float32"),
        ("variance0", 1e300, r"variance0 = 1e\+300: beyond float32"),
        ("input_limit", math.nan, "input_limit = nan"),
    ],
)
def test_numbers_that_the_line_cannot_carry_are_named(name: str, value: float, said: str) -> None:
    made = configuration()
    if name in {field.name for field in fields(ControllerSettings)}:
        made = replace(made, controller=replace(CONTROLLER, **{name: value}))
    elif name == "watchdog_ms":
        made = replace(made, watchdog_ms=int(value))
    else:
        made = replace(made, estimator=replace(made.estimator, **{name: value}))
    with pytest.raises(ValueError, match=said):
        made.body()


def test_a_bad_number_of_the_estimate_is_named() -> None:
    start = seed(4)
    start.d[2] = math.nan
    made = configuration(EstimatorConfiguration(ArxOrders(2, 2), seed=start))
    with pytest.raises(ValueError, match=r"d\[2\] of the estimate to start from = nan"):
        made.body()


def test_estimates_that_do_not_fit() -> None:
    made = configuration(EstimatorConfiguration(ArxOrders(2, 2), seed=seed(6)))
    with pytest.raises(ValueError, match=r"theta \(6,\).*expected \(4,\), \(4,\), \(4, 4\)"):
        made.body()
    made = configuration(EstimatorConfiguration(ArxOrders(6, 6, offset=True), seed=seed(13)))
    with pytest.raises(ValueError, match=r"of 13 parameters does not fit .* at most 12"):
        made.body()


# Answers


def answer(kind: int, layout: str, *values: Any) -> Any:
    return parse_answer(Packet(kind, 1, struct.pack("<" + layout, *values)))


def test_identity() -> None:
    made = answer(0x81, "H3BBH12s", 3, 4, 5, 6, 0b10_1001, 1 << 4 | 1 << 13, b"mps2-an386\0\0")
    assert made == Identity(3, (4, 5, 6), frozenset({0, 3, 5}), frozenset({4, 13}), "mps2-an386")


@pytest.mark.parametrize("version", [0, 1, 300])
def test_an_identity_of_another_version_is_refused_whatever_its_length(version: int) -> None:
    for tail in (b"", b"\0" * 18, b"\0" * 40):
        with pytest.raises(HilError, match=rf"speaks version {version} .* this host version 3"):
            parse_answer(Packet(0x81, 1, struct.pack("<H", version) + tail))


def test_done_refused_and_safe() -> None:
    assert answer(0x82, "B", 3) == Done(State.SAFE)
    assert answer(0x85, "BBBI", 4, 1, 8, 17) == Refused(Reason.CONFIGURATION, State.READY, 8, 17)
    assert answer(0x86, "HIf", 2, 17, 0.0) == Safe(2, 17, 0.0)


single_numbers = st.floats(width=32, allow_nan=False, allow_infinity=False)


@given(
    st.tuples(u32, *[single_numbers] * 3),
    st.tuples(st.sampled_from([int(status) for status in ehsid.Status]), st.integers(0, 15), u16),
    st.tuples(*[single_numbers] * 5),
    st.tuples(u32, u16, u16, u16),
    st.lists(single_numbers, max_size=13),
)
def test_results(
    first: tuple[Any, ...],
    flags: tuple[int, int, int],
    reals_: tuple[Any, ...],
    counts: tuple[Any, ...],
    theta: list[float],
) -> None:
    n = len(theta)
    made = answer(0x84, f"I3f BBH 5f I3H B{n}f", *first, *flags, *reals_, *counts, n, *theta)
    bits = [bool(flags[1] >> bit & 1) for bit in range(3)]
    white = not flags[1] & 8
    expected = (*first, flags[0], *bits, white, flags[2], *reals_, *counts, tuple(theta))
    assert isinstance(made, Result)
    assert astuple(made) == expected


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
@pytest.mark.parametrize(
    ("place", "name"),
    [(4, "command_v"), (8, "gain_v_m"), (20, "innovation_m"), (51, "theta\\[0\\]")],
)
def test_a_result_that_is_not_finite_is_refused(place: int, name: str, value: float) -> None:
    body = bytearray(50) + b"\1" + bytes(4)
    struct.pack_into("<f", body, place, value)
    with pytest.raises(HilError, match=f"{name} = {value:g}: expected a finite number"):
        parse_answer(Packet(0x84, 1, bytes(body)))


def test_the_name_of_a_board_cannot_steer_the_terminal() -> None:
    made = parse_answer(Packet(0x81, 1, b"\3\0" + bytes(6) + b"\x1b[31m\r\nx\0\0\0\0"))
    assert isinstance(made, Identity)
    assert made.board == "?[31m??x"


SERVO_RESULT = "I2f2B" + "2fB" * 3 + "I3H"
HEAD, COUNTS = (7, 0.5, 20.0, 0, 0b110), (1234, 1, 2, 3)
K, OMEGA_N, XI = (0.03, 0.001, 0), (25.0, 4.0, 6), (0.4, 0.25, 3)


def test_results_of_a_servo() -> None:
    made = answer(0x87, SERVO_RESULT, *HEAD, *K, *OMEGA_N, *XI, *COUNTS)
    assert isinstance(made, ServoResult)
    assert (made.number, made.command_v, made.gain_v_m, made.status) == (7, 0.5, 20.0, 0)
    assert made.gain_estimated
    assert made.limited
    assert made.tracked == [(*map(np.float32, one[:2]), one[2]) for one in (K, OMEGA_N, XI)]
    assert (made.step_cycles, made.bad_frames, made.repeated, made.trips) == COUNTS
    plain = answer(0x87, SERVO_RESULT, *(*HEAD[:4], 0), *K, *OMEGA_N, *XI, *COUNTS)
    assert not plain.gain_estimated
    assert not plain.limited


def test_a_servo_without_values_yet() -> None:
    none = (math.nan, math.nan, 1)
    made = answer(0x87, SERVO_RESULT, *HEAD, *none, *none, *none, *COUNTS)
    assert all(math.isnan(value) for value, _, _ in made.tracked)


@pytest.mark.parametrize(
    ("head", "servo", "said"),
    [
        (HEAD, (0.03, math.nan, 0), "velocity_gain_half_width = nan: expected a finite number"),
        (HEAD, (math.nan, 0.1, 0), "velocity_gain_m_s_v = nan: expected a finite number"),
        (HEAD, (math.inf, 0.1, 0), "velocity_gain_m_s_v = inf: expected a finite number"),
        (HEAD, (0.03, 0.1, 7), "velocity_gain_reason = 7: expected one of those"),
        ((7, math.nan, *HEAD[2:]), K, "command_v = nan: expected a finite number"),
        ((7, 0.5, math.inf, *HEAD[3:]), K, "gain_v_m = inf: expected a finite number"),
        ((*HEAD[:3], 77, 0), K, "status = 77: expected a status of the estimator"),
    ],
)
def test_results_of_a_servo_that_cannot_be(
    head: tuple[float, ...], servo: tuple[float, ...], said: str
) -> None:
    with pytest.raises(HilError, match=said):
        answer(0x87, SERVO_RESULT, *head, *servo, *OMEGA_N, *XI, *COUNTS)


@pytest.mark.parametrize(
    ("kind", "right"), [(0x81, 20), (0x82, 1), (0x84, 51), (0x85, 7), (0x86, 10), (0x87, 51)]
)
def test_sizes_of_answers(kind: int, right: int) -> None:
    body = b"\3\0" + bytes(80)  # an identity of version 3; refused for reason 3
    for size in range(60):
        packet = Packet(kind, 1, body[:size])
        if size == right:
            parse_answer(packet)
        else:
            with pytest.raises(BadFrame):
                parse_answer(packet)


def test_status_in_words() -> None:
    assert status_name(5) == "invalid input"
    assert status_name(10) == "status 10"  # EHSID_NOT_INITIALISED, which only C has
