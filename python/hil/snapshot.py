# SPDX-License-Identifier: MIT
"""Snapshot of an estimate during a run: a file from which an estimator can begin again.

No request of the protocol reads the covariance of the target. The host runs the same estimator on
the same samples, so its covariance is that of the target as long as both agree bit for bit.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import msgspec
import numpy as np

import ehsid
from ehsid.harness.base.encoding import from_json, json_text
from ehsid.harness.base.files import write_text
from ehsid.harness.firmware.configuration import EstimatorConfiguration, Seed
from ehsid.harness.models.identification import IdentificationError

from .errors import HilError

ENDING = ".snapshot.json"
# P comes rounded to float32 and may then not be positive definite. A share of its variances on the
# diagonal makes it so; the smallest one that does is taken.
SHARES = (0.0, 1e-7, 1e-6, 1e-5, 1e-4)


@dataclass(frozen=True)
class Snapshot:
    """Content of the file.

    Attributes
    ----------
    rig, time_s
        name of the rig, and time in the run, s.
    na, nb, nk, offset
        orders of the estimator with n parameters.
    command_scale, position_scale, command_offset, position_offset
        scaling of the signals, V and m.
    theta
        the n parameters, in the units of the signals about the offsets.
    u, d
        factors of the covariance P = u diag(d) u' of the scaled parameters; u by rows.
    noise_variance
        residual variance, m^2.
    """

    schema_version: Literal[1]
    rig: str
    time_s: float
    na: int
    nb: int
    nk: int
    offset: bool
    command_scale: float
    position_scale: float
    command_offset: float
    position_offset: float
    theta: tuple[float, ...]
    u: tuple[tuple[float, ...], ...]
    d: tuple[float, ...]
    noise_variance: float


def taken(
    estimator: ehsid.ArxEstimator,
    configuration: EstimatorConfiguration,
    theta: tuple[float, ...],
    *,
    rig: str,
    time_s: float,
) -> Snapshot:
    """Returns the snapshot of the target's estimate.

    Parameters
    ----------
    estimator
        the host's estimator on the same samples.
    configuration
        its settings.
    theta
        the target's parameters.
    rig, time_s
        see `Snapshot`.

    Raises
    ------
    HilError
        target and host do not agree, so that the covariance of the target is not known; or it is
        not positive definite, also not with a share of its variances.
    """
    ours, theirs = (np.asarray(one, dtype=np.float32) for one in (estimator.theta_hat, theta))
    if ours.tobytes() != theirs.tobytes():
        raise HilError(
            "no snapshot: the parameters of the target are not those of this host on the same "
            "samples, so its covariance is not known; build the firmware with -ffp-contract=off "
            "and the version of this ehsid"
        )
    seed = _seed(estimator)
    orders, scaling = configuration.orders, configuration.scaling
    return Snapshot(
        schema_version=1,
        rig=rig,
        time_s=time_s,
        na=orders.na,
        nb=orders.nb,
        nk=orders.nk,
        offset=orders.offset,
        command_scale=scaling.command_scale,
        position_scale=scaling.position_scale,
        command_offset=scaling.command_offset,
        position_offset=scaling.position_offset,
        theta=tuple(map(float, seed.theta)),
        u=tuple(tuple(map(float, row)) for row in seed.u),
        d=tuple(map(float, seed.d)),
        noise_variance=seed.noise_variance,
    )


def _seed(estimator: ehsid.ArxEstimator) -> Seed:
    covariance = np.asarray(estimator.P, dtype=np.float64)
    variances = np.diag(np.diag(covariance))
    for share in SHARES:
        with suppress(IdentificationError):
            return Seed.from_covariance(
                estimator.theta_hat, covariance + share * variances, estimator.residual_variance
            )
    raise HilError(
        "no snapshot: the parameters are not told apart well enough yet, so that their covariance "
        "is singular; wait until the signals have moved more"
    )


def write_snapshot(path: Path, snapshot: Snapshot) -> None:
    """Writes the file, whole or not at all."""
    write_text(path, json_text(snapshot))


def read_snapshot(path: Path) -> Snapshot:
    """Reads the file.

    Raises
    ------
    HilError
        it cannot be read, or is not the file of a snapshot.
    """
    try:
        return from_json(path.read_bytes(), Snapshot)
    except OSError as error:
        raise HilError(
            f"{path}: cannot be read ({error.strerror}): expected the file of a snapshot; check "
            "the path"
        ) from None
    except msgspec.DecodeError as error:
        raise HilError(
            f"{path}: this is not the file of a snapshot ({error}): expected one that was stored "
            "during a run; name another one"
        ) from None


def restored(snapshot: Snapshot, configuration: EstimatorConfiguration) -> EstimatorConfiguration:
    """Returns the settings with which an estimator begins at the estimate of a snapshot.

    Raises
    ------
    HilError
        the orders are others, or the numbers are none that an estimator accepts.
    """
    orders = configuration.orders
    held = (snapshot.na, snapshot.nb, snapshot.nk, snapshot.offset)
    if held != (orders.na, orders.nb, orders.nk, orders.offset):
        raise HilError(
            f"the snapshot has na {snapshot.na}, nb {snapshot.nb}, nk {snapshot.nk}: expected "
            f"{orders}, the orders of this run; take a snapshot with the same orders"
        )
    made = replace(
        configuration,
        scaling=ehsid.Scaling(
            command_scale=snapshot.command_scale,
            position_scale=snapshot.position_scale,
            command_offset=snapshot.command_offset,
            position_offset=snapshot.position_offset,
        ),
        seed=Seed(
            np.array(snapshot.theta),
            np.array(snapshot.u),
            np.array(snapshot.d),
            snapshot.noise_variance,
        ),
    )
    try:
        made.estimator()
    except (ValueError, TypeError) as error:
        raise HilError(
            f"the estimate of the snapshot is not one that an estimator can begin with ({error}): "
            "expected a file as it was stored; take another one"
        ) from None
    return made
