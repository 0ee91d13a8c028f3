# SPDX-License-Identifier: MIT
"""Configurations and their headers: the same numbers on both sides, and clear refusals."""

import hashlib
import re
from dataclasses import replace
from pathlib import Path

import make_headers
import numpy as np
import numpy.typing as npt
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st
from sources import ROOT
from typer.testing import CliRunner

import ehsid
from ehsid.harness.cli import cli
from ehsid.harness.firmware import (
    EstimatorConfiguration,
    GoldenTrace,
    Seed,
    check_name,
    configure_from_record,
    float32_literal,
    liveliest,
    render_c_header,
    render_header,
)
from ehsid.harness.models.identification import (
    ArxOrders,
    IdentificationError,
    IoData,
    fit_arx,
    identify,
)

EXPORT = ROOT / "tests" / "export"
CRANE = ROOT / "examples" / "data" / "hydraulic_crane.csv"
COLUMNS = ["--input", "valve_opening", "--output", "oil_pressure"]


def bits(values: npt.ArrayLike) -> bytes:
    return np.asarray(values, dtype=np.float32).tobytes()


def number(literal: str) -> float:
    return float.fromhex(literal.strip().removesuffix("F"))


# Headers


@given(st.floats(width=32, allow_nan=False, allow_infinity=False))
def test_literals_are_the_float32_to_the_bit(value: float) -> None:
    literal = float32_literal(value)
    # Digits on both sides of the binary exponent, as the grammar of C++17 wants them.
    assert re.fullmatch(r"-?0x[01](\.[0-9a-f]{1,6})?p[+-]\d+F", literal)
    assert bits(number(literal)) == bits(value)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_literals_round_as_the_binding_does(value: float) -> None:
    limit = float(np.finfo(np.float32).max)
    if abs(value) > limit * (1.0 + 2.0**-25):
        with pytest.raises(ValueError, match="not finite in float32"):
            float32_literal(value)
    elif abs(value) <= limit:
        assert bits(number(float32_literal(value))) == bits(value)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -1e39])
def test_numbers_beyond_float32_are_refused(value: float) -> None:
    with pytest.raises(ValueError, match="not finite in float32"):
        float32_literal(value)


def array(text: str, name: str) -> list[float]:
    """All literals of a constexpr array."""
    body = re.search(rf" {name} = \{{(.*?)^\}}+;", text, flags=re.DOTALL | re.MULTILINE)
    assert body is not None, name
    return [number(literal) for literal in re.findall(r"-?0x[0-9a-f.]+p[+-]\d+F", body[1])]


def read_back(text: str) -> EstimatorConfiguration:
    """The configuration that a header holds, read without the code that wrote it."""
    kind = re.search(r"ArxEstimator<float, (\d), (\d), (\d+), ehsid::(\w+)<[^>]*>(, true)?>", text)
    assert kind is not None
    na, nb, nk = (int(digits) for digits in kind.groups()[:3])
    orders = ArxOrders(na, nb, nk, offset=kind[5] is not None)
    n = orders.n_parameters
    given_options: dict[str, dict[str, float]] = {}
    for group, member, value in re.findall(r"options\.(\w+)\.(\w+) = ([^;]+);", text):
        # A count is written as an integer.
        parsed = number(value) if value.endswith("F") else int(value)
        given_options.setdefault(group, {})[member] = parsed
    policy = {
        name.replace("lambda", "lambda_") if name == "lambda" else name: value
        for name, value in given_options["forgetting"].items()
    }
    forgetting = getattr(ehsid, kind[4])(**policy)
    factors, u = array(text, "kFactors0"), np.eye(n)
    above = iter(factors[n:])
    for j in range(n):
        for i in range(j):
            u[i, j] = next(above)
    one = {
        name: number(found[1])
        for name in ("kNoiseVariance = ", "Constant(Estimator::kN, ", "input_limit = ")
        if (found := re.search(re.escape(name) + r"([^;)]+F)", text))
    }
    theta = np.array(array(text, "kTheta0"))
    variance = one["kNoiseVariance = "]
    never = "options.reset_enabled = false;" in text
    assert never == ("reset" not in given_options)
    return EstimatorConfiguration(
        orders,
        scaling=ehsid.Scaling(**given_options["scaling"]),
        forgetting=forgetting,
        rls=ehsid.RlsOptions(**given_options["rls"]),
        reset=None if never else ehsid.RmseResetOptions(**given_options["reset"]),  # type: ignore[arg-type]
        convergence=ehsid.ConvergenceOptions(**given_options["convergence"]),  # type: ignore[arg-type]
        variance0=one["Constant(Estimator::kN, "],
        input_limit=one["input_limit = "],
        seed=Seed(theta, u, np.array(factors[:n]), variance),
    )


