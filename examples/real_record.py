# SPDX-License-Identifier: MIT
"""The hydraulic crane: order, residual tests, recursive estimates."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import ehsid
from ehsid.harness.models.estimation import EstimationResult, estimate
from ehsid.harness.models.identification import (
    ArxOrders,
    IdentificationResult,
    IoData,
    fit_arx,
    identify,
)
from ehsid.harness.records import read_record
from ehsid.harness.show.model_figures import estimation_figure, identification_figure
from ehsid.harness.show.page import Picture, Section, Table

RECORD = Path(__file__).parent / "data" / "hydraulic_crane.csv"


@dataclass(frozen=True, eq=False)
class Part:
    """Sections of the page and what the lead says of them."""

    lead: Sequence[str]
    sections: Sequence[Section]


def order_table(result: IdentificationResult) -> Table:
    """One row an order."""
    rows = [
        (
            str(candidate.orders.na),
            str(candidate.orders.nk),
            f"{candidate.one_step_fit_percent:.2f}",
            f"{candidate.simulation_fit_percent:.2f}",
            f"{candidate.validation.fpe:.5f}",
            f"{candidate.validation.loss:.5f}",
            f"{candidate.validation.aic:.3f}",
            f"{candidate.validation.mdl:.5f}",
        )
        for candidate in result.by_order
    ]
    chosen = [c.orders for c in result.by_order].index(result.chosen.orders)
    return Table(
        f"Orders, each with its own delay, on the {result.n_validation} samples that the estimate "
        "has not seen. The chosen order is marked.",
        ("order", "delay", "one-step fit %", "simulation fit %", "FPE", "loss", "AIC", "MDL"),
        rows,
        marked=[chosen],
    )


def runs(data: IoData, orders: ArxOrders) -> dict[str, EstimationResult]:
    """The recursion with several ways to forget; the first is shown in full."""
    varying, f_ratio = ehsid.Exponential(), ehsid.FRatio()
    return {
        "varying, Eq. (15)": estimate(data, orders, forgetting=varying, reset=False),
        "varying, with reset": estimate(data, orders, forgetting=varying),
        "0.99": estimate(data, orders, forgetting=ehsid.Constant(0.99), reset=False),
        "1": estimate(data, orders, forgetting=ehsid.Constant(1.0), reset=False),
        "F-ratio, with reset": estimate(data, orders, forgetting=f_ratio),
    }


def parameter_table(data: IoData, result: EstimationResult) -> Table:
    """Recursive beside batch estimates."""
    batch = fit_arx(data, result.orders, remove_means=True)
    rows = [
        (
            name,
            f"{entry['value']:.4f}",
            f"{entry['ci95'][0]:.4f} .. {entry['ci95'][1]:.4f}",
            f"{offline:.4f}",
        )
        for (name, entry), offline in zip(
            result.to_dict()["parameters"].items(), batch.theta, strict=True
        )
    ]
    return Table(
        f"Parameters at the end of the record, {result.forgetting}, beside batch least squares "
        "over the whole of it.",
        ("parameter", "recursive", "95 % interval", "batch"),
        rows,
    )


def real_record_section() -> Part:
    """Identify the crane offline, then run the estimator over its record."""
    columns = ("valve_opening", "oil_pressure")
    data = IoData.from_record(read_record(RECORD, columns=columns), *columns)
    offline = identify(data)
    orders = ArxOrders(offline.chosen.orders.na, offline.chosen.orders.nb, offline.chosen.orders.nk)
    recursive = runs(data, orders)
    shown = recursive["varying, Eq. (15)"]
    fits = Table(
        f"The same recursion (float32), ways to forget. One-step fit behind the first "
        f"{shown.n_start} equations; simulation: free run of the whole record with the final "
        "parameters.",
        ("lambda", "one-step fit %", "simulation fit %", "RMSE", "resets"),
        [
            (
                name,
                f"{run.one_step_fit_percent:.2f}",
                f"{run.simulation_fit_percent:.2f}",
                f"{run.rmse:.4f}",
                str(run.resets),
            )
            for name, run in recursive.items()
        ],
    )
    section = Section(
        "A real record: the hydraulic crane",
        [
            (
                "Valve opening to oil pressure, 1,024 measured samples, scaled; the sampling time "
                "is not given. The first half estimates, the second judges."
            ),
            Picture(
                identification_figure(offline),
                "Second half: measured and simulated pressure, and both residual tests. "
                f"Verdicts: {offline.whiteness.verdict}; {offline.independence.verdict}.",
                "Measured pressure and the free run of the chosen model over 512 samples; below, "
                "bars of the residual's autocorrelation and of its correlation with the input, "
                "with 99 % bands",
            ),
            order_table(offline),
            offline.reason,
            offline.delay_reason,
            *(sentence for sentence in offline.advice),
            (
                "The same record sample by sample, through the code that a controller links. The "
                "actuator is nonlinear and moves in bursts: to a linear model each burst looks "
                "like another plant. A policy that reacts fast, and the reset, follow the "
                "bursts and predict worse than one that averages over them."
            ),
            Picture(
                estimation_figure(shown, data.dt_s),
                "Parameters with their 95 % band, forgetting factor and innovation, sample by "
                "sample.",
                "Curves of the parameters with narrowing bands; the forgetting factor rises "
                "towards one; the innovation is larger during bursts",
            ),
            fits,
            parameter_table(data, shown),
        ],
    )
    chosen = offline.chosen
    lead = [
        f"Hydraulic crane: order {chosen.orders.na}, delay {chosen.orders.nk}. One step ahead the "
        f"model fits with {chosen.one_step_fit_percent:.1f} %, simulated freely with only "
        f"{chosen.simulation_fit_percent:.1f} %, and its residual is "
        f"{'white' if offline.whiteness.passed else 'not white'}: it predicts, but is not the "
        "machine."
    ]
    return Part(lead, [section])
