# SPDX-License-Identifier: MIT
"""A loop over an opened simulator, written apart from the one of the product."""

from __future__ import annotations

import ctypes as c

import numpy as np

from ehsid.harness.base.numbers import FloatArray
from ehsid.harness.simulators.opening import FmuFunctions, PythonSteps

VALUES = (c.c_void_p, c.c_void_p, c.c_size_t, c.c_void_p)


def run(stepper: FmuFunctions | PythonSteps, inputs: FloatArray, dt_s: float) -> FloatArray:
    """The outputs at each sample; inputs, shape (n, inputs), are held from it to the next."""
    if isinstance(stepper, PythonSteps):
        found = [list(stepper.read())]
        found += [list(stepper.step(dt_s, row)) for row in inputs[:-1].tolist()]
        return np.array(found)
    more = (c.c_size_t,) if stepper.major == 3 else ()
    transfer = c.CFUNCTYPE(c.c_int, *VALUES, *more)
    setter, getter = transfer(stepper.set_real), transfer(stepper.get_real)
    flags, last = [c.c_bool() for _ in range(3)], c.c_double()
    told = (*(c.addressof(flag) for flag in flags), c.addressof(last))
    pointers = (c.c_void_p,) * 4 if stepper.major == 3 else ()
    kind = c.c_bool if stepper.major == 3 else c.c_int
    advance = c.CFUNCTYPE(c.c_int, c.c_void_p, c.c_double, c.c_double, kind, *pointers)(
        stepper.do_step
    )
    outputs = np.zeros(stepper.output_refs.size)

    def moved(function: c._FuncPointer, refs: FloatArray, values: FloatArray) -> None:
        size = (values.size,) if stepper.major == 3 else ()
        status = function(stepper.component, refs.ctypes.data, refs.size, values.ctypes.data, *size)
        assert status == 0

    def read() -> FloatArray:
        moved(getter, stepper.output_refs, outputs)
        return (outputs - stepper.output_offset) / stepper.output_scale

    found = [read().tolist()]
    for i, row in enumerate(inputs[:-1]):
        moved(setter, stepper.input_refs, stepper.input_scale * row + stepper.input_offset)
        assert advance(stepper.component, i * dt_s, dt_s, 1, *(told if more else ())) == 0
        found.append(read().tolist())
    return np.array(found)
