/* SPDX-License-Identifier: MIT
 * Cortex-M without a library of the vendor: vectors, semihosting, and SysTick as the clock. With an instruction a
 * nanosecond TENTHS is ten times their number in a period of SysTick. */
#include "port.h"

extern char stack_top[], data_start[], data_end[], data_from[], bss_start[], bss_end[];
int main(void);
void start(void);

void start(void) {
  char* to;
  const char* from = data_from;
  for (to = data_start; to < data_end; ++to) *to = *from++;
  for (to = bss_start; to < bss_end; ++to) *to = 0;
#ifdef __ARM_FP
  *(volatile uint32_t*)0xe000ed88U |= 0xf00000U; /* CPACR: the floating-point unit on */
  __asm__ volatile("dsb\nisb");
#endif
  *(volatile uint32_t*)0xe000e014U = 0xffffffU; /* SysTick: largest reload, processor clock, on */
  *(volatile uint32_t*)0xe000e018U = 0U;
  *(volatile uint32_t*)0xe000e010U = 5U;
  (void)main();
}

static void fault(void) { port_stop(2); }

__attribute__((section(".vectors"), used)) static void* const vectors[16] = {
    stack_top, (void*)start, (void*)fault, (void*)fault, (void*)fault, (void*)fault};

static int call(int operation, const void* argument) {
  register int r0 __asm__("r0") = operation;
  register const void* r1 __asm__("r1") = argument;
  __asm__ volatile("bkpt 0xab" : "+r"(r0) : "r"(r1) : "memory");
  return r0;
}

void port_write(const char* text) { (void)call(4, text); }

void port_stop(int code) {
  uint32_t arguments[2] = {0x20026U, 0U};
  arguments[1] = (uint32_t)code;
  (void)call(0x20, arguments);
}

uint32_t port_instructions(void) {
  return (0xffffffU - *(volatile uint32_t*)0xe000e018U) * TENTHS / 10U;
}
