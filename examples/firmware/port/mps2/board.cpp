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
constexpr std::uint32_t kInterrupts = 0x4000400CU;  // which are raised; cleared by writing ones
constexpr std::uint32_t kBaudDivider = 0x40004010U;
constexpr std::uint32_t kTransmitFull = 1U;  // in kState
constexpr std::uint32_t kReceiveFull = 2U;
constexpr std::uint32_t kTransmitOn = 1U;  // in kControl
constexpr std::uint32_t kReceiveOn = 2U;
constexpr std::uint32_t kReceiveInterruptOn = 8U;
constexpr std::uint32_t kReceived = 2U;  // in kInterrupts

// SysTick, and the register that says whether its interrupt is waiting
constexpr std::uint32_t kTickControl = 0xE000E010U;
constexpr std::uint32_t kTickReload = 0xE000E014U;
constexpr std::uint32_t kTickValue = 0xE000E018U;
constexpr std::uint32_t kProcessorClockInterruptOn = 7U;
constexpr std::uint32_t kInterruptControl = 0xE000ED04U;
constexpr std::uint32_t kTickPending = 1U << 26U;

// Which processor this is (ARMv7-M B3.2.3, CPUID), and interrupts of the board, 0 to 31
constexpr std::uint32_t kProcessor = 0xE000ED00U;
constexpr std::uint32_t kPartMask = 0xFFF0U;
constexpr std::uint32_t kCortexM7 = 0xC270U;
constexpr std::uint32_t kInterruptEnable = 0xE000E100U;
constexpr std::uint32_t kUart0Receive = 1U << 0U;  // as QEMU's hw/arm/mps2.c wires these two boards

volatile std::uint32_t ticks = 0;

// What was received and not read yet: the interrupt (or who masks it) writes `filled` and the bytes, read()
// alone `taken`. Both count up for ever, so their difference is the number of bytes that wait.
constexpr std::uint32_t kWaiting = 256;  // 22 ms of the line
volatile std::uint8_t waiting[kWaiting];
volatile std::uint32_t filled = 0;
volatile std::uint32_t taken = 0;

/// With the buffer full a byte stays in the UART: the emulator then waits with the next, a real line would lose it.
void take_from_line() {
  while (filled - taken < kWaiting && (at(kState) & kReceiveFull) != 0) {
    waiting[filled % kWaiting] = static_cast<std::uint8_t>(at(kData));
    filled = filled + 1;
  }
}

std::uint32_t mask_interrupts() {
  std::uint32_t masked = 0;
  __asm__ volatile("mrs %0, primask\n cpsid i" : "=r"(masked)::"memory");
  return masked;
}

void restore_interrupts(std::uint32_t masked) {
  __asm__ volatile("msr primask, %0\n isb" ::"r"(masked) : "memory");
}

void wait_until_sent() {
  while ((at(kState) & kTransmitFull) != 0) {
  }
}

}  // namespace

extern "C" {

void port_tick() { ticks = ticks + 1; }

void port_received() {
  at(kInterrupts) = kReceived;
  take_from_line();
}
}

namespace port {

const char* board_name() {
  return (at(kProcessor) & kPartMask) == kCortexM7 ? "mps2-an500" : "mps2-an386";
}

void start() {
  at(kBaudDivider) = kClockHz / kBaud;
  at(kControl) = kTransmitOn | kReceiveOn | kReceiveInterruptOn;
  at(kInterruptEnable) = kUart0Receive;
  at(kTickReload) = kPeriod - 1;
  at(kTickValue) = 0;
  at(kTickControl) = kProcessorClockInterruptOn;
}

bool read(std::uint8_t& byte) {
  if (filled == taken) {
    return false;
  }
  byte = waiting[taken % kWaiting];
  taken = taken + 1;
  if (filled - taken >=
      kWaiting - 1) {  // it was full: no interrupt will come for what the UART still holds
    const std::uint32_t masked = mask_interrupts();
    take_from_line();
    restore_interrupts(masked);
  }
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
  const std::uint32_t masked = mask_interrupts();
  std::uint32_t value = at(kTickValue);
  std::uint32_t passed = ticks;
  if ((at(kInterruptControl) & kTickPending) != 0) {
    value = at(kTickValue);  // read again: the first may be from before the tick
    ++passed;
  }
  restore_interrupts(masked);
  // Down from kPeriod - 1; the tick is raised at 0.
  return passed * kPeriod + (value == 0 ? 0 : kPeriod - value);
}

/// Masked, an interrupt still ends the sleep: a byte that comes between the question and the sleep does not wait
/// for the tick.
void wait_for_interrupt() {
  const std::uint32_t masked = mask_interrupts();
  if (filled == taken) {
    __asm__ volatile("dsb\n wfi" ::: "memory");
  }
  restore_interrupts(masked);
}

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
