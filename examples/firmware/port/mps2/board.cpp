// SPDX-License-Identifier: MIT
// The port for Arm's MPS2 boards with FPGA images AN386 (Cortex-M4F) and AN500 (Cortex-M7), as QEMU emulates
// them. UART: Arm CMSDK APB UART (Cortex-M System Design Kit TRM, ch. 4.3). Timer: SysTick (ARMv7-M B3.3).
#include "../../port.hpp"

namespace {

constexpr std::uint32_t kClockHz = 25'000'000;
constexpr std::uint32_t kBaud = 115'200;
constexpr std::uint32_t kPeriod = kClockHz / port::kTicksPerSecond;

volatile std::uint32_t& at(std::uint32_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

// UART0
constexpr std::uint32_t kData = 0x40004000U;
constexpr std::uint32_t kState = 0x40004004U;
constexpr std::uint32_t kControl = 0x40004008U;
constexpr std::uint32_t kBaudDivider = 0x40004010U;
constexpr std::uint32_t kTransmitFull = 1U;  // in kState
constexpr std::uint32_t kReceiveFull = 2U;
constexpr std::uint32_t kTransmitAndReceive = 3U;  // in kControl

// SysTick, and the register that says whether its interrupt is waiting
constexpr std::uint32_t kTickControl = 0xE000E010U;
constexpr std::uint32_t kTickReload = 0xE000E014U;
constexpr std::uint32_t kTickValue = 0xE000E018U;
constexpr std::uint32_t kProcessorClockInterruptOn = 7U;
constexpr std::uint32_t kInterruptControl = 0xE000ED04U;
constexpr std::uint32_t kTickPending = 1U << 26U;

volatile std::uint32_t ticks = 0;

void wait_until_sent() {
  while ((at(kState) & kTransmitFull) != 0) {
  }
}

}  // namespace

extern "C" void port_tick() { ticks = ticks + 1; }

namespace port {

void start() {
  at(kBaudDivider) = kClockHz / kBaud;
  at(kControl) = kTransmitAndReceive;
  at(kTickReload) = kPeriod - 1;
  at(kTickValue) = 0;
  at(kTickControl) = kProcessorClockInterruptOn;
}

bool read(std::uint8_t& byte) {
  if ((at(kState) & kReceiveFull) == 0) {
    return false;
  }
  byte = static_cast<std::uint8_t>(at(kData));
  return true;
}

void write(const void* bytes, std::size_t count) {
  const auto* next = static_cast<const std::uint8_t*>(bytes);
  for (std::size_t i = 0; i < count; ++i) {
    wait_until_sent();
    at(kData) = next[i];
  }
}

std::uint32_t milliseconds() { return ticks; }

std::uint32_t cycles() {
  std::uint32_t masked = 0;
  __asm__ volatile("mrs %0, primask\n cpsid i" : "=r"(masked)::"memory");
  std::uint32_t value = at(kTickValue);
  std::uint32_t passed = ticks;
  if ((at(kInterruptControl) & kTickPending) != 0) {
    value = at(kTickValue);  // read again: the first may be from before the tick
    ++passed;
  }
  __asm__ volatile("msr primask, %0" ::"r"(masked) : "memory");
  // Down from kPeriod - 1; the tick is raised at 0.
  return passed * kPeriod + (value == 0 ? 0 : kPeriod - value);
}

void wait_for_interrupt() { __asm__ volatile("wfi" ::: "memory"); }

/// Semihosting, SYS_EXIT_EXTENDED with ADP_Stopped_ApplicationExit (Arm semihosting specification 2.0). On a
/// board without a debugger the breakpoint is a fault from which the processor does not come back.
void stop(int code) {
  wait_until_sent();
  const std::uint32_t block[2] = {0x20026U, static_cast<std::uint32_t>(code)};
  for (;;) {
    __asm__ volatile("movs r0, #0x20\n mov r1, %0\n bkpt 0xAB" ::"r"(block) : "r0", "r1", "memory");
  }
}

}  // namespace port