@st.composite
def configurations(draw: st.DrawFn) -> EstimatorConfiguration:
    orders = ArxOrders(
        draw(st.integers(1, 6)),
        draw(st.integers(1, 6)),
        draw(st.integers(0, 20)),
        offset=draw(st.booleans()),
    )
    n = orders.n_parameters
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    short = float(rng.uniform(1.0, 20.0))
    release = float(rng.uniform(1.0, 3.0))
    return EstimatorConfiguration(
        orders,
        scaling=ehsid.Scaling(
            command_scale=10.0 ** rng.uniform(-3, 3),
            position_scale=10.0 ** rng.uniform(-3, 3),
            command_offset=rng.normal(),
            position_offset=rng.normal(),
        ),
        forgetting=draw(policies.ANY).compiled,
        rls=ehsid.RlsOptions(
            information_margin=rng.uniform(-1, 3), covariance_ceiling=rng.uniform(0.5, 2)
        ),
        reset=draw(
            st.sampled_from(
                [
                    None,
                    ehsid.RmseResetOptions(
                        short_window=short,
                        long_window=short * rng.uniform(2.0, 10.0),
                        trigger_ratio=release * rng.uniform(1.1, 3.0),
                        release_ratio=release,
                        cool_down=int(rng.integers(0, 100)),
                        floor=10.0 ** rng.uniform(-6, -3),
                    ),
                ]
            )
        ),
        convergence=ehsid.ConvergenceOptions(
            tolerance=rng.uniform(0.01, 1), magnitude=rng.uniform(0.01, 1), hold=7
        ),
        variance0=10.0 ** rng.uniform(2, 8),
        input_limit=10.0 ** rng.uniform(1, 6),
        seed=Seed(
            rng.normal(size=n),
            np.triu(rng.normal(size=(n, n)), 1) + np.eye(n),
            10.0 ** rng.uniform(-4, 2, size=n),
            10.0 ** rng.uniform(-8, -1),
        ),
    )


