# SPDX-License-Identifier: MIT
"""One servo, estimated in every form that ehsid exports: python benchmarks/one_servo.py

A simulated servo under a multisine, 20 s at 5 ms with noise on the sensors, and the estimator that
is started from this record, in float32: the C++ header, the C99 sources, the FMUs of FMI 2.0 and
3.0 and the function block in Structured Text, each against the estimator in Python after every
sample. Needs gcc, the extra `fmu`, and the tests of this repository, which run the block.
"""

from __future__ import annotations

import ctypes
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from fmpy import simulate_fmu

import ehsid
from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.firmware import configure_from_record
from ehsid.harness.models.identification import ArxOrders, IoData
from ehsid.harness.records import read_record

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests" / "python"))
from structured_text_in_c import Block  # noqa: E402 -- a helper of the tests

RIG = ROOT / "examples" / "rigs" / "bench.toml"
RECORD, SEED, DT_S = "servo.csv", 1, 0.005
ORDERS = ArxOrders(3, 3, 1, offset=True)
N = ORDERS.n_parameters
FLAGS = ("-O2", "-ffp-contract=off")
IN_CPP = """#include "servo_configuration.hpp"
#include <cstdio>
int main() {
  static servo::Estimator estimator;
  if (servo::configure(estimator) != ehsid::Status::ok) return 1;
  float u, y;
  while (std::scanf("%f,%f", &u, &y) == 2) {
    (void)estimator.step(u, y);
    const auto theta = estimator.theta_hat();
    for (int i = 0; i < estimator.size(); ++i) std::printf("%a ", static_cast<double>(theta[i]));
    std::printf("\\n");
  }
}
"""


def exported(folder: Path, *options: str) -> None:
    """Runs `ehsid export` on the record in the folder."""
    command = [sys.executable, "-m", "ehsid", "export", RECORD, "-q", *options]
    subprocess.run(command, cwd=folder, check=True, stdout=subprocess.DEVNULL)


def in_cpp(folder: Path, u: FloatArray, y: FloatArray) -> FloatArray:
    """Estimates after each sample of a C++ program that includes the exported header, (k, N)."""
    exported(folder, "--out", "servo_configuration.hpp")
    (folder / "main.cpp").write_text(IN_CPP, encoding="utf-8")
    include = ("-D", "EHSID_WITHOUT_EIGEN", "-I", str(ROOT / "cpp" / "include"))
    subprocess.run(
        ["c++", "-std=c++17", *FLAGS, *include, "-o", "main", "main.cpp"], cwd=folder, check=True
    )
    lines = "".join(f"{a!r},{b!r}\n" for a, b in zip(u.tolist(), y.tolist(), strict=True))
    said = subprocess.run(
        [folder / "main"], input=lines, capture_output=True, text=True, check=True
    )
    return np.array([[float.fromhex(x) for x in row.split()] for row in said.stdout.splitlines()])


def in_c(folder: Path, u: FloatArray, y: FloatArray) -> FloatArray:
    """The same of the C99 sources."""
    exported(folder, "--c-source", "--out", "servo_estimator.c")
    command = ["cc", "-std=c99", *FLAGS, "-fPIC", "-shared", "-o", "servo.so", "servo_estimator.c"]
    subprocess.run([*command, "-lm"], cwd=folder, check=True)
    library = ctypes.CDLL(str(folder / "servo.so"))
    state = ctypes.create_string_buffer(1 << 16)
    theta = (ctypes.c_float * N)()
    library.servo_init(state)
    rows = []
    for a, b in zip(u.tolist(), y.tolist(), strict=True):
        library.servo_step(state, ctypes.c_float(a), ctypes.c_float(b))
        library.servo_theta(state, theta)
        rows.append(list(theta))
    return np.array(rows)


def in_st(folder: Path, u: FloatArray, y: FloatArray) -> FloatArray:
    """The same of the function block, translated to C as in the tests."""
    exported(folder, "--st", "--out", "servo_estimator.st")
    block = Block((folder / "servo_estimator.st").read_text(encoding="utf-8"), folder)
    rows = []
    for a, b in zip(u.tolist(), y.tolist(), strict=True):
        block.cycle(command=a, position=b)
        rows.append(block["theta"])
    return np.array(rows)


def in_fmu(folder: Path, fmi: int, u: FloatArray, y: FloatArray) -> FloatArray:
    """The same of an FMU, which FMPy steps. Its inputs at t_k act in the step to t_k+1."""
    path = folder / f"estimator{fmi}.fmu"
    exported(folder, "--fmu", path.name, "--fmi", str(fmi))
    real = np.float64 if fmi == 2 else np.float32
    signals = np.zeros(u.size, dtype=[("time", np.float64), ("command", real), ("position", real)])
    signals["time"], signals["command"], signals["position"] = DT_S * np.arange(u.size), u, y
    found = simulate_fmu(
        str(path),
        stop_time=DT_S * u.size,
        step_size=DT_S,
        output_interval=DT_S,
        input=signals,
        output=ORDERS.names,
    )
    rows = np.column_stack([found[name] for name in ORDERS.names])
    return np.asarray(rows[1 : u.size + 1], dtype=np.float64)


def main() -> None:
    """Prints the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        servo = ehsid.simulate(RIG, "multisine", duration_s=20.0, dt_s=DT_S, noise=True, seed=SEED)
        servo.save(folder / RECORD)
        data = IoData.from_record(read_record(folder / RECORD), "command_v", "position_m")
        u, y = (np.asarray(x, dtype=np.float32).astype(np.float64) for x in (data.u, data.y))
        export = configure_from_record(data, ORDERS, forgetting=ehsid.FRatio())
        estimates = {}
        for dtype in ("float32", "float64"):
            estimator = export.configuration.estimator(dtype)
            rows = []
            for a, b in zip(u.tolist(), y.tolist(), strict=True):
                estimator.step(a, b)
                rows.append(estimator.theta_hat)
            estimates[dtype] = np.array(rows)
        forms = {
            "C++ header, gcc": in_cpp(folder, u, y),
            "C99 sources, gcc": in_c(folder, u, y),
            "FMU, FMI 2.0": in_fmu(folder, 2, u, y),
            "FMU, FMI 3.0": in_fmu(folder, 3, u, y),
            "Structured Text, REAL": in_st(folder, u, y),
            "Python in double precision": estimates["float64"],
        }
    print(f"{u.size} samples, {ORDERS}, {export.configuration.forgetting!r}, seed {SEED}")
    print("largest difference of a parameter from Python in float32, over its largest value:")
    expected = estimates["float32"]
    size = np.abs(expected).max(axis=0)
    for form, found in forms.items():
        away = (
            float((np.abs(found - expected) / size).max())
            if found.shape == expected.shape
            else np.nan
        )
        print(f"{form:<28} {'0, the same bits' if away == 0.0 else f'{away:.1e}'}")


if __name__ == "__main__":
    main()
