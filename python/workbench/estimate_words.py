# SPDX-License-Identifier: MIT
"""What the page says of a recursive estimation, as HTML."""

from __future__ import annotations

import re
from collections.abc import Sequence

from ehsid.harness.base.arrays import FloatArray
from ehsid.harness.show.page import Table

from .estimate_look import MOST_RESETS, Estimated
from .look import plain, told
from .shown_units import coefficient, column

MOST_TIMES = 6  # of resets that are named
CODE, CODE_TAG = re.compile("`([a-z0-9. -]+)`"), r"<code>\1</code>"


def servo(found: Estimated) -> str:
    """Returns K, omega_n and xi with their intervals and trust; "" where there is no servo."""
    if not found.servo:
        return ""
    headings, *rows = found.servo
    lines = (f"<p>{CODE.sub(CODE_TAG, plain(line))}</p>" for line in found.servo_told)
    return told(Table("", headings, rows)) + "".join(lines)


def outcome(found: Estimated, time_s: FloatArray) -> str:
    """Says whether the estimate has converged, and its figures."""
    output = column(found.output_name)
    if found.simulated is None:
        simulated = "its simulation diverges"
    elif found.simulated < 0.0:
        simulated = f"its simulation is worse than a constant ({found.simulated:.1f} %)"
    else:
        simulated = f"its simulation fits {found.simulated:.1f} %"
    converged = (
        '<span class="good">✓</span> The estimate has converged.'
        if found.converged
        else '<span class="bad">✗</span> The estimate has not converged.'
    )
    text = (
        f'<p role="status">{converged} RMSE of the prediction by one step '
        f"<b>{plain(output.text(found.rmse))}</b>, fit {found.one_step:.2f} %; with the "
        f"coefficients of the end {simulated}. {_resets(found, time_s)}</p>"
    )
    if found.skipped:
        text += (
            f"<p>{found.skipped} of {found.n_samples} samples carried no information and left the "
            "coefficients as they were.</p>"
        )
    if found.not_white:
        return text + f"<p>{CODE.sub(CODE_TAG, plain(found.not_white))}</p>"
    return text + "<p>The residuals are white: nothing contradicts the deviations.</p>"


def what_to_try(tries: Sequence[str]) -> str:
    """Returns what to try where an estimate is worth little, as a list."""
    items = "".join(f"<li>{CODE.sub(CODE_TAG, plain(one))}</li>" for one in tries)
    return f"<p>What to try:</p><ul>{items}</ul>" if tries else ""


def at_the_end(found: Estimated) -> str:
    """Returns the coefficients at the end of the record as a table."""
    rows = []
    for name, value, deviation in zip(found.names, found.theta, found.deviations, strict=True):
        shown = coefficient(name, found.input_name, found.output_name)
        spread = "" if deviation is None else f"± {shown.factor * deviation:.2g}"
        rows.append([name, f"{shown.factor * value:.5g}", spread, shown.unit])
    return told(Table("", ("at the end", "value", "1-sigma", "unit"), rows))


def _resets(found: Estimated, time_s: FloatArray) -> str:
    count = len(found.reset_samples)
    if not count:
        return "There was no reset."
    times = ", ".join(f"{time_s[one]:.4g} s" for one in found.reset_samples[:MOST_TIMES])
    more = " and later" if count > MOST_TIMES else ""
    number = f"{MOST_RESETS} or more" if count == MOST_RESETS else f"{count}"
    plural = "s" * (count != 1)
    return f"The RMSE showed a change {number} time{plural}, with a reset at {times}{more}."
