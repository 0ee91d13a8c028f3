# SPDX-License-Identifier: MIT
"""Two measured machines: a press that a linear model follows, and a crane that none does."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure

from ehsid.harness.models.identification import IdentificationResult, IoData, identify
from ehsid.harness.models.identification.dynamics import dynamics
from ehsid.harness.records import read_record
from ehsid.harness.show.page import Code, Picture, Section, Table
from ehsid.harness.show.plotting import FITTED, MEASURED, stacked, styled

DATA = Path(__file__).parent / "data"
PRESS = ("mts_press.csv.gz", "target_mm", "position_mm")
CRANE = ("hydraulic_crane.csv", "valve_opening", "oil_pressure")
# Of the author of the record: examples/data/README.md.
PRESS_DELAY_MS, PRESS_GAIN = 25.9, 1.004
# The commands of a first day, the first of them the one that script/demo says.
IDENTIFY = [
    f"ehsid identify examples/data/{file} --input {u} --output {y}" for file, u, y in (PRESS, CRANE)
]


def identified(file: str, input_name: str, output_name: str) -> IdentificationResult:
    """Identify one record, as `ehsid identify` does."""
    record = read_record(DATA / file, columns=[input_name, output_name])
    return identify(IoData.from_record(record, input_name, output_name))


@styled
def press_figure(result: IdentificationResult) -> Figure:
    """The half of the record that was not fitted, and what the model makes of its input."""
    figure, (upper, lower) = stacked(3.8, [2.0, 1.0], xlabel="time in s")
    time = result.simulated.index * (result.dt_s or 1.0)
    measured, simulated = result.simulated.measured, result.simulated.predicted
    upper.plot(time, measured, color=MEASURED, linewidth=4.0, alpha=0.3, label="measured")
    upper.plot(
        time,
        simulated,
        color=FITTED,
        linewidth=1.2,
        label="model, from the command alone",
    )
    lower.plot(time, simulated - measured, color=FITTED, linewidth=1.0)
    upper.set_ylabel("position in mm")
    lower.set_ylabel("error in mm")
    upper.legend(loc="upper right", ncols=2)
    return figure


def press_section() -> Section:
    """Order, delay and gain of the press beside those that its author found."""
    result = identified(*PRESS)
    told = dynamics(result.chosen.model, result.dt_s)
    assert told.lag_s is not None
    assert told.static_gain is not None
    rows = [
        ("order", str(result.chosen.orders.na), "2"),
        ("how late it follows, ms", f"{1e3 * told.lag_s.value:.1f}", f"{PRESS_DELAY_MS}"),
        ("gain, mm per mm", f"{told.static_gain.value:.3f}", f"{PRESS_GAIN}"),
        ("fit of the free run, %", f"{result.chosen.simulation_fit_percent:.1f}", ""),
    ]
    return Section(
        "A real machine: a test press",
        [
            (
                "Twenty seconds of a hydraulic press, measured by others. From the first half "
                "comes a model that a controller can be designed with: how many states it has, "
                "how late it follows its command, and by how much. The second half judges it."
            ),
            Picture(
                press_figure(result),
                "The second half of the record, which was not fitted.",
                "Measured position and the model lie on each other; the error below is small",
            ),
            Table("", ("", "ehsid", "author of the record"), rows),
            Code(IDENTIFY[0]),
        ],
    )


def crane_section() -> Section:
    """What is said of a machine that no linear model follows."""
    result = identified(*CRANE)
    chosen = result.chosen
    return Section(
        "And a machine that no linear model follows",
        [
            (
                "A hydraulic crane, a record on which many methods were compared. "
                f"One sample ahead the best linear model fits with "
                f"{chosen.one_step_fit_percent:.1f} %, left alone with only "
                f"{chosen.simulation_fit_percent:.1f} %: it predicts the next sample, and is not "
                "the machine. ehsid says so, and does not give a better figure than there is."
            ),
            Code(IDENTIFY[1]),
        ],
    )
