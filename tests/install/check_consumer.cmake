# SPDX-License-Identifier: MIT
# Builds and runs consumer/ in a clean folder: WAY is find_package or add_subdirectory. With the installed package
# consumer_c/ too, a project in C alone, where C_API says that there is one.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(work ${BUILD}/tests/install/${WAY})
file(REMOVE_RECURSE ${work})

set(consumers consumer)
if(WAY STREQUAL "find_package")
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix)
  set(where -D CMAKE_PREFIX_PATH=${work}/prefix)
  if(C_API)
    list(APPEND consumers consumer_c)
  endif()
else()
  set(where -D EHSID_SOURCE=${SOURCE})
endif()
foreach(consumer IN LISTS consumers)
  set(build ${work}/${consumer})
  run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/${consumer} -B ${build} -G ${GENERATOR}
      -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=Release -D Eigen3_DIR=${EIGEN} ${where})
  run(${CMAKE_COMMAND} --build ${build})
  run(${build}/${consumer})
endforeach()
