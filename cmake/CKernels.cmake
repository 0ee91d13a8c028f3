# SPDX-License-Identifier: MIT
# ehsid_c_kernels(SOURCES): one source file for each forgetting policy of the C API, made from cpp/src/c_kernels.cpp and the
# list in c_api.h, so that the policies compile side by side. With EHSID_FEW_KERNELS they have the sizes that firmware and
# fuzz targets name, a third of all: for tests that run again what another build has tested in all sizes.
get_filename_component(ehsid_c_root ${CMAKE_CURRENT_LIST_DIR} DIRECTORY)
set(ehsid_c_header ${ehsid_c_root}/cpp/include/ehsid/c_api.h)

function(ehsid_c_kernels result)
  set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS ${ehsid_c_header})
  file(READ ${ehsid_c_header} header)
  string(REGEX MATCHALL " DO\\([a-z0-9_]+\\)" policies "${header}")
  list(TRANSFORM policies REPLACE " DO\\(|\\)" "")
  set(sources "")
  foreach(policy IN LISTS policies)
    set(source ${CMAKE_CURRENT_BINARY_DIR}/c_kernels/${policy}.cpp)
    if(EHSID_FEW_KERNELS)
      configure_file(${ehsid_c_root}/tests/fuzz/kernels.cpp.in ${source} @ONLY)
      list(APPEND sources ${source})
      continue()
    endif()
    file(CONFIGURE OUTPUT ${source} CONTENT "#define EHSID_POLICY ${policy}\n#include \"${ehsid_c_root}/cpp/src/c_kernels.cpp\"\n" @ONLY)
    list(APPEND sources ${source})
  endforeach()
  set(${result} ${sources} PARENT_SCOPE)
endfunction()
