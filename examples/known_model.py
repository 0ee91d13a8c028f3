# SPDX-License-Identifier: MIT
"""The published model as known truth: ways to forget side by side, and a change of the plant."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import numpy.typing as npt
from matplotlib.figure import Figure
from real_record import Part

import ehsid
from ehsid.harness.models.identification import ArxOrders
from ehsid.harness.show.page import Picture, Section, Table
from ehsid.harness.show.units import percent
from ehsid.harness.signals.excitation import multisine
from ehsid.lab.studies import Contender, KnownPlant, Outcome, compare
from ehsid.lab.studies.pages.experiment_files import change_figure, error_figure
from ehsid.lab.studies.rig_records import DT_S, DURATION_S, MODEL_16, RECURSIVE

ORDERS = ArxOrders(3, 3, 1)
SAMPLES = round(DURATION_S / DT_S)
# The loss of the published third-order model is 0.0228: the variance of its equation error.
PUBLISHED_NOISE = float(np.sqrt(0.0228))
QUIET_NOISE = 0.01
# The published fit of 95.48 % with that error belongs to an output of rms 0.151 / 0.0452 = 3.3.
# This input moves model (16) by about as much; the error, summed by the integrator, comes on top.
BAND_HZ = (0.05, 5.0)
INPUT_RMS = 1.5
CHANGE = SAMPLES // 2
SETTLED = 0.05


def policies() -> dict[str, ehsid.Forgetting]:
    """The three of the paper and the estimator's own default."""
    return {
        "varying, Eq. (15)": ehsid.Exponential(),
        "0.99": ehsid.Constant(0.99),
        "1": ehsid.Constant(1.0),
        "F-ratio (default)": ehsid.FRatio(),
    }


def excite(rng: np.random.Generator) -> npt.NDArray[np.float64]:
    """A random-phase multisine as long as the published record."""
    return multisine(SAMPLES, DT_S, band_hz=BAND_HZ, rms=INPUT_RMS, rng=rng)


def parameter_table(outcomes: Mapping[str, Outcome]) -> Table:
    """Truth, ours, and the paper's columns as the paper's."""
    rows = []
    for i, name in enumerate(ORDERS.names):
        ours = [f"{np.median(outcome.theta[:, i]):.4f}" for outcome in outcomes.values()]
        published = [f"{run.theta[i]:.4f}" for run in RECURSIVE.values()]
        rows.append((name, f"{MODEL_16[i]:.4f}", *ours, *published))
    ours = [f"{np.median(outcome.rmse):.4f}" for outcome in outcomes.values()]
    rows.append(("RMSE", "", *ours, *(f"{run.rmse:.4f}" for run in RECURSIVE.values())))
    return Table(
        "Parameters after 100 s and RMSE of the innovation, median of the runs; the paper's "
        "figures are of its own rig, whose data were not published, and no target.",
        ("", "truth", *outcomes, *(f"paper, {name}" for name in RECURSIVE)),
        rows,
    )


def speed_table(outcomes: Mapping[str, Outcome]) -> Table:
    """How fast and how calm."""
    rows = []
    for name, outcome in outcomes.items():
        at = [
            f"{100 * np.median(outcome.error[:, round(t / DT_S) - 1]):.2f}"
            for t in (5, 20, 50, 100)
        ]
        settled = np.quantile(outcome.settling(SETTLED), [0.5, 0.95]) * DT_S
        rows.append((name, *at, f"{settled[0]:.1f}", f"{settled[1]:.1f}"))
    return Table(
        "Parameter error |theta_hat - theta| / |theta| in %, median of the runs, and the time "
        f"after which it stays below {100 * SETTLED:.0f} %.",
        ("lambda", "5 s", "20 s", "50 s", "100 s", "settled, median s", "95 % of runs, s"),
        rows,
    )


def changed_runs(seeds: int) -> dict[str, tuple[Outcome, Outcome]]:
    """A plant whose b jumps by half at 50 s, without and with the reset."""
    theta = np.array(MODEL_16)
    after = theta * np.where(np.arange(theta.size) < ORDERS.na, 1.0, 1.5)
    plant = KnownPlant.of(ORDERS, MODEL_16).changed(CHANGE, after)
    contenders = {
        (name, reset): Contender(policy, reset)
        for name, policy in policies().items()
        for reset in (False, True)
    }
    outcomes = compare(
        plant,
        {f"{name}|{reset}": contender for (name, reset), contender in contenders.items()},
        excite=excite,
        noise=QUIET_NOISE,
        seeds=range(seeds),
    )
    return {name: (outcomes[f"{name}|False"], outcomes[f"{name}|True"]) for name in policies()}


def drawn_change(pairs: Mapping[str, tuple[Outcome, Outcome]]) -> Figure:
    """From 2 s before the change to 15 s after it."""
    window = slice(CHANGE - round(2 / DT_S), CHANGE + round(15 / DT_S))
    return change_figure(pairs, DT_S, CHANGE, window)


