# SPDX-License-Identifier: MIT
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from servo_records import AXIS, EFFECTS, OTHER, RIG, WITH_PRESSURES, full, made

from ehsid.harness.gap.inference.families import friction_laws
from ehsid.harness.gap.model.equations import equations, residuals, share_of
from ehsid.harness.gap.model.inverse_servo import CAP, FORCE, ROD, SPOOL, SUPPLY, servo_terms
from ehsid.harness.gap.model.inverse_signals import all_values, measured
from ehsid.harness.gap.schema import EquationShare
from ehsid.harness.records import Record, make_record
from ehsid.harness.rigs import Rig

# Largest residual with the effect, as a share of the largest term, and the smallest ratio of the
# residual without the effect to it. These effects depend on the smoothed position.
LOSSY = {
    # At rest, friction balances the drive; the rod creeps by less than the position shows.
    **dict.fromkeys(friction_laws(), (0.4, 2.0)),
    "sensor_backlash": (0.15, 2.0),
    "sensor_lag": (0.07, 10.0),
}


def equation_shares(
    records: Sequence[Record], rig: Rig, values: Mapping[str, float]
) -> tuple[EquationShare, ...]:
    """Residual of every equation, with the residual that the sensor noise causes."""
    return tuple(share_of(equation) for equation in equations(records, rig, values))


def rms(rows: np.ndarray) -> float:
    return float(np.sqrt(np.mean(rows**2)))


@pytest.mark.parametrize("effect", EFFECTS)
def test_equations_hold_for_simulated_records(effect: str) -> None:
    """The residual is small at the values of the simulation and large without the effect."""
    record = made(full(effect), noisy=False)
    signals = measured(record, RIG)
    terms_with_effect = servo_terms(signals, all_values(RIG, full(effect)), "ehs")
    shares = {
        name: rms(np.sum(list(terms.values()), axis=0)) / max(map(rms, terms.values()))
        for name, terms in terms_with_effect.items()
    }
    # At 1 kHz the trapezoidal rule has an error of about 1e-3 for a spool of 250 Hz. Presliding of
    # the seals takes 20 um, a tenth of the motion of the rod in the 20 ms over which the position
    # is smoothed. The smoothing also affects the lag and the play of a sensor.
    largest_share, least_ratio = LOSSY.get(effect, (0.002, 20.0))
    assert max(shares.values()) < largest_share, shares
    residuals_without_effect = residuals([signals], all_values(RIG, {}), "ehs")
    ratios = {
        name: rms(rows) / rms(np.sum(list(terms_with_effect[name].values()), axis=0))
        for name, rows in residuals_without_effect.items()
    }
    assert max(ratios.values()) > least_ratio, ratios


def test_the_supply_line_holds_with_a_line_behind_a_droop() -> None:
    values = {**full("line_resonance"), **full("supply_droop")}
    signals = measured(made(values, noisy=False), RIG)
    both = servo_terms(signals, all_values(RIG, values), "ehs")[SUPPLY]
    residual = rms(np.sum(list(both.values()), axis=0))
    for missing in ("line_resonance", "supply_droop"):
        without = {name: value for name, value in values.items() if missing not in name}
        terms = servo_terms(signals, all_values(RIG, without), "ehs")[SUPPLY]
        assert rms(np.sum(list(terms.values()), axis=0)) > 20.0 * residual


def test_the_residual_without_an_effect_is_the_noise() -> None:
    for share in equation_shares([made(OTHER)], RIG, {}):
        # The regression and the linear motion of the spool between samples add a few per cent.
        assert 0.8 * share.noise < share.residual.value < 1.35 * share.noise, share
        assert share.residual.low <= share.residual.value <= share.residual.high


def test_only_equations_with_measured_signals_are_used() -> None:
    names = [share.equation for share in equation_shares([made({})], RIG, {})]
    assert sorted(names) == sorted([CAP, ROD, SUPPLY, FORCE])
    with_spool = made({}, columns=(*WITH_PRESSURES, "spool"))
    assert SPOOL in [share.equation for share in equation_shares([with_spool], RIG, {})]
    assert equation_shares([made({}, columns=("position_m",))], RIG, {}) == ()
    # One of two records has no pressures: no equation is common to both.
    both = [made({}), made({}, columns=("position_m",))]
    assert equation_shares(both, RIG, {}) == ()


@pytest.mark.parametrize(
    ("effect", "equation"),
    [
        ("coulomb_friction", {FORCE}),
        ("load_force", {FORCE}),
        ("valve_dead_band", {CAP, ROD}),
        ("internal_leakage", {CAP, ROD}),
        ("supply_droop", {SUPPLY}),
    ],
)
def test_an_effect_raises_the_residual_of_its_own_equation_only(
    effect: str, equation: set[str]
) -> None:
    shares = equation_shares([made({**OTHER, **full(effect)})], RIG, {})
    above_noise = {share.equation for share in shares if share.residual.low > 1.5 * share.noise}
    assert above_noise == equation


def test_an_axis_has_a_force_balance_from_its_position() -> None:
    values = {"effects.coulomb_friction.force_n": 20.0, "effects.load_force.force_n": 5.0}
    record = made(values, rig=AXIS, columns=("position_m",))
    (share,) = equation_shares([record], AXIS, {})
    assert (share.equation, share.subsystem) == (FORCE, "mechanics")
    assert share.residual.low > 2.0 * share.noise
    (quiet,) = equation_shares([made({}, rig=AXIS, columns=("position_m",))], AXIS, {})
    assert quiet.residual.value < 1.35 * quiet.noise


def test_units_of_the_command_change_nothing() -> None:
    record = made(OTHER)
    shares = equation_shares([record], RIG, {})
    columns = {"time_s": record.time_s, **record.columns}
    tenfold = make_record({**columns, "command_v": 10.0 * record.column("command_v")})
    scaled = RIG.with_values({"valve.rated_command_v": 10.0 * RIG.values["valve.rated_command_v"]})
    for share, share_scaled in zip(shares, equation_shares([tenfold], scaled, {}), strict=True):
        assert share.residual.value == pytest.approx(share_scaled.residual.value, rel=1e-9)


def test_gaps_are_refused() -> None:
    record = made({})
    time_s = np.array(record.time_s)
    time_s[3000:] += 0.5
    record_with_gap = make_record({"time_s": time_s, **record.columns})
    with pytest.raises(ValueError, match="cut the record at its gaps"):
        equation_shares([record_with_gap], RIG, {})


def test_fine_samples_are_thinned() -> None:
    record = made(full("transport_delay"))
    fine = make_record(
        {
            "time_s": np.arange(4 * len(record)) * 0.25e-3,
            # Each value is held over four samples.
            "command_v": np.repeat(record.column("command_v"), 4),
            **{name: np.repeat(record.column(name), 4) for name in WITH_PRESSURES},
        }
    )
    for share, share_fine in zip(
        equation_shares([record], RIG, {}), equation_shares([fine], RIG, {}), strict=True
    ):
        assert share.residual.value == pytest.approx(share_fine.residual.value, rel=1e-6)
