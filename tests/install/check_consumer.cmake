# SPDX-License-Identifier: MIT
# Builds and runs consumer/ in a clean folder: WAY is find_package or add_subdirectory.
set(work ${BUILD}/tests/install/${WAY})
file(REMOVE_RECURSE ${work})

function(run)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${WAY}: failed: ${ARGN}")
  endif()
endfunction()

if(WAY STREQUAL "find_package")
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix)
  set(where -D CMAKE_PREFIX_PATH=${work}/prefix)
else()
  set(where -D EHSID_SOURCE=${SOURCE})
endif()
run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/consumer -B ${work}/build -G ${GENERATOR}
    -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Release -D Eigen3_DIR=${EIGEN} ${where})
run(${CMAKE_COMMAND} --build ${work}/build)
run(${work}/build/consumer)
