// SPDX-License-Identifier: MIT
// Counts the processor's ticks and the stack of one form (measured.hpp), and prints them:
//   bytes <storage> updates <of samples> ticks <sum> most <largest> stack <deepest>
// Interrupts are masked while anything is measured. Ticks include the call; target_budget.py takes off those of
// an empty form.
#include "measured.hpp"
#include "report.hpp"
#include "signal.hpp"

namespace {

#ifndef EHSID_SAMPLES
#define EHSID_SAMPLES 400  // four times the longest window of a policy
#endif
constexpr int kSamples = EHSID_SAMPLES;
constexpr std::uint32_t kPaint = 0xA5C3965AU;
constexpr int kPainted = 1024;  // words

// SysTick (ARMv7-M B3.3), which counts down from its largest value: 0.67 s, so that no update is longer.
constexpr std::uint32_t kTickControl = 0xE000E010U;
constexpr std::uint32_t kTickReload = 0xE000E014U;
constexpr std::uint32_t kTickValue = 0xE000E018U;
constexpr std::uint32_t kProcessorClock = 5U;  // and no interrupt
constexpr std::uint32_t kMostTicks = 0xFFFFFFU;

alignas(8) std::uint8_t storage[4096];

/// Regressors of independent numbers between -1 and 1; y = phi' (1, 1/2, 1/3 ..) plus noise of 1/1000.
class Source {
 public:
  void next(budget::Input& input) {
    float y = 0.0F;
    for (int i = 0; i < budget::kN; ++i) {
      input.phi[i] = random();
      y += input.phi[i] / static_cast<float>(i + 1);
    }
    input.y = y + 1e-3F * random();
    const firmware::Sample sample = servo_.next();
    input.command = sample.command;
    input.position = sample.position;
    if (samples_++ % 6 == 0) {  // a command of random steps
      held_ = sample.command * (1.0F + 0.3F * random());
    }
    input.servo_command = held_;
    input.servo_position = x_ + 1e-3F * random();
    for (int i = 0; i < 50; ++i) {  // Euler steps of 1 ms
      x_ += 0.001F * v_;
      v_ += 0.001F * a_;
      a_ += 0.001F * (169.0F * (0.3F * held_ - v_) - 12.2F * a_);
    }
  }

 private:
  float random() {
    word_ = word_ * 1664525U + 1013904223U;  // Numerical Recipes, 7.1
    return static_cast<float>(static_cast<std::int32_t>(word_)) / 2147483648.0F;
  }

  std::uint32_t word_ = 1;
  firmware::Signal servo_;
  float held_ = 0.0F;
  float x_ = 0.0F;
  float v_ = 0.0F;
  float a_ = 0.0F;
  int samples_ = 0;
};

/// Words below the caller's frame that an update writes to, at its deepest.
[[gnu::noinline]] std::uint32_t stack_of_update(const budget::Input& input) {
  std::uint32_t* top = nullptr;
  __asm__ volatile("mov %0, sp" : "=r"(top)::"memory");
  for (int i = 1; i <= kPainted; ++i) {
    *(static_cast<volatile std::uint32_t*>(top) - i) = kPaint;
  }
  static_cast<void>(measured_update(storage, input));
  int deepest = kPainted;
  while (deepest > 0 && *(static_cast<volatile std::uint32_t*>(top) - deepest) == kPaint) {
    --deepest;
  }
  return static_cast<std::uint32_t>(deepest) * 4;
}

volatile std::uint32_t& at(std::uint32_t address) {
  return *reinterpret_cast<volatile std::uint32_t*>(address);
}

void put_pair(const char* name, std::uint32_t value) {
  firmware::put(name);
  firmware::put_number(value);
}

}  // namespace

int main() {
  port::start();
  __asm__ volatile("cpsid i" ::: "memory");
  at(kTickControl) = 0;
  at(kTickReload) = kMostTicks;
  at(kTickValue) = 0;
  at(kTickControl) = kProcessorClock;
  if (measured_bytes > sizeof storage) {
    return 1;
  }
  measured_start(storage);
  Source source;
  budget::Input input{};
  std::uint32_t sum = 0;
  std::uint32_t most = 0;
  std::uint32_t stack = 0;
  std::uint32_t updates = 0;
  for (int k = 0; k < measured_first + 2 * kSamples; ++k) {
    source.next(input);
    if (k >= measured_first + kSamples) {
      const std::uint32_t used = stack_of_update(input);
      stack = used > stack ? used : stack;
      continue;
    }
    const std::uint32_t before = at(kTickValue);
    __asm__ volatile("dsb\n isb" ::: "memory");
    const int status = measured_update(storage, input);
    __asm__ volatile("dsb\n isb" ::: "memory");
    const std::uint32_t ticks = (before - at(kTickValue)) & kMostTicks;
    if (k >= measured_first && status == 0) {
      sum += ticks;
      most = ticks > most ? ticks : most;
      ++updates;
    }
  }
  put_pair("bytes ", measured_bytes);
  put_pair(" updates ", updates);
  put_pair(" ticks ", sum);
  put_pair(" most ", most);
  put_pair(" stack ", stack);
  firmware::put("\n");
  return 0;
}
