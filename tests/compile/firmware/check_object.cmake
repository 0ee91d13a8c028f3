# SPDX-License-Identifier: MIT
# cmake -D OBJECT=... -D NM=... -D OBJDUMP=... -P check_object.cmake
#
# Fails if the object, or one of an archive, refers to anything but block copies and sqrtf, or holds a static constructor. A list of
# what is allowed, not of what is forbidden: heap, exceptions, type information, guards, iostream, libm and the
# software double arithmetic of a single-precision unit (__aeabi_dadd ...) are all names outside of it.
cmake_minimum_required(VERSION 3.22) # for if(IN_LIST)

set(allowed memcpy memmove memset sqrtf __aeabi_memcpy __aeabi_memcpy4 __aeabi_memcpy8
            __aeabi_memmove __aeabi_memmove4 __aeabi_memset __aeabi_memset4 __aeabi_memclr
            __aeabi_memclr4 _GLOBAL_OFFSET_TABLE_)

function(run output)
  execute_process(COMMAND ${ARGN} OUTPUT_VARIABLE text RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "cannot run: ${ARGN}")
  endif()
  set(${output} "${text}" PARENT_SCOPE)
endfunction()

run(defined "${NM}" --defined-only "${OBJECT}")
if(NOT defined MATCHES " [TW] ")
  message(FATAL_ERROR "${OBJECT} defines no function: nothing was checked")
endif()

run(undefined "${NM}" --undefined-only "${OBJECT}")
string(REGEX MATCHALL "[^ \n]+(\n|$)" names "${undefined}")
foreach(name IN LISTS names)
  string(STRIP "${name}" name)
  if(NOT name MATCHES ":$" AND NOT name IN_LIST allowed) # a colon: an object of an archive
    message(SEND_ERROR "not for a controller: ${OBJECT} refers to ${name}")
  endif()
endforeach()

# Type information and thread-safe or guarded statics would be defined, not referred to.
if(defined MATCHES " [A-Za-z] (_ZT[ISV]|_ZGV)[^\n]*")
  message(SEND_ERROR "not for a controller: ${OBJECT} defines ${CMAKE_MATCH_0}")
endif()

run(sections "${OBJDUMP}" -h "${OBJECT}")
if(sections MATCHES "\\.(init_array|ctors|gcc_except_table)")
  message(SEND_ERROR "not for a controller: ${OBJECT} has a section ${CMAKE_MATCH_0}")
endif()
