# SPDX-License-Identifier: MIT
"""Files for build systems that nothing here runs: what they name is there and agrees."""

import json
import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from sources import ROOT

import ehsid

ALWAYS = {"cpp/src/c_api.cpp", "cpp/src/c_integrating.cpp", "cpp/src/c_riv.cpp"}
SOURCES = {*ALWAYS, "cpp/src/c_kernels.cpp"}


def text(path: str) -> str:
    return (ROOT / path).read_text(encoding="utf-8")


@pytest.mark.parametrize("path", ["cmake/CApi.cmake", "zephyr/CMakeLists.txt"])
def test_every_source_of_the_c_api_is_compiled(path: str) -> None:
    assert all((ROOT / source).is_file() for source in SOURCES)
    assert "${kernels})" in text(path)
    assert all(source in text(path) for source in ALWAYS)
    assert "ehsid_c_kernels(kernels)" in text(path)
    assert "/cpp/src/c_kernels.cpp" in text("cmake/CKernels.cmake")


def test_platformio_names_this_version_and_what_is_there() -> None:
    library = json.loads(text("library.json"))
    assert library["version"] == ehsid.__version__
    assert library["license"] == "MIT"
    build = library["build"]
    assert all((ROOT / build["includeDir"] / header).is_file() for header in library["headers"])
    excluded, *included = build["srcFilter"]
    assert excluded == "-<*>"
    found = {
        path.relative_to(ROOT).as_posix()
        for pattern in included
        for path in (ROOT / build["srcDir"]).glob(pattern.removeprefix("+<").removesuffix(">"))
    }
    assert found == SOURCES
    export = library["export"]
    assert all((ROOT / path).exists() for path in export["include"] + export["exclude"])


class _Environment(dict[str, Any]):
    """What the script uses of a construction environment of SCons."""

    def __init__(self, option: str | None) -> None:
        super().__init__(CXXFLAGS=["-std=gnu++11", "-fno-rtti"], CPPDEFINES=["F_CPU"])
        self.option = option

    def GetProjectOption(self, name: str, default: str) -> str:  # noqa: N802
        assert name == "custom_ehsid_c"
        return default if self.option is None else self.option

    def Replace(self, **values: Any) -> None:  # noqa: N802
        self.update(values)

    def Append(self, **values: list[str]) -> None:  # noqa: N802
        for name, more in values.items():
            self[name] = [*self.get(name, []), *more]


@pytest.mark.parametrize("exported", [("env",), ("env", "projenv")])
@pytest.mark.parametrize("option", [None, "no", "yes"])
def test_platformio_gives_the_program_what_the_headers_need(
    option: str | None, exported: tuple[str, ...], monkeypatch: pytest.MonkeyPatch
) -> None:
    made = {name: _Environment(option) for name in (*exported, "all")}
    script = text(json.loads(text("library.json"))["build"]["extraScript"])
    names: dict[str, Any] = {}

    def imported(name: str) -> None:
        if name not in exported:
            raise RuntimeError(f"{name} is not exported")
        names[name] = made[name]

    scons = ModuleType("SCons.Script")
    scons.Import, scons.DefaultEnvironment = imported, lambda: made["all"]  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "SCons", ModuleType("SCons"))
    monkeypatch.setitem(sys.modules, "SCons.Script", scons)
    exec(compile(script, "platformio.py", "exec"), names)
    for_c = option == "yes"
    for environment in made.values():
        assert environment["CXXFLAGS"] == ["-fno-rtti", "-std=gnu++17"]
        assert ("EHSID_WITHOUT_EIGEN" in environment["CPPDEFINES"]) != for_c
    assert made["env"].get("SRC_FILTER") == (None if for_c else ["-<*>"])


