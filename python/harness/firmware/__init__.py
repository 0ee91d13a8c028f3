# SPDX-License-Identifier: MIT
"""Exports an offline model to the firmware: one configuration for Python and C++ estimators.

>>> export = configure_from_record(data, ArxOrders(3, 3, 1), forgetting=ehsid.FRatio())
>>> trace = GoldenTrace.of(export.configuration, *liveliest(data))
>>> text = render_header(export.configuration, trace, name="servo")
"""

from .configuration import EstimatorConfiguration, Seed, configure_from_record
from .estimator_fmu import STEM, fmu_files
from .fmu import write_fmu
from .header import (
    GoldenTrace,
    check_name,
    float32_literal,
    liveliest,
    render_c_header,
    render_header,
)
from .of_record import (
    FILE_NAMES,
    chosen_orders,
    header_of_record,
)
from .servo import (
    ServoSettings,
    render_servo_header,
    servo_header_of_record,
)
from .source import render_sources

__all__ = [
    "FILE_NAMES",
    "STEM",
    "EstimatorConfiguration",
    "GoldenTrace",
    "Seed",
    "ServoSettings",
    "check_name",
    "chosen_orders",
    "configure_from_record",
    "float32_literal",
    "fmu_files",
    "header_of_record",
    "liveliest",
    "render_c_header",
    "render_header",
    "render_servo_header",
    "render_sources",
    "servo_header_of_record",
    "write_fmu",
]
