# SPDX-License-Identifier: MIT
"""Python objects that the functions of the package cannot use."""

from __future__ import annotations

from collections.abc import Callable

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
NAN, INF = float("nan"), float("inf")
U = np.sin(np.arange(100.0))
Y = np.cumsum(U)
MASKED = np.ma.masked_array(U, mask=np.arange(100) == 5)
RNG = np.random.default_rng(1)
DATA = IoData.from_arrays(U, Y)
RIG = parse_rig(BENCH)


def call(
    shown: str,
    run: Callable[[], object],
    wrong: str,
    *says: str,
    kind: type[Exception] = ValueError,
) -> Case:
    """A call that must raise an exception of this kind, or of one that is derived from it."""

    def outcome() -> Outcome:
        try:
            run()
        except kind as error:
            first, *more = str(error).splitlines()
            return Outcome(kind.__name__, first + (" ..." if more else ""))
        return Outcome("nothing", "")

    return Case(wrong, shown, outcome, kind.__name__, says, {})


def rls() -> ehsid.Rls:
    return ehsid.Rls(3)


def servo() -> ehsid.ArxEstimator:
    return ehsid.ArxEstimator(2, 2, 1)


CASES = (
    call(
        "rls.update([1, 2], 1.0)",
        lambda: rls().update([1.0, 2.0], 1.0),
        "a regressor that is too short",
        "phi",
        "(3,)",
    ),
    call(
        "rls.update(eye(3), 1.0)",
        lambda: rls().update(np.eye(3), 1.0),
        "a matrix for a regressor",
        "phi",
        "(3, 3)",
    ),
    call(
        "rls.update(['a', 'b', 'c'], 1.0)",
        lambda: rls().update(["a", "b", "c"], 1.0),
        "text for numbers",
        "phi must hold real numbers",
        kind=TypeError,
    ),
    call(
        "rls.update([1j, 0, 0], 1.0)",
        lambda: rls().update([1j, 0, 0], 1.0),
        "complex numbers",
        "phi",
        "complex128",
        kind=TypeError,
    ),
    call(
        "rls.update(masked, 1.0)",
        lambda: rls().update(MASKED[4:7], 1.0),
        "a masked regressor",
        "phi",
        "masked",
        kind=TypeError,
    ),
    call(
        "rls.update([1, 2, 3], 'x')",
        lambda: rls().update([1.0, 2.0, 3.0], "x"),
        "text for the output",
        "update",
        kind=TypeError,
    ),
    call(
        "rls.run(ones((4, 2)), ones(4))",
        lambda: rls().run(np.ones((4, 2)), np.ones(4)),
        "regressors that are too short",
        "phi",
        "(N, 3)",
    ),
    call(
        "rls.run(ones((4, 3)), ones(5))",
        lambda: rls().run(np.ones((4, 3)), np.ones(5)),
        "outputs of another number",
        "y",
        "(4,)",
    ),
    call(
        "servo.run(u, y[:50])",
        lambda: servo().run(U, Y[:50]),
        "columns of unequal lengths",
        "y",
        "(100,)",
    ),
    call(
        "servo.run(u.reshape(10, 10), y)",
        lambda: servo().run(U.reshape(10, 10), Y),
        "a matrix for a column",
        "u",
        "(N,)",
    ),
    call(
        "servo.run('record.csv', y)",
        lambda: servo().run("record.csv", Y),
        "the name of a file for an array",
        "u must hold real numbers",
        kind=TypeError,
    ),
    call(
        "servo.run([None] * 100, y)",
        lambda: servo().run([None] * 100, Y),
        "None for numbers",
        "u",
        "object",
        kind=TypeError,
    ),
    call(
        "servo.run(masked, y)",
        lambda: servo().run(MASKED, Y),
        "a masked column",
        "u",
        "masked",
        kind=TypeError,
    ),
    call(
        "servo.run(dates, y)",
        lambda: servo().run(np.arange("2024-01-01", "2024-04-10", dtype="datetime64[D]"), Y),
        "dates for numbers",
        "u",
        kind=TypeError,
    ),
    call(
        "servo.step(None, 1.0)",
        lambda: servo().step(None, 1.0),
        "None for a sample",
        "step",
        kind=TypeError,
    ),
    call(
        "servo.restore('text')",
        lambda: servo().restore("text"),
        "text for a snapshot",
        "restore",
        kind=TypeError,
    ),
    call("servo.restore(b'')", lambda: servo().restore(b""), "an empty snapshot", "bytes"),
    call(
        "servo.restore(servo.save()[:-1])",
        lambda: servo().restore(servo().save()[:-1]),
        "a snapshot cut by one byte",
        "bytes",
    ),
    call(
        "servo.restore(rls.save())",
        lambda: servo().restore(rls().save()),
        "the snapshot of something else",
        "not a saved state",
    ),
    call(
        "rls.start_from_covariance([0] * 3, eye(2))",
        lambda: rls().start_from_covariance([0.0] * 3, np.eye(2)),
        "a covariance of another size",
        "p0",
    ),
    call(
        "rls.start_from_covariance([0] * 3, ones((3, 3)))",
        lambda: rls().start_from_covariance([0.0] * 3, np.ones((3, 3))),
        "a covariance of rank one",
        "p0",
    ),
    call(
        "rls.start_from_covariance([0, nan, 0], eye(3))",
        lambda: rls().start_from_covariance([0.0, NAN, 0.0], np.eye(3)),
        "start values that are not numbers",
        "theta0",
    ),
    call("ehsid.Rls(0)", lambda: ehsid.Rls(0), "no parameters", "n must be in 1..13"),
    call(
        "ehsid.Rls(10**30)",
        lambda: ehsid.Rls(10**30),
        "a number of parameters that no integer holds",
        "n",
        kind=(TypeError),
    ),
    call(
        "ehsid.Rls(2.5)",
        lambda: ehsid.Rls(2.5),
        "a fraction of a parameter",
        "constructor arguments",
        kind=TypeError,
    ),
    call(
        "ehsid.Rls(2, dtype='float16')",
        lambda: ehsid.Rls(2, dtype="float16"),
        "a precision that there is not",
        "float32 or float64",
    ),
    call(
        "ehsid.Rls(2, theta0=[1, nan])",
        lambda: ehsid.Rls(2, theta0=[1.0, NAN]),
        "start values that are not numbers",
        "theta0 must be finite",
    ),
    call(
        "ehsid.Rls(2, variance0=[1, 0])",
        lambda: ehsid.Rls(2, variance0=[1.0, 0.0]),
        "a variance of zero",
        "variance0",
    ),
    call(
        "ehsid.ArxEstimator(7, 1, 1)",
        lambda: ehsid.ArxEstimator(7, 1, 1),
        "an order of 7",
        "na must be in 1..6, got 7",
    ),
    call(
        "ehsid.ArxEstimator(1, 1, 21)",
        lambda: ehsid.ArxEstimator(1, 1, 21),
        "a delay of 21 samples",
        "nk must be in 0..20, got 21",
    ),
    call(
        "ehsid.ArxEstimator(1, 1, 1, input_limit=0)",
        lambda: ehsid.ArxEstimator(1, 1, 1, input_limit=0.0),
        "a limit of zero",
        "input_limit",
    ),
    call("ehsid.Constant(1.5)", lambda: ehsid.Constant(1.5), "a factor above 1", "(0, 1]"),
    call(
        "ehsid.Exponential(nan)",
        lambda: ehsid.Exponential(NAN),
        "a factor that is not a number",
        "(0, 1]",
    ),
    call(
        "ehsid.Scaling(position_scale=0)",
        lambda: ehsid.Scaling(position_scale=0.0),
        "a scale of zero",
        "scales",
        "> 0",
    ),
    call("make_record({})", lambda: make_record({}), "no columns", "no columns", "Expected"),
    call(
        "make_record({'u': 3.0})",
        lambda: make_record({"u": 3.0}),
        "a number for a column",
        "'u'",
        "a single number",
    ),
    call(
        "make_record({'u': [1, nan, 2]})",
        lambda: make_record({"u": [1.0, NAN, 2.0]}),
        "NaN in a column",
        "row 2",
        "'u'",
    ),
    call(
        "make_record({'u': masked})",
        lambda: make_record({"u": MASKED}),
        "a masked column",
        "1 values are masked",
        "'u'",
    ),
    call(
        "make_record({'u': [1, 2], 'y': [1, 2, 3]})",
        lambda: make_record({"u": [1.0, 2.0], "y": [1.0, 2.0, 3.0]}),
        "columns of unequal lengths",
        "'u'",
        "equal length",
    ),
    call(
        "make_record({'u': ['1', '2']})",
        lambda: make_record({"u": ["1", "2"]}),
        "text for numbers",
        "'u'",
        "real numbers",
    ),
    call(
        "make_record({'time_s': [0, 0, 1], 'u': [1, 2, 3]})",
        lambda: make_record({"time_s": [0.0, 0.0, 1.0], "u": [1.0, 2.0, 3.0]}),
        "one time twice",
        "'time_s'",
        "same",
    ),
    call(
        "read_record('\\0.csv')",
        lambda: read_record("\0.csv"),
        "a zero byte in a path",
        "zero byte",
    ),
    call(
        "write_record(record, 'nowhere/r.csv')",
        lambda: write_record(make_record({"u": [1.0, 2.0]}), "nowhere/r.csv"),
        "a folder that is not there",
        "nowhere/r.csv",
        "create the folder",
    ),
    call(
        "write_record(record, 'r.mat')",
        lambda: write_record(make_record({"a b": [1.0, 2.0]}), "r.mat"),
        "a name that MATLAB does not allow",
        "'a b'",
        "rename",
    ),
    call(
        "IoData.from_arrays(u, y[:50])",
        lambda: IoData.from_arrays(U, Y[:50]),
        "columns of unequal lengths",
        "(100,)",
        "(50,)",
    ),
    call(
        "IoData.from_arrays(masked, y)",
        lambda: IoData.from_arrays(MASKED, Y),
        "a masked column",
        "masked",
        "filled()",
    ),
    call(
        "IoData.from_arrays(u, [nan] * 100)",
        lambda: IoData.from_arrays(U, [NAN] * 100),
        "NaN in a column",
        "finite",
    ),
    call(
        "identify(data, orders=[])",
        lambda: identify(DATA, orders=[], delays=[1]),
        "no orders",
        "order",
    ),
    call(
        "identify(data, orders=[0], delays=[1])",
        lambda: identify(DATA, orders=[0], delays=[1]),
        "an order of 0",
        "na",
        "0",
    ),
    call(
        "fit_arx(IoData.from_arrays(0 * u, y), ArxOrders(2, 2, 1))",
        lambda: fit_arx(IoData.from_arrays(0 * U, Y), ArxOrders(2, 2, 1)),
        "an input that is zero",
        "b1, b2",
    ),
    call("ArxOrders(-1, 2, 1)", lambda: ArxOrders(-1, 2, 1), "an order below 0", "na"),
    call(
        "estimate(data[:10], ArxOrders(3, 3, 1))",
        lambda: estimate(
            IoData.from_arrays(U[:10], Y[:10]), ArxOrders(3, 3, 1), forgetting=ehsid.Constant()
        ),
        "too few samples",
        "10 samples",
        "record longer",
    ),
    call(
        "EstimatorConfiguration(ArxOrders(9, 1, 1)).estimator()",
        lambda: EstimatorConfiguration(ArxOrders(9, 1, 1)).estimator(),
        "an order of 9",
        "na",
        "1..6",
    ),
    call(
        "configure_from_record(data, ArxOrders(3, 3, 1), inflation=nan)",
        lambda: configure_from_record(
            DATA, ArxOrders(3, 3, 1), forgetting=ehsid.FRatio(), inflation=NAN
        ),
        "an inflation that is not a number",
        "inflation nan",
    ),
    call(
        "simulate(rig, [nan, 1, 2], dt_s=1e-3)",
        lambda: simulate(RIG, np.array([NAN, 1.0, 2.0]), dt_s=1e-3),
        "a command that is not a number",
        "command",
    ),
    call(
        "simulate(rig, masked, dt_s=1e-3)",
        lambda: simulate(RIG, MASKED, dt_s=1e-3),
        "a masked command",
        "masked",
        "filled()",
    ),
    call(
        "simulate(rig, u, dt_s=0)",
        lambda: simulate(RIG, U, dt_s=0.0),
        "a sampling time of zero",
        "dt_s",
    ),
    call(
        "simulate(rig, u, dt_s=inf)",
        lambda: simulate(RIG, U, dt_s=INF),
        "an infinite sampling time",
        "dt_s",
    ),
    call(
        "simulate(rig, u, dt_s=1e-3, position0_m=9)",
        lambda: simulate(RIG, U, dt_s=1e-3, position0_m=9.0),
        "a start outside the stroke",
        "9 m",
        "0 to 0.3 m",
    ),
    call(
        "rig.with_values({'load.mass': 1})",
        lambda: RIG.with_values({"load.mass": 1.0}),
        "a value that the rig does not have",
        "did you mean 'load.mass_kg'?",
    ),
    call(
        "parse_rig('plant = 3')", lambda: parse_rig("plant = 3"), "a number for the plant", '"ehs"'
    ),
    call("diagnose([], rig)", lambda: diagnose([], RIG), "no records", "record"),
    call(
        "prbs(1, amplitude=1, hold=0)",
        lambda: prbs(1, amplitude=1.0, hold=0),
        "a hold of 0 samples",
        "hold",
    ),
    call(
        "chirp(100, 1e-3, amplitude=1, band_hz=(5, 1))",
        lambda: chirp(100, 1e-3, amplitude=1.0, band_hz=(5.0, 1.0)),
        "a band upside down",
        "band_hz",
    ),
    call(
        "odd_multisine(100, 1e-3, band_hz=(1, 900), peak=1, rng=rng)",
        lambda: odd_multisine(100, 1e-3, band_hz=(1.0, 900.0), peak=1.0, rng=RNG),
        "a band beyond half the sampling rate",
        "band_hz",
    ),
    call(
        "random_steps(-5, amplitude=1, hold=(1, 2), rng=rng)",
        lambda: random_steps(-5, amplitude=1.0, hold=(1, 2), rng=RNG),
        "fewer than no samples",
        "-5",
    ),
    call(
        "triangle(100, 1e-3, amplitude=nan, period_s=1)",
        lambda: triangle(100, 1e-3, amplitude=NAN, period_s=1.0),
        "an amplitude that is not a number",
        "amplitude",
    ),
)
