# SPDX-License-Identifier: MIT
"""Options that a command cannot use, beside records and rigs that are good."""

from __future__ import annotations

import numpy as np
from bad_input.case import Case, Content, command
from bad_input.inputs import AXIS, BENCH, GOOD, LONG, csv, signals
from bad_input.rigs import OWN

TITLE = "Options"
ABOUT = "The records and rig files that are used with these options are valid."
STILL = csv({**signals(400), "position_m": np.full(400, 0.1)})
FILES: dict[str, Content] = {
    "record.csv": LONG,
    "rig.toml": BENCH,
    "axis.toml": AXIS,
    "short.csv": GOOD,
    "still.csv": STILL,
    "machines/m1/rig.toml": BENCH,
    "machines/m1/run.csv": LONG,
    "empty/rig.toml": BENCH,
    "own.toml": OWN.format(program='python = "module:Mine"'),
}
SIMULATE = "ehsid simulate rig.toml --excitation steps"
NEW = "ehsid rig new --rod 35mm --stroke 300mm --supply 120bar --rated-flow 38l/min --out new.toml"
EXCITE = "ehsid excite rig.toml --out new.csv"
CHECK = "ehsid rig check rig.toml record.csv"
INJECT = "ehsid inject record.csv --rig rig.toml --out new.csv"
HIL = "ehsid hil --port socket://127.0.0.1:9"
OPEN = f"{HIL} --loop open --out out"
ACCUMULATOR = f"{NEW} --bore '63 mm' --accumulator"
PLATE = "--bore 63mm --rod 35mm --stroke 300mm --supply 120bar --rated-flow 38l/min"
START = "ehsid start record.csv --out out"
SERVO = "ehsid export record.csv --servo --out made.hpp"


def option(wrong: str, line: str, library: str | None = None) -> Case:
    return command(wrong, line, files=FILES, library=library)


