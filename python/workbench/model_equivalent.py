# SPDX-License-Identifier: MIT
"""The commands and the Python that do the same as the step Model."""

from __future__ import annotations

from ehsid.harness.catalogue.policies import POLICIES

from .model_choice import recursion_of
from .session import Session


def model_commands(session: Session) -> list[list[str]]:
    """Returns the commands, to be run in the folder of the session."""
    choice, entry = session.settings.model, session.modelled()
    if entry is None:
        return []
    record = f"records/{entry.id}.parquet"
    columns = ["--input", choice.input_name, "--output", choice.output_name]
    tried = ["--orders", choice.orders, "--delays", choice.delays]
    estimator = [*export_options(session), "--method", choice.method]
    return [
        ["ehsid", "identify", record, *columns, *tried, "--out", "model"],
        ["ehsid", "estimate", record, *estimator, "--out", "model"],
    ]


def export_options(session: Session) -> list[str]:
    """Returns columns, orders, forgetting and reset as options of `estimate` and `export`."""
    choice = session.settings.model
    members = {one.name: one.member for one in POLICIES[choice.policy].settings}
    settings = [
        word
        for name, value in choice.settings.items()
        for word in ("--setting", f"{members[name]}={value:.12g}")
    ]
    orders = ["--na", f"{choice.na}", "--nb", f"{choice.nb}", "--nk", f"{choice.nk}"]
    columns = ["--input", choice.input_name, "--output", choice.output_name]
    reset = [] if choice.reset else ["--no-reset"]
    return [*columns, *orders, "--forgetting", choice.policy, *settings, *reset]


def model_python(session: Session) -> list[str]:
    """Returns the Python, to be run in the folder of the session."""
    choice, entry = session.settings.model, session.modelled()
    if entry is None:
        return []
    recursion = recursion_of(choice)
    names = f"input={choice.input_name!r}, output={choice.output_name!r}"
    reset = "" if choice.reset else ", reset=False"
    return [
        "import ehsid",
        "",
        f"record = ehsid.read('records/{entry.id}.parquet')",
        "model = ehsid.identify(",
        f"    record, {names}, orders={choice.orders!r}, delays={choice.delays!r}",
        ")",
        "print(model.summary())",
        "model.save('model')",
        "found = ehsid.estimate(",
        f"    record, {names}, na={choice.na}, nb={choice.nb}, nk={choice.nk},",
        f"    forgetting=ehsid.{recursion.forgetting!r}, method={choice.method!r}{reset},",
        ")",
        "print(found.summary())",
        "found.save('model')",
    ]
