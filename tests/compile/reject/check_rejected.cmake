# SPDX-License-Identifier: MIT
# cmake -D COMPILER=... -D SOURCE=... -D INCLUDES=dir,dir -P check_rejected.cmake
string(REPLACE "," ";-isystem;" includes "-isystem;${INCLUDES}")
set(compile "${COMPILER}" -fsyntax-only ${includes} "${SOURCE}")

file(STRINGS "${SOURCE}" lines LIMIT_COUNT 3)
list(GET lines 1 expected)
if(NOT expected MATCHES "^// expected: (.+)$")
  message(FATAL_ERROR "${SOURCE}: the second line must be `// expected: MESSAGE`")
endif()
set(expected "${CMAKE_MATCH_1}")
list(GET lines 2 standard)
if(NOT standard MATCHES "^// standard: (.+)$") # of the case that is refused
  set(CMAKE_MATCH_1 c++17)
endif()
set(standard "${CMAKE_MATCH_1}")

execute_process(COMMAND ${compile} -std=c++17 -DCORRECTED RESULT_VARIABLE failed ERROR_VARIABLE errors)
if(failed)
  message(FATAL_ERROR "${SOURCE}: does not compile when corrected\n${errors}")
endif()
execute_process(COMMAND ${compile} -std=${standard} RESULT_VARIABLE failed ERROR_VARIABLE errors)
if(NOT failed)
  message(FATAL_ERROR "${SOURCE}: compiles, but must not")
endif()
string(FIND "${errors}" "${expected}" position)
if(position EQUAL -1)
  message(FATAL_ERROR "${SOURCE}: refused without the sentence `${expected}`\n${errors}")
endif()
