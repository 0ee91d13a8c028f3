# SPDX-License-Identifier: MIT
"""Models from Python beside those of the rooms."""

import json
from pathlib import Path
from typing import Any

import control
import numpy as np
import polars as pl
import pytest
from sources import ROOT

import ehsid
from ehsid.harness.models import estimation, identification
from ehsid.harness.models.identification import ArxOrders, IoData
from ehsid.harness.records import read_record

CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"
NAMES = {"input": "valve_opening", "output": "oil_pressure"}
FAST = {"orders": [2, 3], "delays": [1, 2]}


@pytest.fixture(scope="module")
def data() -> IoData:
    return IoData.from_record(read_record(CRANE, columns=list(NAMES.values())), *NAMES.values())


@pytest.fixture(scope="module")
def model() -> ehsid.Identification:
    return ehsid.identify(CRANE, **NAMES, **FAST)


@pytest.fixture(scope="module")
def found() -> ehsid.Estimation:
    return ehsid.estimate(CRANE, **NAMES, na=2, nb=2, nk=1)


def sources() -> list[Any]:
    """The same samples as a path, a record, a frame and arrays."""
    frame = pl.read_csv(CRANE)
    u, y = (frame[name].to_numpy() for name in NAMES.values())
    return [CRANE, str(CRANE), ehsid.read(CRANE), ehsid.read(CRANE).result, frame, (u, y, None)]


def test_identify_gives_the_result_of_the_room(data: IoData) -> None:
    expected = identification.identify(data, **FAST).to_dict()
    for source in sources():
        assert ehsid.identify(source, **NAMES, **FAST).result.to_dict() == expected
    assert ehsid.identify(*sources()[-1], **FAST).result.to_dict() == expected


def test_a_model_predicts_and_simulates_what_its_frame_has(
    model: ehsid.Identification, data: IoData
) -> None:
    chosen = model.result.chosen.model
    assert np.array_equal(model.theta, chosen.theta)
    assert model.parameters == dict(zip(model.orders.names, model.theta, strict=True))
    history, frame = model.orders.n_history, model.to_polars()
    half = data.n_samples - model.result.n_validation
    u, y = data.u[half:], data.y[half:]
    predicted = model.predict(u, y)
    shown = frame["sample"].to_numpy()
    assert np.array_equal(np.isnan(predicted), np.arange(y.size) < history)
    whole = model.predict(data.u, data.y)
    # The same sums of products: a few roundings of numbers of order one.
    np.testing.assert_allclose(whole[shown], frame["one_step"], atol=1e-12)
    np.testing.assert_allclose(predicted[history:], whole[half + history :], atol=1e-12)
    first = int(shown[0]) - history
    run = model.simulate(data.u[first:], data.y[first : first + history])
    assert np.array_equal(run[:history], data.y[first : first + history])
    np.testing.assert_allclose(run[history:], frame["simulated"], atol=1e-9)
    with pytest.raises(ValueError, match=r"^start has the shape \(1,\)"):
        model.simulate(u, [0.0])


def test_a_model_at_zero_steps_as_python_control_says() -> None:
    rng = np.random.default_rng(3)
    u = rng.normal(size=400)
    y = control.forced_response(control.tf([0.2], [1.0, -0.7], 0.01), U=u).outputs
    found = ehsid.identify(u, y + 1e-6 * rng.normal(size=u.size), 0.01, orders=[1], delays=[1])
    step = np.ones(100)
    step[0] = 0.0  # at zero until the first sample
    expected = control.forced_response(found.to_control(), U=step).outputs
    # Beside the offset, which python-control does not have: 1e-6 / (1 - 0.7) at most.
    np.testing.assert_allclose(found.simulate(step), expected, atol=1e-5)


def test_a_number_is_the_constant_forgetting_factor() -> None:
    u, y, dt_s = sources()[-1]
    found = ehsid.estimate(u, y, dt_s, na=2, nb=2, forgetting=np.float64(0.99))
    expected = ehsid.estimate((u, y, dt_s), na=2, nb=2, forgetting=ehsid.Constant(0.99))
    assert found.result.to_dict() == expected.result.to_dict()
    assert found.result.forgetting == "Constant(lambda_=0.99)"


