# SPDX-License-Identifier: MIT
"""Exported headers, one a forgetting policy and one of a ServoEstimator.

With them what Python makes of the whole record with each policy.
tests/cpp/test_exported_header.cpp configures the C++ estimator from the headers and must make the
bits of trajectories.csv from examples/data/hydraulic_crane.csv; tests/c must make those of the C++
headers from the C headers; tests/compile/firmware compiles them as a controller would;
tests/python/firmware/test_export.py checks that this script still makes these files. A row:
header, sample, then in hexadecimal the status and the bits of innovation and theta. Bits that part
do not meet again, so every 16th sample is enough.
`python tests/export/make_headers.py` writes all anew.
"""

from __future__ import annotations

import hashlib
from dataclasses import replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.firmware import (
    EstimatorConfiguration,
    GoldenTrace,
    Seed,
    ServoSettings,
    configure_from_record,
    liveliest,
    render_c_header,
    render_header,
    render_servo_header,
)
from ehsid.harness.models.identification import ArxOrders, IoData
from ehsid.harness.records import read_record

HERE = Path(__file__).parent
RECORD = HERE.parents[1] / "examples" / "data" / "hydraulic_crane.csv"
TRAJECTORIES = "trajectories.csv"
CASE_LIST = "cases.h"
EVERY = 16
# Samples of a self-test; the trajectories tell of the rest of the record.
TRACE_SAMPLES = 16

Case = tuple[ArxOrders, ehsid.Forgetting]
# Every policy with its defaults, unless another case of that name follows.
CASES: dict[str, Case] = {info.id: (ArxOrders(3, 3, 1), info.policy()) for info in ehsid.policies()}
CASES |= {
    "constant": (ArxOrders(3, 3, 1), ehsid.Constant(0.98)),
    "exponential": (ArxOrders(3, 3, 1), ehsid.Exponential(0.995, 0.97)),
    "error_driven": (ArxOrders(4, 2, 1), ehsid.ErrorDriven(memory=80.0, lambda_min=0.6)),
    "f_ratio": (ArxOrders(2, 3, 2, offset=True), ehsid.FRatio(eta=1.5, critical_ratio=3.0)),
}


def rounded(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
    """To four digits, so that another LAPACK makes the same file."""
    return np.array([float(f"{value:.4g}") for value in values.ravel()]).reshape(values.shape)


def data() -> IoData:
    """The crane's record."""
    record = read_record(RECORD, columns=["valve_opening", "oil_pressure"])
    return IoData.from_record(record, "valve_opening", "oil_pressure")


def configuration(name: str) -> EstimatorConfiguration:
    """Of the record; settings other than the defaults where they enter the arithmetic."""
    orders, forgetting = CASES[name]
    made = configure_from_record(data(), orders, forgetting=forgetting).configuration
    scaling = {
        side: rounded(np.array([getattr(made.scaling, side)])).item()
        for side in ("command_scale", "position_scale", "command_offset", "position_offset")
    }
    assert made.seed is not None
    seed = Seed(
        rounded(made.seed.theta),
        rounded(made.seed.u),
        rounded(made.seed.d),
        rounded(np.array([made.seed.noise_variance])).item(),
    )
    reset = None
    if name != "constant":
        reset = ehsid.RmseResetOptions(short_window=5.0, long_window=60.0, trigger_ratio=2.0)
    return replace(
        made,
        scaling=ehsid.Scaling(**scaling),
        rls=ehsid.RlsOptions(information_margin=1.5, covariance_ceiling=2.0),
        reset=reset,
        convergence=ehsid.ConvergenceOptions(tolerance=0.1, hold=10),
        variance0=rounded(np.array([made.variance0])).item(),
        input_limit=1e3,
        seed=seed,
    )


def provenance() -> list[str]:
    """Where the numbers come from."""
    digest = hashlib.sha256(RECORD.read_bytes()).hexdigest()
    return [f"Record {RECORD.name}, sha256", digest, "Made by tests/export/make_headers.py"]


def header(name: str) -> str:
    """The text of NAME.hpp."""
    made = configuration(name)
    trace = GoldenTrace.of(made, *liveliest(data(), TRACE_SAMPLES))
    return render_header(made, trace, name=name, dt_s=0.05, provenance=provenance())


def c_header(name: str) -> str:
    """The text of NAME.h, of the same configuration."""
    return render_c_header(configuration(name), name=name, dt_s=0.05, provenance=provenance())


def servo_header(c: bool) -> str:
    """The text of servo_estimator.hpp or .h, with settings other than the defaults."""
    settings = ServoSettings(0.002, delay=6, drift=0.03, tolerance=0.15)
    made = ["Made by tests/export/make_headers.py"]
    return render_servo_header(settings, name="servo_estimator", c=c, provenance=made)


def trajectory(name: str) -> list[str]:
    """Rows of trajectories.csv."""
    record, estimator, rows = data(), configuration(name).estimator(), []
    samples = zip(record.u.astype(np.float32), record.y.astype(np.float32), strict=True)
    for k, (command, position) in enumerate(samples):
        status = estimator.step(float(command), float(position))
        if k % EVERY == EVERY - 1:
            numbers = np.array([estimator.innovation, *estimator.theta_hat], dtype=np.float32)
            words = [f"{word:08x}" for word in numbers.view(np.uint32)]
            rows.append(",".join([name, str(k), f"{status.value:x}", *words]))
    return rows


def case_list() -> str:
    """The text of cases.h, which includes all headers and lists their names."""
    names = " \\\n".join(f"  DO({name})" for name in CASES)
    includes = {
        kind: "\n".join(f'#include "{name}.{kind}"' for name in CASES) for kind in ("hpp", "h")
    }
    return (
        "/* Written by make_headers.py: every exported header, in C++ or in C. */\n"
        "/* clang-format off */\n"
        f"#ifdef __cplusplus\n{includes['hpp']}\n#else\n{includes['h']}\n#endif\n\n"
        f"#undef EXPORTED_CASES\n#define EXPORTED_CASES(DO) \\\n{names}\n"
        "/* clang-format on */\n"
    )


def files() -> dict[str, str]:
    """All files by name."""
    rows = [row for name in CASES for row in trajectory(name)]
    return {
        **{f"{name}.hpp": header(name) for name in CASES},
        **{f"{name}.h": c_header(name) for name in CASES},
        **{f"servo_estimator.{kind}": servo_header(kind == "h") for kind in ("hpp", "h")},
        CASE_LIST: case_list(),
        TRAJECTORIES: "\n".join(rows) + "\n",
    }


if __name__ == "__main__":
    for file_name, text in files().items():
        (HERE / file_name).write_text(text, encoding="utf-8", newline="\n")