CASES = (
    option("no such command", "ehsid identifi record.csv"),
    option("no such option", "ehsid identify record.csv --oders 2"),
    option("no record", "ehsid identify"),
    option("two records", "ehsid identify record.csv record.csv"),
    option("no rig", "ehsid gap record.csv --out out"),
    option("no folder for the results", "ehsid gap record.csv --rig rig.toml"),
    option("an option without its value", "ehsid identify record.csv --orders"),
    option(
        "a column that is misspelt", "ehsid identify record.csv --map 'position_m=Positon_m [mm]'"
    ),
    option(
        "a unit that is misspelt",
        "ehsid identify record.csv --map 'position_m=position_m [milimeter]'",
    ),
    option("an order of 0", "ehsid estimate record.csv --na 0"),
    option("an order of 7", "ehsid estimate record.csv --nb 7"),
    option("an order of 1e21", "ehsid export record.csv --na 1000000000000000000000"),
    option("an order of 2.5", "ehsid estimate record.csv --na 2.5"),
    option("a delay below 0", "ehsid estimate record.csv --nk=-1"),
    option("text for an order", "ehsid estimate record.csv --na three"),
    option("text for orders", "ehsid identify record.csv --orders two"),
    option("orders upside down", "ehsid identify record.csv --orders 5-2"),
    option("orders of 20 digits", "ehsid identify record.csv --orders 1-" + "9" * 20),
    option("orders beyond the limit", "ehsid identify record.csv --orders 2-51"),
    option("orders in Arabic digits", "ehsid identify record.csv --orders ٢"),
    option("delays below 0", "ehsid identify record.csv --delays=-1"),
    option("delays beyond the limit", "ehsid identify record.csv --delays 1-9999"),
    option("no such policy", "ehsid estimate record.csv --forgetting fratio"),
    option(
        "a factor of another policy", "ehsid estimate record.csv --forgetting f-ratio --lambda0 0.9"
    ),
    option("a factor above 1", "ehsid estimate record.csv --lambda0 1.5"),
    option("a factor of 0", "ehsid estimate record.csv --lambda0 0"),
    option("a factor that is no number", "ehsid estimate record.csv --lambda0 nan"),
    option("a setting without a number", "ehsid estimate record.csv --setting lambda0"),
    option("a setting of another policy", "ehsid estimate record.csv --setting eta=1"),
    option("a setting with text", "ehsid estimate record.csv --setting lambda0=big"),
    option(
        "a setting given twice", "ehsid estimate record.csv --lambda0 0.9 --setting lambda0=0.8"
    ),
    option("a factor of another policy", "ehsid export record.csv --lambda0 0.9"),
    option("a setting below its range", "ehsid export record.csv --setting eta=-1"),
    option("one setting twice", "ehsid export record.csv --setting eta=1 --setting eta=2"),
    option("a folder without records", "ehsid estimate empty --out out"),
    option(
        "a policy that a method does not take",
        "ehsid estimate record.csv --method riv --forgetting f-ratio",
    ),
    option("a negative inflation", "ehsid export record.csv --inflation -1"),
    option("an inflation of NaN", "ehsid export record.csv --inflation nan"),
    option("a name that is C++ code", "ehsid export record.csv --name 'x{};int y'"),
    option("a name that is a keyword", "ehsid export record.csv --name class"),
    option("a name of 300 letters", f"ehsid export record.csv --name {'n' * 300}"),
    option("a name that begins with a digit", "ehsid export record.csv --name 2nd"),
    option("a version of FMI without an FMU", "ehsid export record.csv --fmi 3"),
    option("a version of FMI for sources", "ehsid export record.csv --c-source --fmi 3"),
    option("a version of FMI that there is not", "ehsid export record.csv --fmu a.fmu --fmi 4"),
    option("an FMU named as an archive", "ehsid export record.csv --fmu a.zip"),
    option("an FMU and another file", "ehsid export record.csv --fmu a.fmu --out b.c"),
    option("a rig file for two FMUs", "ehsid export rig.toml --fmu a.fmu --out b.fmu"),
    option("a precision for a simulator", "ehsid export --fmu rig.toml --float64"),
    option("a user's simulator for an FMU", "ehsid export --fmu own.toml"),
    option("an FMU of no record", "ehsid export --fmu a.fmu"),
    option("nothing to export", "ehsid export"),
    option("a precision for a header", "ehsid export record.csv --float64"),
    option("sources and a header of C", "ehsid export record.csv --c-source --c"),
    option("sources of a ServoEstimator", "ehsid export record.csv --c-source --servo"),
    option(
        "sources whose name cannot be included", "ehsid export record.csv --c-source --out 'a b.c'"
    ),
    option("an order of a ServoEstimator", f"{SERVO} --na 3"),
    option("a delay of a model for a ServoEstimator", f"{SERVO} --nk 2"),
    option("no constant term of a ServoEstimator", f"{SERVO} --no-offset"),
    option("a policy for a ServoEstimator", f"{SERVO} --forgetting constant"),
    option("a setting of a policy for a ServoEstimator", f"{SERVO} --setting eta=2"),
    option("a delay of 1.5 samples", f"{SERVO} --setting delay=1.5"),
    option("a delay of 21 samples", f"{SERVO} --setting delay=21"),
    option("an infinite delay", f"{SERVO} --setting delay=inf"),
    option("a negative drift", f"{SERVO} --setting drift=-1"),
    option("a tolerance that is no number", f"{SERVO} --setting tolerance=nan"),
    option("a rig file in place of a record", "ehsid export rig.toml"),
    option("an option of estimators with a rig file", "ehsid export --fmu rig.toml --na 2"),
    option("a simulator named as an archive", "ehsid export --fmu rig.toml --out rig.zip"),
    option("too long a step of a simulator", "ehsid export --fmu rig.toml --dt 0.5"),
    option("C sources named as a header", "ehsid export record.csv --c-source --out a.h"),
    option("orders given and to be chosen", "ehsid export record.csv --na 2 --identify"),
    option("no source of a command", "ehsid simulate rig.toml"),
    option("two sources of a command", f"{SIMULATE} --command record.csv"),
    option(
        "a logged command in a closed loop", "ehsid simulate rig.toml --command record.csv --loop p"
    ),
    option("no such signal", "ehsid simulate rig.toml --excitation sine"),
    option("a duration of 1e300 s", f"{SIMULATE} --duration 1e300"),
    option("a duration of 1e9 s", f"{SIMULATE} --duration 1e9"),
    option("a duration and steps beyond all numbers", f"{SIMULATE} --duration 1e300 --dt 1e-300"),
    option("a duration below 0", f"{SIMULATE} --duration=-1"),
    option("a duration that is no number", f"{SIMULATE} --duration nan"),
    option("a sampling time of 0", f"{SIMULATE} --dt 0"),
    option("a sampling time of 1e-12 s", f"{SIMULATE} --dt 1e-12"),
    option("an infinite sampling time", f"{SIMULATE} --dt inf"),
    option("a sampling time that is no number", f"{SIMULATE} --dt nan"),
    option("an amplitude of 1e308", f"{SIMULATE} --amplitude 1e308"),
    option(
        "a triangle beyond the stroke",
        "ehsid simulate rig.toml --excitation triangle --amplitude 9",
    ),
    option("an amplitude of 0", f"{SIMULATE} --amplitude 0"),
    option("an amplitude above the rated command", f"{SIMULATE} --amplitude 99"),
    option("a reference longer than the stroke", f"{SIMULATE} --loop p --amplitude 9"),
    option("a bandwidth of 0", f"{SIMULATE} --loop p --bandwidth 0"),
    option("a bandwidth of 1e300 Hz", f"{SIMULATE} --loop p --bandwidth 1e300"),
    option("a start outside the stroke", f"{SIMULATE} --position0 9"),
    option("a start that is no number", f"{SIMULATE} --position0 nan"),
    option("an effect without a number", f"{SIMULATE} --effect coulomb_friction"),
    option("a number for an effect", f"{SIMULATE} --effect load_force=3"),
    option("no such effect", f"{SIMULATE} --effect friction.force_n=3"),
    option("a size outside its range", f"{SIMULATE} --effect coulomb_friction.force_n=-3"),
    option("a size as text", f"{SIMULATE} --effect coulomb_friction.force_n=much"),
    option("a negative seed", f"{SIMULATE} --seed=-1"),
    option("text for a sampling time", f"{SIMULATE} --dt 1ms"),
    option(
        "noise of sensors that the rig does not tell",
        "ehsid simulate axis.toml --excitation steps --noise",
    ),
    option("no such command of rigs", "ehsid rig nwe"),
    option("a rig of nothing", "ehsid rig new --out new.toml"),
    option("a bore without a number", f"{NEW} --bore wide"),
    option("a bore in bar", f"{NEW} --bore '63 bar'"),
    option("a bore of a power tower", f"{NEW} --bore '63 mm**9**9**9'"),
    option("a bore that is no number", f"{NEW} --bore 'nan mm'"),
    option("a bore beyond all numbers", f"{NEW} --bore '1e999 mm'"),
    option("a bore of 0", f"{NEW} --bore '0 mm'"),
    option("a bore of 30 m", f"{NEW} --bore '30 m'"),
    option("a rod as thick as the bore", f"{NEW} --bore '35 mm'"),
    option("an uncertainty of 0", f"{NEW} --bore '63 mm' --mass '120 kg +- 0 %'"),
    option("a command in bar", f"{NEW} --bore '63 mm' --rated-command '10 bar'"),
    option("a supply below the tank pressure", f"{NEW} --bore '63 mm' --tank '200 bar'"),
    option("a line without its diameter", f"{NEW} --bore '63 mm' --line-length '1 m'"),
    option("edges of a drop that is not given", f"{NEW} --bore '63 mm' --drop-over both"),
    option("a volume without its pre-charge", f"{ACCUMULATOR}-volume '1 l'"),
    option("a pre-charge without its volume", f"{ACCUMULATOR}-precharge '90 bar'"),
    option(
        "a pre-charge above the supply",
        f"{ACCUMULATOR}-volume '1 l' --accumulator-precharge '130 bar'",
    ),
    option(
        "too large an accumulator", f"{ACCUMULATOR}-volume '60 l' --accumulator-precharge '90 bar'"
    ),
    option("a grade of oil that there is not", f"{NEW} --bore '63 mm' --oil 'VG 47'"),
    option("a viscosity with a comma", f"{NEW} --bore '63 mm' --oil '1,5 cSt'"),
    option("a bore of an axis", "ehsid rig new --plant axis --bore '63 mm' --out new.toml"),
    option(
        "a mass of a user's simulator",
        "ehsid rig new --simulator model.fmu --mass '100 kg' --out new.toml",
    ),
    option(
        "a user's simulator that is not there", "ehsid rig new --simulator model.fmu --out new.toml"
    ),
    option(
        "a user's simulator that is no FMU", "ehsid rig new --simulator record.csv --out new.toml"
    ),
    option("no such plant", f"{NEW} --bore '63 mm' --plant pump"),
    option("curves of no valve", f"{NEW} --bore '63 mm' --curves record.csv"),
    option("no diagnosis to edit", "ehsid gap-edit . record.csv"),
    option("two machines for a controller", "ehsid apply rig.toml rig.toml"),
    option("no machine for a controller", "ehsid apply machines"),
    option("an axis without a valve", "ehsid apply axis.toml"),
    option("a controller of 1 Hz", "ehsid apply rig.toml --cycle 1"),
    option("a loop faster than fast", "ehsid apply rig.toml --speed 2"),
    option("no effect to excite", f"{EXCITE} --for friction"),
    option("a sampling time of 0 to excite", f"{EXCITE} --for valve_lag --dt 0"),
    option("an effect that is told already", f"{EXCITE} --for valve_lag"),
    option("an effect that needs no signal", f"{EXCITE} --for sensor_quantisation"),
    option("no record to check", "ehsid rig check rig.toml"),
    option("a sampling time of 0 for a check", f"{CHECK} --dt 0"),
    option("a record that is too short to check", "ehsid rig check rig.toml short.csv"),
    option("a record without motion to check", "ehsid rig check rig.toml still.csv"),
    option("no value of a machine to start with", START),
    option("no such log to start with", f"ehsid start run9.csv {PLATE} --out out"),
    option("two logs of one name", f"ehsid start record.csv record.csv {PLATE} --out out"),
    option("no folder to watch", "ehsid watch nowhere --out out"),
    option("no such effect to watch", "ehsid watch machines/m1 --track leakage --out out"),
    option("a history among the logs", "ehsid watch machines/m1 --out machines/m1/history"),
    option("a log without a date", "ehsid watch machines/m1 --out out"),
    option("a folder without logs", "ehsid watch empty --out out"),
    option("a channel that there is not", "ehsid import record.csv --map position=position_m"),
    option("a column that there is not", "ehsid import record.csv --map position_m=Hub"),
    option("a sampling time of 0 for a log", "ehsid import record.csv --dt 0"),
    option("a sampling time of NaN for a log", "ehsid import record.csv --dt nan"),
    option("a format that is not written", "ehsid import record.csv --out new.xlsx"),
    option("the log for the record", "ehsid import record.csv --out record.csv"),
    option(
        "no such effect to leave out",
        "ehsid gap record.csv --rig rig.toml --out out --exclude-effect friction",
    ),
    option("no processes", "ehsid gap record.csv --rig rig.toml --out out --workers 0"),
    option(
        "a cluster that is not there",
        "ehsid gap-fleet machines --out out --dask tcp://127.0.0.1:9",
        library=r"(?<='tcp://127.0.0.1:9': ).*?(?=; start)",
    ),
    option(
        "a cluster and processes",
        "ehsid gap-fleet machines --out out --dask tcp://127.0.0.1:9 --workers 2",
    ),
    option("no such effect to put in", f"{INJECT} --effect friction"),
    option("an effect named twice", f"{INJECT} --effect gain --effect gain"),
    option("an effect without its size", f"{INJECT} --effect gain"),
    option("a size without an effect", f"{INJECT} --set factor=1.1"),
    option("a size of none of the effects", f"{INJECT} --effect gain --set overlap=0.1"),
    option("a size that is no number", f"{INJECT} --effect gain --set factor=nan"),
    option("a size given twice", f"{INJECT} --effect gain --set factor=1 --set factor=2"),
    option(
        "a size of a name that two effects have",
        f"{INJECT} --effect transport_delay --effect position_delay --set delay_s=0.01",
    ),
    option("a size that is misspelt", f"{INJECT} --effect valve_dead_band --set overlp=0.1"),
    option("a size beyond its range", f"{INJECT} --effect valve_dead_band --set overlap=1e9"),
    option("an effect with a typing error", f"{INJECT} --effect valve_deadband --set overlap=0.1"),
    option("no cases of a check", "ehsid gap-check --out out --count 0"),
    option("a check of 1e12 cases", "ehsid gap-check --out out --count 1000000000000"),
    option("a check with a negative seed", "ehsid gap-check --out out --seed=-1"),
    option("no such grade", "ehsid gap-check --out out --grade easy"),
    option("a grade twice", "ehsid gap-check --out out --grade plain --grade plain"),
    option("no such sensors", "ehsid gap-check --out out --sensors all"),
    option("records of 0 s", "ehsid gap-check --out out --seconds 0"),
    option("records of 1e9 s", "ehsid gap-check --out out --seconds 1e9"),
    option(
        "excitations that there are not",
        "ehsid gap-check --out out --grade wide --excitations loud",
    ),
    option("excitations of another grade", "ehsid gap-check --out out --excitations training"),
    option("too few runs of the experiment", "ehsid experiment --out out --runs 3"),
    option("orders of the experiment as text", "ehsid experiment --out out --orders two"),
    option("no such trend", "ehsid experiment --out out --trend cubic"),
    option("no target", "ehsid hil --out out"),
    option("two targets", f"{HIL} --qemu servo.elf --out out"),
    option(
        "a target that is not there",
        f"{HIL} --out out",
        library=r"(?<=opened \().*?(?=\); expected)",
    ),
    option(
        "no such serial port",
        "ehsid hil --port /dev/nowhere --out out",
        library=r"(?<=there are: ).*?(?=\. Is the)",
    ),
    option("an address without a port", "ehsid hil --port socket://host --out out"),
    option("no such firmware", "ehsid hil --qemu servo.elf --out out"),
    option("a rig of another plant", f"{HIL} --actual axis.toml --out out"),
    option("a sampling time of NaN", f"{HIL} --dt nan --out out"),
    option("cycles that there are not", f"{HIL} --loop open --cycles late=1 --out out"),
    option("most cycles lost", f"{HIL} --loop open --cycles lost=0.6 --out out"),
    option("cycles without a share", f"{OPEN} --cycles lost"),
    option("a share of cycles as text", f"{OPEN} --cycles lost=x"),
    option("a share of cycles twice", f"{OPEN} --cycles lost=0.1 --cycles lost=0"),
    option("cycles of the experiment", f"{HIL} --cycles lost=0.1 --out out"),
    option("an amplitude above the rated command", f"{OPEN} --amplitude 11"),
    option("an order of 7", f"{OPEN} --na 7"),
    option("an effect without a size", f"{OPEN} --effect x"),
    option("a setting of a ServoEstimator", f"{HIL} --setting drift=0.1 --out out"),
    option("a policy for a ServoEstimator", f"{OPEN} --servo --forgetting constant"),
    option("a factor for a ServoEstimator", f"{OPEN} --servo --lambda0 0.99"),
    option("an order of a ServoEstimator", f"{OPEN} --servo --na 2"),
    option("an order of its command", f"{OPEN} --servo --nb 2"),
    option("a delay of a model for a ServoEstimator", f"{OPEN} --servo --nk 2"),
    option("a setting of a policy for a ServoEstimator", f"{OPEN} --servo --setting eta=2"),
    option("a delay of 1.5 samples", f"{OPEN} --servo --setting delay=1.5"),
    option("a negative tolerance", f"{OPEN} --servo --setting tolerance=-1"),
    option("a speed of 0 baud", f"{HIL} --baud 0 --out out"),
    option(
        "a verdict that there is not",
        "ehsid gap record.csv --rig rig.toml --out out --fail-on efects",
    ),
    option(
        "a verdict that there is not among others",
        "ehsid gap-fleet machines --out out --fail-on no_gap,all",
    ),
)
