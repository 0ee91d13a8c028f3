# SPDX-License-Identifier: MIT
"""ServoBank is ServoEstimators side by side, bit for bit, whatever one of them measures."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest

import ehsid

FloatArray = npt.NDArray[np.float64]
AXES, COUNT, DT_S, HOSTILE = 4, 1500, 0.01, 1
PARTS = ("value", "half_width", "trusted", "reason")


def records() -> tuple[FloatArray, FloatArray]:
    """Returns commands and positions, shape (COUNT, AXES), of servos that differ.

    One of them measures NaN, infinity and 9999 in a third of its samples.
    """
    random = np.random.default_rng(7)
    command = np.repeat(random.uniform(-5.0, 5.0, (COUNT // 50, AXES)), 50, axis=0)
    velocity = np.zeros(AXES)
    position = np.zeros((COUNT, AXES))
    for k in range(1, COUNT):
        velocity += 0.2 * (np.linspace(0.02, 0.08, AXES) * command[k - 1] - velocity)
        position[k] = position[k - 1] + DT_S * velocity
    position += random.normal(0.0, 5e-6, position.shape)
    bad = random.random(COUNT) < 1 / 3
    position[bad, HOSTILE] = random.choice([np.nan, np.inf, -np.inf, 9999.0, 1e30], bad.sum())
    return command, position


def parts(told: ehsid.TrackedServos) -> dict[str, npt.NDArray[np.generic]]:
    return {
        f"{name}.{part}": getattr(getattr(told, name), part)
        for name in ("gain", "omega_n", "xi")
        for part in PARTS
    }


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("delay", [1, 3])
def test_a_bank_is_its_axes_bit_for_bit(dtype: str, delay: int) -> None:
    command, position = records()
    bank = ehsid.ServoBank(DT_S, AXES, delay=delay, dtype=dtype)
    run = bank.run(command, position)
    alone = [ehsid.ServoEstimator(DT_S, delay=delay, dtype=dtype) for _ in range(AXES)]
    for i, one in enumerate(alone):
        # As a view with strides: each axis of a numpy array is one.
        wanted = one.run(command[:, i], position[:, i])
        assert run.status[:, i].tobytes() == wanted.status.tobytes()
        for name, path in parts(run).items():
            assert path.shape == (COUNT, AXES)
            assert path[:, i].tobytes() == parts(wanted)[name].tobytes(), name
        assert bank[i].save() == one.save()
    assert ehsid.Status.invalid_input in run.status[:, HOSTILE]
    others = np.arange(AXES) != HOSTILE
    assert not np.isin(run.status[:, others], [ehsid.Status.invalid_input]).any()
    assert np.isfinite(run.gain.value[-1, others]).all()


def test_steps_and_what_is_told_are_those_of_a_run() -> None:
    command, position = records()
    run = ehsid.ServoBank(DT_S, AXES).run(command, position)
    bank = ehsid.ServoBank(DT_S, AXES)
    for k in range(COUNT):
        assert bank.step(command[k], position[k]).tobytes() == run.status[k].tobytes()
        for name, told in parts(bank.servo()).items():
            assert told.shape == (AXES,)
            assert told.tobytes() == parts(run)[name][k].tobytes(), (k, name)


def test_an_axis_of_the_bank_is_saved_and_restored_alone() -> None:
    command, position = records()
    bank = ehsid.ServoBank(DT_S, AXES)
    fresh = bank[0].save()
    bank.run(command, position)
    ran = bank[0].save()
    last = bank[-1]
    last.restore(ran)
    assert (bank[AXES - 1].save(), bank[0].save()) == (ran, ran)
    assert np.isfinite(bank.servo().gain.value[[0, -1]]).all()
    last.restore(fresh)
    assert np.isnan(bank.servo().gain.value[-1])
    del bank
    assert last.save() == fresh  # an axis that is held keeps its bank


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"axes": 0}, "axes"),
        ({"axes": -1}, "axes"),
        ({"dt_s": 0.0}, "dt_s and tolerance must be finite and > 0"),
        ({"delay": 21}, "delay"),
        ({"dtype": "int32"}, "dtype"),
    ],
)
def test_wrong_arguments_are_refused(arguments: dict[str, object], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        ehsid.ServoBank(**{"dt_s": DT_S, "axes": AXES, **arguments})  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("method", "command", "position", "words"),
    [
        ("run", (5, 4), (4, 4), "position"),
        ("run", (5, 3), (5, 3), "command"),
        ("run", (4,), (4,), "command"),
        ("step", (3,), (4,), "command"),
        ("step", (4,), (1, 4), "position"),
    ],
)
def test_signals_of_another_shape_are_refused_and_no_sample_is_taken(
    method: str, command: tuple[int, ...], position: tuple[int, ...], words: str
) -> None:
    bank = ehsid.ServoBank(DT_S, AXES)
    before = [bank[i].save() for i in range(AXES)]
    with pytest.raises(ValueError, match=words):
        getattr(bank, method)(np.zeros(command), np.zeros(position))
    assert [bank[i].save() for i in range(AXES)] == before
    with pytest.raises(IndexError, match=f"axis 4 of a bank of {AXES}"):
        bank[AXES]
