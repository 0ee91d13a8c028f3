# SPDX-License-Identifier: MIT
include_guard(GLOBAL)
# The warnings of our own targets. Never part of ehsid::ehsid: what a user's code warns about is the user's.
add_library(ehsid_warnings INTERFACE)
target_compile_options(
  ehsid_warnings
  INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow
            $<$<BOOL:${EHSID_WARNINGS_AS_ERRORS}>:-Werror>)
