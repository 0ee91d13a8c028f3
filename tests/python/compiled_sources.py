# SPDX-License-Identifier: MIT
"""Exported C99 sources, compiled here and run beside the estimator of Python."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import numpy.typing as npt

import ehsid
from ehsid.harness.firmware import EstimatorConfiguration, GoldenTrace, render_sources

Floats = npt.NDArray[np.floating]

STRICT = [
    "-std=c99",
    "-pedantic",
    "-Wall",
    "-Wextra",
    "-Wconversion",
    "-Wsign-conversion",
    "-Wdouble-promotion",
    "-Wshadow",
    "-Werror",
]
SAME_BITS = ("-O2", "-ffp-contract=off")
# An index out of its bounds or an overflow of an integer ends the process.
CHECKED = (*SAME_BITS, "-fsanitize=undefined,bounds-strict", "-fsanitize-undefined-trap-on-error")

# A run writes after each sample three numbers, theta, deviations, and three flags.
RUN = """
#include "servo_estimator.c"
#ifdef COVERAGE
#include "far_states.c"
extern void __gcov_dump(void);
void write_coverage(void) { __gcov_dump(); }
#endif
unsigned long size_of_state(void) { return sizeof(servo_state); }
void run(servo_state* state, int32_t rows, const servo_real* u, const servo_real* y,
         servo_real* numbers, uint8_t* flags) {
    for (int32_t k = 0; k < rows; ++k) {
        flags[0] = (uint8_t)servo_step(state, u[k], y[k]);
        flags[1] = servo_settled(state);
        flags[2] = servo_converged(state);
        numbers[0] = servo_innovation(state);
        numbers[1] = servo_lambda(state);
        numbers[2] = servo_residual_variance(state);
        servo_theta(state, numbers + 3);
        servo_deviations(state, numbers + 3 + N);
        numbers += 3 + 2 * N;
        flags += 3;
    }
}
"""


def write_sources(
    configuration: EstimatorConfiguration, folder: Path, dtype: str = "float32"
) -> None:
    """Writes servo_estimator.c and .h; the self-test has 30 samples of noise."""
    rng = np.random.default_rng(1)
    scaling = configuration.scaling
    u = scaling.command_offset + scaling.command_scale * rng.normal(size=30)
    y = scaling.position_offset + scaling.position_scale * rng.normal(size=30)
    trace = GoldenTrace.of(configuration, u, y, dtype)
    made = render_sources(configuration, trace, name="servo", stem="servo_estimator", dtype=dtype)
    (folder / "servo_estimator.h").write_text(made.header, encoding="ascii")
    (folder / "servo_estimator.c").write_text(made.source, encoding="ascii")
    (folder / "run.c").write_text(RUN, encoding="ascii")


@dataclass
class Compiled:
    """An estimator in C, after `servo_init`."""

    library: ctypes.CDLL
    state: ctypes.Array[ctypes.c_char]
    n: int
    dtype: str

    def run(self, u: Floats, y: Floats) -> tuple[Floats, npt.NDArray[np.uint8]]:
        """Numbers, shape (m, 3 + 2 n), and status, settled, converged, shape (m, 3)."""
        u, y = u.astype(self.dtype), y.astype(self.dtype)
        numbers = np.zeros((u.size, 3 + 2 * self.n), self.dtype)
        flags = np.zeros((u.size, 3), np.uint8)
        arrays = [array.ctypes.data_as(ctypes.c_void_p) for array in (u, y, numbers, flags)]
        self.library.run(self.state, u.size, *arrays)
        return numbers, flags


def compiled(
    configuration: EstimatorConfiguration,
    folder: Path,
    dtype: str = "float32",
    flags: Sequence[str] = SAME_BITS,
) -> Compiled:
    """Compiles the sources of a configuration, loads them, and starts an estimator."""
    write_sources(configuration, folder, dtype)
    command = ["gcc", *STRICT, *flags, "-shared", "-fPIC", "run.c", "-o", "run.so", "-lm"]
    subprocess.run(command, cwd=folder, check=True, capture_output=True, text=True)
    library = ctypes.CDLL(str(folder / "run.so"))
    library.size_of_state.restype = ctypes.c_ulong
    library.servo_self_test.restype = ctypes.c_bool
    state = ctypes.create_string_buffer(library.size_of_state())
    library.servo_init(state)
    return Compiled(library, state, configuration.orders.n_parameters, dtype)


def in_python(
    estimator: ehsid.ArxEstimator, u: Floats, y: Floats
) -> tuple[Floats, npt.NDArray[np.uint8]]:
    """The same as `Compiled.run`, of the binding."""
    numbers, flags = [], []
    for command, position in zip(u.astype(estimator.dtype), y.astype(estimator.dtype), strict=True):
        status = estimator.step(command, position)
        flags.append((status.value, estimator.settled, estimator.converged))
        readings = (estimator.innovation, estimator.forgetting_factor, estimator.residual_variance)
        numbers.append([*readings, *estimator.theta_hat, *estimator.standard_deviation])
    return np.array(numbers, estimator.dtype), np.array(flags, np.uint8)
