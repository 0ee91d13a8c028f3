/* SPDX-License-Identifier: MIT
 * QEMU's board `virt`: RAM from 0x80000000 on, no firmware before ours, semihosting. */
#include "port.h"

extern char stack_top[];
int main(void);

__attribute__((naked, section(".start"))) void start(void) {
  __asm__ volatile(
      "la sp, stack_top\n"
#ifdef __riscv_flen
      "li t0, 0x2000\n csrs mstatus, t0\n"
#endif
      "call main\n1: j 1b\n");
}

static long call(long operation, const void* argument) {
  register long a0 __asm__("a0") = operation;
  register const void* a1 __asm__("a1") = argument;
  /* The three instructions that say "semihosting" stand in one page and are not compressed. */
  __asm__ volatile(".option push\n.option norvc\nslli x0, x0, 0x1f\nebreak\nsrai x0, x0, 7\n.option pop"
                   : "+r"(a0) : "r"(a1) : "memory");
  return a0;
}

void port_write(const char* text) { (void)call(4, text); }

void port_stop(int code) {
  uint32_t arguments[2] = {0x20026, 0};
  arguments[1] = (uint32_t)code;
  (void)call(0x20, arguments);
}

uint32_t port_instructions(void) {
  uint32_t count;
  __asm__ volatile("csrr %0, minstret" : "=r"(count) : : "memory");
  return count;
}