@pytest.mark.parametrize("given", [{"orders": "2-3", "delays": "1-2"}, {"orders": 2, "delays": 1}])
def test_orders_and_delays_are_numbers_or_ranges(given: dict[str, Any], data: IoData) -> None:
    found = ehsid.identify(CRANE, **NAMES, **given).result
    tried = (range(2, 4), range(1, 3)) if given["orders"] == "2-3" else ([2], [1])
    expected = identification.identify(data, orders=tried[0], delays=tried[1])
    assert found.to_dict() == expected.to_dict()


def test_estimate_gives_the_result_of_the_room(data: IoData) -> None:
    expected = estimation.estimate(
        data, ArxOrders(2, 2, 1, offset=True), forgetting=ehsid.Exponential()
    )
    for source in sources():
        found = ehsid.estimate(source, **NAMES, na=2, nb=2, nk=1).result
        assert found.to_dict() == expected.to_dict()
        assert np.array_equal(found.theta_path, expected.theta_path)


def test_settings_reach_the_estimator(data: IoData) -> None:
    policy = ehsid.Constant(lambda_=0.98)
    guards = ehsid.RlsOptions.textbook()
    settings = {"reset": False, "guards": guards, "start_variance": 1e3, "method": "riv"}
    expected = estimation.estimate(
        data, ArxOrders(2, 1, 2, offset=True), forgetting=policy, **settings
    )
    found = ehsid.estimate(CRANE, **NAMES, na=2, nb=1, nk=2, forgetting=policy, **settings)
    assert np.array_equal(found.result.theta_path, expected.theta_path)
    assert list(found.parameters) == ["a1", "a2", "b1", "offset"]


@pytest.mark.parametrize("name", ["f-ratio", "f_ratio"])
def test_a_policy_by_name_has_its_defaults(name: str) -> None:
    by_name = ehsid.estimate(CRANE, **NAMES, forgetting=name)
    by_object = ehsid.estimate(CRANE, **NAMES, forgetting=ehsid.FRatio())
    assert np.array_equal(by_name.result.theta_path, by_object.result.theta_path)
    assert by_name.result.forgetting == repr(ehsid.FRatio())


def response(theta: np.ndarray, na: int, nb: int, nk: int, z: np.ndarray) -> np.ndarray:
    """Eq. (7) on the unit circle, term by term."""
    a = 1.0 + sum(theta[i] * z ** -(i + 1) for i in range(na))
    return sum(theta[na + i] * z ** -(nk + i) for i in range(nb)) / a


def test_control_systems_have_the_response_of_the_model(
    model: ehsid.Identification, found: ehsid.Estimation
) -> None:
    z = np.exp(1j * np.linspace(0.01, 3.1, 50))
    for made, theta, orders in (
        (model.to_control(), model.result.chosen.model.theta, model.result.chosen.orders),
        (found.to_control(), found.result.theta, found.result.orders),
    ):
        assert isinstance(made, control.TransferFunction)
        expected = response(theta, orders.na, orders.nb, orders.nk, z)
        assert np.allclose(made(z), expected, rtol=1e-9, atol=0.0)
        assert made.dt is True


def test_control_systems_have_the_sampling_time() -> None:
    frame = pl.read_csv(CRANE)
    arrays = (frame["valve_opening"].to_numpy(), frame["oil_pressure"].to_numpy(), 0.05)
    assert ehsid.identify(arrays, **FAST).to_control().dt == 0.05
    assert ehsid.estimate(arrays, na=2, nb=2).to_control().dt == 0.05


