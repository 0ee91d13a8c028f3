# SPDX-License-Identifier: MIT
"""The command `ehsid`: each file parses the options of one subcommand (verb) and calls the work.

At its top, the file of a verb imports only what the options need. The function of the verb imports
the code for the work. Therefore `ehsid --help` and `ehsid VERB --help` answer at once, and a verb
loads only the libraries that it uses.
"""

from __future__ import annotations

from typing import Annotated

import typer

import ehsid

from .console import ManyValues, Quiet, Verbose
from .lazy import Verb, lazy_group, verbs_of_guests
from .usage import examples_text

VERBS = (
    Verb(
        "start",
        "Go from logs and the name plate of a machine to a diagnosis, and say what did it.",
    ),
    Verb("import", "Read a log of any kind, say what was taken for what, and keep it as a record."),
    Verb("estimate", "Estimate a servo and its ARX model, with the code the firmware runs."),
    Verb(
        "identify",
        "Choose order and delay of an ARX model on one half of a record, judged on the other.",
    ),
    Verb(
        "gap",
        "Diagnose the gap between a machine and its simulation: where, which effect, how far.",
        ManyValues,
    ),
    Verb(
        "gap-edit",
        "Test whether a change of the machine was what the diagnosis named: was it that?",
    ),
    Verb(
        "inject",
        "Put an effect of known size into the log of a real machine, to see whether it is found.",
    ),
    Verb(
        "gap-fleet",
        "Diagnose a folder of machines: whose gap is largest, and which of them share one.",
        ManyValues,
    ),
    Verb(
        "watch",
        "Watch machines over months: when something changed, by how much, and what could be seen.",
    ),
    Verb(
        "hunt",
        "Hunt a cause: diagnosis, the experiment that tells most, diagnosis, until one is left.",
    ),
    Verb(
        "export",
        "Write a C++ or C header that starts the firmware's estimator from a model of a record.",
    ),
    Verb("apply", "Write valve tables, friction and loop gains of a machine for its controller."),
    Verb(
        "excite",
        "Choose the signal that shows an effect best, and say from which size on it would be seen.",
    ),
    Verb("simulate", "Simulate a rig on a logged command or on a test signal."),
    Verb(
        "rig new",
        "Write a rig file from what is known of a machine, and fill in the rest.",
        ManyValues,
    ),
    Verb(
        "rig check",
        "Say what of a rig fits records, and which value to change, before anything is fitted.",
    ),
    Verb(
        "effects",
        "List the effects the simulator knows: where they act, their parameters, what shows them.",
    ),
    *verbs_of_guests(),
)

GROUPS = {"rig": "Describe a machine in a rig file (new), and check it against records (check)."}
# Of the command itself and of its groups; those of the other commands stand in their docstrings.
EXAMPLES = {
    "": ("ehsid start run1.csv", "ehsid gap run1.csv --rig rig.toml --out diagnosis"),
    "rig": ("ehsid rig new --out rig.toml", "ehsid rig check rig.toml run1.csv"),
}

# Not `app`: a command has that name, and its module would take the place of this one.
cli = typer.Typer(cls=lazy_group(VERBS, GROUPS, EXAMPLES), no_args_is_help=True)


def _print_version(wanted: bool) -> None:
    if wanted:
        typer.echo(f"ehsid {ehsid.__version__}")
        raise typer.Exit


@cli.callback(
    help="Identify electro-hydraulic servos from their records, and diagnose their simulations.\n\n"
    + examples_text(EXAMPLES[""])
)
def _options(
    ctx: typer.Context,
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            "-V",
            callback=_print_version,
            is_eager=True,
            help="print the version and exit",
        ),
    ] = False,
    verbose: Verbose = False,
    quiet: Quiet = False,
) -> None:
    """Keeps what stands before the name of a command, for that command."""
    ctx.obj = {"verbose": verbose, "quiet": quiet}


def main() -> None:
    """Runs the command `ehsid`; it has this name as `python -m ehsid`, too."""
    cli(prog_name="ehsid")
