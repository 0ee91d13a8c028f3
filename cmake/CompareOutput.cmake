# SPDX-License-Identifier: MIT
# Fails where what PROGRAM prints, called with ARGUMENTS if there are any, is not the content of the file EXPECTED:
#   cmake -DPROGRAM=... -DARGUMENTS=... -DEXPECTED=... -P CompareOutput.cmake
execute_process(COMMAND "${PROGRAM}" ${ARGUMENTS} OUTPUT_VARIABLE printed RESULT_VARIABLE code)
if(NOT code EQUAL 0)
  message(FATAL_ERROR "${PROGRAM} ended with ${code}:\n${printed}")
endif()
file(READ "${EXPECTED}" expected)
if(NOT printed STREQUAL expected)
  message(FATAL_ERROR "${EXPECTED} differs from what ${PROGRAM} prints; if that is right, write it to the file:\n${printed}")
endif()
