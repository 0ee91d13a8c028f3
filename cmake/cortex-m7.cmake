# SPDX-License-Identifier: MIT
# Cortex-M7; the single-precision subset of its unit, which every M7 with one has.
set(EHSID_CPU_FLAGS "-mcpu=cortex-m7 -mthumb -mfloat-abi=hard -mfpu=fpv5-sp-d16")
include(${CMAKE_CURRENT_LIST_DIR}/arm-none-eabi.cmake)
