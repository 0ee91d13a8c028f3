# SPDX-License-Identifier: MIT
"""After hostile samples every policy learns from good ones again, and every output is finite."""

import hostile_samples
import numpy as np
import policies
import pytest
from hypothesis import given
from hypothesis import strategies as st

import ehsid

LAST = 200  # of the good samples: in them some must be taken
TAKEN = (ehsid.Status.ok, ehsid.Status.reset)


def after_hostile(
    made: ehsid.ArxEstimator, name: str, seed: int
) -> tuple[ehsid.Trajectory, np.ndarray]:
    """The whole run, and the status of each good sample."""
    u, y = hostile_samples.hostile_then_good(name, seed)
    with np.errstate(over="ignore"):  # 1e300 becomes infinite in float32
        path = made.run(u, y)
    return path, path.status[hostile_samples.HOSTILE :]


def assert_finite(made: ehsid.ArxEstimator, path: ehsid.Trajectory) -> None:
    """Innovations are NaN where no sample was estimated, by definition."""
    numbers = [path.theta, path.standard_deviation, path.forgetting_factor, path.residual_variance]
    estimated = np.isin(path.status, [*TAKEN, ehsid.Status.no_information])
    numbers += [path.innovation[estimated], made.P, made.covariance, made.gain]
    assert all(np.isfinite(values).all() for values in numbers)
    assert (path.standard_deviation >= 0.0).all()


@pytest.mark.slow
@pytest.mark.parametrize("reset", [True, False])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("policy", policies.NAMES)
def test_every_policy_learns_again(policy: str, dtype: str, reset: bool) -> None:
    for name in [*hostile_samples.CATALOGUE, "mixture"]:
        for seed in range(10) if name == "mixture" else range(1):
            options = {} if reset else {"reset": None}
            made = ehsid.ArxEstimator(
                3, 3, 1, forgetting=policies.PAIRS[policy].compiled, dtype=dtype, **options
            )
            path, status = after_hostile(made, name, seed)
            assert_finite(made, path)
            assert np.isin(status[-LAST:], TAKEN).any(), (name, seed)
            # The three samples behind the last one that was refused fill the regressor.
            assert not (status[10:] >= ehsid.Status.invalid_input).any(), (name, seed)


def test_hostile_samples_leave_nothing_to_learn_from_good_ones() -> None:
    """The tests above can fail: a good sample has a thousandth of what one step forgets."""
    u, y = hostile_samples.hostile_then_good("large", 0)
    made = ehsid.ArxEstimator(3, 3, 1, forgetting=ehsid.Constant(), reset=None, dtype="float64")
    made.run(u[: hostile_samples.HOSTILE], y[: hostile_samples.HOSTILE])
    phi = np.ones(6)
    assert phi @ made.P @ phi < 1e-3 * (1.0 - 0.99)


# Numbers at which products overflow or vanish, in float32 and in double.
EDGES = st.sampled_from(
    [
        *(5e-324, 1e-310, 2.3e-308, 1e-300, 1e-150, 1e-46, 1e-40, 1.2e-38, 1e-30, 1e-20, 1e-10),
        *(1e-3, 1.0, 1e3, 1e10, 1e19, 1e20, 1e30, 3e38, 1e40, 1e150, 1e300, 1.7e308),
    ]
)
SETTINGS = {
    "command_scale": EDGES,
    "position_scale": EDGES,
    "command_offset": EDGES,
    "position_offset": EDGES,
    "variance0": EDGES,
    "theta0": EDGES,
    "input_limit": EDGES,
    "information_margin": EDGES,
    "covariance_ceiling": EDGES,
    "noise_variance": EDGES,
    "tolerance": EDGES,
    "magnitude": EDGES,
    "floor": EDGES,
}


def with_settings(
    chosen: dict[str, float], forgetting: ehsid.Forgetting, dtype: str
) -> ehsid.ArxEstimator:
    """An estimator of order one; ValueError where a setting is refused."""

    def of(*names: str) -> dict[str, float]:
        return {name: chosen[name] for name in names if name in chosen}

    scaling = ("command_scale", "position_scale", "command_offset", "position_offset")
    start = {name: [chosen[name]] * 2 for name in ("theta0", "variance0") if name in chosen}
    made = ehsid.ArxEstimator(
        1,
        1,
        1,
        forgetting=forgetting,
        scaling=ehsid.Scaling(**of(*scaling)),
        rls=ehsid.RlsOptions(**of("information_margin", "covariance_ceiling")),
        reset=ehsid.RmseResetOptions(**of("floor")),
        convergence=ehsid.ConvergenceOptions(**of("tolerance", "magnitude")),
        dtype=dtype,
        **start,
        **of("input_limit"),
    )
    if "noise_variance" in chosen:
        made.seed([0.5, 0.5], np.eye(2), [1.0, 1.0], chosen["noise_variance"])
    return made


@st.composite
def extreme_policies(draw: st.DrawFn) -> ehsid.Forgetting:
    """Any policy with any of its settings at an edge; only what its ranges take."""
    info = draw(st.sampled_from(ehsid.policies()))
    chosen = {setting.name: draw(EDGES) for setting in info.settings if draw(st.booleans())}
    try:
        made: ehsid.Forgetting = info.policy(**chosen)
    except ValueError:
        made = info.policy()
    return made


@given(
    chosen=st.fixed_dictionaries({}, optional=SETTINGS),
    forgetting=extreme_policies(),
    dtype=st.sampled_from(["float32", "float64"]),
    seed=st.integers(0, 1000),
)
def test_extreme_settings_are_refused_or_harmless(
    chosen: dict[str, float], forgetting: ehsid.Forgetting, dtype: str, seed: int
) -> None:
    try:
        made = with_settings(chosen, forgetting, dtype)
    except ValueError:
        return
    u, y = hostile_samples.mixture(np.random.default_rng(seed), 300)
    scale = [chosen.get(name, 1.0) for name in ("command_scale", "position_scale")]
    with np.errstate(over="ignore", invalid="ignore"):
        path = made.run(u * scale[0], y * scale[1])
    assert_finite(made, path)


MASKED = np.ma.masked_array([1.0, 2.0, 3.0], mask=[False, True, False])
MATRIX = np.ma.masked_array(np.eye(6))


@pytest.mark.parametrize(
    "call",
    [
        lambda: ehsid.ArxEstimator(1, 1, 1).run(MASKED, np.ones(3)),
        lambda: ehsid.ArxEstimator(1, 1, 1).run(np.ones(3), MASKED),
        lambda: ehsid.Rls(3).update(MASKED, 1.0),
        lambda: ehsid.Rls(3).predict(MASKED),
        lambda: ehsid.Rls(3).run(np.ones((3, 3)), MASKED),
        lambda: ehsid.Rls(6).start_from_covariance(np.zeros(6), MATRIX),
        lambda: ehsid.identify_servo(np.ones(6), MATRIX, 1e-3),
    ],
)
def test_masked_arrays_are_refused(call) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(TypeError, match=r"is a masked array.*filled\(numpy\.nan\)"):
        call()
