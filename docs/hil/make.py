# SPDX-License-Identifier: MIT
"""Makes the pictures of docs/hil.md and docs/evidence/hil.md.

python docs/hil/make.py build/firmware/servo_an386.elf

Runs `ehsid hil` on the emulated Cortex-M4F: the experiment, and position control of a machine whose
supply has less pressure than the controller was tuned for, with and without retuning.
"""

from __future__ import annotations

import sys
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from ehsid.harness.rigs.new import published_rig
from ehsid.harness.signals.excitation import random_steps
from ehsid.harness.signals.simulation import draw_noise, suggested_controller
from ehsid.harness.signals.simulation.run import OUTPUTS_OF
from ehsid.hil.comparison import Agreement, compare
from ehsid.hil.cycles import CycleOptions
from ehsid.hil.emulator import emulated
from ehsid.hil.page import control_figure, cycles_figure, estimates_figure, servo_figure
from ehsid.hil.plan import Plan, position_plan
from ehsid.hil.recording import Recording
from ehsid.hil.run import RunResult, run_plan
from ehsid.hil.session import Session
from ehsid.hil.transport import open_line
from ehsid.lab.studies.on_target import FACTORS, experiment_plans
from ehsid.lab.studies.rig_records import DT_S

HERE = Path(__file__).parent
SAMPLES = 1600  # of 50 ms
BANDWIDTH_HZ = 0.3
WEAK_SUPPLY_PA = 4.0e6


def run(session: Session, plan: Plan) -> tuple[RunResult, Agreement]:
    """The run and how it compares; its files are not kept."""
    estimator, servo = plan.configuration.estimator, plan.configuration.servo
    orders = estimator.orders if servo is None else None
    with (
        tempfile.TemporaryDirectory() as folder,
        Recording(Path(folder), OUTPUTS_OF[plan.rig.plant], orders) as recording,
    ):
        result = run_plan(plan, session, recording)
    return result, compare(result)


def weak_supply(retune: bool) -> Plan:
    """Moves of 60 mm and less, smoothed, on the published rig with a third of its pressure."""
    rig, rng = published_rig(), np.random.default_rng(1)
    steps = random_steps(SAMPLES, amplitude=0.03, hold=(10, 60), rng=rng)
    smooth = np.hanning(7)
    reference = 0.15 + np.convolve(steps, smooth / smooth.sum(), mode="same")
    plan = position_plan(
        rig,
        reference,
        suggested_controller(rig, BANDWIDTH_HZ),
        dt_s=DT_S,
        noise=draw_noise(rig, SAMPLES, rng),
        retune=retune,
    )
    return replace(plan, rig=rig.with_values({"supply.pressure_pa": WEAK_SUPPLY_PA}))


def main() -> None:
    """Run, say what came out, and keep the pictures."""
    # As drawn by --cycles jitter=0.3, lost=0.02 and overrun=0.02 for 20 s at 5 ms.
    cycles = CycleOptions(0.3, 0.02, 0.02).draw(4000, 0.005, np.random.default_rng([0, 2]))
    cycles_figure(cycles).savefig(HERE / "cycles.png", dpi=90)
    print(cycles)
    with emulated(Path(sys.argv[1])) as port, open_line(port) as line:
        session, rig = Session(line), published_rig()
        plans = experiment_plans(rig, suggested_controller(rig), seed=0)
        runs = [(name, *run(session, plan)) for name, plan in plans.items()]
        for name, _, agreement in runs:
            print(f"{name}: {agreement.sentence}")
        estimates_figure(runs[: len(FACTORS)]).savefig(HERE / "experiment.png", dpi=90)
        estimates_figure(runs[len(FACTORS) :]).savefig(HERE / "changed.png", dpi=90)
        for name, plan in experiment_plans(rig, suggested_controller(rig), 0, servo={}).items():
            result, agreement = run(session, plan)
            print(f"{name}: {agreement.servo}, {agreement.sentence}")
        assert agreement.servo is not None
        assert agreement.replay.servo is not None
        figure = servo_figure(result, agreement.servo, agreement.replay.servo)
        figure.savefig(HERE / "servo.png", dpi=90)
        for retune in (False, True):
            result, agreement = run(session, weak_supply(retune))
            error = result.plan.reference_m - result.position_m
            retuned = [answer.gain_estimated for answer in result.results]
            print(
                f"retune {retune}: {1e3 * np.sqrt(np.mean(error[SAMPLES // 2 :] ** 2)):.2f} mm rms "
                f"in the second half, gain from the estimate {100 * np.mean(retuned):.0f} % of the "
                f"time, at the end {result.results[-1].gain_v_m:.1f} V/m, velocity gain "
                f"{result.results[-1].velocity_gain_m_s_v:.5f}, {agreement.sentence}"
            )
        control_figure(result).savefig(HERE / "retuning.png", dpi=90)


if __name__ == "__main__":
    main()
