# SPDX-License-Identifier: MIT
"""The work of the step Model: what `ehsid identify` and `ehsid estimate` do, with their files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ehsid.harness.base.files import result_folder
from ehsid.harness.models.estimation import EstimationResult, estimate
from ehsid.harness.models.estimation.advice import advise
from ehsid.harness.models.identification import IoData, identify
from ehsid.harness.models.identification.selection import MOST_DELAY, MOST_ORDER, parse_range
from ehsid.harness.records import Record, read_record
from ehsid.harness.show.model_file_names import ESTIMATION_FILES, IDENTIFICATION_FILES

from . import model_look
from .model_choice import recursion_of
from .session import Entry, Session, SessionError

FOLDER = "model"


def identify_task(folder: Path, *, report: Callable[[float], None]) -> None:
    """Identifies a model, as `ehsid identify --out model`."""
    from ehsid.harness.show.model_figures import write_identification

    session = Session(folder)
    choice, entry = session.settings.model, _entry(session)
    inputs = [session.record_of(entry)]
    with result_folder(folder / FOLDER, "identify", IDENTIFICATION_FILES, inputs) as new:
        orders = parse_range(choice.orders, "orders", MOST_ORDER)
        delays = parse_range(choice.delays, "delays", MOST_DELAY)
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
