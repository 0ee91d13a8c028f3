# SPDX-License-Identifier: MIT
"""Soak of hardware in the loop: a million samples over a line with faults, to a target that resets.

    python tests/soak/line_with_faults.py SERVO STATE SECONDS SEED

The firmware runs as a process of this host. A relay drops, repeats, damages and delays frames in
both directions, and the target is reset now and then. After each run of 10,000 samples: every
sample was answered once and in order, the runs began anew at those samples before which the target
was reset and at no other, and every estimate is bit for bit that of the host. Adds to the JSON file
STATE; exit code 1 where something did not hold.
"""

from __future__ import annotations

import json
import os
import random
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path

import numpy as np
from hil_firmware import HostDevice
from hil_line import Seeded

import ehsid
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import random_steps
from ehsid.harness.signals.simulation import draw_noise, suggested_controller
from ehsid.harness.signals.simulation.run import OUTPUTS_OF
from ehsid.hil.comparison import compare
from ehsid.hil.faults import TO_TARGET, Passing, Relay, relayed
from ehsid.hil.frames import BadFrame, decode
from ehsid.hil.messages import Kind
from ehsid.hil.plan import Plan, position_plan
from ehsid.hil.recording import RECORD, Recording
from ehsid.hil.run import MOST_RESTARTS, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import open_line

SAMPLES = 1_000_000
OF_A_RUN = 10_000
DT_S = 0.01
TIMEOUT_S = 0.05
PATIENT = 100
NEVER_MS = 60_000  # the watchdog has tests of its own; here it would depend on the load
FAULT_PROBABILITY = 0.002  # of a frame
RIG = Path(__file__).parents[2] / "examples" / "rigs" / "axis.toml"


class Faults:
    """Disturbs frames by chance, and resets the target before some of the samples."""

    def __init__(self, relay: Relay, rng: random.Random) -> None:
        self.disturbed = Seeded(
            rng.randrange(2**31), probability=FAULT_PROBABILITY, hold_s=1.5 * TIMEOUT_S
        )
        self.resets = sorted(rng.sample(range(1, OF_A_RUN), rng.randint(0, MOST_RESTARTS)))
        self._left = list(self.resets)
        self._relay = relay

    def __call__(self, way: str, number: int, frame: bytes) -> Passing:
        if way == TO_TARGET and self._left and _sample_number(frame) == self._left[0]:
            self._left.pop(0)
            self._relay.device.reset()
        return self.disturbed(way, number, frame)


def _sample_number(frame: bytes) -> int | None:
    try:
        packet = decode(frame)
    except BadFrame:
        return None
    is_sample = packet.kind == Kind.SAMPLE
    return int.from_bytes(packet.body[:4], "little") if is_sample else None


def plan_of(rng: random.Random) -> Plan:
    """A run of position control with a policy by chance, on an axis, which is cheap to simulate."""
    rig = read_rig(RIG)
    policies = (ehsid.Constant, ehsid.Exponential, ehsid.FRatio)
    numbers = np.random.default_rng(rng.randrange(2**31))
    steps = random_steps(OF_A_RUN, amplitude=0.02, hold=(20, 80), rng=numbers)
    return position_plan(
        rig,
        0.1 + steps,
        suggested_controller(rig, 1.0),
        dt_s=DT_S,
        noise=draw_noise(rig, OF_A_RUN, numbers),
        forgetting=rng.choice(policies)(),
        watchdog_ms=NEVER_MS,
    )


def memory_bytes(process: int) -> int:
    """Memory that a process of this host has in use."""
    pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE")


def one_run(relay: Relay, session: Session, rng: random.Random, state: dict) -> list[str]:
    """One run; what did not hold. Adds its counts to the state."""
    plan, faults = plan_of(rng), Faults(relay, rng)
    relay.disturb(faults)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        orders = plan.configuration.estimator.orders
        with Recording(folder, OUTPUTS_OF[plan.rig.plant], orders) as recording:
            run = run_plan(plan, session, recording)
        rows = (folder / RECORD).read_text().count("\n") - 1
    problems = []
    if rows != OF_A_RUN or [one.number for one in run.results] != list(range(OF_A_RUN)):
        problems.append(f"{rows} rows and {len(run.results)} answers for {OF_A_RUN} samples")
    if list(run.restarts) != faults.resets:
        problems.append(f"began anew at {list(run.restarts)}, reset at {faults.resets}")
    agreement = compare(run)
    if not agreement.equal:
        problems.append(agreement.sentence)
    state["samples"] += OF_A_RUN
    state["runs"] += 1
    state["resets"] += len(faults.resets)
    state["faults"] = dict(Counter(state["faults"]) + Counter(faults.disturbed.made))
    state["asked_again"] += run.counters.asked_again
    return problems


def main() -> int:
    """Runs until the time is up or a million samples are there; returns the exit code."""
    program, state_file = Path(sys.argv[1]), Path(sys.argv[2])
    end, seed = time.monotonic() + float(sys.argv[3]), int(sys.argv[4])
    state = {
        "samples": 0,
        "runs": 0,
        "resets": 0,
        "faults": {},
        "asked_again": 0,
        "seconds": 0.0,
        "memory_growth_bytes": 0,
        "problems": [],
    }
    if state_file.exists():
        state |= json.loads(state_file.read_text())
    rng = random.Random(seed + state["runs"])
    began, before = time.monotonic(), 0
    with relayed(HostDevice(program)) as relay, open_line(relay.port) as line:
        session = Session(line, timeout_s=TIMEOUT_S, attempts=PATIENT)
        while time.monotonic() < end and state["samples"] < SAMPLES:
            problems = one_run(relay, session, rng, state)
            state["problems"] += [f"run {state['runs']}, seed {seed}: {one}" for one in problems]
            now = memory_bytes(os.getpid())
            before = before or now  # after the first run: libraries and tables are there
            state["memory_growth_bytes"] = max(state["memory_growth_bytes"], now - before)
    state["seconds"] += time.monotonic() - began
    state_file.write_text(json.dumps(state, indent=1) + "\n")
    return 1 if state["problems"] else 0


if __name__ == "__main__":
    sys.exit(main())