def test_frames_have_the_signals(model: ehsid.Identification, found: ehsid.Estimation) -> None:
    half = model.to_polars()
    assert half.columns == ["sample", "measured", "one_step", "simulated"]
    assert half.height == model.result.simulated.index.size
    assert np.array_equal(half["measured"], model.result.one_step.measured)
    paths = found.to_pandas()
    assert len(paths) == 1024
    assert np.array_equal(paths["b2"], found.result.theta_path[:, 3])
    assert np.array_equal(paths["oil_pressure"], pl.read_csv(CRANE)["oil_pressure"])


def test_no_signal_is_lost_under_the_name_of_a_path() -> None:
    frame = pl.read_csv(CRANE)
    u, y = (frame[name].to_numpy() for name in NAMES.values())
    log = {"sample": u, "status": y}
    found = ehsid.estimate(log, input="sample", output="status", na=1, nb=1).to_polars()
    assert np.array_equal(found["sample"], np.arange(1024))
    assert np.array_equal(found["sample (signal)"], u)
    assert np.array_equal(found["status (signal)"], y)
    assert found["status"].dtype == pl.UInt8


@pytest.mark.slow
@pytest.mark.parametrize("what", [pytest.param("model", marks=pytest.mark.thorough), "found"])
def test_saved_files_are_those_of_the_command(
    what: str, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    result = request.getfixturevalue(what)
    stem = {"model": "identify", "found": "estimate"}[what]
    folder = result.save(tmp_path / "out")
    saved, expected = json.loads((folder / f"{stem}.json").read_text()), result.result.to_dict()
    assert {key: saved[key] for key in expected} == expected
    assert (folder / f"{stem}.png").stat().st_size > 10_000
    assert (folder / "identify_bode.png").exists() == (what == "model")


def test_summaries_say_what_the_commands_print(
    model: ehsid.Identification, found: ehsid.Estimation
) -> None:
    told = model.summary()
    assert model.result.reason in told
    assert model.result.whiteness.verdict in told
    assert "one-step %" in told
    told = found.summary()
    assert "95 % interval" in told
    assert f"one-step fit {found.result.one_step_fit_percent:.2f} %" in told


@pytest.mark.parametrize(
    ("call", "says"),
    [
        (lambda: ehsid.identify(CRANE), ["hydraulic_crane.csv", "command_v"]),
        (lambda: ehsid.identify(CRANE, input="a", output="a"), ["input='a'", "two columns"]),
        (lambda: ehsid.identify((np.ones(5), np.ones(5))), ["expected u, y, dt_s"]),
        (lambda: ehsid.identify(np.ones(5), np.ones(5)), ["2 arguments", "expected u, y, dt_s"]),
        (lambda: ehsid.estimate(np.ones(5), np.ones(5), "1 ms"), ["dt_s = '1 ms'", "seconds"]),
        (lambda: ehsid.identify((np.ones(9), np.ones(9), -1.0)), ["dt_s = -1", "above 0"]),
        (lambda: ehsid.identify((np.ones(9), np.ones(8), 1.0)), ["equal length"]),
        (lambda: ehsid.identify((np.ones(9), np.ones(9), 1.0)), ["arrays: ", "record longer"]),
        (lambda: ehsid.identify(CRANE, **NAMES, orders="5-2"), ["orders '5-2'", "such as 2-5"]),
        (lambda: ehsid.estimate(CRANE, **NAMES, forgetting="f-rati"), ["'f-rati'", "'f-ratio'"]),
        (lambda: ehsid.estimate(CRANE, **NAMES, forgetting=3), ["forgetting=3", "exponential"]),
        (lambda: ehsid.estimate(CRANE, **NAMES, forgetting=0.0), ["forgetting=0.0", "above 0"]),
        (lambda: ehsid.estimate(CRANE, **NAMES, forgetting=True), ["forgetting=True"]),
        (lambda: ehsid.estimate(CRANE, **NAMES, na=9), ["hydraulic_crane.csv: "]),
    ],
)
def test_errors_say_what_and_where(call: object, says: list[str]) -> None:
    with pytest.raises(ValueError) as caught:  # noqa: PT011 -- the texts are in the table
        call()  # type: ignore[operator]
    for text in says:
        assert text in str(caught.value)
    assert "--" not in str(caught.value)
