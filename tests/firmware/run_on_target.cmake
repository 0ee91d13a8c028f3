# SPDX-License-Identifier: MIT
# cmake -D WAY=same|relay|damaged -D QEMU=... -D MACHINE=... -D IMAGE=... -D HOST=... -P run_on_target.cmake
#
# same: the program on the emulated target prints what it prints on the host, and both pass.
# relay: host, target, host; each takes over the states that the one before saved.
# damaged: the same with one byte changed on the way to the target, which must refuse the state.
set(target "${QEMU}" -machine "${MACHINE}" -display none -monitor none -serial stdio
           -semihosting-config enable=on,target=native -kernel "${IMAGE}")
set(work "${IMAGE}.${WAY}")

if(WAY STREQUAL "same")
  execute_process(COMMAND "${HOST}" OUTPUT_VARIABLE expected RESULT_VARIABLE host_failed)
  execute_process(COMMAND ${target} INPUT_FILE /dev/null OUTPUT_VARIABLE made
                  RESULT_VARIABLE target_failed)
  if(host_failed OR target_failed OR NOT made STREQUAL expected
     OR NOT made MATCHES "PASS [0-9]+ checks\n$")
    message(FATAL_ERROR "host (exit ${host_failed}):\n${expected}\n"
                        "${MACHINE} (exit ${target_failed}):\n${made}")
  endif()
  message(STATUS "${MACHINE}, as on the host:\n${made}")
  return()
endif()

file(WRITE "${work}.0" "row 0\n")
execute_process(COMMAND "${HOST}" INPUT_FILE "${work}.0" OUTPUT_VARIABLE saved RESULT_VARIABLE failed)
if(failed)
  message(FATAL_ERROR "on the host, first part:\n${saved}")
endif()
if(WAY STREQUAL "damaged")
  # The first byte of the first state.
  string(REGEX REPLACE "^(row [0-9]+\n)3" "\\12" damaged "${saved}")
  if(damaged STREQUAL saved)
    message(FATAL_ERROR "nothing was damaged:\n${saved}")
  endif()
  file(WRITE "${work}.1" "${damaged}")
  execute_process(COMMAND ${target} INPUT_FILE "${work}.1" OUTPUT_VARIABLE made RESULT_VARIABLE failed)
  if(NOT failed EQUAL 1 OR NOT made MATCHES "FAIL Constant, sample 220: state refused")
    message(FATAL_ERROR "${MACHINE} (exit ${failed}) took a damaged state:\n${made}")
  endif()
  return()
endif()
file(WRITE "${work}.1" "${saved}")
execute_process(COMMAND ${target} INPUT_FILE "${work}.1" OUTPUT_FILE "${work}.2" RESULT_VARIABLE failed)
if(failed)
  file(READ "${work}.2" made)
  message(FATAL_ERROR "on ${MACHINE} (exit ${failed}), second part:\n${made}")
endif()
execute_process(COMMAND "${HOST}" INPUT_FILE "${work}.2" OUTPUT_VARIABLE made RESULT_VARIABLE failed)
if(failed OR NOT made MATCHES "^row 660\n")
  message(FATAL_ERROR "on the host again (exit ${failed}), last part:\n${made}")
endif()
