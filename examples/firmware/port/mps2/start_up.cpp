// SPDX-License-Identifier: MIT
// From reset to main() on a Cortex-M4F or M7: vector table, memory, floating-point unit. Addresses of system
// registers: ARMv7-M Architecture Reference Manual, B3.2 (system control space).
#include "../../port.hpp"

extern "C" {

// Set by mps2.ld; only their addresses mean anything.
extern std::uint32_t port_stack_top;
extern std::uint32_t port_data_source;
extern std::uint32_t port_data_begin;
extern std::uint32_t port_data_end;
extern std::uint32_t port_bss_begin;
extern std::uint32_t port_bss_end;

// main(), under a name of its own: C++ does not let a program call main.
int port_application() __asm__("main");

void port_tick();
void port_received();

[[noreturn]] void port_reset() {
  // CPACR: full access to coprocessors 10 and 11. Before any function that may use a float register.
  *reinterpret_cast<volatile std::uint32_t*>(0xE000ED88U) |= 0xFU << 20U;
  __asm__ volatile("dsb\n isb" ::: "memory");

  const std::uint32_t* source = &port_data_source;
  for (std::uint32_t* to = &port_data_begin; to != &port_data_end; ++to, ++source) {
    *to = *source;
  }
  for (std::uint32_t* to = &port_bss_begin; to != &port_bss_end; ++to) {
    *to = 0;
  }
  port::stop(port_application());
}

[[noreturn]] void port_fault() {
  static const char kMessage[] = "FAULT: exception of the processor\n";
  port::write(kMessage, sizeof kMessage - 1);
  port::stop(70);
}
}

namespace {

using Handler = void (*)();

/// ARMv7-M B1.5.3. The table ends with the one interrupt of the board that is used.
struct VectorTable {
  const void* stack;
  Handler handlers[16];
};

[[gnu::section(".vectors"), gnu::used]] const VectorTable kVectors = {
    &port_stack_top,
    {
        port_reset,  // 1
        port_fault,  // 2 NMI
        port_fault,  // 3 HardFault
        port_fault,  // 4 MemManage
        port_fault,  // 5 BusFault
        port_fault,  // 6 UsageFault
        nullptr,
        nullptr,
        nullptr,
        nullptr,
        port_fault,  // 11 SVCall
        port_fault,  // 12 DebugMonitor
        nullptr,
        port_fault,     // 14 PendSV
        port_tick,      // 15 SysTick
        port_received,  // 16 interrupt 0 of the board: UART0
    }};

}  // namespace
