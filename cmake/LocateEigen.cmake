# SPDX-License-Identifier: MIT
# Where Eigen3::Eigen comes from: from the system or any prefix CMake searches, else from a folder that is named, else
# from the Python wheel `cmeel-eigen`, so that nothing needs root. An imported target, so Eigen's headers are system
# headers to the compiler. Installed beside ehsid-config.cmake, which searches in the same way.

# For our own build: provides Eigen3::Eigen, or ends with what is missing.
function(ehsid_locate_eigen)
  if(TARGET Eigen3::Eigen)
    return()
  endif()
  ehsid_find_eigen(problem)
  if(problem)
    message(FATAL_ERROR "${problem}")
  endif()
  # Else a project that adds us as a subdirectory could not see what our target links.
  set_target_properties(Eigen3::Eigen PROPERTIES IMPORTED_GLOBAL TRUE)
  message(STATUS "Eigen: ${Eigen3_DIR}")
endfunction()

# ehsid_find_eigen(PROBLEM [FOLDERS...]): provides Eigen3::Eigen, looking also in these folders of Eigen3Config.cmake. Sets
# PROBLEM to what is missing, where it was looked for and how to mend it, or to an empty string.
function(ehsid_find_eigen problem)
  set(${problem} "" PARENT_SCOPE)
  if(TARGET Eigen3::Eigen)
    return()
  endif()
  find_package(Eigen3 3.4 CONFIG QUIET)
  set(others "")
  foreach(file version IN ZIP_LISTS Eigen3_CONSIDERED_CONFIGS Eigen3_CONSIDERED_VERSIONS)
    string(APPEND others "    not usable: ${file}, of version ${version}\n")
  endforeach()
  set(named "")
  foreach(folder IN LISTS ARGN)
    if(NOT TARGET Eigen3::Eigen)
      # A toolchain file may confine searches to the target's folders: headers of the host do.
      find_package(Eigen3 3.4 CONFIG QUIET PATHS "${folder}" NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
      string(APPEND named "  - in ${folder}, where it was when ehsid was installed\n")
    endif()
  endforeach()
  if(NOT TARGET Eigen3::Eigen)
    ehsid_eigen_from_wheel(folder pythons)
    find_package(Eigen3 3.4 CONFIG QUIET PATHS "${folder}" NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH)
  endif()
  if(TARGET Eigen3::Eigen)
    return()
  endif()
  if(pythons)
    string(REPLACE ";" ", " pythons "${pythons}")
    set(wheel "of ${pythons}")
  else()
    set(wheel "of Python, but there is no Python in PATH")
  endif()
  set(${problem}
      "Eigen 3.4 was not found. It was looked for:
  - where find_package(Eigen3) looks: Eigen3_DIR, CMAKE_PREFIX_PATH, folders of the system
${others}${named}  - as the package cmeel-eigen ${wheel}
Do one of these:
  - install it for the system; on Debian and Ubuntu: apt install libeigen3-dev
  - pip install cmeel-eigen, and call CMake where this Python environment is active
  - give the folder that has Eigen3Config.cmake: -D Eigen3_DIR=FOLDER"
      PARENT_SCOPE)
endfunction()

# Sets `result` to the folder of Eigen3Config.cmake inside the wheel, or to an empty string, and `asked` to the Pythons
# that were asked: the one that the project has chosen, the first in PATH, and that of .venv in our sources, which the
# scripts make. find_package(Python) would choose one for the whole project.
function(ehsid_eigen_from_wheel result asked)
  find_program(python NAMES python3 python NO_CACHE)
  set(sources ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/..)
  set(pythons "")
  foreach(candidate IN ITEMS "${Python_EXECUTABLE}" "${Python3_EXECUTABLE}" "${python}"
                             "${sources}/.venv/bin/python" "${sources}/.venv/Scripts/python.exe")
    if(EXISTS "${candidate}")
      get_filename_component(candidate "${candidate}" ABSOLUTE) # links stay: they lead to other packages
      list(APPEND pythons "${candidate}")
    endif()
  endforeach()
  list(REMOVE_DUPLICATES pythons)
  set(${result} "" PARENT_SCOPE)
  set(${asked} "${pythons}" PARENT_SCOPE)
  foreach(python IN LISTS pythons)
    execute_process(
      COMMAND "${python}" -c "
import importlib.metadata
files = importlib.metadata.files('cmeel-eigen') or []
print(next(f.locate().resolve().parent for f in files if f.name == 'Eigen3Config.cmake'))"
      OUTPUT_VARIABLE folder OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE failed)
    if(NOT failed)
      set(${result} "${folder}" PARENT_SCOPE)
      return()
    endif()
  endforeach()
endfunction()
