# SPDX-License-Identifier: MIT
"""Makes the pictures of docs/excitation.md: python docs/excitation/make.py"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt
import scipy.signal
from matplotlib.figure import Figure
from rich.progress import track

import ehsid
from ehsid.harness.rigs import read_rig
from ehsid.harness.signals.excitation import (
    Excitation,
    chirp,
    odd_multisine,
    prbs,
    random_steps,
    travel,
    triangle,
)
from ehsid.harness.signals.simulation import simulate, velocity_gain

FloatArray = npt.NDArray[np.float64]

HERE = Path(__file__).parent
RIG = read_rig(HERE.parents[1] / "examples" / "rigs" / "bench.toml").with_values(
    {"effects.valve_lag.bandwidth_hz": 0.0, "effects.valve_lag.damping": 0.0}
)
DT_S = 1e-3
PERIOD = 4000
BAND_HZ = (0.5, 140.0)  # to twice the hydraulic frequency of the rig


def multisine(peak: float) -> Excitation:
    """One period."""
    return odd_multisine(PERIOD, DT_S, band_hz=BAND_HZ, peak=peak, rng=np.random.default_rng(3))


def steps(peak: float, n: int) -> FloatArray:
    """A new level every 0.1 to 0.4 s."""
    return random_steps(n, amplitude=peak, hold=(100, 400), rng=np.random.default_rng(7))


def signals(peak: float) -> dict[str, FloatArray]:
    """All of the same peak and two periods long."""
    n = 2 * PERIOD
    return {
        "multisine": np.tile(multisine(peak).samples, 2),
        "prbs": prbs(n, amplitude=peak, hold=3),
        "steps": steps(peak, n),
        "chirp": chirp(n, DT_S, amplitude=peak, band_hz=BAND_HZ),
        "triangle": triangle(n, DT_S, amplitude=peak, period_s=2.0),
    }


def density(name: str, signal: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Frequencies and power spectral density."""
    # A whole period and a sweep need no window; the sweep must not be cut.
    whole = name in ("multisine", "chirp")
    found: tuple[FloatArray, FloatArray] = scipy.signal.welch(
        signal,
        1.0 / DT_S,
        window="boxcar" if whole else "hann",
        nperseg=signal.size if name == "chirp" else PERIOD,
        detrend=False,
    )
    return found


def signals_figure() -> Figure:
    """Time, spectrum and amplitudes of every signal."""
    figure = Figure(figsize=(10, 9.5), layout="constrained")
    rows = figure.subplots(5, 3, width_ratios=[2, 2, 1])
    for axes, (name, signal) in zip(rows, signals(1.0).items(), strict=True):
        axes[0].plot(np.arange(signal.size) * DT_S, signal, linewidth=0.9)
        axes[0].set(ylabel=name, xlim=(0.0, 0.3 if name in ("multisine", "prbs") else 8.0))
        # Statistics of few levels would be those of the draw.
        long = steps(1.0, 100 * PERIOD) if name == "steps" else signal
        frequency, power = density(name, long)
        style = "." if name == "multisine" else "-"
        axes[1].loglog(frequency, power, style, linewidth=0.9, markersize=2.5)
        axes[1].axvspan(*BAND_HZ, color="0.92", zorder=0)
        axes[1].set(xlim=(0.25, 500.0), ylim=(1e-6, 3.0))
        axes[2].hist(long, bins=41, range=(-1.05, 1.05), density=True)
        axes[2].set(ylim=(0.0, 3.0), yticks=[])
    rows[0, 0].set_title("signal")
    rows[0, 1].set_title("power spectral density, 1/Hz")
    rows[0, 2].set_title("distribution")
    rows[-1, 0].set_xlabel("time in s")
    rows[-1, 1].set_xlabel("frequency in Hz")
    rows[-1, 2].set_xlabel("amplitude")
    return figure


