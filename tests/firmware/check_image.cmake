# SPDX-License-Identifier: MIT
# cmake -D IMAGE=... -D NM=... -P check_image.cmake
#
# Fails if a linked firmware image holds a heap, exceptions, the unwinder, static constructors, guarded statics
# or software double arithmetic. It complements check_object.cmake: what a library brings along shows only here.
execute_process(COMMAND "${NM}" "${IMAGE}" OUTPUT_VARIABLE symbols RESULT_VARIABLE failed)
if(failed OR NOT symbols MATCHES " T main\n")
  message(FATAL_ERROR "${IMAGE}: no symbol main, nothing was checked")
endif()

set(forbidden malloc free calloc realloc _malloc_r _free_r _sbrk sbrk _sbrk_r abort exit atexit
              "_Z(n[wa]|d[la]).*" # operator new, operator delete
              "__cxa_.*" "_Unwind_.*" "__gnu_(unwind|Unwind).*" "__aeabi_unwind_.*" "__gxx_.*"
              "_ZGV.*" "_GLOBAL__sub_I.*" "__libc_init_array" "_ZT[ISV].*" "__aeabi_(d|[a-z]+2d).*")
string(REGEX MATCHALL "[^\n]+" lines "${symbols}")
foreach(line IN LISTS lines)
  string(REGEX REPLACE "^.* " "" name "${line}")
  foreach(pattern IN LISTS forbidden)
    if(name MATCHES "^${pattern}$")
      message(SEND_ERROR "not for a controller: ${IMAGE} holds ${name}")
      break()
    endif()
  endforeach()
endforeach()
