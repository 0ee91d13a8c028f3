# SPDX-License-Identifier: MIT
"""What the page draws of an identified model; kept in a file, and the signals as pyramids.

The numbers are those of `identification`; here they are only brought together.
"""

from __future__ import annotations

from pathlib import Path

import msgspec
import numpy as np

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.base.encoding import from_json
from ehsid.harness.base.files import write_text
from ehsid.harness.catalogue.channels import TIME
from ehsid.harness.models.identification import (
    IdentificationResult,
    IoData,
    frequency_response,
    poles_zeros,
    power_band,
    response_grid,
)
from ehsid.harness.models.identification.residuals import IndependenceTest, WhitenessTest
from ehsid.harness.models.identification.roots import Roots
from ehsid.harness.models.identification.velocity_gain import integrator, velocity_gain
from ehsid.harness.records import Record

from .downsampling import make_pyramid, store
from .session import Session

FILE = "identified.json"
SAME_POLE = 1e-6  # of two computations of its place in the z plane
MEASURED, SIMULATED, RESIDUAL = "measured", "simulated", "residual"


class Root(msgspec.Struct, frozen=True):
    """A pole or zero in the z plane.

    Attributes
    ----------
    real, imag
        where it is.
    deviation
        standard deviation of its modulus; None where another root is too near to tell.
    frequency_hz, damping
        natural frequency and damping of a pole; None for a zero and for an integrator.
    integrates
        whether it is a pole that cannot be told from z = 1.
    """

    real: float
    imag: float
    deviation: float | None = None
    frequency_hz: float | None = None
    damping: float | None = None
    integrates: bool = False


class Correlation(msgspec.Struct, frozen=True):
    """A residual test: the correlation at each lag in samples, and the 99 % band of one lag."""

    passed: bool
    verdict: str
    lags: list[int]
    values: list[float]
    band: float


class Row(msgspec.Struct, frozen=True):
    """A candidate: orders, delay, fit of one step and of the free run in percent, and FPE."""

    na: int
    nb: int
    nk: int
    one_step: float
    simulated: float | None
    fpe: float


class Bode(msgspec.Struct, frozen=True):
    """Magnitude in dB and phase in degrees over the frequency, each with its 95 % band."""

    frequency_hz: list[float]
    magnitude_db: list[float]
    magnitude_low: list[float]
    magnitude_high: list[float]
    phase_deg: list[float]
    phase_low: list[float]
    phase_high: list[float]
    excited_hz: tuple[float, float]


class Identified(msgspec.Struct, frozen=True):
    """An identified model, as the page shows it.

    Attributes
    ----------
    record, input_name, output_name, dt_s
        what it was made of.
    chosen, rows
        the chosen structure, and one candidate for each order.
    reasons, advice
        sentences.
    names, theta, deviations
        coefficients, in the units of the record.
    velocity_gain
        see `identification.velocity_gain`; None if the model does not integrate.
    """

    record: str
    input_name: str
    output_name: str
    dt_s: float
    chosen: Row
    rows: list[Row]
    reasons: list[str]
    advice: list[str]
    names: list[str]
    theta: list[float]
    deviations: list[float | None]
    poles: list[Root]
    zeros: list[Root]
    velocity_gain: float | None
    whiteness: Correlation
    independence: Correlation
    bode: Bode


def look_folder(session: Session) -> Path:
    """Returns the folder of what the page draws of models; no record can have its name."""
    return session.folder / "looks" / "_model"


def write_look(
    session: Session, record: Record, result: IdentificationResult, data: IoData
) -> None:
    """Writes what the page draws of an identification of a record."""
    folder = look_folder(session)
    folder.mkdir(parents=True, exist_ok=True)
    free, ahead = result.simulated, result.one_step
    first, last = int(free.index[0]), int(free.index[-1]) + 1  # only the half that is judged by
    np.save(folder / f"{TIME}.npy", times_of(record)[first:last])
    for name, index, values in (
        (MEASURED, free.index, free.measured),
        (SIMULATED, free.index, free.predicted),
        (RESIDUAL, ahead.index, ahead.residual),
    ):
        whole = np.full(last - first, np.nan)
        whole[index - first] = np.where(np.isfinite(values), values, np.nan)
        store(make_pyramid(whole), folder, name)
    shown = _identified(record.name, result, data)
    write_text(folder / FILE, msgspec.json.encode(shown).decode())


