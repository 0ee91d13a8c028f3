# SPDX-License-Identifier: MIT
"""Python objects that the functions of the package cannot use."""

from __future__ import annotations

import numpy as np
from bad_input.case import Case, Outcome
from bad_input.inputs import BENCH

import ehsid
from ehsid.harness.diagnosis import diagnose
from ehsid.harness.firmware import EstimatorConfiguration, configure_from_record
from ehsid.harness.models.estimation import estimate
from ehsid.harness.models.identification import ArxOrders, IoData, fit_arx, identify
from ehsid.harness.records import make_record, read_record, write_record
from ehsid.harness.rigs import parse_rig
from ehsid.harness.signals.excitation import chirp, odd_multisine, prbs, random_steps, triangle
from ehsid.harness.signals.simulation import simulate

TITLE = "Python arrays and values"
ABOUT = (
    "`rls` is `ehsid.Rls(3)`, `servo` is `ehsid.ArxEstimator(2, 2, 1)`, `u` and `y` are vectors "
    "of 100 numbers, and `rig` is the rig of the examples. A refused call changes nothing."
)
U = np.sin(np.arange(100.0))
Y = np.cumsum(U)
FUNCTIONS = (
    *(diagnose, EstimatorConfiguration, configure_from_record, estimate, ArxOrders, IoData),
    *(fit_arx, identify, make_record, read_record, write_record, parse_rig, simulate),
    *(chirp, odd_multisine, prbs, random_steps, triangle, np.diag, np.eye, np.ones),
)
NAMES = {
    **{function.__name__: function for function in FUNCTIONS},
    "ehsid": ehsid,
    "nan": float("nan"),
    "inf": float("inf"),
    "u": U,
    "y": Y,
    "masked": np.ma.masked_array(U, mask=np.arange(100) == 5),
    "dates": np.arange("2024-01-01", "2024-04-10", dtype="datetime64[D]"),
    "data": IoData.from_arrays(U, Y),
    "short": IoData.from_arrays(U[:10], Y[:10]),
    "record": make_record({"u": [1.0, 2.0]}),
    "rig": parse_rig(BENCH),
    "rng": np.random.default_rng(1),
}


def call(wrong: str, shown: str, kind: type[Exception] = ValueError) -> Case:
    """A call that must raise an exception of this kind, or of one that is derived from it."""

    def outcome() -> Outcome:
        rls, servo = ehsid.Rls(3), ehsid.ArxEstimator(2, 2, 1)
        rls.run(np.eye(3), np.arange(3.0))
        servo.run(U, Y)
        before = rls.save(), servo.save()
        try:
            eval(shown, {**NAMES, "rls": rls, "servo": servo})
        except kind as error:
            assert (rls.save(), servo.save()) == before
            first, *more = str(error).splitlines()
            return Outcome(kind.__name__, first + (" ..." if more else ""))
        return Outcome("nothing", "")

    return Case(wrong, shown, outcome, kind.__name__, {})


