# SPDX-License-Identifier: MIT
"""All messages between host and target, version 3: kinds, states, reasons and fields.

This is the only place of the host that knows them. The tables in docs/hil_protocol.md are made from
here, and a test compares the sources of the firmware with it.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import IntEnum, IntFlag
from typing import ClassVar

import ehsid
from ehsid.harness.firmware.configuration import EstimatorConfiguration

from .frames import Field, Message

VERSION = 3

MOST_LOST = 1000
"""Most cycles without a sample, by which the number of a sample may jump ahead."""


class Kind(IntEnum):
    """Kind of a packet, its first byte."""

    HELLO = 0x01
    CONFIGURE = 0x02
    START = 0x03
    SAMPLE = 0x04
    RESUME = 0x05
    STOP = 0x06
    CONFIGURE_SERVO = 0x07
    IDENTITY = 0x81
    DONE = 0x82
    RESULT = 0x84
    REFUSED = 0x85
    SAFE = 0x86
    SERVO_RESULT = 0x87


class State(IntEnum):
    """State of the target; its valve is open in `RUNNING` only."""

    IDLE = 0
    READY = 1
    RUNNING = 2
    SAFE = 3


class Reason(IntEnum):
    """Reason for which the target refused a request."""

    STATE = 1
    ORDER = 2
    UNKNOWN = 3
    CONFIGURATION = 4
    NOT_IN_FIRMWARE = 5


class Settings(IntFlag):
    """Flags of `configure`; `configure_servo` has two of them."""

    OFFSET = 1 << 0
    RESET = 1 << 1
    POSITION_CONTROL = 1 << 2
    SEED = 1 << 3
    FOLLOW_ESTIMATE = 1 << 4


class Flags(IntFlag):
    """Flags of `result`; `servo_result` has two of them."""

    CONVERGED = 1 << 0
    GAIN_FROM_ESTIMATE = 1 << 1
    AT_LIMIT = 1 << 2
    RESIDUALS_NOT_WHITE = 1 << 3


def _forgetting_fields() -> list[Field]:
    """Settings of all forgetting policies, each at its place; policies can share a place."""
    owners: dict[int, list[str]] = {}
    settings = {}
    for info in ehsid.policies():
        for setting in info.settings:
            owners.setdefault(setting.hil_place, []).append(info.id)
            settings[setting.hil_place] = setting
    return [
        Field(
            settings[place].member,
            "f32",
            "" if settings[place].unit == "1" else settings[place].unit,
            ", ".join(owners[place]),
            group="forgetting",
        )
        for place in range(ehsid.HIL_PLACES)
    ]


def _tracked(name: str, ending: str, unit: str, meaning: str) -> tuple[Field, Field, Field]:
    """A value of a ServoEstimator, half of its 90 % interval, and why it is not trusted."""
    return (
        Field(f"{name}{ending}", "f32", unit, f"{meaning}; NaN before there is one"),
        Field(f"{name}_half_width", "f32", unit, "half of its 90 % interval"),
        Field(f"{name}_reason", "u8", "", "`ehsid_trust`: 0 trusted, or why not"),
    )


_CONTROLLER = (
    Field("sample_time_s", "f32", "s", group="controller"),
    Field("fixed_gain_v_m", "f32", "V/m", group="controller"),
    Field("feed_forward_v_s_m", "f32", "V s/m", group="controller"),
    Field("command_limit_v", "f32", "V", group="controller"),
    Field("bandwidth_rad_s", "f32", "rad/s", group="controller"),
    Field("gain_min_v_m", "f32", "V/m", group="controller"),
    Field("gain_max_v_m", "f32", "V/m", group="controller"),
    Field("gain_step", "f32", "", "per sample, share of the fixed gain", group="controller"),
    Field("watchdog_ms", "u32", "ms", "1 to 60000"),
)
_COUNTS = (
    Field("step_cycles", "u32", "cycles", "processor clock from sample to command, estimate"),
    Field("bad_frames", "u16", "", "damaged or late frames received since power-up"),
    Field("repeated", "u16", "", "answers sent again since power-up"),
    Field("trips", "u16", "", "times the watchdog closed the valve since power-up"),
)

HELLO = Message(Kind.HELLO, (Field("version", "u16", "", "protocol version of the host"),), "all")
CONFIGURE = Message(
    Kind.CONFIGURE,
    (
        Field("policy", "u8", "", "number of the forgetting policy"),
        Field("na", "u8", "", "past outputs"),
        Field("nb", "u8", "", "past commands"),
        Field("nk", "u8", "samples", "delay"),
        Field("flags", "u8", values=Settings),
        Field("command_scale", "f32", "V", "> 0", group="scaling"),
        Field("position_scale", "f32", "m", "> 0", group="scaling"),
        Field("command_offset", "f32", "V", group="scaling"),
        Field("position_offset", "f32", "m", group="scaling"),
        *_forgetting_fields(),
        Field("information_margin", "f32", group="rls"),
        Field("covariance_ceiling", "f32", group="rls"),
        Field("short_window", "f32", "samples", group="reset"),
        Field("long_window", "f32", "samples", group="reset"),
        Field("trigger_ratio", "f32", group="reset"),
        Field("release_ratio", "f32", group="reset"),
        Field("cool_down", "i32", "samples", group="reset"),
        Field("floor", "f32", group="reset"),
        Field("tolerance", "f32", group="convergence"),
        Field("magnitude", "f32", group="convergence"),
        Field("hold", "i32", "samples", group="convergence"),
        Field("variance0", "f32", "", "of the scaled signals", group="estimator"),
        Field("input_limit", "f32", "", "largest plausible scaled signal", group="estimator"),
        *_CONTROLLER,
        Field("theta", "f32", "", "estimate to start from", "n"),
        Field("d", "f32", "", "diagonal of D in P = U D U'", "n"),
        Field("u", "f32", "", "columns of U above its diagonal", "n(n-1)/2"),
        Field("seed_noise_variance", "f32", "m^2", "residual variance of the estimate", "0 or 1"),
    ),
    "idle, ready",
)
START = Message(Kind.START, (Field("number", "u32", "", "number of the first sample"),), "ready")
SAMPLE = Message(
    Kind.SAMPLE,
    (
        Field("number", "u32", "", "k: number of the sample before plus one, and lost cycles"),
        Field("position_m", "f32", "m", "measured at t_k"),
        Field("reference_m", "f32", "m", "reference position"),
        Field("reference_velocity_m_s", "f32", "m/s", "speed of the reference"),
        Field("direct_v", "f32", "V", "added to the controller's command"),
    ),
    "running",
)
RESUME = Message(Kind.RESUME, states="safe")
STOP = Message(Kind.STOP, states="ready, running, safe")
CONFIGURE_SERVO = Message(
    Kind.CONFIGURE_SERVO,
    (
        Field("delay", "u8", "samples", "ServoEstimator: 1 to 20"),
        Field("flags", "u8", "", "of `configure`: bit 2 position control, bit 4 follow estimate"),
        Field("drift", "f32", "", "ServoEstimator: deviation of ln K and ln omega_n in 1 s, >= 0"),
        Field("tolerance", "f32", "", "ServoEstimator: share of K, > 0"),
        *_CONTROLLER,
    ),
    "idle, ready",
)

IDENTITY = Message(
    Kind.IDENTITY,
    (
        Field("version", "u16", "", "protocol version of the target"),
        Field("major", "u8", "", "version of the firmware"),
        Field("minor", "u8"),
        Field("patch", "u8"),
        Field("policies", "u8", "", "bit i: policy i is in the firmware"),
        Field("parameters", "u16", "", "bit n: estimators of n parameters are in the firmware"),
        Field("board", "ascii", "", "name of the board, filled with zeros", 12),
    ),
)
DONE = Message(Kind.DONE, (Field("state", "u8", values=State),))
RESULT = Message(
    Kind.RESULT,
    (
        Field("number", "u32", "", "k of the sample"),
        Field("command_v", "f32", "V", "acts from t_k to t_{k+1}"),
        Field("gain_v_m", "f32", "V/m", "gain of the controller"),
        Field("velocity_gain_m_s_v", "f32", "m/s/V", "computed from theta, or 0 if none"),
        Field("status", "u8", "", "`ehsid_status` of this sample"),
        Field("flags", "u8", values=Flags),
        Field("resets", "u16", "", "changes of the plant since the start"),
        Field("innovation_m", "f32", "m", "measured less predicted position"),
        Field("forgetting_factor", "f32", "", "lambda(k)"),
        Field("fit_percent", "f32", "%", "fit of the one-step-ahead prediction"),
        Field(
            "excitation",
            "f32",
            "",
            "share of recent samples during which every parameter was excited, 0 to 1",
        ),
        Field("residual_variance_m2", "f32", "m^2", "residual variance sigma^2"),
        *_COUNTS,
        Field("n", "u8", "", "number of parameters"),
        Field("theta", "f32", "", "estimate, in the units of the signals", "n"),
    ),
)
REFUSED = Message(
    Kind.REFUSED,
    (
        Field("reason", "u8", values=Reason),
        Field("state", "u8", values=State),
        Field("status", "u8", "", "`ehsid_status` of a refused configuration, else 0"),
        Field("expected", "u32", "", "number of the sample that the target waits for"),
    ),
)
SAFE = Message(
    Kind.SAFE,
    (
        Field("trips", "u16", "", "times the watchdog closed the valve since power-up"),
        Field("expected", "u32", "", "number of the sample that the target waits for"),
        Field("valve_command_v", "f32", "V", "command at the valve, 0"),
    ),
)
_SERVO = (
    _tracked("velocity_gain", "_m_s_v", "m/s/V", "K of the servo"),
    _tracked("omega_n", "_rad_s", "rad/s", "natural frequency"),
    _tracked("xi", "", "", "damping ratio"),
)
TRACKED = tuple((value.name, half.name, reason.name) for value, half, reason in _SERVO)
SERVO_RESULT = Message(
    Kind.SERVO_RESULT,
    (
        Field("number", "u32", "", "k of the sample"),
        Field("command_v", "f32", "V", "acts from t_k to t_{k+1}"),
        Field("gain_v_m", "f32", "V/m", "gain of the controller"),
        Field("status", "u8", "", "`ehsid_status` of this sample"),
        Field("flags", "u8", "", "of `result`: bit 1 gain from estimate, bit 2 at limit"),
        *(field for fields in _SERVO for field in fields),
        *_COUNTS,
    ),
)

MESSAGES = (
    *(HELLO, CONFIGURE, START, SAMPLE, RESUME, STOP, CONFIGURE_SERVO),
    *(IDENTITY, DONE, RESULT, REFUSED, SAFE, SERVO_RESULT),
)


def status_name(status: int) -> str:
    """Returns an `ehsid_status` in words, e.g. "invalid input".

    A status that only the C interface has is named by its number.
    """
    try:
        return ehsid.Status(status).name.replace("_", " ")
    except ValueError:
        return f"status {status}"


class _Request:
    """A request whose attributes are the fields of its message."""

    message: ClassVar[Message]
    finite: ClassVar[bool] = True

    def body(self) -> bytes:
        """Returns the body; raises ValueError if a number does not fit its type."""
        return self.message.pack(vars(self), finite=self.finite)


@dataclass(frozen=True)
class Hello(_Request):
    """Request for the identity of the target; the target goes to the state idle."""

    message: ClassVar[Message] = HELLO

    version: int = VERSION


@dataclass(frozen=True)
class Start(_Request):
    """Begins a run with sample `number`, 0 to 2^32 - 1."""

    message: ClassVar[Message] = START

    number: int


@dataclass(frozen=True)
class Sample(_Request):
    """Measurements at t_k, with the fields of `SAMPLE`.

    Values that are not finite are allowed, because a sensor may give them. Without position control
    `direct_v` is the whole command.
    """

    message: ClassVar[Message] = SAMPLE
    finite: ClassVar[bool] = False

    number: int
    position_m: float
    reference_m: float = 0.0
    reference_velocity_m_s: float = 0.0
    direct_v: float = 0.0


@dataclass(frozen=True)
class Resume(_Request):
    """Opens the valve again after the watchdog has closed it."""

    message: ClassVar[Message] = RESUME


@dataclass(frozen=True)
class Stop(_Request):
    """Closes the valve."""

    message: ClassVar[Message] = STOP


class Stopped(Exception):  # noqa: N818 -- the user's request
    """Raised by a `Steer`: the run ends before this sample, with the samples so far as result."""


# Called with the number of each sample before it is sent. Returns the settings with which the
# estimator of the target begins anew at this sample, or values of the simulated machine, by full
# name, that replace those of the plan from this sample on; None lets all go on.
Steer = Callable[[int], EstimatorConfiguration | Mapping[str, float] | None]