def detection_figure() -> Figure:
    """Where a multisine's response lies beside its own lines, without and with a dead band."""
    found, periods = multisine(3.0), 8
    noise_m = RIG.sensors["position_noise_m"]
    rng = np.random.default_rng(1)
    figure = Figure(figsize=(10, 4), layout="constrained")
    for axis, effect in zip(
        figure.subplots(1, 2, sharey=True), (None, "valve_dead_band"), strict=True
    ):
        command = np.tile(found.samples, periods + 1)
        position = simulate(RIG, command, dt_s=DT_S, values=typical(effect)).record.column(
            "position_m"
        )
        position = position + noise_m * rng.standard_normal(position.size)
        # The difference turns a drift into a constant; the first period is the transient's.
        velocity = np.diff(position)[-periods * PERIOD :].reshape(periods, PERIOD) / DT_S
        spectra = np.fft.rfft(velocity) / PERIOD
        mean = np.abs(spectra.mean(axis=0))
        floor = spectra.std(axis=0, ddof=1) / np.sqrt(periods)
        frequency = np.fft.rfftfreq(PERIOD, DT_S)
        even = np.arange(2, found.excited[-1], 2)
        for lines, label, style in (
            (found.excited, "excited", "C0."),
            (found.detection, "odd, left out", "C3."),
            (even, "even", "C1."),
        ):
            axis.loglog(frequency[lines], mean[lines], style, markersize=3, label=label)
        axis.loglog(frequency[even], floor[even], "k", linewidth=0.5, label="noise, from periods")
        axis.set(title=effect or "rig alone", xlabel="frequency in Hz", xlim=(0.4, 160.0))
        axis.grid(True, alpha=0.3)
    figure.axes[0].set_ylabel("velocity at the line in m/s")
    figure.axes[0].legend(fontsize="small", loc="upper left")
    return figure


def drift_figure() -> Figure:
    """Position as `travel` takes it and as the rig moves."""
    figure = Figure(figsize=(10, 3.6), layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    stroke_m = RIG.values["cylinder.stroke_m"]
    gain = velocity_gain(RIG)
    for axis, name in zip(axes, ("steps", "multisine"), strict=True):
        command = signals(3.0)[name]
        record = simulate(RIG, command, dt_s=DT_S).record
        time = np.arange(command.size) * DT_S
        integral = 0.5 * stroke_m + gain * DT_S * (np.cumsum(command) - command)
        axis.plot(time, 1e3 * record.column("position_m"), label="simulated")
        axis.plot(time, 1e3 * integral, "0.4", linewidth=1.0, label="integrator")
        low, high = travel(command, DT_S, gain, 0.5 * stroke_m)
        axis.axhspan(1e3 * low, 1e3 * high, color="0.92", zorder=0, label="travel")
        axis.set(title=name, xlabel="time in s", xlim=(0.0, time[-1]))
    axes[0].set_ylabel("position in mm")
    axes[1].legend(fontsize="small", loc="upper left")
    return figure


def typical(effect: str | None) -> dict[str, float]:
    """Parameters of one effect at their typical size."""
    return {
        f"effects.{info.id}.{parameter.name}": parameter.typical
        for info in ehsid.effects()
        if info.id == effect
        for parameter in info.parameters
    }


def effects_figure() -> Figure:
    """How much each effect changes what each signal makes."""
    commands = {**signals(3.0), "triangle": 0.8 * signals(1.0)["triangle"]}
    outputs = ("position", "load pressure")

    def run(command: FloatArray, effect: str | None) -> FloatArray:
        # Most effects let the rod drift outwards.
        record = simulate(
            RIG, command, dt_s=DT_S, position0_m=0.08, values=typical(effect), keep_inside=True
        ).record
        load = record.column("pressure_a_pa") - record.column("pressure_b_pa")
        return np.stack([record.column("position_m"), load])

    without = {name: run(command, None) for name, command in commands.items()}
    infos = ehsid.effects()
    change = np.empty((len(outputs), len(infos), len(commands)))
    for row, info in track(list(enumerate(infos)), description="simulating"):
        for column, (name, command) in enumerate(commands.items()):
            difference = run(command, info.id) - without[name]
            rms = np.sqrt(np.mean(difference**2, axis=1))
            change[:, row, column] = 100.0 * rms / without[name].std(axis=1)
    figure = Figure(figsize=(10, 7), layout="constrained")
    for axis, output, values in zip(
        figure.subplots(1, 2, sharey=True), outputs, change, strict=True
    ):
        axis.imshow(
            np.log10(np.maximum(values, 0.01)), cmap="Blues", vmin=-2, vmax=3, aspect="auto"
        )
        for (row, column), value in np.ndenumerate(values):
            text = "0" if value < 0.005 else f"{value:.2g}" if value < 10 else f"{value:.0f}"
            colour = "white" if value > 30.0 else "black"
            axis.text(column, row, text, ha="center", va="center", fontsize="small", color=colour)
        axis.set_title(f"change of {output}, % of its standard deviation", fontsize="medium")
        axis.set_xticks(range(len(commands)), list(commands))
        axis.set_yticks(range(len(infos)), [info.id for info in infos])
    return figure


def main() -> None:
    """Write the pictures."""
    for name, figure in (
        ("signals", signals_figure()),
        ("detection", detection_figure()),
        ("drift", drift_figure()),
        ("effects", effects_figure()),
    ):
        figure.savefig(HERE / f"{name}.png", dpi=70)


if __name__ == "__main__":
    main()
