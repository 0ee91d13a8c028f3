# SPDX-License-Identifier: MIT
# ehsid::c, the estimator for C: a static library without the C++ run-time library. Sections of their own, so that
# a linker with --gc-sections keeps only the policies and sizes that a program names.
include(cmake/CKernels.cmake)
# gcc compiles and tests all sizes; sanitizers and the emulator see a few of them, and all in script/test --all.
if(EHSID_BUILD_TESTS AND NOT EHSID_THOROUGH AND (CMAKE_CROSSCOMPILING OR CMAKE_CXX_FLAGS MATCHES "-fsanitize"))
  set(EHSID_FEW_KERNELS ON)
endif()
ehsid_c_kernels(kernels)
add_library(ehsid_c STATIC cpp/src/c_api.cpp cpp/src/c_riv.cpp cpp/src/c_integrating.cpp ${kernels})
add_library(ehsid::c ALIAS ehsid_c)
set_target_properties(ehsid_c PROPERTIES EXPORT_NAME c)
if(NOT CMAKE_CROSSCOMPILING) # for shared libraries of hosts; firmware stays where it is
  set_target_properties(ehsid_c PROPERTIES POSITION_INDEPENDENT_CODE ON)
endif()
target_include_directories(ehsid_c PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}/cpp/include>)
include(cmake/Warnings.cmake)
target_link_libraries(ehsid_c PRIVATE $<BUILD_INTERFACE:ehsid::reproducible> $<BUILD_INTERFACE:ehsid_warnings>)
target_compile_options(
  ehsid_c
  PRIVATE "$<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-fno-exceptions;-fno-rtti;-fno-threadsafe-statics>"
          "$<$<CXX_COMPILER_ID:GNU,Clang,AppleClang>:-fno-math-errno;-ffunction-sections;-fdata-sections>")
# Eigen's assertions print and abort; every argument is checked before it gets there.
target_compile_definitions(ehsid_c PRIVATE EIGEN_NO_DEBUG)
