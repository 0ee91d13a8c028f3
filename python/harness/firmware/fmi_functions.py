# SPDX-License-Identifier: MIT
"""The functions of an FMU for co-simulation, as the wrapper in templates/fmu.c.j2 defines them.

The wrapper of a simulator, templates/simulator_fmu.cpp.j2, has some other bodies.

Each is a name without the prefix fmi2 or fmi3, the types of its parameters a0, a1 ..., its body,
and its type where that is not a status. Source: Functional Mock-up Interface, Modelica Association,
2.0 (2014) and 3.0 (2022), the tables of functions in ch. 2 to 4.
"""

from __future__ import annotations

Function = tuple[str, list[str], str] | tuple[str, list[str], str, str]

ME, REFS, SIZE, TEXT = "void*", "const reference*", "size_t", "const char*"
GET = [ME, REFS, SIZE]
NOTHING = "return OK;"
NO = "return ERROR;"  # what a co-simulation of sampled data does not have
NONE = "return (a2 == 0U) ? OK : ERROR;"  # there are no variables of this type
TEXTS = "const char* const*"


def _states(state: str, serialised: str, deserialise: str) -> list[Function]:
    """Returns the functions of the state, whose names differ in capitals between 2.0 and 3.0."""
    return [
        (f"Get{state}", [ME, "void**"], "return get_state(a0, a1);"),
        (f"Set{state}", [ME, "void*"], "return set_state(a0, a1);"),
        (f"Free{state}", [ME, "void**"], "return free_state(a1);"),
        (serialised, [ME, "void*", "size_t*"], "*a2 = sizeof(memory); return OK;"),
        (f"Serialize{state}", [ME, "void*", "uint8_t*", SIZE], "return serialise(a1, a2, a3);"),
        (
            deserialise,
            [ME, "const uint8_t*", SIZE, "void**"],
            "return deserialise(a1, a2, a3);",
        ),
    ]


def _common(truth: str) -> list[Function]:
    return [
        ("FreeInstance", [ME], "free(a0);", "void"),
        ("SetDebugLogging", [ME, truth, SIZE, TEXTS], NOTHING),
        ("ExitInitializationMode", [ME], NOTHING),
        ("Terminate", [ME], NOTHING),
        ("Reset", [ME], "start(&((instance*)a0)->state); return OK;"),
    ]


FMI2: list[Function] = [
    ("GetTypesPlatform", [], 'return "default";', TEXT),
    ("GetVersion", [], 'return "2.0";', TEXT),
    (
        "Instantiate",
        [TEXT, "int", TEXT, TEXT, "const callbacks*", "truth", "truth"],
        "return (a1 == 1) ? instantiate(a2, (a4 != NULL) ? a4->log : NULL, "
        "(a4 != NULL) ? a4->environment : NULL) : NULL;",
        ME,
    ),
    *_common("truth"),
    ("SetupExperiment", [ME, "truth", "double", "double", "truth", "double"], NOTHING),
    ("EnterInitializationMode", [ME], NOTHING),
    ("GetReal", [*GET, "double*"], "return get_numbers(a0, a1, a2, a3);"),
    ("SetReal", [*GET, "const double*"], "return set_numbers(a0, a1, a2, a3);"),
    ("GetInteger", [*GET, "int32_t*"], "return get_integers(a0, a1, a2, a3);"),
    ("SetInteger", [*GET, "const int32_t*"], NONE),
    ("GetBoolean", [*GET, "truth*"], "return get_truths(a0, a1, a2, a3);"),
    ("SetBoolean", [*GET, "const truth*"], "return set_truths(a0, a1, a2, a3);"),
    ("GetString", [*GET, "const char**"], NONE),
    ("SetString", [*GET, TEXTS], NONE),
    *_states("FMUstate", "SerializedFMUstateSize", "DeSerializeFMUstate"),
    (
        "GetDirectionalDerivative",
        [*GET, REFS, SIZE, "const double*", "double*"],
        NO,
    ),
    ("SetRealInputDerivatives", [*GET, "const int32_t*", "const double*"], NO),
    ("GetRealOutputDerivatives", [*GET, "const int32_t*", "double*"], NO),
    ("DoStep", [ME, "double", "double", "truth"], "return step(a0, a1, a2);"),
    ("CancelStep", [ME], NO),
    ("GetStatus", [ME, "int", "int*"], NO),
    (
        "GetRealStatus",
        [ME, "int", "double*"],
        "*a2 = ((instance*)a0)->state.time; return (a1 == 2) ? OK : ERROR;",
    ),
    ("GetIntegerStatus", [ME, "int", "int32_t*"], NO),
    ("GetBooleanStatus", [ME, "int", "truth*"], NO),
    ("GetStringStatus", [ME, "int", "const char**"], NO),
]

START = [TEXT, TEXT, TEXT, "bool", "bool"]
FRACTIONS = ["const uint64_t*", "const uint64_t*"]
DOUBLES = ["double*", SIZE]
SENSITIVITY = [*GET, REFS, SIZE, "const double*", SIZE, *DOUBLES]
# Variables that the estimator does not have, and the types of their values.
OTHERS = {
    **{
        f"{sign}Int{size}": f"{sign.lower()}int{size}_t"
        for size in (8, 16, 64)
        for sign in ("", "U")
    },
    "UInt32": "uint32_t",
    "String": TEXT,
}


