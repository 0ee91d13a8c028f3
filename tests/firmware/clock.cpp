// SPDX-License-Identifier: MIT
// Loop timer and counter of the port. To be run with -icount, where time passes with instructions and not with
// the load of the host.
#include "port.hpp"
#include "report.hpp"

namespace {

constexpr std::uint32_t kPeriod = 25'000;  // ticks of the processor in one of the loop timer

/// Reads the counter until `ticks` have passed: never backwards, never a leap. One read and what is around it are
/// about a hundred instructions, at 0.8 ticks each.
bool steady(std::uint32_t ticks) {
  const std::uint32_t start = port::cycles();
  std::uint32_t last = start;
  while (last - start < ticks) {
    const std::uint32_t now = port::cycles();
    if (now == last || now - last > 500) {
      return false;
    }
    last = now;
  }
  return true;
}

}  // namespace

int main() {
  port::start();
  firmware::Report report;

  port::wait_for_interrupt();
  const std::uint32_t since = port::milliseconds();
  const std::uint32_t counted = port::cycles();
  for (int i = 0; i < 50; ++i) {
    port::wait_for_interrupt();
  }
  report.check(port::milliseconds() - since == 50, "clock", "one wait is not one tick", 0);
  const std::uint32_t passed = port::cycles() - counted;
  report.check(passed > 50 * kPeriod - 500 && passed < 50 * kPeriod + 500, "clock",
               "counter and timer differ", 0);
  report.check(steady(20 * kPeriod), "clock", "counter not steady", 0);

  port::wait_for_interrupt();
  report.check(steady(kPeriod / 2), "clock", "counter not steady", 1);
  __asm__ volatile("cpsid i" ::: "memory");
  // Over a tick that nobody counts yet.
  report.check(steady(kPeriod * 4 / 5), "clock", "counter not steady while masked", 0);
  const std::uint32_t before = port::cycles();
  __asm__ volatile("cpsie i\n isb" ::: "memory");
  report.check(port::cycles() - before < 500, "clock", "counter leaps at the interrupt", 0);
  return report.finish();
}
