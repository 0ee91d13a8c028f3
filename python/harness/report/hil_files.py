# SPDX-License-Identifier: MIT
"""Converts a run with the hardware in the loop to plain values and to a row of a table."""

from __future__ import annotations

from typing import Any

import ehsid
from ehsid.harness.deploy.hil.answers import Identity
from ehsid.harness.deploy.hil.comparison import Agreement, rmse
from ehsid.harness.deploy.hil.configuration import POLICIES
from ehsid.harness.deploy.hil.run import RunResult


def plain_identity(identity: Identity) -> dict[str, Any]:
    """Returns the identity of the target as plain values for the JSON file."""
    return {
        "board": identity.board,
        "firmware": ".".join(map(str, identity.firmware)),
        "protocol": identity.version,
        "policies": [POLICIES[i].__name__ for i in sorted(identity.policies) if i < len(POLICIES)],
        "parameters": sorted(identity.parameters),
    }


def plain_run(name: str, run: RunResult, agreement: Agreement) -> dict[str, Any]:
    """Returns a run and its agreement with the host as plain values for the JSON file."""
    last, configuration = run.results[-1], run.plan.configuration
    names = configuration.estimator.orders.names
    return {
        "name": name,
        "rig": run.plan.rig.name,
        "dt_s": run.plan.dt_s,
        "samples": len(run.results),
        "seconds": round(run.seconds, 3),
        "change": dict(run.plan.change),
        "change_at_sample": run.plan.change_at,
        "forgetting": repr(configuration.estimator.forgetting),
        "orders": str(configuration.estimator.orders),
        "parameters": {
            name: {"value": float(value), "standard_deviation": float(deviation)}
            for name, value, deviation in zip(
                names, agreement.theta[-1], agreement.replay.deviation[-1], strict=True
            )
        },
        "rmse_m": rmse(run),
        "forgetting_factor": last.forgetting_factor,
        "fit_percent": last.fit_percent,
        "converged": last.converged,
        "resets": last.resets,
        "status": ehsid.Status(last.status).name,
        "controller": {
            "position_control": configuration.controller.position_control,
            "gain_fixed_v_m": configuration.controller.fixed_gain_v_m,
            "gain_v_m": last.gain_v_m,
            "velocity_gain_m_s_v": last.velocity_gain_m_s_v,
            "share_retuned": sum(result.gain_estimated for result in run.results)
            / len(run.results),
            "share_at_limit": sum(result.limited for result in run.results) / len(run.results),
        },
        "equal_to_host": agreement.equal,
        "samples_that_differ": agreement.different.size,
        "largest_difference": agreement.largest,
        "line": run.counters,
        "target_resets_before_samples": list(run.restarts),
    }


def run_row(name: str, run: RunResult, agreement: Agreement) -> dict[str, str]:
    """Returns the row of a run for the table on the terminal: its cells by heading."""
    last = run.results[-1]
    return {
        "run": name,
        "RMSE, mm": f"{1e3 * rmse(run):.4g}",
        "fit, %": f"{last.fit_percent:.1f}",
        "lambda": f"{last.forgetting_factor:.4f}",
        "resets": str(last.resets),
        "converged": "yes" if last.converged else "no",
        "bits": "same" if agreement.equal else f"{agreement.different.size} other",
    }
