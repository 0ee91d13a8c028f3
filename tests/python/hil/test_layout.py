# SPDX-License-Identifier: MIT
"""The table of messages against the sources of the firmware and against the document."""

import re
import runpy
from enum import IntEnum, IntFlag

import pytest
from hil_firmware import ROOT

import ehsid
from ehsid.harness.models.estimation.servo import KEYS
from ehsid.hil import messages
from ehsid.hil.frames import Field, Message, Type, check
from ehsid.hil.messages import Flags, Kind, Reason, Settings, State

FIRMWARE = ROOT / "examples" / "firmware" / "servo"
HEADER = (FIRMWARE / "messages.hpp").read_text(encoding="utf-8")
# Names in the firmware that are not those of the fields.
OTHER_NAMES = {"flags": "kGainFromEstimate", "n": "parameters", "parameters": "kParameterCounts"}
READ = re.compile(
    r"(?:\{(?P<list>(?:\s*&[\w.]+,?)+)\}\)\s*\{\s*\*\w+|(?P<single>[\w.]+)) = in\.(?P<type>\w+)\(\)"
)


def function(file: str, name: str) -> str:
    """The text of a function, from its name to the brace that ends it."""
    text = (FIRMWARE / file).read_text(encoding="utf-8")
    (found,) = re.findall(rf"^\w[^;\n]*\b{name}\([^;]*?\{{\n.*?^\}}", text, re.S | re.M)
    return str(found)


def constant(name: str) -> int:
    (found,) = re.findall(rf"\b{name} = (\d+);", HEADER)
    return int(found)


def read_by(text: str) -> list[tuple[str, str]]:
    """Names and types of the numbers that a text reads, in order."""
    return [
        (name.strip(" \n&"), match["type"])
        for match in READ.finditer(text)
        for name in (match["list"] or match["single"]).split(",")
    ]


def same_name(field: Field, source: str) -> bool:
    """Whether a C++ expression has the name of the field, with or without its unit."""
    words = OTHER_NAMES.get(field.name, field.name).split("_")
    plain = source.replace("_", "").lower()
    return any("".join(words[:end]).lower() in plain for end in range(1, len(words) + 1))


@pytest.mark.parametrize(
    ("enum", "name"),
    [(Kind, "Request"), (Kind, "Answer"), (State, "State"), (Reason, "Reason")],
    ids=["requests", "answers", "states", "reasons"],
)
def test_numbers_are_those_of_the_firmware(enum: type[IntEnum], name: str) -> None:
    (text,) = re.findall(rf"enum class {name} : std::uint8_t {{(.*?)}};", HEADER, re.S)
    theirs = {key: int(number, 0) for key, number in re.findall(r"(\w+) = (\w+)", text)}
    theirs.pop("none", None)
    ours = {member.name.lower(): member.value for member in enum}
    if enum is Kind:
        ours = {key: value for key, value in ours.items() if (value >= 0x80) == (name == "Answer")}
    assert ours == theirs


@pytest.mark.parametrize(("enum", "title"), [(Settings, "configure"), (Flags, "result")])
def test_flags_are_those_of_the_firmware(enum: type[IntFlag], title: str) -> None:
    text = HEADER.partition(f"// Flags of `{title}`")[2].partition("\n\n")[0]
    theirs = re.findall(r"\bk(\w+) = 1U << (\d)U", text)
    assert [(flag.name or "").replace("_", "").lower() for flag in enum] == [
        name.lower() for name, _ in theirs
    ]
    assert [flag.value for flag in enum] == [1 << int(bit) for _, bit in theirs]


def test_sizes_are_those_of_the_firmware() -> None:
    for name in ("HELLO", "CONFIGURE", "CONFIGURE_SERVO", "START", "SAMPLE"):
        in_header = f"k{name.title().replace('_', '')}Bytes"
        assert getattr(messages, name).layout.size == constant(in_header)
    assert messages.SERVO_RESULT.layout.size <= messages.RESULT.layout.size + 4 * 7
    assert f"3 + {messages.RESULT.layout.size} + 4 * kMaxParameters + 2" in HEADER
    assert constant("kBoardBytes") == messages.IDENTITY.fields[-1].count
    assert constant("kProtocolVersion") == messages.VERSION
    assert constant("kMostLost") == messages.MOST_LOST


