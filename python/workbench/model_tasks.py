# SPDX-License-Identifier: MIT
"""What the user chooses for a model, and the work of the step Model, with its files."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import ehsid
from ehsid.harness.base.files import result_folder
from ehsid.harness.catalogue.parameters import POLICIES, policies_of
from ehsid.harness.models.estimation import EstimationResult, Recursion, estimate
from ehsid.harness.models.estimation.advice import advise
from ehsid.harness.models.identification import ArxOrders, IoData, identify
from ehsid.harness.models.identification.selection import MOST_DELAY as LONGEST_DELAY
from ehsid.harness.models.identification.selection import MOST_ORDER, parse_range
from ehsid.harness.records import Record, read_record
from ehsid.harness.show.model_file_names import ESTIMATION_FILES, IDENTIFICATION_FILES

from . import model_look
from .session import MOST_COEFFICIENTS, MOST_DELAY, Entry, ModelChoice, Session, SessionError

# Factors are of interest near 1, where each step doubles or halves the memory or so.
FACTORS = (
    *(0.5, 0.6, 0.7, 0.8, 0.85, 0.9, 0.92, 0.94, 0.95, 0.96, 0.97, 0.98, 0.985, 0.99),
    *(0.993, 0.995, 0.997, 0.998, 0.999, 0.9995, 0.9998, 0.9999, 1.0),
)
DECADES = 2  # that a slider reaches to both sides of a default
SMALL = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0)  # where the default is 0


def slider_values(setting: ehsid.PolicySetting, value: float) -> list[float]:
    """Returns the values that a slider for a setting offers, in order.

    Parameters
    ----------
    setting
        setting of a policy, with its range and its default.
    value
        that it has now, which is always among them.
    """
    if setting.range == "in (0, 1]":
        offered = [*FACTORS]
    elif setting.default > 0.0:
        digits = [10.0**k * m for k in range(-DECADES, DECADES) for m in (1.0, 2.0, 5.0)]
        offered = [float(f"{setting.default * one:.3g}") for one in (*digits, 10.0**DECADES)]
    else:
        offered = [*SMALL]
    if setting.range == ">= 0":
        offered.append(0.0)
    elif setting.range == ">= 1":
        offered = [1.0, *(one for one in offered if one > 1.0)]
    return sorted({*offered, setting.default, value})


def value_of(choice: ModelChoice, setting: ehsid.PolicySetting) -> float:
    """Returns the value of a setting of the chosen policy."""
    return choice.settings.get(setting.name, setting.default)


def set_method(choice: ModelChoice, method: str) -> None:
    """Chooses a recursion; a policy that it does not take gives way to the default one."""
    choice.method = method
    if choice.policy not in policies_of(method):
        set_policy(choice, ModelChoice().policy)


def set_policy(choice: ModelChoice, policy: str) -> None:
    """Chooses a forgetting policy with its defaults."""
    choice.policy = policy
    choice.settings = {}


def recursion_of(choice: ModelChoice) -> Recursion:
    """Returns the settings of the estimator, the same as those of `ehsid estimate`.

    Raises
    ------
    ValueError
        a setting is outside its range.
    """
    return Recursion(
        ArxOrders(choice.na, choice.nb, choice.nk, offset=True),
        POLICIES[choice.policy].policy(**choice.settings),
        reset=choice.reset,
        method=choice.method,
    )


def adopt_found(session: Session) -> None:
    """Gives the estimator orders and delay that the identification has found, if it has these."""
    found = json.loads((session.folder / "model" / "identify.json").read_bytes())
    orders, choice = found["chosen"]["orders"], session.settings.model
    if max(orders["na"], orders["nb"]) <= MOST_COEFFICIENTS and orders["nk"] <= MOST_DELAY:
        choice.na, choice.nb, choice.nk = orders["na"], orders["nb"], orders["nk"]


FOLDER = "model"


def identify_task(folder: Path, *, report: Callable[[float], None]) -> None:
    """Identifies a model, as `ehsid identify --out model`."""
    from ehsid.harness.show.model_figures import write_identification

    session = Session(folder)
    choice, entry = session.settings.model, _entry(session)
    inputs = [session.record_of(entry)]
    with result_folder(folder / FOLDER, "identify", IDENTIFICATION_FILES, inputs) as new:
        orders = parse_range(choice.orders, "orders", MOST_ORDER)
        delays = parse_range(choice.delays, "delays", LONGEST_DELAY)
        data, record = io_data(session)
        report(0.2)
        result = identify(data, orders=orders, delays=delays)
        report(0.5)
        write_identification(new, result, data, record.origin)
        report(0.9)
        model_look.write_look(session, record, result, data)
    report(1.0)


def estimate_task(folder: Path, *, report: Callable[[float], None]) -> None:
    """Estimates recursively, as `ehsid estimate --out model`."""
    session = Session(folder)
    entry = _entry(session)
    inputs = [session.record_of(entry)]
    with result_folder(folder / FOLDER, "estimate", ESTIMATION_FILES, inputs) as new:
        data, record = io_data(session)
        report(0.1)
        result = estimated(session, data)
        # The page shows this at once; the figure of a long record takes much longer.
        look = model_look.look_of(session, record, result, data)
        model_look.write_estimate_look(session, look)
        report(0.5)
        advice = advise(data, recursion_of(session.settings.model), result)
        model_look.write_tries(session, look.figures, advice)
        report(0.7)
        from ehsid.harness.show.model_figures import write_estimation

        write_estimation(new, result, data.dt_s, record.origin, advice)
    report(1.0)


def io_data(session: Session) -> tuple[IoData, Record]:
    """Returns input and output of the chosen record, and the record itself.

    Raises
    ------
    ValueError
        there is no record, or it does not have the columns.
    """
    choice = session.settings.model
    names = [choice.input_name, choice.output_name]
    record = read_record(session.record_of(_entry(session)), columns=names)
    return IoData.from_record(record, *names), record


def estimated(session: Session, data: IoData) -> EstimationResult:
    """Runs the estimator with the choices of the session.

    Raises
    ------
    ValueError
        the data or the choices do not allow it.
    """
    return estimate(data, **vars(recursion_of(session.settings.model)))


def _entry(session: Session) -> Entry:
    entry = session.modelled()
    if entry is None:
        raise SessionError("there is no record: bring one in the step Load")
    return entry