CASES = (
    call("a regressor that is too short", "rls.update([1, 2], 1.0)"),
    call("a matrix for a regressor", "rls.update(eye(3), 1.0)"),
    call("text for numbers", "rls.update(['a', 'b', 'c'], 1.0)", TypeError),
    call("complex numbers", "rls.update([1j, 0, 0], 1.0)", TypeError),
    call("a masked regressor", "rls.update(masked[4:7], 1.0)", TypeError),
    call("text for the output", "rls.update([1, 2, 3], 'x')", TypeError),
    call("regressors that are too short", "rls.run(ones((4, 2)), ones(4))"),
    call("outputs of another number", "rls.run(ones((4, 3)), ones(5))"),
    call("a vector for regressors", "rls.run(ones(3), ones(3))"),
    call("complex outputs", "rls.run(ones((4, 3)), [1j] * 4)", TypeError),
    call("a matrix for a regressor", "rls.predict([[1, 2, 3]])"),
    call("columns of unequal lengths", "servo.run(u, y[:50])"),
    call("a matrix for a column", "servo.run(u.reshape(10, 10), y)"),
    call("the name of a file for an array", "servo.run('record.csv', y)", TypeError),
    call("None for numbers", "servo.run([None] * 100, y)", TypeError),
    call("a masked column", "servo.run(masked, y)", TypeError),
    call("dates for numbers", "servo.run(dates, y)", TypeError),
    call("None for a sample", "servo.step(None, 1.0)", TypeError),
    call("text for a snapshot", "servo.restore('text')", TypeError),
    call("an empty snapshot", "servo.restore(b'')"),
    call("a snapshot cut by one byte", "servo.restore(servo.save()[:-1])"),
    call("the snapshot of something else", "servo.restore(rls.save())"),
    call("a covariance of another size", "rls.start_from_covariance([0] * 3, eye(2))"),
    call("a covariance of rank one", "rls.start_from_covariance([0] * 3, ones((3, 3)))"),
    call("start values that are not numbers", "rls.start_from_covariance([0, nan, 0], eye(3))"),
    call("a covariance without rows", "rls.start_from_covariance([0] * 3, ones((0, 3)))"),
    call("a vector for a covariance", "rls.start_from_covariance([0] * 3, ones(3))"),
    call("a variance below 0", "rls.start_from_covariance([0] * 3, diag([1, -1, 1]))"),
    call(
        "a variance that is not a number", "rls.start_from_covariance([0] * 3, diag([1, nan, 1]))"
    ),
    call("too few start values", "rls.start_from_covariance([0] * 2, eye(3))"),
    call("no parameters", "ehsid.Rls(0)"),
    call("14 parameters", "ehsid.Rls(14)"),
    call("a number of parameters that no integer holds", "ehsid.Rls(10**30)", TypeError),
    call("a fraction of a parameter", "ehsid.Rls(2.5)", TypeError),
    call("a precision that there is not", "ehsid.Rls(2, dtype='float16')"),
    call("whole numbers for a precision", "ehsid.Rls(2, dtype=int)"),
    call("a precision that is no type", "ehsid.ArxEstimator(1, 1, 1, dtype='flat')"),
    call("too few start values", "ehsid.Rls(2, theta0=[1])"),
    call("start values that are not numbers", "ehsid.Rls(2, theta0=[1, nan])"),
    call("a variance of zero", "ehsid.Rls(2, variance0=[1, 0])"),
    call("too many variances", "ehsid.Rls(2, variance0=[1, 1, 1])"),
    call(
        "a variance that float32 rounds to zero", "ehsid.Rls(1, variance0=[1e-60], dtype='float32')"
    ),
    call("an order of 7", "ehsid.ArxEstimator(7, 1, 1)"),
    call("an order of 0", "ehsid.ArxEstimator(0, 1, 1)"),
    call("an order of 0 of the command", "ehsid.ArxEstimator(1, 0, 1)"),
    call("an order of 7 of the command", "ehsid.ArxEstimator(1, 7, 1)"),
    call("a delay below 0", "ehsid.ArxEstimator(1, 1, -1)"),
    call("a delay of 21 samples", "ehsid.ArxEstimator(1, 1, 21)"),
    call("a limit of zero", "ehsid.ArxEstimator(1, 1, 1, input_limit=0)"),
    call("a factor above 1", "ehsid.Constant(1.5)"),
    call("a factor that is not a number", "ehsid.Exponential(nan)"),
    call("a scale of zero", "ehsid.Scaling(position_scale=0)"),
    call("no columns", "make_record({})"),
    call("the time alone", "make_record({'time_s': [0, 1]})"),
    call("a number for a column", "make_record({'u': 3.0})"),
    call("NaN in a column", "make_record({'u': [1, nan, 2]})"),
    call("a masked column", "make_record({'u': masked})"),
    call("columns of unequal lengths", "make_record({'u': [1, 2], 'y': [1, 2, 3]})"),
    call("text for numbers", "make_record({'u': ['1', '2']})"),
    call("one time twice", "make_record({'time_s': [0, 0, 1], 'u': [1, 2, 3]})"),
    call("a zero byte in a path", "read_record('\\0.csv')"),
    call("a folder that is not there", "write_record(record, 'nowhere/r.csv')"),
    call(
        "a name that MATLAB does not allow", "write_record(make_record({'a b': [1, 2]}), 'r.mat')"
    ),
    call("columns of unequal lengths", "IoData.from_arrays(u, y[:50])"),
    call("a masked column", "IoData.from_arrays(masked, y)"),
    call("NaN in a column", "IoData.from_arrays(u, [nan] * 100)"),
    call("no orders", "identify(data, orders=[])"),
    call("an order of 0", "identify(data, orders=[0], delays=[1])"),
    call("an input that is zero", "fit_arx(IoData.from_arrays(0 * u, y), ArxOrders(2, 2, 1))"),
    call("an order below 0", "ArxOrders(-1, 2, 1)"),
    call(
        "too few samples",
        "estimate(short, ArxOrders(3, 3, 1), forgetting=ehsid.Constant())",
    ),
    call("an order of 9", "EstimatorConfiguration(ArxOrders(9, 1, 1)).estimator()"),
    call(
        "an inflation that is not a number",
        "configure_from_record(data, ArxOrders(3, 3, 1), forgetting=ehsid.FRatio(), inflation=nan)",
    ),
    call("a command that is not a number", "simulate(rig, [nan, 1, 2], dt_s=1e-3)"),
    call("a masked command", "simulate(rig, masked, dt_s=1e-3)"),
    call("a sampling time of zero", "simulate(rig, u, dt_s=0)"),
    call("an infinite sampling time", "simulate(rig, u, dt_s=inf)"),
    call("a start outside the stroke", "simulate(rig, u, dt_s=1e-3, position0_m=9)"),
    call("a value that the rig does not have", "rig.with_values({'load.mass': 1})"),
    call("a number for the plant", "parse_rig('plant = 3')"),
    call("no records", "diagnose([], rig)"),
    call("a hold of 0 samples", "prbs(1, amplitude=1, hold=0)"),
    call("a band upside down", "chirp(100, 1e-3, amplitude=1, band_hz=(5, 1))"),
    call(
        "a band beyond half the sampling rate",
        "odd_multisine(100, 1e-3, band_hz=(1, 900), peak=1, rng=rng)",
    ),
    call("fewer than no samples", "random_steps(-5, amplitude=1, hold=(1, 2), rng=rng)"),
    call("an amplitude that is not a number", "triangle(100, 1e-3, amplitude=nan, period_s=1)"),
)
