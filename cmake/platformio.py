# SPDX-License-Identifier: MIT
"""What PlatformIO adds to the user's program, and which sources it compiles.

PlatformIO applies the flags of a library to the library alone. The headers are compiled in the
user's program, which therefore needs C++17 as well, and the word that it does without Eigen. The
sources in `cpp/src` are the API for C. They need Eigen, and are compiled only where platformio.ini
says `custom_ehsid_c = yes`.
"""

from typing import Any

from SCons.Script import DefaultEnvironment, Import

STANDARD = "-std=gnu++17"


def environments() -> list[Any]:
    """Those of the library, of all that is compiled, and of the user's sources, where there is one.

    See "Construction Environments" in the documentation of PlatformIO.
    """
    found = {}
    Import("env")
    found["env"] = globals()["env"]
    found["all"] = DefaultEnvironment()
    try:
        Import("projenv")
        found["projenv"] = globals()["projenv"]
    except Exception:  # SCons has an error of its own for a name that nobody exported
        pass
    return list(found.values())


def with_standard(flags: list[str]) -> list[str]:
    """The flags with C++17 in place of any other standard."""
    return [*(flag for flag in flags if not str(flag).startswith("-std=")), STANDARD]


of_library, *others = environments()
is_for_c = str(of_library.GetProjectOption("custom_ehsid_c", "no")).lower() in ("yes", "true", "1")
for environment in (of_library, *others):
    environment.Replace(CXXFLAGS=with_standard(environment.get("CXXFLAGS", [])))
    if not is_for_c:
        environment.Append(CPPDEFINES=["EHSID_WITHOUT_EIGEN"])
if not is_for_c:
    of_library.Replace(SRC_FILTER=["-<*>"])