def times_of(record: Record) -> FloatArray:
    """Returns the times of all samples of a record in s."""
    if record.time_s is not None:
        return record.time_s
    return (record.dt_s or 1.0) * np.arange(len(record), dtype=np.float64)


def read_look(session: Session) -> Identified | None:
    """Returns what the page draws of the last identification; None without one."""
    try:
        return from_json((look_folder(session) / FILE).read_bytes(), Identified)
    except (OSError, msgspec.DecodeError):
        return None


def _identified(record: str, result: IdentificationResult, data: IoData) -> Identified:
    model, dt_s = result.chosen.model, data.dt_s or 1.0
    rows = [
        Row(
            one.orders.na,
            one.orders.nb,
            one.orders.nk,
            one.one_step_fit_percent,
            _finite(one.simulation_fit_percent),
            one.validation.fpe,
        )
        for one in result.by_order
    ]
    place = [one.orders for one in result.by_order].index(result.chosen.orders)
    return Identified(
        record=record,
        input_name=data.input_name,
        output_name=data.output_name,
        dt_s=dt_s,
        chosen=rows[place],
        rows=rows,
        reasons=[result.reason, result.delay_reason],
        advice=list(result.advice),
        names=list(model.orders.names),
        theta=model.theta.tolist(),
        deviations=[_finite(one) for one in model.standard_deviations.tolist()],
        poles=_poles(result, dt_s),
        zeros=_roots(poles_zeros(model).zeros),
        velocity_gain=velocity_gain(model, dt_s),
        whiteness=_correlation(result.whiteness),
        independence=_correlation(result.independence),
        bode=_bode(result, data),
    )


def _roots(roots: Roots) -> list[Root]:
    return [
        Root(value.real, value.imag, _finite(float(deviation)) if reliable else None)
        for value, deviation, reliable in zip(
            roots.values.tolist(), roots.modulus_deviation, roots.reliable, strict=True
        )
    ]


def _poles(result: IdentificationResult, dt_s: float) -> list[Root]:
    # python-control takes a second to import, and the page itself does not need it.
    from ehsid.harness.models.identification.loop import analyse_loop
    from ehsid.harness.models.identification.systems import to_control

    model = result.chosen.model
    modes = analyse_loop(to_control(model, dt_s)).modes
    at_one = integrator(model)
    made = []
    for i, root in enumerate(_roots(poles_zeros(model).poles)):
        if i == at_one:
            made.append(msgspec.structs.replace(root, integrates=True))
            continue
        pole = complex(root.real, abs(root.imag))
        mode = min(modes, key=lambda mode: abs(mode.pole - pole), default=None)
        if mode is None or abs(mode.pole - pole) > SAME_POLE:
            made.append(root)
            continue
        frequency, damping = _finite(mode.frequency_hz), _finite(mode.damping)
        made.append(msgspec.structs.replace(root, frequency_hz=frequency, damping=damping))
    return made


def _correlation(test: WhitenessTest | IndependenceTest) -> Correlation:
    return Correlation(
        test.passed, test.verdict, test.lags.tolist(), test.correlation.tolist(), test.band
    )


def _bode(result: IdentificationResult, data: IoData) -> Bode:
    dt_s = data.dt_s or 1.0
    grid = response_grid(result.n_validation, dt_s)
    response = frequency_response(result.chosen.model, grid, dt_s)
    magnitude, phase = response.magnitude_band_db(), response.phase_band_deg()

    def plain(values: FloatArray) -> list[float]:
        finite: list[float] = np.nan_to_num(values, nan=0.0, posinf=1e4, neginf=-1e4).tolist()
        return finite

    return Bode(
        grid.tolist(),
        plain(response.magnitude_db),
        plain(magnitude[:, 0]),
        plain(magnitude[:, 1]),
        plain(response.phase_deg),
        plain(phase[:, 0]),
        plain(phase[:, 1]),
        power_band(data),
    )


def _finite(value: float) -> float | None:
    return value if np.isfinite(value) else None
