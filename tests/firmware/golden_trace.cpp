// SPDX-License-Identifier: MIT
// The file that EHSID_TRACE names, byte by byte, in read-only memory.
__asm__(
    ".section .rodata\n"
    ".global golden_trace_begin\n"
    ".global golden_trace_end\n"
    "golden_trace_begin:\n"
    ".incbin \"" EHSID_TRACE
    "\"\n"
    "golden_trace_end:\n"
    ".byte 0\n"
    ".text\n");
