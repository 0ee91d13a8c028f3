# SPDX-License-Identifier: MIT
"""The commands and the Python that do the same as the step Model."""

from __future__ import annotations

from ehsid.harness.app.model_choice import recursion_of
from ehsid.harness.app.session import Session
from ehsid.harness.catalogue.policies import POLICIES
from ehsid.harness.identification.search_range import MOST_DELAY, MOST_ORDER, parse_range


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
    orders = parse_range(choice.orders, "orders", MOST_ORDER)
    delays = parse_range(choice.delays, "delays", MOST_DELAY)
    recursion = recursion_of(choice)
    names = (choice.input_name, choice.output_name)
    return [
        "import ehsid",
        "from ehsid.harness.estimation import estimate, structure",
        "from ehsid.harness.identification import IoData, identify",
        "from ehsid.harness.records import read_record",
        "",
        f"record = read_record('records/{entry.id}.parquet', columns={[*names]!r})",
        f"data = IoData.from_record(record, {names[0]!r}, {names[1]!r})",
        f"model = identify(data, orders={orders!r}, delays={delays!r})",
        "print(model.reason, model.delay_reason)",
        f"orders = structure({choice.na}, {choice.nb}, {choice.nk}, {choice.method!r})",
        f"result = estimate(data, orders, forgetting=ehsid.{recursion.forgetting!r},",
        f"                  reset={choice.reset}, method={choice.method!r})",
        "print(result.to_dict())",
    ]