def change_table(pairs: Mapping[str, tuple[Outcome, Outcome]]) -> Table:
    """Samples until the estimate has followed."""
    rows = []
    for name, pair in pairs.items():
        cells = []
        for outcome in pair:
            settling = outcome.settling(SETTLED, CHANGE)
            never = np.mean(settling >= SAMPLES - CHANGE)
            median = np.median(settling)
            cells.append("not in 50 s" if never > 0.5 else f"{median:.0f}")
        fired = [times[times >= CHANGE] for times in pair[1].resets]
        early = sum(int(np.count_nonzero(times < CHANGE)) for times in pair[1].resets)
        delays = [int(times[0]) - CHANGE for times in fired if times.size]
        rows.append(
            (
                name,
                *cells,
                f"{len(delays)} of {len(fired)}",
                f"{np.median(delays):.0f}" if delays else "none",
                str(early),
            )
        )
    return Table(
        f"Samples after the change until the error stays below {100 * SETTLED:.0f} %, median of "
        "the runs; runs in which the reset fired, its delay, and false alarms before the change.",
        ("lambda", "without reset", "with reset", "fired", "delay, samples", "false alarms"),
        rows,
    )


def known_model_sections(seeds: int) -> Part:
    """Both experiments on model (16)."""
    outcomes = compare(
        KnownPlant.of(ORDERS, MODEL_16),
        {name: Contender(policy) for name, policy in policies().items()},
        excite=excite,
        noise=PUBLISHED_NOISE,
        seeds=range(seeds),
    )
    pairs = changed_runs(seeds)
    at_5_s = {n: float(np.median(o.error[:, round(5 / DT_S) - 1])) for n, o in outcomes.items()}
    last = {n: float(np.median(o.error[:, -1])) for n, o in outcomes.items()}
    settling = {n: np.median(pair[1].settling(SETTLED, CHANGE)) for n, pair in pairs.items()}
    slowest = max(settling.values())
    varying = "varying, Eq. (15)"
    comparison = Section(
        "The published model (16) as the known truth",
        [
            (
                f"Third-order ARX at {1000 * DT_S:.0f} ms for {DURATION_S:.0f} s, {seeds} runs "
                f"(seeds 0 to {seeds - 1}), float32. Input: multisine "
                f"{BAND_HZ[0]} to {BAND_HZ[1]:g} Hz, rms {INPUT_RMS}. Equation error: white, "
                f"variance 0.0228, the loss of the published third-order model. All start from "
                "theta = 0 with the same vague P; no reset."
            ),
            Picture(
                error_figure(outcomes, DT_S),
                "Error of the parameters, median and 5 to 95 % of the runs; below, the forgetting "
                "factor of the first run. F-ratio forgets only when errors grow and lies on "
                "lambda = 1 here.",
                "Curves of the parameter error over 100 s on a logarithmic axis: all fall at "
                "first; lambda = 0.99 levels off above the others, which go on falling",
            ),
            speed_table(outcomes),
            parameter_table(outcomes),
            (
                "The paper reports lambda = 1 as slowest. From a vague start it is not: after 5 s "
                f"the median error of lambda = 1 is {percent(at_5_s['1'])}, that of the varying "
                f"factor {percent(at_5_s[varying])}; at the end they are at "
                f"{percent(last['1'])} and {percent(last[varying])}. That the constant 0.99 "
                f"stays restless holds: {percent(last['0.99'])}. The paper's own column for "
                "lambda = 1 has plainly not converged; `ehsid experiment` shows the start."
            ),
        ],
    )
    change = Section(
        "A change of the plant, with and without the reset of Fig. 4",
        [
            (
                f"At {CHANGE * DT_S:.0f} s all b grow by half. Equation error {QUIET_NOISE} rms; "
                "at the published noise such a change only doubles the error of the prediction, "
                "less than the factor of 3 that the reset asks for by default, and it does not "
                "fire."
            ),
            Picture(
                drawn_change(pairs),
                "Error of the parameters around the change, median of the runs; dashed without, "
                "solid with reset.",
                "With reset every curve jumps at the change and falls back at once; without, only "
                "F-ratio does so, lambda = 0.99 creeps and the others do not follow",
            ),
            change_table(pairs),
        ],
    )
    lead = [
        f"Published model, known truth: after 100 s the varying factor is within "
        f"{percent(last[varying])} of the true parameters, constant 0.99 "
        f"within {percent(last['0.99'])} (median of {seeds} runs).",
        f"When the plant changes, the reset brings every policy back to {100 * SETTLED:.0f} % in "
        f"{slowest:.0f} samples (median); without it only the F-ratio policy follows quickly.",
    ]
    return Part(lead, [comparison, change])
