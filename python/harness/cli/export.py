# SPDX-License-Identifier: MIT
"""`ehsid export`: writes an estimator for a firmware, or the simulator of a rig as an FMU."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_files, write_text
from ..catalogue.parameters import POLICIES, SERVO_ORDERS, TARGET_POLICY
from .console import Console, about, note
from .export_simulator import export_simulator
from .next_command import Given, estimate_line
from .options import (
    RECORD_HELP,
    ForServo,
    InputColumn,
    Maps,
    Offset,
    OutputColumn,
    Reset,
    hints_of,
    read_io,
)
from .policy_option import (
    Lambda0,
    PolicyName,
    PolicySettings,
    growth_settings,
    make_policy,
    servo_settings,
)

if TYPE_CHECKING:
    from ..firmware.of_record import Whole
    from ..models.identification import ArxOrders, IoData


def _orders(data: IoData, given: tuple[int | None, ...], choose: bool, offset: bool) -> ArxOrders:
    """Returns the given orders (default 3, 3, 1) or those that offline identification chooses."""
    from ..firmware import chosen_orders
    from ..models.identification import ArxOrders

    if choose:
        return chosen_orders(data, offset=offset)
    defaults = zip(given, SERVO_ORDERS, strict=True)
    na, nb, nk = (default if value is None else value for value, default in defaults)
    return ArxOrders(na, nb, nk, offset=offset)


# Whole estimators: the option, the ending of the file, and that of the file beside it.
WHOLE = {"--c-source": (".c", ".h"), "--st": (".st", ".xml"), "--fmu": (".fmu",)}


def _whole(given: dict[str, bool], float64: bool, path: Path | None) -> tuple[str | None, Path]:
    """Returns the option that asks for a whole estimator, if one does, and the file to write.

    given: whether each option that chooses the kind of file is there.
    """
    from ..firmware import FILE_NAMES

    chosen = [option for option, is_given in given.items() if is_given]
    whole = next((option for option in chosen if option in WHOLE), None)
    if whole is None:
        if float64:
            raise ValueError(
                "--float64: a header is float32: expected --c-source, --st or --fmu with it; add "
                "one of them, or leave out --float64"
            )
        return None, path or Path(FILE_NAMES[given["--c"]])
    for option in chosen:
        if option != whole:
            raise ValueError(f"{whole} writes another file than {option}; leave one of them out")
    ending = WHOLE[whole][0]
    file = path or Path(f"servo_estimator{ending}")
    if file.suffix != ending:
        named = "--fmu" if whole == "--fmu" else "--out"
        raise ValueError(
            f"{named} {file}: expected a name that ends in {ending}, e.g. servo_estimator{ending}"
        )
    return whole, file


def export_command(
    record: Annotated[
        Path | None,
        typer.Argument(
            metavar="RECORD",
            help=f"{RECORD_HELP}; or a rig file, TOML, whose simulator --fmu then writes",
            show_default=False,
        ),
    ] = None,
    input_name: InputColumn = "command_v",
    output_name: OutputColumn = "position_m",
    na: Annotated[
        int | None, typer.Option(min=1, max=6, help="past outputs; default 3", show_default=False)
    ] = None,
    nb: Annotated[
        int | None, typer.Option(min=1, max=6, help="past inputs; default 3", show_default=False)
    ] = None,
    nk: Annotated[
        int | None,
        typer.Option(min=0, max=20, help="delay in samples; default 1", show_default=False),
    ] = None,
    choose: Annotated[
        bool, typer.Option("--identify", help="let offline identification choose na, nb, nk")
    ] = False,
    offset: Offset = True,
    forgetting: Annotated[
        PolicyName, typer.Option(help="forgetting policy; f-ratio keeps what the start knows")
    ] = TARGET_POLICY,
    lambda0: Lambda0 = None,
    setting: PolicySettings = None,
    reset: Reset = True,
    inflation: Annotated[
        float | None,
        typer.Option(
            help="factor on the offline covariance; default 10, or so that the model counts for "
            "100 samples at most",
            show_default=False,
        ),
    ] = None,
    maps: Maps = None,
    sampling_time: Annotated[
        float | None,
        typer.Option(
            "--dt",
            metavar="SECONDS",
            help="sampling time, where the log has no time; else the log is resampled to it. Of a "
            "rig: step of its simulator, default 0.001",
            show_default=False,
        ),
    ] = None,
    servo: ForServo = False,
    growth: Annotated[
        Path | None,
        typer.Option(
            metavar="RIG",
            help="the tables of a GrowthMonitor, which tells which effect grows: RECORD is of the "
            "quiet machine, RIG its rig file; --setting then takes hours",
            show_default=False,
        ),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            help="namespace in C++, prefix in C, model of an FMU; default servo, or simulator",
            show_default=False,
        ),
    ] = None,
    c: Annotated[
        bool, typer.Option("--c", help="C99, for ehsid/c_api.h, without the self-test")
    ] = False,
    c_source: Annotated[
        bool,
        typer.Option("--c-source", help="the whole estimator in C99, a .c with its .h beside it"),
    ] = False,
    st: Annotated[
        bool,
        typer.Option(
            "--st",
            help="the whole estimator as a function block for a PLC, in Structured Text, with "
            "PLCopen XML beside it",
        ),
    ] = False,
    fmu: Annotated[
        Path | None,
        typer.Option(
            help="the whole estimator as an FMU for co-simulation, with its sources; in place of "
            "--out. Or a rig file, TOML, in place of RECORD: its simulator, to --out",
            show_default=False,
        ),
    ] = None,
    fmi: Annotated[
        int | None,
        typer.Option(
            min=2, max=3, help="with --fmu: version of FMI; default 2", show_default=False
        ),
    ] = None,
    float64: Annotated[
        bool, typer.Option("--float64", help="with --c-source, --st or --fmu: in double precision")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="file to write; default servo_configuration.hpp, .h with --c, servo_estimator.c "
            "with --c-source, .st with --st, growth_tables.hpp with --growth, RIG.fmu with a rig "
            "file",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write a C++ or C header that starts the firmware's estimator from a model of a record.

    Or the estimator itself, or with a rig file its simulator as an FMU.

    Examples: ehsid export rec.csv --na 3 --nb 3 --nk 1 --out servo_configuration.hpp

    ehsid export rec.csv --servo --out servo_configuration.hpp

    ehsid export rec.csv --growth rig.toml --out growth_tables.hpp

    ehsid export rec.csv --c-source --out servo_estimator.c

    ehsid export rec.csv --st --out servo_estimator.st

    ehsid export rec.csv --fmu estimator.fmu --fmi 3

    ehsid export --fmu rig.augmented.toml --out simulator.fmu
    """
    from ..firmware import (
        STEM,
        check_name,
        header_of_record,
        servo_header_of_record,
    )
    from ..firmware.growth import HOURS
    from ..firmware.growth_header import growth_header_of_record
    from ..rigs import read_rig

    of_arx = {
        "--na": na is not None,
        "--nb": nb is not None,
        "--nk": nk is not None,
        "--identify": choose,
        "--no-offset": not offset,
        "--forgetting": forgetting != TARGET_POLICY,
        "--lambda0": lambda0 is not None,
        "--no-reset": not reset,
        "--inflation": inflation is not None,
    }
    if fmi is not None and fmu is None:
        raise ValueError("--fmi goes with --fmu; give the name of the FMU with it")
    rig_file = fmu if record is None else record
    if rig_file is not None and rig_file.suffix.lower() == ".toml":
        of_estimators = {
            **of_arx,
            "--setting": setting is not None,
            "--map": maps is not None,
            "--servo": servo,
            "--growth": growth is not None,
            "--c": c,
            "--c-source": c_source,
            "--st": st,
            "--float64": float64,
        }
        export_simulator(rig_file, fmu, out, of_estimators, name, fmi, sampling_time)
        return
    if record is None:
        raise ValueError(
            f"RECORD is missing: expected {RECORD_HELP}; or --fmu RIG.toml for the simulator of a "
            "rig; `ehsid export --help` lists what there is"
        )
    name = name or "servo"
    check_name(name)
    kinds = {"--servo": servo, "--c": c, "--c-source": c_source, "--st": st}
    if growth is not None:
        wrong = {**of_arx, **kinds, "--fmu": fmu is not None, "--float64": float64}
        hours = growth_settings(setting, wrong).get("hours", HOURS)
        path = out or Path("growth_tables.hpp")
        with result_files(path, "export", inputs=[record, growth]) as folder:
            rig = read_rig(growth)
            data, _ = read_io(record, input_name, output_name, hints_of(maps, sampling_time))
            with about(record):
                tables = growth_header_of_record(record, data, rig, name=name, hours=hours)
            write_text(folder / path.name, tables.text)
        Console().print(f"{path}: {tables.summary}", soft_wrap=True)
        return
    if fmu is not None:
        kinds |= {"--fmu": True, "--out": out is not None}
    whole, path = _whole(kinds, float64, fmu or out)
    if servo:
        chosen = servo_settings(setting, of_arx)
        with result_files(path, "export", inputs=[record]) as folder:
            data, _ = read_io(record, input_name, output_name, hints_of(maps, sampling_time))
            with about(record):
                made = servo_header_of_record(record, data, chosen, name=name, c=c)
            write_text(folder / path.name, made.text)
        Console().print(f"{path}: {made.summary}", soft_wrap=True)
        for line in made.words:
            note(f"note: {line}")
        return
    if choose and any(value is not None for value in (na, nb, nk)):
        raise ValueError("--identify chooses na, nb and nk itself; leave them out, or --identify")
    if inflation is not None and not 1.0 <= inflation < math.inf:
        raise ValueError(f"--inflation {inflation:g}: expected a finite number of at least 1")
    policy = make_policy(forgetting, lambda0, setting)
    dtype = "float64" if float64 else "float32"
    form: Whole | None = None
    if whole is not None:
        form = "st" if whole == "--st" else "c"
    beside = [path.with_suffix(ending).name for ending in WHOLE.get(whole or "", ())[1:]]
    with result_files(path, "export", beside, inputs=[record]) as folder:
        data, _ = read_io(record, input_name, output_name, hints_of(maps, sampling_time))
        with about(record):
            orders = _orders(data, (na, nb, nk), choose, offset)
            header = header_of_record(
                record,
                data,
                orders,
                forgetting=policy,
                inflation=inflation,
                reset=reset,
                name=name,
                c=c,
                whole=form,
                stem=path.stem if whole == "--c-source" else STEM,
                dtype=dtype,
            )
        summary = header.summary
        if whole == "--fmu":
            held = header.write_fmu(folder / path.name, name, fmi or 2, dtype, data.dt_s)
            summary = f"{summary}; {held}"
        else:
            write_text(folder / path.name, header.text)
        for other in beside:
            write_text(folder / other, header.beside)
    Console().print(f"{path}: {summary}", soft_wrap=True)
    if not header.converges:
        given = Given(record, input_name, output_name, maps or (), sampling_time)
        following = estimate_line(given, header.orders)
        note(
            "note: run over this record, the estimator does not report that it has converged; "
            f"`{following}` says what to try"
        )
    if policy.forgets_the_start:
        *others, last = (
            name for name, info in POLICIES.items() if not info.policy().forgets_the_start
        )
        Console(stderr=True).print(
            f"note: {policy!r} forgets from the first sample on, the offline model too; "
            f"{', '.join(others)} and {last} keep it, see docs/export.md",
            soft_wrap=True,
        )