def fmi3(real: str) -> list[Function]:
    """Returns the functions of FMI 3.0; `real` is the type of all numbers, Float32 or Float64."""
    c_type = {"Float32": "float", "Float64": "double"}[real]
    made: list[Function] = [
        ("GetVersion", [], 'return "3.0";', TEXT),
        (
            "InstantiateCoSimulation",
            [*START, "bool", "bool", REFS, SIZE, ME, "logger", ME],
            "return instantiate(a1, a10, a9);",
            ME,
        ),
        ("InstantiateModelExchange", [*START, ME, ME], "return NULL;", ME),
        ("InstantiateScheduledExecution", [*START, ME, ME, ME, ME, ME], "return NULL;", ME),
        *_common("bool"),
        ("EnterInitializationMode", [ME, "bool", "double", "double", "bool", "double"], NOTHING),
        *_states("FMUState", "SerializedFMUStateSize", "DeserializeFMUState"),
        (
            "DoStep",
            [ME, "double", "double", "bool", "bool*", "bool*", "bool*", "double*"],
            "*a4 = false; *a5 = false; *a6 = false; *a7 = a1 + a2; return step(a0, a1, a2);",
        ),
        (f"Get{real}", [*GET, f"{c_type}*", SIZE], "return get_numbers(a0, a1, a2, a3);"),
        (f"Set{real}", [*GET, f"const {c_type}*", SIZE], "return set_numbers(a0, a1, a2, a3);"),
        ("GetInt32", [*GET, "int32_t*", SIZE], "return get_integers(a0, a1, a2, a3);"),
        ("SetInt32", [*GET, "const int32_t*", SIZE], NONE),
        ("GetBoolean", [*GET, "bool*", SIZE], "return get_truths(a0, a1, a2, a3);"),
        ("SetBoolean", [*GET, "const bool*", SIZE], "return set_truths(a0, a1, a2, a3);"),
    ]
    if real == "Float32":
        made += [
            ("GetFloat64", [*GET, "double*", SIZE], "return get_times(a0, a1, a2, a3);"),
            ("SetFloat64", [*GET, "const double*", SIZE], NONE),
        ]
    others = {**OTHERS, "Float32": "float"} if real == "Float64" else OTHERS
    for name, c_type in others.items():
        made += [
            (f"Get{name}", [*GET, f"{c_type}*", SIZE], NONE),
            (f"Set{name}", [*GET, f"{c_type} const*", SIZE], NONE),
        ]
    refused = {
        **{f"{verb}Binary": [*GET, "size_t*", "void*", SIZE] for verb in ("Get", "Set")},
        **{f"{verb}Clock": [*GET, "const bool*"] for verb in ("Get", "Set")},
        "GetNumberOfVariableDependencies": [ME, "reference", "size_t*"],
        "GetVariableDependencies": [ME, "reference", "size_t*", "reference*", "size_t*", ME, SIZE],
        "GetDirectionalDerivative": SENSITIVITY,
        "GetAdjointDerivative": SENSITIVITY,
        "GetOutputDerivatives": [*GET, "const int32_t*", *DOUBLES],
        "GetIntervalDecimal": [*GET, "double*", "int*"],
        "GetIntervalFraction": [*GET, "uint64_t*", "uint64_t*", "int*"],
        "GetShiftDecimal": [*GET, "double*"],
        "GetShiftFraction": [*GET, "uint64_t*", "uint64_t*"],
        **{f"Set{name}Decimal": [*GET, "const double*"] for name in ("Interval", "Shift")},
        **{f"Set{name}Fraction": [*GET, *FRACTIONS] for name in ("Interval", "Shift")},
        **{
            f"{name}Mode": [ME]
            for name in (
                *("EnterConfiguration", "ExitConfiguration", "EnterEvent", "EnterStep"),
                "EnterContinuousTime",
            )
        },
        "EvaluateDiscreteStates": [ME],
        "UpdateDiscreteStates": [ME, *["bool*"] * 5, "double*"],
        "CompletedIntegratorStep": [ME, "bool", "bool*", "bool*"],
        "SetTime": [ME, "double"],
        "SetContinuousStates": [ME, "const double*", SIZE],
        "GetContinuousStates": [ME, *DOUBLES],
        "GetContinuousStateDerivatives": [ME, *DOUBLES],
        "GetNominalsOfContinuousStates": [ME, *DOUBLES],
        "GetEventIndicators": [ME, *DOUBLES],
        "GetNumberOfEventIndicators": [ME, "size_t*"],
        "GetNumberOfContinuousStates": [ME, "size_t*"],
        "ActivateModelPartition": [ME, "reference", "double"],
    }
    return made + [(name, types, NO) for name, types in refused.items()]


# What a simulator does in another way: memory is that of C++, there are no whole numbers, and a
# state is not written as bytes, because what it holds grows with the run.
SIMULATOR = {
    "FreeInstance": "release(a0);",
    "Reset": "return reset(a0);",
    "ExitInitializationMode": "return run(a0);",
    "GetInteger": NONE,
    "GetInt32": NONE,
    "GetBoolean": NONE,
    "SetBoolean": NONE,
    "GetRealStatus": NO,
    **{
        name: NO
        for verb, size in (("DeSerialize", "FMUstate"), ("Deserialize", "FMUState"))
        for name in (f"Serialized{size}Size", f"Serialize{size}", f"{verb}{size}")
    },
}


def of_simulator(fmi: int) -> list[Function]:
    """Returns the functions of the FMU of a simulator, for a version of FMI, 2 or 3."""
    plan = "return prepare(a0, a3, a4 != 0, a5);"
    bodies = {**SIMULATOR, "SetupExperiment" if fmi == 2 else "EnterInitializationMode": plan}
    made: list[Function] = []
    for each in FMI2 if fmi == 2 else fmi3("Float64"):
        name, types, body = each[:3]
        body = bodies.get(name, body)
        made.append((name, types, body) if len(each) == 3 else (name, types, body, each[3]))
    return made
