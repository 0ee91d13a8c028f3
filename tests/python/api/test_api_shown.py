# SPDX-License-Identifier: MIT
"""Every result shows itself: one line, escaped HTML, and figures with labels and units."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_diagnoses import bench, made_diagnosis, measured_record
from matplotlib.figure import Figure
from offline_pages import read
from sources import ROOT

import ehsid

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"
HOSTILE = "<script>alert('x')</script>\n\x1b[31m\u202e&"
NAMES = {"input": "valve_opening", "output": "oil_pressure"}


def arrays() -> dict[str, Any]:
    frame = ehsid.read(CRANE)
    return {name: frame[name] for name in NAMES.values()}


def record(name: str) -> ehsid.Record:
    return ehsid.read(arrays(), name=name)


def diagnosis(name: str) -> ehsid.Diagnosis:
    found = made_diagnosis("effects")
    runs = tuple(replace(run, record=name) for run in found.runs)
    used = measured_record("held_out", 2, seconds=4.3, dt_s=2e-3)
    rig = ehsid.Rig(replace(bench(), name=name))
    return ehsid.Diagnosis(replace(found, runs=runs, sentence=name), [used], rig)


def simulation(name: str) -> ehsid.Simulation:
    rig = ehsid.Rig(replace(bench(), name=name))
    return ehsid.simulate(rig, "steps", duration_s=0.5, amplitude=1.0)


MADE: dict[str, Callable[[str], Any]] = {
    "Record": record,
    "Identification": lambda name: ehsid.identify(record(name), **NAMES, orders=[2]),
    "Estimation": lambda name: ehsid.estimate(record(name), **NAMES, na=2, nb=2),
    "Rig": lambda name: ehsid.Rig(replace(bench(), name=name)),
    "Simulation": simulation,
    "Diagnosis": diagnosis,
}
EVERY = pytest.mark.parametrize("kind", MADE)


@EVERY
def test_a_repr_is_one_harmless_line(kind: str) -> None:
    line = repr(MADE[kind](HOSTILE))
    assert line.startswith(f"<ehsid.{kind}: ")
    assert line.endswith(">")
    assert line.isprintable()
    assert "alert" in line


@EVERY
def test_html_is_escaped_and_whole(kind: str) -> None:
    html = MADE[kind](HOSTILE)._repr_html_()
    assert "&lt;script&gt;" in html
    tags = read(html)
    assert tags.seen <= {
        *("caption", "div", "p", "strong", "table"),
        *("tbody", "td", "th"),
        "thead",
        "tr",
    }
    assert "table" in tags.seen
    assert "\x1b" not in html
    assert "\u202e" not in html


@EVERY
def test_html_takes_the_colours_of_its_page(kind: str) -> None:
    html = MADE[kind]("bench")._repr_html_()
    assert "background" not in html
    assert ";color" not in html.replace('"', ";")


@EVERY
def test_a_summary_is_plain_text(kind: str) -> None:
    told = MADE[kind](HOSTILE).summary()
    assert "\x1b" not in told
    assert "\u202e" not in told
    assert len(told.splitlines()) > 2
    assert not [line for line in told.splitlines() if line != line.rstrip()]


@EVERY
def test_figures_have_labels_and_units(kind: str) -> None:
    if kind == "Rig":
        assert not hasattr(ehsid.Rig, "plot")
        return
    figure = MADE[kind]("$x_1 bench").plot()
    assert isinstance(figure, Figure)
    figure.canvas.draw()
    assert figure.axes[-1].get_xlabel() in ("time in s", "sample", "lag in samples")
    for axes in figure.axes:
        assert axes.get_ylabel() or axes.get_title(loc="left")
        assert axes.lines or axes.collections
    words = " ".join(axes.get_ylabel() for axes in figure.axes)
    expected = {
        "Record": "oil_pressure in its unit",
        "Identification": "oil_pressure",
        "Estimation": "parameters, 95 % band",
        "Simulation": "position in mm",
        "Diagnosis": "error in\nbar",
    }
    assert expected[kind] in words


def test_models_of_channels_have_their_units() -> None:
    run = ehsid.simulate(ehsid.Rig(bench()), "multisine", duration_s=2.0)
    assert ehsid.identify(run.record, orders=[2]).plot().axes[0].get_ylabel() == "position_m in m"
    axes = ehsid.estimate(run.record, na=2, nb=2).plot().axes
    assert axes[2].get_ylabel() == "innovation of\nposition_m in m"
    assert axes[2].get_xlabel() == "time in s"


def test_a_figure_of_a_diagnosis_has_measured_and_simulated_values() -> None:
    found = diagnosis("bench")
    figure = found.plot()
    run = found.result.runs[0]
    assert len(figure.axes) == 2 * len(run.measured)
    labels = [line.get_label() for line in figure.axes[0].lines]
    assert labels == [
        "measured",
        "simulator as configured",
        "rig values fitted",
        "with what was found",
    ]
    drawn = np.asarray(figure.axes[0].lines[0].get_ydata())
    assert np.nanmax(drawn) == pytest.approx(1e3 * np.max(run.measured["position_m"]))


def test_a_record_of_many_columns_names_a_few_in_its_line() -> None:
    many = ehsid.read({f"c{i}": np.arange(3.0) for i in range(20)})
    assert repr(many).endswith("c6, c7, 12 more>")
    assert len(many.plot().axes) == 8
    assert "c19" in many.summary()


@pytest.mark.slow
def test_names_of_columns_are_no_formulas() -> None:
    """A name with an unpaired $ or a broken formula is drawn as it is."""
    u, y = arrays().values()
    name = r"$\frac{p$ <b>" + "\x1b"
    log = ehsid.read({"u": u, name: y})
    shown = r"$\frac{p$ <b>\x1b"
    for figure in (
        log.plot(),
        ehsid.identify(log, input="u", output=name, orders=2).plot(),
        ehsid.estimate(log, input="u", output=name, na=2, nb=2).plot(),
    ):
        figure.canvas.draw()
        assert [axes for axes in figure.axes if shown in axes.get_ylabel()]
