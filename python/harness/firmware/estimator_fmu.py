# SPDX-License-Identifier: MIT
"""The estimator as an FMU: a step of it takes one sample."""

from __future__ import annotations

from .configuration import EstimatorConfiguration
from .fmi_functions import FMI2, fmi3
from .fmu import Model, Variable
from .source import PRECISIONS, Sources

STEM = "servo_estimator"
"""Name of the sources of the estimator in the archive, without .c and .h."""


def _variables(configuration: EstimatorConfiguration, name: str) -> list[Variable]:
    scaling, names = configuration.scaling, configuration.orders.names
    starts = {
        "command": (scaling.command_offset, "command sent at the beginning of the step"),
        "position": (scaling.position_offset, "position measured at the beginning of the step"),
    }
    outputs = {
        "innovation": ("Real", "prediction error, in units of the position"),
        "lambda": ("Real", "forgetting factor"),
        "residual_variance": ("Real", "sigma^2, in squared units of the position"),
        **dict.fromkeys(names, ("Real", "parameter, in the units of the signals")),
        **{f"std_{one}": ("Real", f"standard deviation of {one}") for one in names},
        "status": (
            "Integer",
            f"outcome of the step, see {name}_status in sources/{STEM}.h",
        ),
        "settled": ("Boolean", "are all deviations inside the tolerance?"),
        "converged": ("Boolean", "settled, with white residuals"),
    }
    return [
        *(Variable(one, "input", words, start=float(at)) for one, (at, words) in starts.items()),
        *(Variable(one, "output", words, kind) for one, (kind, words) in outputs.items()),
        Variable("enable", "input", "false: the estimate rests", "Boolean", start=True),
        Variable("reset", "input", "true: back to a vague start", "Boolean", start=False),
    ]


def fmu_files(
    configuration: EstimatorConfiguration,
    sources: Sources,
    *,
    name: str,
    fmi: int = 2,
    dtype: str = "float32",
    dt_s: float | None = None,
) -> dict[str, str]:
    """Returns the text files of the FMU by their place in the archive.

    Parameters
    ----------
    configuration
        settings and seed.
    sources
        what `render_sources` made of the configuration, with this name and dtype and the stem STEM.
    name
        identifier of the model.
    fmi
        version, 2 or 3.
    dtype
        precision; in FMI 3.0 the variables are Float32 or Float64, in 2.0 always double.
    dt_s
        sampling time, s; with it a step of another size is refused.
    """
    real = {"float32": "Float32", "float64": "Float64"}[dtype]
    model = Model(
        name=name,
        title=name,
        description=f"Online estimator: {configuration.orders}, {configuration.forgetting!r}",
        variables=_variables(configuration, name),
        language="C99",
        sources={f"{STEM}.c": sources.source, f"{STEM}.h": sources.header},
        dt_s=dt_s,
        serialised=True,
    )
    values = {
        "X": name.upper(),
        "stem": STEM,
        "dtype": dtype,
        "scaling": configuration.scaling,
        "linkage": "",
        "number_type": "double" if fmi == 2 else f"{name}_real",
        "real_kind": real,
        **PRECISIONS[dtype],
    }
    return model.files(fmi, "fmu.c", FMI2 if fmi == 2 else fmi3(real), values)
