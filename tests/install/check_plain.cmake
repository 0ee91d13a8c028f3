# SPDX-License-Identifier: MIT
# The build and the package of a user who sets nothing: no source is compiled, and the package finds the Eigen of its build
# again, or says what is missing, where it was looked for and how to mend it.
cmake_minimum_required(VERSION 3.22)
include(${CMAKE_CURRENT_LIST_DIR}/run.cmake)
set(work ${BUILD}/tests/install/plain)
file(REMOVE_RECURSE ${work})
set(WAY plain)
set(prefix ${work}/prefix)
set(tools -G ${GENERATOR} -D CMAKE_MAKE_PROGRAM=${MAKE_PROGRAM} -D CMAKE_CXX_COMPILER=${COMPILER})
# As on a machine that has neither Eigen nor Python.
set(bare -D CMAKE_FIND_USE_CMAKE_SYSTEM_PATH=OFF -D CMAKE_FIND_USE_SYSTEM_ENVIRONMENT_PATH=OFF
         -D CMAKE_FIND_USE_PACKAGE_REGISTRY=OFF -D CMAKE_FIND_USE_CMAKE_ENVIRONMENT_PATH=OFF)

# says(RESULT SAID COMMAND...): the command ends with code 0 for the result `done`, with another for `refused`; what it says,
# without its breaks of lines, has the text SAID.
function(says result said)
  execute_process(COMMAND ${ARGN} COMMAND_ECHO STDOUT RESULT_VARIABLE code OUTPUT_VARIABLE text ERROR_VARIABLE text)
  string(REGEX REPLACE "[ \n]+" " " words "${text}")
  string(FIND "${words}" "${said}" at)
  set(ended refused)
  if(code EQUAL 0)
    set(ended done)
  endif()
  if(NOT ended STREQUAL result OR at EQUAL -1)
    message(FATAL_ERROR "${ended}, not ${result} with \"${said}\":\n${text}")
  endif()
endfunction()

function(components names result said)
  file(REMOVE_RECURSE ${work}/components)
  says(${result} "${said}" ${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/components -B ${work}/components
       ${tools} ${bare} -D CMAKE_PREFIX_PATH=${prefix} -D COMPONENTS=${names})
endfunction()

run(${CMAKE_COMMAND} -S ${SOURCE} -B ${work}/build ${tools} -D Eigen3_DIR=${EIGEN})
run(${CMAKE_COMMAND} --build ${work}/build)
run(${CMAKE_COMMAND} --install ${work}/build --prefix ${prefix})
file(GLOB_RECURSE compiled ${work}/build/*.o ${work}/build/*.obj ${work}/build/*.a)
if(compiled)
  message(FATAL_ERROR "a build without options compiles: ${compiled}")
endif()
file(STRINGS ${work}/build/CMakeCache.txt optimised REGEX "^CMAKE_BUILD_TYPE:STRING=Release$")
if(NOT optimised)
  message(FATAL_ERROR "a build without options is not optimised")
endif()

components(cpp done "Eigen: ${EIGEN} ")
components(c refused "without the library for C. Build it with -D EHSID_BUILD_C=ON")
components(ada refused "the components cpp and c, but no component ada")

# The Eigen of the build has gone.
file(GLOB_RECURSE config ${prefix}/ehsid-config.cmake)
file(READ ${config} text)
string(REPLACE "${EIGEN}" "${work}/gone" text "${text}")
file(WRITE ${config} "${text}")
components(cpp refused "Eigen 3.4 was not found.")
components(cpp refused "- in ${work}/gone, where it was when ehsid was installed")
components(cpp refused "- as the package cmeel-eigen of Python, but there is no Python in PATH")
components(cpp refused "apt install libeigen3-dev")
components(cpp refused "-D Eigen3_DIR=FOLDER")
components(cpp refused "The library for C needs no Eigen: find_package(ehsid CONFIG REQUIRED COMPONENTS c)")

# Headers without Eigen, on a machine that has none; what needs it is refused.
set(without ${work}/without)
run(${CMAKE_COMMAND} -S ${SOURCE} -B ${without}/build ${tools} ${bare} -D EHSID_EIGEN=OFF)
run(${CMAKE_COMMAND} --install ${without}/build --prefix ${without}/prefix)
set(prefix ${without}/prefix)
components(cpp done "without Eigen")
says(refused "Leave EHSID_EIGEN ON to build the library for C" ${CMAKE_COMMAND} -S ${SOURCE} -B ${without}/c ${tools}
     -D EHSID_EIGEN=OFF -D EHSID_BUILD_C=ON)

# The sources with the .venv that script/demo makes, called from a shell that does not use it.
set(clone ${work}/clone)
file(COPY ${SOURCE}/CMakeLists.txt ${SOURCE}/cmake DESTINATION ${clone})
file(COPY ${SOURCE}/cpp/include/ehsid/version.hpp DESTINATION ${clone}/cpp/include/ehsid)
set(from_sources ${CMAKE_COMMAND} -S ${clone} -B ${clone}/build ${tools} ${bare})
says(refused "Eigen 3.4 was not found." ${from_sources})
file(WRITE ${clone}/.venv/bin/python "#!/bin/sh\necho '${EIGEN}'\n")
file(CHMOD ${clone}/.venv/bin/python PERMISSIONS OWNER_READ OWNER_EXECUTE)
says(done "Eigen: ${EIGEN} " ${from_sources})
