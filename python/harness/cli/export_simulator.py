# SPDX-License-Identifier: MIT
"""`ehsid export --fmu` of a rig file: writes its simulator as an FMU."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from ..base.files import result_files
from .console import Console, about
from .options import hints_of

# As `ehsid simulate` runs a test signal, s.
DT_S = 1e-3


def export_simulator(
    rig_file: Path,
    fmu: Path | None,
    out: Path | None,
    given: Mapping[str, bool],
    name: str | None,
    fmi: int | None,
    dt_s: float | None,
) -> None:
    """Writes the simulator of a rig file as an FMU.

    Parameters
    ----------
    rig_file
        the rig file, given in place of a record, or behind --fmu.
    fmu, out, name, fmi, dt_s
        the options --fmu, --out, --name, --fmi and --dt, or None.
    given
        options of estimators, and whether they are given.

    Raises
    ------
    ValueError
        options contradict each other, or the rig cannot be simulated.
    """
    wrong = [option for option, is_given in given.items() if is_given]
    if wrong:
        raise ValueError(
            f"{wrong[0]} is of an estimator, and {rig_file} is a rig file: expected --fmu, --fmi, "
            "--name, --dt and --out with it; leave it out, or name a record"
        )
    if fmu is None:
        raise ValueError(
            f"{rig_file} is a rig file: expected --fmu {rig_file.stem}.fmu with it, for its "
            "simulator; or name a record, for an estimator"
        )
    if fmu != rig_file and out is not None:
        raise ValueError("--fmu writes another file than --out; leave one of them out")
    option, path = ("--fmu", fmu) if fmu != rig_file else ("--out", out)
    if path is None:
        path = Path(f"{rig_file.stem}.fmu")
    if path.suffix != ".fmu":
        raise ValueError(
            f"{option} {path}: expected a name that ends in .fmu, e.g. {rig_file.stem}.fmu"
        )
    from ..firmware import check_name
    from ..firmware.simulator_fmu import simulator_fmu
    from ..rigs import read_rig

    hints_of(None, dt_s)
    name, dt_s = check_name(name or "simulator"), DT_S if dt_s is None else dt_s
    with result_files(path, "export", inputs=[rig_file]) as folder:
        rig = read_rig(rig_file)
        with about(rig_file):
            made = simulator_fmu(rig, name=name, fmi=fmi or 2, dt_s=dt_s)
        words = made.write(folder / path.name)
    Console().print(f"{path}: {words}", soft_wrap=True)