@pytest.mark.slow
@given(configuration=configurations(), seed=st.integers(0, 1000))
def test_a_header_holds_the_estimator_to_the_bit(
    configuration: EstimatorConfiguration, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    scaling = configuration.scaling
    u = scaling.command_offset + scaling.command_scale * rng.normal(size=200)
    y = scaling.position_offset + scaling.position_scale * rng.normal(size=200)
    trace = GoldenTrace.of(configuration, u, y)
    text = render_header(configuration, trace, name="servo")
    assert max(len(line) for line in text.splitlines()) <= 120
    again = read_back(text).estimator()
    estimator = configuration.estimator()
    assert again.save() == estimator.save()
    for k, (command, position) in enumerate(zip(trace.command, trace.position, strict=True)):
        assert again.step(command, position) == estimator.step(command, position)
        assert bits(estimator.innovation) == bits(trace.innovation[k])
    assert again.save() == estimator.save()
    assert bits(estimator.theta_hat) == bits(trace.theta)
    samples = np.array(array(text, "kTrace")).reshape(-1, 3)
    assert bits(samples[:, 0]) == bits(trace.command)
    assert bits(samples[:, 1]) == bits(trace.position)
    assert bits(samples[:, 2]) == bits(trace.innovation)
    assert bits(array(text, "kTraceTheta")) == bits(trace.theta)


def test_without_a_seed_the_header_has_none() -> None:
    configuration = EstimatorConfiguration(ArxOrders(1, 1, 1))
    trace = GoldenTrace.of(configuration, [1.0, -1.0, 1.0], [0.0, 0.1, 0.0])
    text = render_header(configuration, trace, name="servo")
    assert "seed" not in text
    assert "kTheta0" not in text
    assert "return estimator.configure(options);" in text


LITERAL = r"-?0x[0-9a-f.]+p[+-]\d+F"


@pytest.mark.slow
@given(configuration=configurations())
def test_the_c_header_holds_the_numbers_of_the_other(configuration: EstimatorConfiguration) -> None:
    trace = GoldenTrace.of(configuration, [1.0], [0.0])
    settings_in_cpp = render_header(configuration, trace, name="servo").split("struct TraceSample")
    text = render_c_header(configuration, name="servo")
    assert max(len(line) for line in text.splitlines()) <= 120
    wanted = re.findall(LITERAL, settings_in_cpp[0])
    found = re.findall(LITERAL, text)
    if configuration.reset is None:  # in C its members stand there all the same
        assert ".reset_enabled = false" in text
        for name in ("short_window", "long_window", "trigger_ratio", "release_ratio", "floor"):
            found.remove(float32_literal(getattr(ehsid.RmseResetOptions(), name)))
    assert sorted(found) == sorted(wanted)
    orders = configuration.orders
    assert f", {orders.n_parameters})," in text
    for name in ("na", "nb", "nk"):
        assert f".{name} = {getattr(orders, name)}," in text


def test_comments_of_the_c_header_cannot_end_either() -> None:
    configuration = EstimatorConfiguration(ArxOrders(1, 1, 1))
    text = render_c_header(configuration, name="servo", provenance=["a */ b", "c\n#error no"])
    assert " * a *_ b\n * c_#error no\n" in text
    assert ".seed = NULL," in text


def test_comments_cannot_end_their_line() -> None:
    configuration = EstimatorConfiguration(ArxOrders(1, 1, 1))
    trace = GoldenTrace.of(configuration, [1.0], [0.0])
    text = render_header(
        configuration, trace, name="servo", provenance=["a\n#error no", "b\u2028c", "d\\"]
    )
    assert "// a_#error no\n// b_c\n// d_\n" in text


@pytest.mark.parametrize("name", ["servo", "Servo_2", "a", "z9"])
def test_identifiers_are_names(name: str) -> None:
    assert check_name(name) == name


@pytest.mark.parametrize(
    "name", ["", "2servo", "a b", "a::b", "a__b", "_a", "é", "a\n", "class", "co_await", "std"]
)
def test_other_names_are_refused(name: str) -> None:
    with pytest.raises(ValueError, match=r"identifier|keyword|belongs"):
        check_name(name)


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    [f"{case}.{kind}" for case in make_headers.CASES for kind in ("hpp", "h")]
    + [
        "servo_estimator.hpp",
        "servo_estimator.h",
        make_headers.TRAJECTORIES,
        make_headers.CASE_LIST,
    ],
)
def test_committed_files_are_those_of_the_script(name: str) -> None:
    assert (EXPORT / name).read_text(encoding="utf-8") == make_headers.files()[name], (
        "make them anew: python tests/export/make_headers.py"
    )


def test_committed_headers_cover_every_policy() -> None:
    assert {type(forgetting) for _, forgetting in make_headers.CASES.values()} == set(
        ehsid.Forgetting.__args__
    )
    assert any(orders.offset for orders, _ in make_headers.CASES.values())


# Seeds


def crane() -> IoData:
    return make_headers.data()


