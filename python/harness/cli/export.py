# SPDX-License-Identifier: MIT
"""`ehsid export`: writes an offline model and estimator settings as a firmware header."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from ..base.files import result_files, write_text
from ..catalogue.parameters import POLICIES
from .console import Console, about, note
from .next_command import Given, estimate_line
from .options import (
    InputColumn,
    Maps,
    Offset,
    OutputColumn,
    RecordFile,
    Reset,
    SamplingTime,
    hints_of,
    read_io,
)
from .policy_option import Lambda0, PolicyName, PolicySettings, make_policy, servo_settings

if TYPE_CHECKING:
    from ..models.identification import ArxOrders, IoData


def _orders(data: IoData, given: tuple[int | None, ...], choose: bool, offset: bool) -> ArxOrders:
    """Returns the given orders (default 3, 3, 1) or those that offline identification chooses."""
    from ..firmware import chosen_orders
    from ..models.identification import ArxOrders

    if choose:
        return chosen_orders(data, offset=offset)
    defaults = zip(given, (3, 3, 1), strict=True)
    na, nb, nk = (default if value is None else value for value, default in defaults)
    return ArxOrders(na, nb, nk, offset=offset)


def _precision(float64: bool, c_source: bool, path: Path, others: dict[str, bool]) -> str:
    """Returns the precision of C sources, after checks of the options that go with --c-source."""
    if not c_source:
        if float64:
            raise ValueError("--float64 goes with --c-source; a header is float32")
        return "float32"
    for option, given in others.items():
        if given:
            raise ValueError(f"--c-source writes another file than {option}; leave one of them out")
    if path.suffix != ".c":
        raise ValueError(f"--out {path}: expected a name that ends in .c, e.g. servo_estimator.c")
    return "float64" if float64 else "float32"


def export_command(
    record: RecordFile,
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
    ] = "f-ratio",
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
    sampling_time: SamplingTime = None,
    servo: Annotated[
        bool,
        typer.Option(
            "--servo",
            help="ServoEstimator, for K, omega_n and xi, in place of an ARX model; --setting then "
            "takes delay, drift and tolerance",
        ),
    ] = False,
    name: Annotated[str, typer.Option(help="namespace in C++, prefix in C")] = "servo",
    c: Annotated[
        bool, typer.Option("--c", help="C99, for ehsid/c_api.h, without the self-test")
    ] = False,
    c_source: Annotated[
        bool,
        typer.Option("--c-source", help="the whole estimator in C99, a .c with its .h beside it"),
    ] = False,
    float64: Annotated[
        bool, typer.Option("--float64", help="with --c-source: in double precision")
    ] = False,
    out: Annotated[
        Path | None,
        typer.Option(
            help="file to write; default servo_configuration.hpp, .h with --c, servo_estimator.c "
            "with --c-source",
            show_default=False,
        ),
    ] = None,
) -> None:
    """Write a C++ or C header that starts the firmware's estimator from a model of a record.

    Example: ehsid export rec.csv --na 3 --nb 3 --nk 1 --out servo_configuration.hpp
    Example: ehsid export rec.csv --servo --out servo_configuration.hpp
    Example: ehsid export rec.csv --c-source --out servo_estimator.c
    """
    from ..firmware import (
        FILE_NAMES,
        check_name,
        header_of_record,
        servo_header_of_record,
        sources_of_record,
    )

    check_name(name)
    path = out or Path("servo_estimator.c" if c_source else FILE_NAMES[c])
    dtype = _precision(float64, c_source, path, {"--servo": servo, "--c": c})
    if servo:
        chosen = servo_settings(
            setting,
            {
                "--na": na is not None,
                "--nb": nb is not None,
                "--nk": nk is not None,
                "--identify": choose,
                "--no-offset": not offset,
                "--forgetting": forgetting != "f-ratio",
                "--lambda0": lambda0 is not None,
                "--no-reset": not reset,
                "--inflation": inflation is not None,
            },
        )
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
    kinds = {"stem": path.stem, "dtype": dtype} if c_source else {"c": c}
    make = sources_of_record if c_source else header_of_record
    beside = [path.with_suffix(".h").name] if c_source else []
    with result_files(path, "export", beside, inputs=[record]) as folder:
        data, _ = read_io(record, input_name, output_name, hints_of(maps, sampling_time))
        with about(record):
            orders = _orders(data, (na, nb, nk), choose, offset)
            header = make(
                record,
                data,
                orders,
                forgetting=policy,
                inflation=inflation,
                reset=reset,
                name=name,
                **kinds,
            )
        write_text(folder / path.name, header.text)
        for declarations in beside:
            write_text(folder / declarations, header.declarations)
    Console().print(f"{path}: {header.summary}", soft_wrap=True)
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