@pytest.mark.parametrize(
    ("message", "file", "name"),
    [
        (messages.IDENTITY, "answers.cpp", "write_identity"),
        (messages.DONE, "servo.cpp", "done"),
        (messages.RESULT, "answers.cpp", "write_result"),
        (messages.REFUSED, "servo.cpp", "refused"),
        (messages.SAFE, "servo.cpp", "safe_notice"),
    ],
)
def test_the_firmware_writes_these_fields(message: Message, file: str, name: str) -> None:
    written = re.findall(r"out\.(\w+)\((.*?)\);", function(file, name), re.S)
    types = ["u8" if field.type == "ascii" else field.type for field in message.fields]
    assert [type_ for type_, _ in written] == types
    for field, (_, source) in zip(message.fields, written, strict=True):
        assert same_name(field, source), (field.name, source)


def test_the_firmware_writes_the_fields_of_a_servo() -> None:
    text = function("answers.cpp", "write_servo_result")
    loop = re.search(
        r"for \(const ehsid_tracked_value\* value : \{(.*?)\}\) \{(.*?)\n  \}", text, re.S
    )
    assert loop is not None
    assert re.findall(r"&servo\.(\w+)", loop[1]) == list(KEYS.values())
    told = re.findall(r"out\.(\w+)\(.*?value->(\w+)", loop[2])
    assert told == [("f32", "value"), ("f32", "half_width"), ("u8", "reason")]
    written = re.findall(r"out\.(\w+)\((.*?)\);", text.replace(loop[0], "out.f32(tracked);"), re.S)
    fields = list(messages.SERVO_RESULT.fields)
    first = fields.index(next(field for field in fields if field.name == messages.TRACKED[0][0]))
    tracked = fields[first : first + 9]
    assert [field.type for field in tracked] == [type_ for type_, _ in told] * 3
    assert [field.name for field in tracked] == [name for one in messages.TRACKED for name in one]
    fields[first : first + 9] = [Field("tracked", "f32")]
    assert [type_ for type_, _ in written] == [field.type for field in fields]
    for field, (_, source) in zip(fields, written, strict=True):
        assert same_name(field, source), (field.name, source)


def test_the_firmware_reads_these_settings_of_a_servo() -> None:
    controller = function("configuration.cpp", "read_controller")
    whole = function("configuration.cpp", "read_servo_configuration")
    read = read_by(re.sub(r"read_controller\(in[^;]*;", lambda _: controller, whole))
    fields = messages.CONFIGURE_SERVO.fields
    assert [type_ for _, type_ in read] == [field.type for field in fields]
    for field, (source, _) in zip(fields, read, strict=True):
        assert source.endswith(field.name), (field.name, source)


def test_the_firmware_reads_these_settings() -> None:
    parts = {
        name: function("configuration.cpp", f"read_{name}")
        for name in ("head", "forgetting", "estimator", "controller", "configuration")
    }
    # The firmware reads as many numbers as there are places; the policies tell which is which.
    loop = re.search(r"for \(float& number : numbers\) \{.*?\n  \}", parts["forgetting"], re.S)
    assert loop is not None
    assert "float numbers[ehsid::kHilPlaces];" in parts["forgetting"]
    members = {s.hil_place: s.member for policy in ehsid.policies() for s in policy.settings}
    places = ", ".join(f"&{members[place]}" for place in range(ehsid.HIL_PLACES))
    parts["forgetting"] = f"for (float* value : {{{places}}}) {{\n*value = in.f32();\n}}"
    whole = parts["configuration"]
    for name in ("head", "estimator", "forgetting", "controller"):
        whole = re.sub(rf"read_{name}\(in[^;]*;", lambda _, name=name: parts[name], whole)
    read = read_by(whole)
    fields = messages.CONFIGURE.fixed
    assert [type_ for _, type_ in read] == [field.type for field in fields]
    for field, (source, _) in zip(fields, read, strict=True):
        assert source.endswith(field.name), (field.name, source)


def test_the_firmware_reads_these_measurements() -> None:
    text = function("servo.cpp", "Servo::take_sample")
    assert [(name.removeprefix("now."), type_) for name, type_ in read_by(text)] == [
        (field.name, field.type) for field in messages.SAMPLE.fields
    ]


def test_the_tables_of_the_document_are_made_from_the_messages() -> None:
    make = runpy.run_path(str(ROOT / "docs" / "hil" / "make_tables.py"))
    text = make["DOCUMENT"].read_text(encoding="utf-8")
    assert make["with_tables"](text) == text, "write them again: python docs/hil/make_tables.py"
    assert all(rows in text for rows in make["TABLES"].values())


@pytest.mark.parametrize(
    ("type_", "value"), [("u8", 256), ("u16", -1), ("u32", 2**32), ("i32", -(2**31) - 1)]
)
def test_whole_numbers_have_the_range_of_their_type(type_: Type, value: int) -> None:
    with pytest.raises(ValueError, match=f"x = {value}: expected a whole number from"):
        check("x", value, type_)
    check("x", value - 1 if value > 0 else value + 1, type_)
