# SPDX-License-Identifier: MIT
# Builds and runs consumer/ and examples/cpp in a clean folder: WAY is find_package or add_subdirectory. With the installed
# package also consumer_c/ and examples/c, projects in C alone, where C_API says that there is a library for them. The
# programs of the last release (tests/interface/released) must compile, too.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(work ${BUILD}/tests/install/${WAY})
file(REMOVE_RECURSE ${work})

set(consumers consumer)
set(languages cpp)
if(WAY STREQUAL "find_package")
  run(${CMAKE_COMMAND} --install ${BUILD} --prefix ${work}/prefix)
  set(where -D CMAKE_PREFIX_PATH=${work}/prefix)
  if(C_API)
    list(APPEND consumers consumer_c)
    list(APPEND languages c)
  endif()
else()
  set(where -D EHSID_SOURCE=${SOURCE})
endif()

function(configure project build)
  run(${CMAKE_COMMAND} -S ${project} -B ${build} -G ${GENERATOR} -D CMAKE_CXX_COMPILER=${COMPILER}
      -D CMAKE_BUILD_TYPE=Release -D Eigen3_DIR=${EIGEN} ${where})
endfunction()

foreach(consumer IN LISTS consumers)
  set(build ${work}/${consumer})
  configure(${CMAKE_CURRENT_LIST_DIR}/${consumer} ${build})
  run(${CMAKE_COMMAND} --build ${build})
  run(${build}/${consumer})
endforeach()

# Major number, and before 1.0 the minor one, of the sources and of the last release.
file(STRINGS ${SOURCE}/cpp/include/ehsid/version.hpp numbers REGEX "^#define EHSID_VERSION_(MAJOR|MINOR) [0-9]+$")
string(REGEX REPLACE "#define EHSID_VERSION_[A-Z]+ " "" numbers "${numbers}")
string(REPLACE ";" "." VERSION_OF_INTERFACE "${numbers}")
file(READ ${SOURCE}/tests/interface/released/version.txt released)
string(REGEX MATCH "^[0-9]+\\.[0-9]+" RELEASED_INTERFACE "${released}")
if(NOT numbers MATCHES "^0;")
  string(REGEX REPLACE "\\..*" "" VERSION_OF_INTERFACE "${VERSION_OF_INTERFACE}")
  string(REGEX REPLACE "\\..*" "" RELEASED_INTERFACE "${RELEASED_INTERFACE}")
endif()

# The examples in all languages print the same text: the test of the one in Python compares with the same file.
foreach(language IN LISTS languages)
  set(build ${work}/examples/${language})
  configure(${SOURCE}/examples/${language} ${build})
  run(${CMAKE_COMMAND} --build ${build})
  run(${CMAKE_COMMAND} -D PROGRAM=${build}/online -D ARGUMENTS=${SOURCE}/examples/data/servo_samples.csv
      -D EXPECTED=${SOURCE}/examples/servo_online.txt -P ${SOURCE}/cmake/CompareOutput.cmake)
  # A version that may change the interface (tests/interface/rules.py) need not compile them.
  if(VERSION_OF_INTERFACE STREQUAL RELEASED_INTERFACE)
    set(build ${work}/released/${language})
    configure(${SOURCE}/tests/interface/released/examples/${language} ${build})
    run(${CMAKE_COMMAND} --build ${build})
  endif()
endforeach()

# From the sources the C library takes minutes to compile; for a Cortex-M it is (check_arm.cmake). Here only the program is.
if(WAY STREQUAL "add_subdirectory" AND GENERATOR STREQUAL "Ninja")
  configure(${SOURCE}/examples/c ${work}/examples/c)
  run(${CMAKE_COMMAND} --build ${work}/examples/c --target CMakeFiles/online.dir/online.c.o)
endif()
