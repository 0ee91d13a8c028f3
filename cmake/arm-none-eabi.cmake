# SPDX-License-Identifier: MIT
# Cortex-M4 with its single-precision unit; cortex-m7.cmake sets other flags and includes this. Compiles only: a
# board brings its own start-up code and linker script.
if(NOT DEFINED EHSID_CPU_FLAGS)
  set(EHSID_CPU_FLAGS "-mcpu=cortex-m4 -mthumb -mfloat-abi=hard -mfpu=fpv4-sp-d16")
endif()
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR arm)
set(CMAKE_C_COMPILER arm-none-eabi-gcc)
set(CMAKE_CXX_COMPILER arm-none-eabi-g++)
set(CMAKE_TRY_COMPILE_TARGET_TYPE STATIC_LIBRARY)
set(CMAKE_C_FLAGS_INIT "${EHSID_CPU_FLAGS}")
set(CMAKE_CXX_FLAGS_INIT "${EHSID_CPU_FLAGS}")

# Programs of the host; headers of the host only for Eigen, which is headers and nothing else.
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE BOTH)
