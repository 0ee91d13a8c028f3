/* SPDX-License-Identifier: MIT
 * What main.c needs of a core under QEMU with semihosting. */
#pragma once

#include <stdint.h>

void port_write(const char* text);
/* Ends the run with this exit code. */
void port_stop(int code);
/* Instructions so far; wraps. QEMU must run with -icount shift=0. */
uint32_t port_instructions(void);
