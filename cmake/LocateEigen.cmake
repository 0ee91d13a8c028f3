# SPDX-License-Identifier: MIT
# Provides Eigen3::Eigen: from the system or any prefix CMake searches, else from the Python wheel `cmeel-eigen`,
# so that nothing needs root. An imported target, so Eigen's headers are system headers to the compiler.

function(ehsid_locate_eigen)
  if(TARGET Eigen3::Eigen)
    return()
  endif()
  find_package(Eigen3 3.4 CONFIG QUIET)
  if(NOT TARGET Eigen3::Eigen)
    ehsid_eigen_from_wheel(directory)
    find_package(Eigen3 3.4 CONFIG QUIET PATHS "${directory}" NO_DEFAULT_PATH)
  endif()
  if(NOT TARGET Eigen3::Eigen)
    message(FATAL_ERROR "Eigen 3.4 was not found. Install it (Debian: libeigen3-dev), or "
                        "`pip install cmeel-eigen`, or set Eigen3_DIR to the folder of Eigen3Config.cmake.")
  endif()
  # Else a project that adds us as a subdirectory could not see what our target links.
  set_target_properties(Eigen3::Eigen PROPERTIES IMPORTED_GLOBAL TRUE)
  message(STATUS "Eigen: ${Eigen3_DIR}")
endfunction()

# Sets `result` to the folder of Eigen3Config.cmake inside the wheel, or to an empty string.
function(ehsid_eigen_from_wheel result)
  set(${result} "" PARENT_SCOPE)
  find_package(Python 3.8 COMPONENTS Interpreter QUIET)
  if(NOT Python_Interpreter_FOUND)
    return()
  endif()
  execute_process(
    COMMAND "${Python_EXECUTABLE}" -c "
import importlib.metadata
files = importlib.metadata.files('cmeel-eigen') or []
print(next(f.locate().resolve().parent for f in files if f.name == 'Eigen3Config.cmake'))"
    OUTPUT_VARIABLE directory OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
  if(NOT failed)
    set(${result} "${directory}" PARENT_SCOPE)
  endif()
endfunction()
