# SPDX-License-Identifier: MIT
"""Renders a configuration as a function block in Structured Text (IEC 61131-3), and as PLCopen XML.

The block has the statements of the C++ estimator in the same order, so it gives the same bits where
the controller computes in IEEE arithmetic and rounds every operation to its type. It uses no
function but ABS and SQRT, no pointer, and no call of a vendor. Conditions on NaN and Inf are
comparisons with the largest number, which are false for both.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from xml.sax.saxutils import escape

import ehsid

from .block_variables import SECTIONS, XHTML, BlockNumbers, Section, Variable
from .configuration import EstimatorConfiguration
from .header import template

# Words of IEC 61131-3 (third edition) and names of its standard functions that a name may not be.
TAKEN = (
    "abs acos action add and any array asin at atan bool by byte case class concat "
    "configuration constant continue cos ctd ctu ctud date delete dint div do dt dword "
    "else elsif end exit exp expt extends false find for from function ge gt if "
    "implements in insert int interface le left len limit lint ln log lreal lt lword max "
    "method mid min mod move mul mux namespace ne not null of on or override pointer "
    "program public r read real reference repeat replace resource retain return right rol "
    "ror rs s sel shl shr sin sint sqrt sr step string struct sub super tan task then "
    "this time to tod tof ton tp transition true trunc type udint uint ulint until using "
    "usint var when while with word write xor"
)


@dataclass(frozen=True)
class FunctionBlock:
    """An estimator as a function block."""

    name: str
    variables: tuple[Variable, ...]
    body: str
    """Statements, without the declarations."""
    head: tuple[str, ...]
    """Lines that say what it is and where its numbers come from."""

    @property
    def text(self) -> str:
        """The block as a file of Structured Text."""
        # A name of a file must not end the comment.
        head = (f"  {line}".rstrip().replace("*)", "* )") for line in self.head)
        lines = ["(*", *head, "*)"]
        lines.append(f"FUNCTION_BLOCK {self.name}")
        for section in SECTIONS:
            lines += [section, *(each.declaration for each in self._of(section)), "END_VAR"]
        return "\n".join([*lines, "", self.body.rstrip(), "END_FUNCTION_BLOCK", ""])

    @property
    def xml(self) -> str:
        """The block as PLCopen XML (TC6, version 2.01), without a date, so that it repeats."""
        moment = "1970-01-01T00:00:00"
        interface = "".join(
            f"<{tag}>{''.join(each.element for each in self._of(section))}</{tag.split()[0]}>"
            for section, tag in SECTIONS.items()
        )
        note = "\n".join(self.head)
        return (
            '<?xml version="1.0" encoding="utf-8"?>\n'
            '<project xmlns="http://www.plcopen.org/xml/tc6_0201">'
            f'<fileHeader companyName="" productName="ehsid" productVersion="{ehsid.__version__}" '
            f'creationDateTime="{moment}" />'
            f'<contentHeader name="{self.name}" modificationDateTime="{moment}">'
            "<coordinateInfo>"
            '<fbd><scaling x="1" y="1" /></fbd><ld><scaling x="1" y="1" /></ld>'
            '<sfc><scaling x="1" y="1" /></sfc></coordinateInfo></contentHeader>'
            "<types><dataTypes /><pous>"
            f'<pou name="{self.name}" pouType="functionBlock"><interface>{interface}</interface>'
            f"<body><ST>{_kept(self.body)}</ST></body>"
            f"<documentation>{_kept(note)}</documentation>"
            "</pou></pous></types><instances><configurations /></instances></project>\n"
        )

    def _of(self, section: Section) -> Iterable[Variable]:
        return (each for each in self.variables if each.section == section)


LOOP = re.compile(r"( *)FOR (\w+) := (\d+) TO (\d+)(?: BY -1)? DO(?: (.*) END_FOR;)?")


def _without_single_passes(body: str) -> str:
    """Writes a loop of one pass as its statements.

    MatIEC, the compiler of Beremiz and OpenPLC, does not run a loop whose first and last number
    are the same (seen with its version of October 2024). For this reason no loop of the template
    begins or ends at a variable.
    """
    lines: list[str] = []
    single: list[bool] = []
    for line in body.splitlines():
        found = LOOP.fullmatch(line)
        away = 2 * sum(single)
        if found:
            indent, name, first, last, inner = found.groups()
            is_single = first == last
            if is_single:
                lines.append(f"{indent[away:]}{name} := {first};")
                lines += [f"{indent[away:]}{inner}"] if inner else []
            else:
                lines.append(line[away:])
            if not inner:
                single.append(is_single)
        elif line.strip() == "END_FOR;":
            if not single.pop():
                lines.append(line[2 * sum(single) :])
        else:
            lines.append(line[away:] if line.strip() else line)
    return "\n".join(lines)


def _kept(text: str) -> str:
    """Text whose spaces and lines stay as they are."""
    return f'<xhtml xmlns="{XHTML}" xml:space="preserve">{escape(text)}</xhtml>'


def function_block(
    configuration: EstimatorConfiguration,
    *,
    name: str = "servo",
    dtype: str = "float32",
    dt_s: float | None = None,
    provenance: Sequence[str] = (),
) -> FunctionBlock:
    """Returns the estimator of a configuration as a function block.

    Parameters
    ----------
    name
        name of the block, without its suffix `_estimator`.
    dtype
        float32 for REAL, float64 for LREAL.
    dt_s
        sampling time of the record, s, which the cycle of the task must have.
    provenance
        lines that say where the numbers come from.

    Raises
    ------
    ValueError
        the name is a word of IEC 61131-3 or no identifier, or a setting is out of its range.
    """
    if not re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name) or name.lower() in TAKEN.split():
        raise ValueError(
            f"the name {name!r} cannot be used in Structured Text; expected a letter, then "
            "letters, digits and single underscores, and no word of the language, e.g. servo"
        )
    configuration.estimator(dtype)  # raises ValueError for settings out of range
    numbers = BlockNumbers(configuration, dtype)
    orders, policy = configuration.orders, configuration.forgetting.info
    n = orders.n_parameters
    # From None on the estimator never resets.
    body = template("estimator_body.st.j2").render(
        n=n,
        na=orders.na,
        nb=orders.nb,
        nk=orders.nk,
        offset=orders.offset,
        commands=orders.nk + orders.nb,
        full=max(orders.na, orders.nk + orders.nb - 1),
        pairs=n * (n - 1) // 2,
        policy=policy.id,
        policy_name=policy.source,
        follows_errors=policy.id in ("error_driven", "f_ratio"),
        skips_nothing=configuration.rls.information_margin != 0.0,
        reset=configuration.reset,
        to_real=f"DINT_TO_{numbers.type}",
        real=numbers.typed,
    )
    parameters = ", ".join(orders.names)
    cycle = "" if dt_s is None else f" The task must have a cycle of {1e3 * dt_s:.6g} ms."
    head = (
        f"Written by `ehsid export`, ehsid {ehsid.__version__}; do not edit, export again.",
        "Online estimator of an ARX model of a servo: recursive least squares on UD factors,",
        f"Eqs. (12) to (14) of Ghazali et al. (2011). {orders}; parameters {parameters}.",
        f"Forgetting: {configuration.forgetting!r}.{cycle}",
        *provenance,
        "",
        "Call it once a cycle with the command sent at this cycle and the position measured at it.",
        "Where the cycle before was lost or late, set cycle_lost: older samples are then no past.",
        "status: 0 ok, 1 too few past samples, 2 no information, 3 switched off, 4 the plant has",
        "changed and P begins anew, 5 not a number, 6 not plausible, 7 result beyond all numbers.",
        "From 5 on the estimate stays as it was.",
    )
    return FunctionBlock(
        f"{name}_estimator", tuple(numbers.variables()), _without_single_passes(body), head
    )
