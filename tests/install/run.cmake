# SPDX-License-Identifier: MIT
function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${WAY}: failed: ${ARGN}")
  endif()
endfunction()
