# SPDX-License-Identifier: MIT
"""After hostile samples every policy learns from good ones again, and every output is finite."""

import hostile_samples
import numpy as np
import policies
import pytest

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
