# SPDX-License-Identifier: MIT
"""Blocks of the sections on the offline procedure that describe the model that was kept."""

from __future__ import annotations

import numpy as np

from ehsid.harness.models.identification import (
    Agreement,
    FrequencyResponse,
    IdentificationResult,
    PolesZeros,
    Roots,
)
from ehsid.harness.show.loop_blocks import place
from ehsid.harness.show.model_curves import bode
from ehsid.harness.show.model_figures import bode_figure
from ehsid.harness.show.page import Block, Picture, Table

from ..procedure import Procedure
from .offline_figures import outputs_figure, poles_zeros_figure, residual_figure


def outputs_picture(procedure: Procedure) -> Picture:
    """Returns the picture of measured and simulated output (the paper's Fig. 7)."""
    return Picture(
        outputs_figure(procedure.best, procedure.data.dt_s, procedure.data.output_name),
        "Validation part: measured output and free run of the model from its first measured "
        "samples (the paper's Fig. 7); below, what the free run and the one-step prediction "
        "miss.",
        "Two curves of the output over time, and two of the differences below",
    )


def residual_picture(result: IdentificationResult) -> Picture:
    """Returns the picture of the residual tests (the paper's Fig. 8)."""
    return Picture(
        residual_figure(result),
        "One-step residual on the validation part (the paper's Fig. 8): "
        f"{result.whiteness.verdict}; {result.independence.verdict}. Orange: outside the band "
        "of a single lag, as one lag in a hundred is by chance.",
        "Bars of the residual's autocorrelation and of its correlation with the input, lag by "
        "lag, with 99 % bands",
    )


def poles_zeros_blocks(model_roots: PolesZeros) -> list[Block]:
    """Returns the table and the picture of the poles and zeros."""
    rows = [
        *_root_rows("pole", model_roots.poles),
        *_root_rows("zero", model_roots.zeros),
    ]
    at_origin = [
        f"{count} {name}{'s' if count > 1 else ''} at z = 0"
        for count, name in ((model_roots.origin_poles, "pole"), (model_roots.origin_zeros, "zero"))
        if count
    ]
    others = f" Order and delay add {' and '.join(at_origin)}." if at_origin else ""
    return [
        Table(
            "Poles and zeros in the z plane with their standard deviations, to first order in "
            f"those of the parameters.{others}",
            ("root", "z", "deviation, real", "deviation, imaginary", "|z|", "deviation of |z|"),
            rows,
        ),
        Picture(
            poles_zeros_figure(model_roots),
            "Poles (crosses) and zeros (circles) with their regions of 95 %: ellipses, bars on "
            "the real axis. None is drawn where a neighbour is within three deviations, as the "
            "first order does not hold there.",
            "The z plane with the unit circle, crosses and circles with ellipses around them, and "
            "the part around z = 1 enlarged",
        ),
    ]


def _root_rows(name: str, roots: Roots) -> list[tuple[str, ...]]:
    rows: list[tuple[str, ...]] = []
    for value, spread, of_modulus, reliable in zip(
        roots.values, roots.covariance, roots.modulus_deviation, roots.reliable, strict=True
    ):
        if value.imag < 0.0:
            continue
        real, imaginary = np.sqrt(np.diag(spread))
        rows.append(
            (
                name,
                place(value),
                f"{real:.2g}" if reliable else "not valid",
                "" if value.imag == 0.0 else f"{imaginary:.2g}" if reliable else "not valid",
                f"{abs(value):.5f}",
                f"{of_modulus:.2g}" if reliable else "not valid",
            )
        )
    return rows


def response_blocks(procedure: Procedure, truth: FrequencyResponse | None) -> list[Block]:
    """Returns the Bode diagram of the model, compared with the rig's response if it is known."""
    assert procedure.response is not None
    shown = bode(procedure.response, procedure.input_band, truth)
    beside = "" if truth is None else f" Dots: {truth.source}."
    margins = (
        ""
        if procedure.loop is None or procedure.loop.half is None
        else " Orange: gain and phase margin of a proportional controller with half the gain at "
        "the limit of stability."
    )
    blocks: list[Block] = [
        Picture(
            bode_figure(shown, procedure.data.dt_s, procedure.loop),
            "Frequency response of the model with its 95 % band at each frequency by itself."
            f"{beside} Grey: outside the band with 99 % of the input's power, where the model "
            f"extrapolates.{margins}",
            "Magnitude and phase over frequency, with a shaded band"
            + ("" if truth is None else " and the rig's response as dots"),
        )
    ]
    if truth is not None and procedure.input_band is not None:
        blocks.append(_agreement(procedure, truth, procedure.input_band))
    return blocks


def _agreement(procedure: Procedure, truth: FrequencyResponse, band: tuple[float, float]) -> str:
    everywhere = procedure.against(truth)
    excited = everywhere.within(band)
    unit = "cycles a sample" if procedure.data.dt_s is None else "Hz"
    where = f"Where the input has its power, {band[0]:.3g} to {band[1]:.3g} {unit}"
    if excited.inside.size == 0:
        return f"{where}, the rig's response is not known."
    n, inside = excited.inside.size, int(np.sum(excited.inside))
    text = (
        f"{where}, the rig's response is inside the model's region of 95 % at {inside} of {n} "
        f"frequencies; the differences there are {_differences(excited, unit)}. Over all "
        f"frequencies they are {_differences(everywhere, unit)}."
    )
    if inside < 0.9 * n:
        text += (
            " The region allows for chance alone. What lies beyond is bias: of sensor noise, which "
            "is no equation error, and of a rig that is not linear at the size of the record's "
            "motion."
        )
    if procedure.best.failed_tests:
        text += " As residual tests fail, the region is too rough to be held to."
    return text


def _differences(comparison: Agreement, unit: str) -> str:
    worst = int(np.argmax(np.abs(comparison.magnitude_difference_db)))
    turn = int(np.argmax(np.abs(comparison.phase_difference_deg)))
    return (
        f"{comparison.magnitude_difference_db[worst]:+.2f} dB at most, at "
        f"{comparison.frequency_hz[worst]:.3g} {unit}, and "
        f"{comparison.phase_difference_deg[turn]:+.1f} degrees, at "
        f"{comparison.frequency_hz[turn]:.3g} {unit}; the median ones "
        f"{np.median(np.abs(comparison.magnitude_difference_db)):.2f} dB and "
        f"{np.median(np.abs(comparison.phase_difference_deg)):.2f} degrees"
    )
