# SPDX-License-Identifier: MIT
"""The exported C99 sources: the bits of Python, strict compilers, memory, and the command."""

import ctypes
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import hostile_samples
import make_headers
import make_trace
import numpy as np
import policies
import pytest
from compiled_sources import CHECKED, STRICT, Floats, compiled, in_python, write_sources
from hypothesis import given, settings
from hypothesis import strategies as st
from sources import ROOT
from test_export import COLUMNS, CRANE, configurations, run

import ehsid
from ehsid.harness.firmware import EstimatorConfiguration
from ehsid.harness.models.identification import ArxOrders

needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc")
pytestmark = [pytest.mark.slow, needs_gcc]

GOLDEN = {
    "scaling": ehsid.Scaling(
        command_scale=5.0, position_scale=0.3, command_offset=0.25, position_offset=-0.02
    ),
    "reset": ehsid.RmseResetOptions(
        short_window=5.0, long_window=60.0, trigger_ratio=8.0, cool_down=20
    ),
}
POLICIES = (
    ehsid.Constant(0.98),
    ehsid.Constant(0.999),  # forgets so little that a glitch would stay
    ehsid.Exponential(0.995, 0.97),
    ehsid.ErrorDriven(memory=80.0, lambda_min=0.6),
    ehsid.ErrorDriven(memory=80.0, noise_variance=1e-6),
    ehsid.FRatio(eta=1.5, critical_ratio=3.0),
)
# Smallest; without a delay; a delay; the largest with an offset.
ORDERS = (
    ArxOrders(1, 1, 1),
    ArxOrders(1, 1, 0, offset=True),
    ArxOrders(2, 1, 4),
    ArxOrders(6, 6, 1, offset=True),
)


def assert_same_bits(
    configuration: EstimatorConfiguration, folder: Path, dtype: str, *runs: tuple[Floats, Floats]
) -> set[int]:
    """Runs both with resets between the runs, switched off in the second; returns the statuses."""
    made, estimator = (
        compiled(configuration, folder, dtype, CHECKED),
        configuration.estimator(dtype),
    )
    assert made.library.servo_self_test()
    met: set[int] = set()
    with np.errstate(over="ignore"):  # 1e300 is infinite in float32
        for place, (u, y) in enumerate(runs):
            estimator.enabled = place != 1
            made.library.servo_enable(made.state, estimator.enabled)
            numbers, flags = made.run(u, y)
            wanted, wanted_flags = in_python(estimator, u, y)
            assert (flags == wanted_flags).all()
            assert numbers.tobytes() == wanted.tobytes()
            met |= set(flags[:, 0].tolist())
            estimator.reset()
            made.library.servo_reset(made.state)
    return met


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("policy", POLICIES, ids=repr)
def test_golden_samples_have_the_bits_of_python(
    policy: ehsid.Forgetting, dtype: str, tmp_path: Path
) -> None:
    golden = make_trace.signals()
    pieces = tuple((golden[0][cut], golden[1][cut]) for cut in (slice(60), slice(60)))
    configuration = EstimatorConfiguration(ArxOrders(3, 3, 1), forgetting=policy, **GOLDEN)
    met = assert_same_bits(configuration, tmp_path, dtype, golden, *pieces)
    assert met >= {0, 1, 3, 4, 5, 6}


@pytest.mark.parametrize("name", make_headers.CASES)
def test_exported_headers_and_sources_agree(name: str, tmp_path: Path) -> None:
    made = compiled(make_headers.configuration(name), tmp_path)
    record = make_headers.data()
    numbers, flags = made.run(record.u, record.y)
    rows = []
    for k in range(make_headers.EVERY - 1, record.u.size, make_headers.EVERY):
        told = np.array([numbers[k, 0], *numbers[k, 3 : 3 + made.n]], np.float32)
        words = [f"{word:08x}" for word in told.view(np.uint32)]
        rows.append(",".join([name, str(k), f"{flags[k, 0]:x}", *words]))
    assert rows == [
        row
        for row in (ROOT / "tests" / "export" / make_headers.TRAJECTORIES).read_text().split()
        if row.startswith(f"{name},")
    ]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("which", range(4))
def test_hostile_samples_have_the_bits_of_python(which: int, dtype: str, tmp_path: Path) -> None:
    names = [*hostile_samples.CATALOGUE, "mixture"][which::4]
    runs = [hostile_samples.hostile_then_good(name, which, 400) for name in names]
    configuration = EstimatorConfiguration(ORDERS[which], forgetting=POLICIES[which + 1])
    assert_same_bits(configuration, tmp_path, dtype, *runs)


