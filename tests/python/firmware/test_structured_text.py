# SPDX-License-Identifier: MIT
"""Exported function blocks in ST: the bits of the C++ estimator, readable files."""

from __future__ import annotations

import re
import shutil
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from blark.parse import parse_source_code
from structured_text_in_c import Block

import ehsid
from ehsid.harness.firmware import EstimatorConfiguration, configure_from_record
from ehsid.harness.firmware.structured_text import FunctionBlock, function_block
from ehsid.harness.models.identification import ArxOrders, IoData

pytestmark = pytest.mark.skipif(shutil.which("cc") is None, reason="no C compiler")

EXAMPLE = Path(__file__).parents[3] / "examples" / "plc" / "axis.st"
READINGS = {
    "theta": "theta_hat",
    "deviation": "standard_deviation",
    "innovation": "innovation",
    "lambda": "forgetting_factor",
    "residual_variance": "residual_variance",
    "settled": "settled",
    "converged": "converged",
    "excitation": "excitation",
}


def servo(seed: int, samples: int, *, changes: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """Command and position of a servo with a noisy sensor, whose gain may rise at half time."""
    rng = np.random.default_rng(seed)
    u = rng.normal(size=samples)
    y = np.zeros(samples)
    for k in range(3, samples):
        gain = 1.7 if changes and k > samples // 2 else 1.0
        y[k] = 2.2 * y[k - 1] - 1.6 * y[k - 2] + 0.4 * y[k - 3]
        y[k] += gain * (0.05 * u[k - 1] + 0.1 * u[k - 2] + 0.02 * u[k - 3])
    return u, y + 1e-3 * rng.normal(size=samples)


def disturbed() -> tuple[np.ndarray, np.ndarray]:
    """A change of the machine, a hold, rest, a wrong position, and numbers that are none."""
    u, y = servo(1, 1000, changes=True)
    u[300:450], y[350:450] = 0.3, y[350]
    u[800:900], y[800:900] = 0.0, 0.0
    y[470], y[700], u[620:625], y[760] = 50.0, 1e30, np.nan, -np.inf
    return u, y


class Outcomes:
    """What block and estimator say after each sample, to be compared at the end."""

    def __init__(self, block: Block, estimator: ehsid.ArxEstimator) -> None:
        self.block, self.estimator = block, estimator
        self.of_block: dict[str, list[object]] = {name: [] for name in READINGS}
        self.expected: dict[str, list[object]] = {name: [] for name in READINGS}
        self.statuses: list[int] = []
        self.look()

    def look(self) -> None:
        for name, attribute in READINGS.items():
            self.of_block[name].append(self.block[name])
            self.expected[name].append(getattr(self.estimator, attribute))

    def sample(self, u: float, y: float, **inputs: bool) -> None:
        """One cycle of both."""
        if inputs.get("cycle_lost"):
            self.estimator.step(float("nan"), float("nan"))
        status = self.estimator.step(u, y)
        if inputs.get("restart"):
            self.estimator.reset()
        self.block.cycle(command=u, position=y, **inputs)
        assert self.block["status"] == int(status), len(self.statuses)
        self.statuses.append(int(status))
        self.look()

    def are_same(self) -> None:
        for name in READINGS:
            np.testing.assert_array_equal(
                np.array(self.of_block[name], dtype=np.float64),
                np.array(self.expected[name], dtype=np.float64),
                err_msg=name,
            )


CASES = [
    (ehsid.Constant(0.98), ArxOrders(3, 3, 1)),
    (ehsid.Constant(1.0), ArxOrders(1, 1, 0)),
    (ehsid.Exponential(), ArxOrders(2, 3, 4, offset=True)),
    (ehsid.ErrorDriven(), ArxOrders(3, 3, 1)),
    (ehsid.FRatio(), ArxOrders(6, 6, 2)),
    (ehsid.FRatio(eta=1.5), ArxOrders(1, 2, 1, offset=True)),
]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize(("forgetting", "orders"), CASES, ids=repr)
def test_the_bits_are_those_of_the_estimator(
    forgetting: ehsid.Forgetting, orders: ArxOrders, dtype: str, tmp_path: Path
) -> None:
    """The outcome of every sample of a disturbed record is the same, in both precisions."""
    configuration = EstimatorConfiguration(orders, forgetting=forgetting)
    block = Block(function_block(configuration, dtype=dtype).text, tmp_path)
    outcomes = Outcomes(block, configuration.estimator(dtype))
    real = np.float32 if dtype == "float32" else np.float64
    for u, y in zip(*disturbed(), strict=True):
        outcomes.sample(float(real(u)), float(real(y)))
    outcomes.are_same()
    assert {0, 1, 5, 6} <= set(outcomes.statuses)


@pytest.fixture(scope="module")
def exported() -> EstimatorConfiguration:
    u, y = servo(2, 800)
    data = IoData(u, 40.0 + 3.0 * y, (slice(0, 800),), 0.005)
    orders = ArxOrders(3, 3, 1, offset=True)
    return configure_from_record(data, orders, forgetting=ehsid.FRatio()).configuration


def test_a_seed_and_the_inputs_of_the_block(
    exported: EstimatorConfiguration, tmp_path: Path
) -> None:
    """Seeded block against the estimator, with a lost cycle, a pause and a restart by hand."""
    outcomes = Outcomes(Block(function_block(exported).text, tmp_path), exported.estimator())
    u, y = servo(3, 400)
    for k in range(400):
        on = not 150 <= k < 160
        outcomes.estimator.enabled = on
        outcomes.sample(
            float(np.float32(u[k])),
            float(np.float32(40.0 + 3.0 * y[k])),
            cycle_lost=k == 90,
            enable=on,
            restart=k == 250,
        )
    outcomes.are_same()
    assert outcomes.statuses.count(3) == 10
    assert outcomes.statuses[90:93] == [1, 1, 1]
    assert outcomes.block["settled"]


def test_the_xml_has_the_same_block(exported: EstimatorConfiguration) -> None:
    block = function_block(exported, name="lift", dt_s=0.005, provenance=["A < B & C *)."])
    space = {"p": "http://www.plcopen.org/xml/tc6_0201", "h": "http://www.w3.org/1999/xhtml"}
    (pou,) = ElementTree.fromstring(block.xml.encode()).findall(".//p:pou", space)
    assert (pou.get("name"), pou.get("pouType")) == ("lift_estimator", "functionBlock")
    assert pou.findtext(".//p:ST/h:xhtml", namespaces=space) == block.body
    names = [each.get("name") for each in pou.findall(".//p:variable", space)]
    order = re.findall(r"^  (\w+) : ", block.text, re.MULTILINE)
    assert names == order
    theta = pou.findall(".//p:variable[@name='theta']//p:simpleValue", space)
    start = re.search(r"  theta : .* := \[(.*)\]", block.text)
    assert start
    assert [each.get("value") for each in theta] == start[1].split(", ")
    assert "A < B & C * )." in block.text
    assert "cycle of 5 ms" in block.text


@pytest.mark.parametrize(("forgetting", "orders"), CASES, ids=repr)
def test_no_loop_ends_where_it_begins(forgetting: ehsid.Forgetting, orders: ArxOrders) -> None:
    """MatIEC would not run it; a loop that ends at a variable could be one."""
    block = function_block(EstimatorConfiguration(orders, forgetting=forgetting))
    loops = re.findall(r"FOR \w+ := (\S+) TO (\S+)", block.body)
    assert loops
    assert all(int(first) != int(last) for first, last in loops)


@pytest.mark.parametrize("name", ["step", "Left", "2nd", "a__b", "lift-1", ""])
def test_a_name_that_the_language_does_not_allow(
    exported: EstimatorConfiguration, name: str
) -> None:
    with pytest.raises(ValueError, match="cannot be used in Structured Text"):
        function_block(exported, name=name)


@pytest.mark.slow
def test_blark_reads_the_block_and_the_example(exported: EstimatorConfiguration) -> None:
    """A parser that others wrote takes both files, and finds all variables of the block."""
    block: FunctionBlock = function_block(exported)
    for text in (block.text, EXAMPLE.read_text(encoding="utf-8")):
        parsed = parse_source_code(text)
        assert parsed.exception is None
        (unit,) = parsed.transform().items
        if unit.name == block.name:
            declared = [str(item) for section in unit.declarations for item in section.items]
            assert len(declared) == len(block.variables)
