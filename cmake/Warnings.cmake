# SPDX-License-Identifier: MIT
include_guard(GLOBAL)
# The warnings of our own targets. Never part of ehsid::ehsid: what a user's code warns about is the user's.
# MSVC: conditions that are constant, padding and names like those of members are meant (4127, 4324, 4458).
add_library(ehsid_warnings INTERFACE)
if(MSVC)
  target_compile_options(ehsid_warnings INTERFACE /W4 /permissive- /bigobj /wd4127 /wd4324 /wd4458
                                                  $<$<BOOL:${EHSID_WARNINGS_AS_ERRORS}>:/WX>)
else()
  target_compile_options(
    ehsid_warnings INTERFACE -Wall -Wextra -Wpedantic -Wconversion -Wdouble-promotion -Wshadow
                             $<$<BOOL:${EHSID_WARNINGS_AS_ERRORS}>:-Werror>)
endif()