@given(n=st.integers(1, 13), decades=st.floats(0.0, 10.0), seed=st.integers(0, 1000))
def test_factors_are_the_covariance(n: int, decades: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    vectors, _ = np.linalg.qr(rng.normal(size=(n, n)))
    p = (vectors * 10.0 ** rng.uniform(-decades, 0.0, size=n)) @ vectors.T
    p = 0.5 * (p + p.T)
    made = Seed.from_covariance(np.zeros(n), p, 1.0)
    assert (np.tril(made.u, -1) == 0.0).all()
    assert (np.diag(made.u) == 1.0).all()
    # Backward stable: error of the order n eps |P|.
    size = np.sqrt(np.outer(np.diag(p), np.diag(p)))
    error = (made.u * made.d) @ made.u.T - p
    assert np.abs(error / size).max() < 10 * n * np.finfo(float).eps
    np.testing.assert_allclose(made.variances, np.diag(p), rtol=1e-12)


def test_a_singular_covariance_is_named() -> None:
    with pytest.raises(IdentificationError, match="not positive definite"):
        Seed.from_covariance(np.zeros(2), np.zeros((2, 2)), 1.0)


@pytest.mark.parametrize("offset", [False, True])
def test_the_start_is_the_offline_model_in_the_units_of_the_signals(offset: bool) -> None:
    orders = ArxOrders(3, 2, 1, offset=offset)
    export = configure_from_record(crane(), orders, forgetting=ehsid.FRatio(), inflation=7.0)
    scaling, seed = export.configuration.scaling, export.configuration.seed
    assert seed is not None
    # The same fit on unscaled signals about the same offsets.
    raw = replace(
        crane(),
        u=crane().u - scaling.command_offset,
        y=crane().y - scaling.position_offset,
    )
    model = fit_arx(raw, orders)
    np.testing.assert_allclose(seed.theta, model.theta, rtol=1e-8, atol=1e-12)
    np.testing.assert_allclose(seed.noise_variance, model.noise_variance, rtol=1e-9)
    estimator = export.configuration.estimator()
    # float32: U rounded to 6e-8, its entries up to 3 here, and n of them in a sum.
    np.testing.assert_allclose(estimator.covariance, 7.0 * model.covariance, rtol=1e-4, atol=1e-9)
    np.testing.assert_allclose(estimator.theta_hat, model.theta, rtol=3e-7)
    assert export.counts_for == pytest.approx(model.n_rows / 7.0)


def test_long_records_count_for_a_hundred_samples() -> None:
    rng = np.random.default_rng(1)
    u = rng.normal(size=20_000)
    y = np.convolve(u, [0.0, 1.0, 0.5])[: u.size] + 0.1 * rng.normal(size=u.size)
    data = IoData.from_arrays(u, y)
    export = configure_from_record(data, ArxOrders(1, 2, 1), forgetting=ehsid.FRatio())
    assert export.counts_for == pytest.approx(100.0)
    short = configure_from_record(
        data.split(0.02)[0], ArxOrders(1, 2, 1), forgetting=ehsid.FRatio()
    )
    assert short.inflation == 10.0


def fast_sampled() -> IoData:
    """Position of a sluggish plant, sampled so fast that float32 holds no P of three outputs."""
    rng = np.random.default_rng(2)
    u = np.repeat(rng.choice([-1.0, 1.0], 100), 40)
    speed, y = 0.0, np.zeros(u.size)
    for k in range(1, u.size):
        speed += 1e-2 * (u[k - 1] - speed)
        y[k] = y[k - 1] + 1e-3 * speed
    return IoData.from_arrays(u, y + 1e-6 * rng.normal(size=y.size))


def test_ill_conditioned_models_start_too_and_a_reset_is_vaguer_than_they() -> None:
    export = configure_from_record(fast_sampled(), ArxOrders(3, 3, 1), forgetting=ehsid.FRatio())
    seed = export.configuration.seed
    assert seed is not None
    p = (seed.u * seed.d) @ seed.u.T
    with pytest.raises(ValueError, match="positive definite"):
        ehsid.Rls(6, dtype="float32").start_from_covariance(seed.theta, p)
    assert export.configuration.variance0 >= 100.0 * np.diag(p).max() * (1.0 - 1e-12)
    estimator = export.configuration.estimator()
    np.testing.assert_allclose(np.diag(estimator.P), np.diag(p), rtol=1e-5)
    trajectory = estimator.run(
        *(x.astype(np.float32) for x in (fast_sampled().u, fast_sampled().y))
    )
    assert not [status for status in trajectory.status if ehsid.is_error(ehsid.Status(status))]


@pytest.mark.parametrize("inflation", [0.5, 0.0, -1.0, float("nan"), float("inf")])
def test_inflation_is_at_least_one(inflation: float) -> None:
    with pytest.raises(ValueError, match="at least 1"):
        configure_from_record(
            crane(), ArxOrders(1, 1, 1), forgetting=ehsid.FRatio(), inflation=inflation
        )


def test_a_record_without_residuals_is_refused() -> None:
    data = IoData.from_arrays([0.0, 1.0, 0.0, 2.0, 1.0], [0.0, 0.0, 3.0, 1.0, 2.0])
    with pytest.raises(IdentificationError, match="no residual"):
        configure_from_record(data, ArxOrders(2, 1, 1), forgetting=ehsid.FRatio())


def test_the_trace_is_the_liveliest_stretch() -> None:
    rng = np.random.default_rng(3)
    u, y = np.zeros((2, 400))
    u[200:264], y[200:264] = rng.choice([-1.0, 1.0], 64), rng.normal(size=64)
    data = IoData.from_arrays(u, y, segments=[slice(0, 20), slice(30, 400)])
    found_u, found_y = liveliest(data)
    assert found_u.size == 64
    assert np.count_nonzero(found_u) > 60
    assert np.count_nonzero(found_y) > 60
    short, _ = liveliest(IoData.from_arrays(u[190:220], y[190:220]), 64)
    assert short.size == 30


# Command


def run(*arguments: str) -> tuple[int, str, str]:
    outcome = CliRunner().invoke(cli, ["export", *arguments])
    return outcome.exit_code, outcome.stdout, outcome.stderr


def test_command_writes_the_header_whole(tmp_path: Path) -> None:
    out = tmp_path / "crane.hpp"
    code, printed, _ = run(str(CRANE), *COLUMNS, "--na", "2", "--name", "crane", "--out", str(out))
    assert code == 0
    assert "na = 2, nb = 3, nk = 1" in printed
    assert sorted(path.name for path in tmp_path.iterdir()) == [".ehsid", "crane.hpp"]
    text = out.read_text(encoding="utf-8")
    assert "namespace crane {" in text
    assert hashlib.sha256(CRANE.read_bytes()).hexdigest() in text
    assert CRANE.name in text
    assert f"ehsid {ehsid.__version__}" in text
    assert str(ROOT) not in text
    assert str(CRANE.parent) not in text
    expected = configure_from_record(
        crane(), ArxOrders(2, 3, 1, offset=True), forgetting=ehsid.FRatio()
    )
    assert read_back(text).estimator().save() == expected.configuration.estimator().save()


def test_command_writes_c(tmp_path: Path) -> None:
    out = tmp_path / "crane.h"
    code, printed, _ = run(str(CRANE), *COLUMNS, "--c", "--name", "crane", "--out", str(out))
    assert code == 0
    assert "no self-test" in printed
    text = out.read_text(encoding="utf-8")
    assert ".kernel = EHSID_KERNEL(f_ratio, 7)," in text
    assert "static const ehsid_configuration crane_configuration = {" in text
    assert hashlib.sha256(CRANE.read_bytes()).hexdigest() in text


def test_command_lets_identification_choose(tmp_path: Path) -> None:
    out = tmp_path / "crane.hpp"
    code, _, _ = run(str(CRANE), *COLUMNS, "--identify", "--offset", "--out", str(out))
    assert code == 0
    chosen = identify(crane()).chosen.orders
    assert read_back(out.read_text()).orders == chosen


@pytest.mark.parametrize(
    ("policy", "forgets"),
    [("exponential", True), ("constant", True), ("error-driven", True), ("f-ratio", False)],
)
def test_command_notes_that_a_policy_forgets_the_start(
    policy: str, forgets: bool, tmp_path: Path
) -> None:
    out = str(tmp_path / "x.hpp")
    code, _, notes = run(str(CRANE), *COLUMNS, "--forgetting", policy, "--out", out)
    assert code == 0
    assert ("forgets from the first sample" in notes) == forgets