def test_esp_idf_gives_the_program_the_headers_without_eigen(tmp_path: Path) -> None:
    """CMake runs with a stand-in for the function of ESP-IDF, and for a program."""
    (tmp_path / "main.cpp").write_text(
        "#include <ehsid/ehsid.hpp>\n"
        "#ifndef EHSID_WITHOUT_EIGEN\n#error\n#endif\n"
        "int main() {\n"
        "  ehsid::ServoEstimator<float> estimator;\n"
        "  return estimator.step(1.0F, 0.1F) == ehsid::Status::ok ? 1 : 0;\n"
        "}\n"
    )
    (tmp_path / "CMakeLists.txt").write_text(
        "cmake_minimum_required(VERSION 3.22)\nproject(program LANGUAGES CXX)\n"
        "set(ESP_PLATFORM TRUE)\nset(COMPONENT_LIB component)\n"
        "function(idf_component_register)\n"
        '  cmake_parse_arguments(PARSE_ARGV 0 told "" "" INCLUDE_DIRS)\n'
        "  add_library(component INTERFACE)\n"
        "  list(TRANSFORM told_INCLUDE_DIRS PREPEND ${CMAKE_CURRENT_SOURCE_DIR}/)\n"
        "  target_include_directories(component INTERFACE ${told_INCLUDE_DIRS})\n"
        "endfunction()\n"
        f"add_subdirectory({ROOT} component)\n"
        "add_executable(program main.cpp)\ntarget_link_libraries(program component)\n"
    )
    build = tmp_path / "build"
    subprocess.run(["cmake", "-S", tmp_path, "-B", build], check=True, capture_output=True)
    subprocess.run(["cmake", "--build", build], check=True, capture_output=True)
    assert subprocess.run([build / "program"], check=False).returncode == 0


def test_zephyr_module_names_what_is_there() -> None:
    # Flat enough to be read without a YAML library; another shape would fail here.
    lines = [line for line in text("zephyr/module.yml").splitlines() if not line.startswith("#")]
    assert lines[:2] == ["name: ehsid", "build:"]
    entries = dict(line.strip().split(": ") for line in lines[2:])
    assert set(entries) == {"cmake", "kconfig"}
    assert (ROOT / entries["cmake"] / "CMakeLists.txt").is_file()
    assert (ROOT / entries["kconfig"]).is_file()


def test_zephyr_options_are_those_that_cmake_asks_for() -> None:
    defined = set(re.findall(r"^config (\w+)$", text("zephyr/Kconfig"), flags=re.MULTILINE))
    asked = set(re.findall(r"CONFIG_(\w+)", text("zephyr/CMakeLists.txt")))
    assert defined == asked == {"EHSID", "EHSID_C"}


def test_presets_name_toolchains_that_are_there() -> None:
    presets = json.loads(text("CMakePresets.json"))["configurePresets"]
    files = {preset["toolchainFile"] for preset in presets if "toolchainFile" in preset}
    assert {Path(file).name for file in files} == {"arm-none-eabi.cmake", "cortex-m7.cmake"}
    assert all((ROOT / file.removeprefix("${sourceDir}/")).is_file() for file in files)
    assert {"m4f-o2", "m4f-os", "m7-o2", "m7-os"} <= {preset["name"] for preset in presets}


def settings(name: str) -> dict[str, str]:
    """What a preset sets, with what it inherits: its own values and earlier bases go before."""
    presets = {
        preset["name"]: preset
        for preset in json.loads(text("CMakePresets.json"))["configurePresets"]
    }
    bases = presets[name].get("inherits", [])
    found: dict[str, str] = dict(presets[name].get("cacheVariables", {}))
    for base in [bases] if isinstance(bases, str) else bases:
        found = settings(base) | found
    return found


def test_presets_of_developers_switch_on_what_a_user_does_not_build() -> None:
    names = ("C", "TESTS", "FIRMWARE")
    options = [*(f"EHSID_BUILD_{name}" for name in names), "EHSID_WARNINGS_AS_ERRORS"]
    defaults = dict(
        re.findall(r'^option\((\w+) ".*" (\w+)\)$', text("CMakeLists.txt"), flags=re.MULTILINE)
    )
    assert [defaults[option] for option in options] == ["OFF"] * 4
    for name in ("dev", "release", "clang", "tidy", "asan-ubsan", "arm"):
        assert [settings(name).get(option) for option in options] == ["ON"] * 4
    for name in ("m4f-o2", "m4f-os", "m7-o2", "m7-os"):
        assert [settings(name).get(option) for option in options] == ["ON", "OFF", "OFF", "OFF"]


def test_the_c_example_of_the_document_is_the_one_that_is_compiled() -> None:
    blocks = re.findall(r"```c\n(.*?)```", text("docs/linking.md"), flags=re.DOTALL)
    compiled = text("tests/install/consumer_c/controller.c").split("\n", 1)[1]
    assert compiled in blocks
