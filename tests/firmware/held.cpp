// SPDX-License-Identifier: MIT
// A position hold of 1e6 samples: no error, every state usable, P under its ceiling, theta where it was. States
// are printed as hashes: the host must print the same.
#include <cmath>

#include "policies.hpp"
#include "report.hpp"
#include "signal.hpp"

namespace {

constexpr std::uint32_t kExcited = 500;
constexpr std::uint32_t kHeld = 1'000'000;

/// Mean of P_ii / P0_ii, with P0_ii = 1e6 by default, against the ceiling of 1.
template <class Estimator>
bool under_ceiling(const Estimator& estimator) {
  float mean = 0.0F;
  for (int i = 0; i < 6; ++i) {
    mean += estimator.recursion().state().factors.variance(i) / 6e6F;
  }
  // Scaling down to the ceiling rounds each D once, and each sum of variance() at most ten times.
  return mean <= 1.0F + 16.0F * 1.2e-7F;
}

/// Twice the largest parameter of the model, 2.239: a hold teaches nothing, so theta has no reason to leave.
template <class Estimator>
bool bounded(const Estimator& estimator) {
  bool good = true;
  for (const float value : estimator.recursion().state().theta) {
    good = std::fabs(value) < 4.5F && good;
  }
  return good;
}

template <class Forgetting>
[[gnu::noinline]] void run(const char* policy, firmware::Report& report) {
  firmware::Estimator<Forgetting> estimator;
  firmware::Signal signal;
  for (std::uint32_t k = 0; k < kExcited + kHeld; ++k) {
    const firmware::Sample sample = k < kExcited ? signal.next() : signal.hold();
    const ehsid::Status status = estimator.step(sample.command, sample.position);
    const bool look = k >= kExcited && k % 1000 == 0;
    if (ehsid::is_error(status) || look) {
      const auto& state = estimator.recursion().state();
      const bool good = report.check(!ehsid::is_error(status), policy, "status is an error", k) &&
                        report.check(firmware::Estimator<Forgetting>::Recursion::usable(state),
                                     policy, "state is not usable", k) &&
                        report.check(under_ceiling(estimator), policy, "P above its ceiling", k) &&
                        report.check(bounded(estimator), policy, "theta left its bounds", k);
      if (!good) {
        return;
      }
    }
  }
  firmware::put(policy);
  firmware::put(" ");
  const auto& state = estimator.recursion().state();
  firmware::put_hexadecimal(firmware::hash(&state, sizeof state));
  firmware::put("\n");
}

}  // namespace

int main() {
  port::start();
  firmware::Report report;
  firmware::every_policy(
      [&](auto policy, const char* name) { run<decltype(policy)>(name, report); });
  return report.finish();
}
