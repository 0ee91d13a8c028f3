# SPDX-License-Identifier: MIT
"""Control and ServoEstimator in cycles as a PLC has them: python benchmarks/plc_cycles.py [SEEDS]

The firmware of examples/firmware/servo, compiled for this host (cmake --preset dev), controls the
position of the rig in examples/rigs/bench.toml for 20 s along a multisine, as
`ehsid hil --rig examples/rigs/bench.toml --loop position --servo` does. Writes a table: for each
sampling time and kind of cycles the share of samples with a trusted K (mean of the seeds, lowest
and highest), the share of these samples at which K is within 10 %, the largest error of K while it
is trusted, and the rms position error, as a multiple of that of the regular run with the same seed
(mean of the seeds). Takes 3 seeds by default. Exits with 1 if an estimate differs from that of the
host in a bit.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import ehsid
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.rigs import Rig, read_rig
from ehsid.harness.signals.simulation import velocity_gain
from ehsid.harness.signals.simulation.run import OUTPUTS_OF
from ehsid.harness.signals.simulation.settings import SignalOptions
from ehsid.hil.comparison import compare
from ehsid.hil.cycles import CycleOptions
from ehsid.hil.faults import relayed
from ehsid.hil.plan import LoopRun, with_servo
from ehsid.hil.recording import Recording
from ehsid.hil.run import run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import Line, open_line

ROOT = Path(__file__).parents[1]
sys.path.insert(0, str(ROOT / "tests" / "python"))
from hil_firmware import HostDevice  # noqa: E402 -- the tests know where the firmware is

SECONDS = 20.0
DT_S = (0.001, 0.005, 0.01)
KINDS = {
    "regular": None,
    "jitter 10 %": CycleOptions(jitter=0.1),
    "jitter 30 %": CycleOptions(jitter=0.3),
    "lost 1 %": CycleOptions(lost=0.01),
    "lost 5 %": CycleOptions(lost=0.05),
    "overrun 1 %": CycleOptions(overrun=0.01),
    "overrun 5 %": CycleOptions(overrun=0.05),
    "jitter 30 %, lost 5 %, overrun 5 %": CycleOptions(0.3, 0.05, 0.05),
}


def measured(
    line: Line, rig: Rig, dt_s: float, cycles: CycleOptions | None, seed: int
) -> tuple[float, float, float, float]:
    """Returns the shares of trusted K and of it within 10 %, its largest relative error, rms in m.

    The rms is that of the position error.
    """
    signal = SignalOptions("multisine", SECONDS, dt_s, None, seed)
    orders = ArxOrders(3, 3, 1, offset=True)
    run = LoopRun(True, signal, None, ehsid.FRatio(), orders, True, {}, 60_000, cycles)
    plan = with_servo(run.plan(rig), {})
    with (
        tempfile.TemporaryDirectory() as folder,
        Recording(Path(folder), OUTPUTS_OF[rig.plant], None, plan.cycles) as recording,
    ):
        result = run_plan(plan, Session(line), recording)
    agreement = compare(result)
    if not agreement.equal or agreement.servo is None:
        raise SystemExit(f"{dt_s:g} s, {cycles}, seed {seed}: {agreement.sentence}")
    gain = agreement.servo.gain
    error = np.abs(gain.path[gain.trusted_path] / velocity_gain(rig) - 1.0)
    position_error = plan.reference_m[result.numbers] - result.position_m
    return (
        float(np.mean(gain.trusted_path)),
        float(np.mean(error < 0.1)) if error.size else np.nan,
        float(np.max(error, initial=0.0)),
        float(np.sqrt(np.mean(np.square(position_error)))),
    )


def main() -> None:
    """Runs all, and prints the rows of the table as they are done."""
    seeds = range(int(sys.argv[1]) if len(sys.argv) > 1 else 3)
    rig = read_rig(ROOT / "examples" / "rigs" / "bench.toml")
    print("| dt | cycles | K trusted | K within 10 % | largest error of K | rms position error |")
    print("|---|---|---|---|---|---|")
    with relayed(HostDevice()) as relay, open_line(relay.port) as line:
        for dt_s in DT_S:
            regular = np.ones(len(seeds))
            for name, cycles in KINDS.items():
                told = np.array([measured(line, rig, dt_s, cycles, seed) for seed in seeds])
                share, within, error, rms = told.T
                regular = rms if cycles is None else regular
                size = (
                    f"{1e3 * np.mean(rms):.2g} mm"
                    if cycles is None
                    else f"{np.mean(rms / regular):.3f} times"
                )
                print(
                    f"| {1e3 * dt_s:g} ms | {name} | {100.0 * np.mean(share):.0f} % "
                    f"({100.0 * np.min(share):.0f} to {100.0 * np.max(share):.0f}) | "
                    f"{100.0 * np.nanmean(within):.0f} % | {100.0 * np.max(error):.0f} % | "
                    f"{size} |",
                    flush=True,
                )


if __name__ == "__main__":
    main()
