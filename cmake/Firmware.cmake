# SPDX-License-Identifier: MIT
# Images for the boards in examples/firmware/port, and what firmware is compiled with.
include(${CMAKE_CURRENT_LIST_DIR}/Warnings.cmake)

# No exceptions, no RTTI, no guards around local statics, assertions off; the bits of every other machine.
if(NOT TARGET ehsid_firmware)
  add_library(ehsid_firmware INTERFACE)
  target_compile_options(ehsid_firmware INTERFACE -fno-exceptions -fno-rtti -fno-threadsafe-statics
                                                  -fno-math-errno -fno-stack-protector)
  target_compile_definitions(ehsid_firmware INTERFACE NDEBUG)
  target_link_libraries(ehsid_firmware INTERFACE ehsid::reproducible ehsid_warnings)
endif()

# Boards that QEMU emulates, as mps2-<name>, and their processors.
set(ehsid_boards an386 an500)
set(ehsid_an386_processor -mcpu=cortex-m4 -mfpu=fpv4-sp-d16)
set(ehsid_an500_processor -mcpu=cortex-m7 -mfpu=fpv5-sp-d16)

# Images take no default libraries: memcpy and its like alone, named behind every archive that needs them.
if(CMAKE_CROSSCOMPILING)
  set(CMAKE_CXX_STANDARD_LIBRARIES "-lc -lgcc")
endif()

# ehsid_add_image(TARGET BOARD SOURCES...): <TARGET>.elf
function(ehsid_add_image target board)
  set(firmware ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../examples/firmware)
  set(script ${firmware}/port/mps2/mps2.ld)
  add_executable(${target} ${ARGN} ${firmware}/port/mps2/start_up.cpp
                           ${firmware}/port/mps2/board.cpp)
  target_link_libraries(${target} PRIVATE ehsid_firmware)
  target_include_directories(${target} PRIVATE ${firmware})
  target_compile_options(${target} PRIVATE ${ehsid_${board}_processor} -ffunction-sections
                                           -fdata-sections)
  target_link_options(${target} PRIVATE ${ehsid_${board}_processor} -nostartfiles -nodefaultlibs
                      -Wl,--gc-sections -T ${script})
  set_target_properties(${target} PROPERTIES SUFFIX .elf LINK_DEPENDS ${script})
endfunction()

# A test that the image holds nothing that is not for a controller.
function(ehsid_check_image target)
  set(tests ${CMAKE_CURRENT_FUNCTION_LIST_DIR}/../tests/firmware)
  add_test(NAME firmware.${target}.symbols
           COMMAND ${CMAKE_COMMAND} -D IMAGE=$<TARGET_FILE:${target}> -D NM=${CMAKE_NM} -P
                   ${tests}/check_image.cmake)
endfunction()