@settings(max_examples=5)
@given(configuration=configurations(), seed=st.integers(0, 99), dtype=st.sampled_from(["f4", "f8"]))
def test_any_settings_have_the_bits_of_python(
    configuration: EstimatorConfiguration,
    seed: int,
    dtype: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> None:
    rng, scaling = np.random.default_rng(seed), configuration.scaling
    u = scaling.command_offset + scaling.command_scale * rng.normal(size=200)
    y = scaling.position_offset + scaling.position_scale * rng.normal(size=200)
    assert_same_bits(configuration, tmp_path_factory.mktemp("any"), np.dtype(dtype).name, (u, y))


def test_a_copy_of_the_state_goes_on_as_the_estimator_does(tmp_path: Path) -> None:
    made = compiled(EstimatorConfiguration(ArxOrders(3, 3, 1), **GOLDEN), tmp_path)
    u, y = make_trace.signals()
    made.run(u[:300], y[:300])
    saved = ctypes.string_at(made.state, ctypes.sizeof(made.state))
    first = made.run(u[300:], y[300:])
    ctypes.memmove(made.state, saved, len(saved))
    again = made.run(u[300:], y[300:])
    assert all(a.tobytes() == b.tobytes() for a, b in zip(first, again, strict=True))


COMPILERS = {
    "gcc": [],
    "clang": [],
    "arm-none-eabi-gcc": ["-mcpu=cortex-m4", "-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"],
    "riscv64-unknown-elf-gcc": ["-march=rv32imafc", "-mabi=ilp32f", "--specs=picolibc.specs"],
}


@pytest.mark.thorough
@pytest.mark.parametrize("compiler", COMPILERS)
def test_strict_compilers_take_the_sources(compiler: str, tmp_path: Path) -> None:
    if shutil.which(compiler) is None:
        pytest.skip(f"no {compiler}")
    others: list[dict[str, Any]] = [{}, {"reset": None, "rls": policies.UNGUARDED}]
    for place, policy in enumerate(POLICIES):
        made = EstimatorConfiguration(ORDERS[1], forgetting=policy, **others[place % 2])
        write_sources(made, tmp_path, ("float32", "float64")[place % 3 == 0])
        command = [compiler, *STRICT, *COMPILERS[compiler], "-O1", "-c", "servo_estimator.c"]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
        assert done.returncode == 0, done.stderr


@pytest.mark.thorough
def test_misra_deviations_are_those_of_the_page(tmp_path: Path) -> None:
    if shutil.which("cppcheck") is None:
        pytest.skip("no cppcheck")
    options = "-q --std=c99 --language=c --enable=style,warning,portability --addon=misra "
    options += "--suppress=missingIncludeSystem --template={id} servo_estimator.c"
    page = (ROOT / "docs" / "export.md").read_text(encoding="utf-8")
    for policy in POLICIES:
        write_sources(EstimatorConfiguration(ORDERS[2], forgetting=policy, **GOLDEN), tmp_path)
        command = ["cppcheck", *options.split()]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert set(done.stderr.split()) == {"misra-c2012-8.7", "misra-c2012-21.15"}
    assert "| 8.7 |" in page
    assert "| 21.15 |" in page


@pytest.mark.thorough
@pytest.mark.parametrize("place", [1, 2, 3, 5])
def test_no_use_touches_memory_beyond_the_state(place: int, tmp_path: Path) -> None:
    if shutil.which("frama-c") is None:
        pytest.skip("no frama-c")
    orders = ArxOrders(2, 1, 1)  # smaller ones do not reach all loops
    configuration = EstimatorConfiguration(orders, forgetting=POLICIES[place], **GOLDEN)
    write_sources(configuration, tmp_path)
    uses = shutil.copy(ROOT / "tests" / "export" / "any_use.c", tmp_path)
    command = [
        "frama-c",
        *["-eva", "-eva-precision", "3", "-warn-special-float", "none"],
        str(uses),
    ]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    assert "0 alarms generated by the analysis." in done.stdout
    assert done.stdout.count("100% coverage") == 2


@pytest.mark.thorough
@pytest.mark.parametrize("place", [1, 2, 3, 5])
def test_every_branch_is_taken(place: int, tmp_path: Path) -> None:
    if shutil.which("gcov") is None:
        pytest.skip("no gcov")
    reset = ehsid.RmseResetOptions(short_window=5.0, long_window=60.0, cool_down=20)
    settings = {"reset": reset, "input_limit": 1e4, "forgetting": POLICIES[place]}
    configuration = replace(make_headers.configuration("constant"), **settings)
    flags = ("-O0", "--coverage", "-DCOVERAGE", f"-I{ROOT / 'tests' / 'export'}")
    made = compiled(configuration, tmp_path, flags=flags)
    scaling = configuration.scaling
    runs = [hostile_samples.good(np.random.default_rng(1), 5000)]
    for seed in range(2):
        names = [*hostile_samples.CATALOGUE, "mixture"]
        runs += [hostile_samples.hostile_then_good(name, seed) for name in names]
    with np.errstate(over="ignore"):
        for place, (u, y) in enumerate(runs):
            made.library.servo_init(made.state)
            made.library.servo_enable(made.state, place != 1)
            made.run(
                u * scaling.command_scale + scaling.command_offset,
                y * scaling.position_scale + scaling.position_offset,
            )
            made.library.servo_reset(made.state)
    made.library.far_states()
    assert made.library.servo_self_test()
    made.library.write_coverage()
    command = ["gcov", "-b", "-c", *(str(path) for path in tmp_path.glob("*.gcda"))]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
    told = done.stdout.split("File 'servo_estimator.c'")[1].splitlines()
    assert told[1].startswith("Lines executed:100.00%")
    assert told[3].startswith("Taken at least once:100.00%")


def test_command_writes_both_files(tmp_path: Path) -> None:
    out = tmp_path / "crane.c"
    for more, real in (([], "float"), (["--float64"], "double")):
        arguments = [*COLUMNS, "--c-source", *more, "--name", "crane", "--out", str(out)]
        code, printed, _ = run(str(CRANE), *arguments)
        assert code == 0
        assert "self-test over 64 samples" in printed
        assert f"typedef {real} crane_real;" in (tmp_path / "crane.h").read_text("ascii")
        assert '#include "crane.h"' in out.read_text("ascii")
    assert sorted(path.name for path in tmp_path.iterdir()) == [".ehsid", "crane.c", "crane.h"]


def test_long_windows_are_refused() -> None:
    made = replace(make_headers.configuration("f_ratio"), reset=None)
    longest = ehsid.RmseResetOptions(long_window=1e8)
    with pytest.raises(ValueError, match="long_window"):
        write_sources(replace(made, reset=longest), Path())
