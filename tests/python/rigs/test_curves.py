# SPDX-License-Identifier: MIT
"""Test curves of a valve: known values are found again, and what is none of them is told."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from ehsid.harness.cli import cli
from ehsid.harness.rigs import Rig, read_rig

MACHINE = ["--bore", "63 mm", "--rod", "35 mm", "--stroke", "300 mm", "--supply", "120 bar"]
FLOW, ROUNDING, PRESSURE = 38.0 / 6e4, 0.004, 70e5


def made(
    folder: Path,
    *,
    overlap: float = 0.03,
    bias: float = -0.01,
    half_width: float = 0.008,
    limit: float = math.inf,
    seed: int = 1,
) -> list[str]:
    """Writes the curves of a valve with noise, by its equations; returns their paths."""
    rng = np.random.default_rng(seed)
    quarter = np.linspace(0.0, 1.0, 200)
    cycle = np.concatenate([quarter, quarter[::-1], -quarter, -quarter[::-1], quarter])

    def behind(u: np.ndarray) -> np.ndarray:
        held, x = 0.0, []
        for one in u:
            held = min(max(held, one - half_width), one + half_width)
            x.append(held + bias)
        shares = np.array(x)
        return limit * np.tanh(shares / limit) if math.isfinite(limit) else shares

    x = behind(cycle)
    opening = np.maximum(x - overlap, 0.0) + np.minimum(x + overlap, 0.0)
    near = 0.1 * cycle
    ahead, back = behind(near) - overlap, -behind(near) - overlap
    squares = [(0.5 * (s + np.hypot(s, ROUNDING))) ** 2 for s in (ahead, back)]
    load = PRESSURE * (squares[0] - squares[1]) / (squares[0] + squares[1])
    # Supply to A to tank and supply to B to tank: a a' / sqrt(a^2 + a'^2) each.
    parallel = np.sqrt(squares[0] * squares[1] / (squares[0] + squares[1]))
    leakage = 2.0 * FLOW * parallel * math.sqrt(PRESSURE / 35e5) + 0.2 / 6e4
    curves = {
        "flow_gain.csv": ("signal [V],flow [l/min]", cycle, 6e4 * FLOW * opening, 0.1),
        "pressure_gain.csv": ("signal [%],load_pressure [bar]", near, 1e-5 * load, 0.2),
        "leakage.csv": ("command_v,leakage_m3_s", near, leakage, 1e-8),
    }
    for name, (head, u, measured, noise) in curves.items():
        signal = u * (100.0 if "%" in head else 10.0)
        rows = np.column_stack([signal, measured + noise * rng.standard_normal(u.size)])
        np.savetxt(folder / name, rows, delimiter=",", header=head, comments="", fmt="%.9g")
    return [str(folder / name) for name in curves]


def new(*words: str) -> tuple[int, str]:
    arguments = ["rig", "new", *MACHINE, *words]
    outcome = CliRunner().invoke(cli, arguments, env={"COLUMNS": "200"})
    return outcome.exit_code, " ".join(outcome.output.split())


def rig_of(tmp_path: Path, curves: list[str]) -> tuple[Rig, str]:
    code, shown = new(
        "--rated-drop", "35 bar", "--curves", *curves, "--out", f"{tmp_path}/rig.toml"
    )
    assert code == 0, shown
    return read_rig(tmp_path / "rig.toml"), shown


@pytest.mark.slow
@pytest.mark.parametrize("limit", [math.inf, 0.6])
def test_known_values_are_found_within_their_uncertainty(tmp_path: Path, limit: float) -> None:
    rig, shown = rig_of(tmp_path, made(tmp_path, limit=limit))
    truth = {
        "valve.rated_flow_m3_s": FLOW,
        "effects.valve_dead_band.overlap": 0.03,
        "effects.valve_null_bias.offset": -0.01,
        "effects.valve_hysteresis.half_width": 0.008,
        "nuisance.edge_rounding": ROUNDING,
    }
    if math.isfinite(limit):
        truth["effects.valve_flow_saturation.limit"] = limit
    for name, value in truth.items():
        assert abs(rig.values[name] - value) < 3.0 * rig.sigma(name) * abs(value), name
        assert rig.sigma(name) < (0.5 if "rounding" in name else 0.15), name
    assert ("effects.valve_flow_saturation.limit" in rig.values) == math.isfinite(limit)
    assert "pressure gain" in shown
    assert "null leakage" in shown
    assert "ISO 10770-1" in (tmp_path / "rig.toml").read_text("utf-8")


@pytest.mark.slow
def test_a_valve_without_them_gets_no_effects(tmp_path: Path) -> None:
    rig, _ = rig_of(tmp_path, made(tmp_path, overlap=0.0, bias=0.0, half_width=0.0)[:1])
    assert [one for one in rig.effects() if one != "valve_lag"] == []


FLOW_ROWS = "\n".join(f"{u / 2.0},{u}" for u in range(-20, 21))


@pytest.mark.parametrize(
    ("text", "options", "message"),
    [
        ("signal [V],speed [m/s]\n" + FLOW_ROWS, [], "no test of a valve: expected a column"),
        ("signal [V],flow\n" + FLOW_ROWS, [], "column 'flow': has no unit"),
        ("signal [V],flow [bar]\n" + FLOW_ROWS, [], "does not convert into m^3/s"),
        ("signal [Hz],flow [l/min]\n" + FLOW_ROWS, [], "none of a signal: expected V, mA or %"),
        ("signal [V],flow [l/min]\n1,2\n2,3", [], "2 points: expected 20 at least"),
        ("signal [V],flow [l/min]\n" + FLOW_ROWS.replace("-", ""), [], "expected both signs"),
        ("flow [l/min],signal [V]\n" + FLOW_ROWS, ["--rated-flow", "38 l/min"], "leave out the"),
        ("signal [V],flow [l/min]\n" + FLOW_ROWS, ["--plant", "axis"], "expected a plant ehs"),
    ],
)
def test_what_is_no_curve_is_told(
    tmp_path: Path, text: str, options: list[str], message: str
) -> None:
    curve = tmp_path / "curve.csv"
    curve.write_text(text)
    out = tmp_path / "rig.toml"
    code, shown = new("--curves", str(curve), *options, "--out", str(out))
    assert code == 2
    assert message in shown
    assert not out.exists()
