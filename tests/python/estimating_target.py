# SPDX-License-Identifier: MIT
"""A target in Python that estimates: what the firmware does, with the estimator of this host.

It needs no compiler and no emulator. Its controller is a proportional one.
"""

import math
import struct
from dataclasses import dataclass

import numpy as np
from hil_target import RUNNING, Target

import ehsid
from ehsid.harness.firmware.configuration import EstimatorConfiguration, Seed
from ehsid.harness.models.identification import ArxOrders
from ehsid.hil import messages
from ehsid.hil.configuration import POLICIES
from ehsid.hil.frames import Packet, encode
from ehsid.hil.messages import Flags, Settings


def estimator_of(body: bytes) -> tuple[ehsid.ArxEstimator, dict[str, float]]:
    """Return the estimator that the body of `configure` describes, and all of its numbers."""
    values, rest = messages.CONFIGURE.unpack(body)
    info = ehsid.policies()[values["policy"]]
    flags = values["flags"]
    orders = ArxOrders(values["na"], values["nb"], values["nk"], offset=Settings.OFFSET in flags)
    n = orders.n_parameters
    groups = {
        group: {f.name: values[f.name] for f in messages.CONFIGURE.fixed if f.group == group}
        for group in ("scaling", "rls", "reset", "convergence")
    }
    configuration = EstimatorConfiguration(
        orders,
        scaling=ehsid.Scaling(**groups["scaling"]),
        forgetting=POLICIES[values["policy"]](
            **{setting.name: values[setting.member] for setting in info.settings}
        ),
        rls=ehsid.RlsOptions(**groups["rls"]),
        reset=ehsid.RmseResetOptions(**groups["reset"]) if Settings.RESET in flags else None,
        convergence=ehsid.ConvergenceOptions(**groups["convergence"]),
        variance0=values["variance0"],
        input_limit=values["input_limit"],
        seed=seed_of(rest, n) if Settings.SEED in flags else None,
    )
    return configuration.estimator(), values


def seed_of(rest: bytes, n: int) -> Seed:
    """Return the estimate to start from."""
    numbers = np.frombuffer(rest, dtype="<f4").astype(float)
    u = np.eye(n)
    above = [(row, column) for column in range(n) for row in range(column)]
    for (row, column), value in zip(above, numbers[2 * n : -1], strict=True):
        u[row, column] = value
    return Seed(numbers[:n], u, numbers[n : 2 * n], float(numbers[-1]))


@dataclass
class EstimatingTarget(Target):
    """The state machine of `Target` with the estimator of this host; `begun` is for assertions."""

    def carry_out(self, packet: Packet) -> bytes:
        before = len(self.configurations)
        answer = super().carry_out(packet)
        if len(self.configurations) > before:
            self.estimator, self.values = estimator_of(packet.body)
            self.fit = 0.0
        return answer

    def sample(self, packet: Packet) -> bytes:
        number, position, reference, _, direct = struct.unpack("<I4f", packet.body)
        lost = self.lost_before(number)
        if lost is None or self.state != RUNNING:
            return self.refused(packet, 2)
        if lost:
            self.estimator.step(math.nan, math.nan)
        self.expected = number + 1
        self.carried_out.append(number)
        gain, limit = self.values["fixed_gain_v_m"], self.values["command_limit_v"]
        if Settings.POSITION_CONTROL in self.values["flags"]:
            direct += gain * (reference - position)
        command = float(np.float32(min(max(direct, -limit), limit)))
        status = self.estimator.step(command, position)
        theta = self.estimator.theta_hat
        flags = Flags.CONVERGED * self.estimator.converged | Flags.RESIDUALS_NOT_WHITE * (
            not self.estimator.residuals_white
        )
        innovation = self.estimator.innovation
        return encode(
            0x84,
            packet.sequence,
            struct.pack("<I3fBBH", number, command, gain, 0.0, int(status), flags, 0)
            + struct.pack("<f", innovation if math.isfinite(innovation) else 0.0)
            + struct.pack("<ff", self.estimator.forgetting_factor, 98.5)
            + struct.pack("<ff", self.estimator.excitation, self.estimator.residual_variance)
            + struct.pack("<I3H", 1234, self.bad_frames, self.repeated, self.trips)
            + struct.pack(f"<B{theta.size}f", theta.size, *theta),
        )
